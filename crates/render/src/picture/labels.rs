use super::time_labels::short_time_labels;
use super::view::ColorBy;
use crate::Layer;

/// Returns the labels above the color bar: its quantity, and the first and the last value.
pub fn labels(color_by: ColorBy, [least, most]: [f64; 2]) -> (&'static str, [String; 2]) {
    match color_by {
        ColorBy::Height => ("height", [least, most].map(height_label)),
        ColorBy::Probability => ("probability", [least, most].map(|value| format!("{value:.2}"))),
        ColorBy::Count => ("count", [least, most].map(|value| format!("{value:.0}"))),
        ColorBy::LastScan => ("last scan", [least, most].map(|value| format!("{value:.0}"))),
        ColorBy::Distance => ("distance", [least, most].map(|value| format!("{value} m"))),
        ColorBy::Layer(Layer::Time) => match short_time_labels([least, most]) {
            (labels, None) => ("last hit", labels),
            // The rest of the dates is an entry with this name.
            (labels, Some(_)) => ("", labels),
        },
        ColorBy::Layer(layer) => (layer.name(), [least, most].map(|value| number_label(value, most - least))),
    }
}

/// Returns the name of a layer in a legend.
pub fn layer_name(layer: Layer) -> &'static str {
    match layer {
        Layer::Colour => "color",
        layer => layer.name(),
    }
}

/// Formats a number with a comma before every third digit.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Formats a value with two or three digits of its range.
fn number_label(value: f64, range: f64) -> String {
    let digits = (2.0 - range.max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

fn height_label(height_m: f64) -> String {
    // Adding 0 converts -0, for example of a height just below the ground, to 0.
    format!("{:.1} m", (height_m * 10.0).round() / 10.0 + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_height_just_below_zero_is_written_as_zero() {
        assert_eq!(height_label(-0.04), "0.0 m");
        assert_eq!(height_label(-1.26), "-1.3 m");
    }

    #[test]
    fn digits_are_grouped() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
    }

    #[test]
    fn numbers_have_the_digits_of_their_range() {
        assert_eq!([number_label(17.26, 200.0), number_label(1.234, 0.5)], ["17", "1.234"]);
        assert_eq!(number_label(0.0, 0.0), "0.000000000");
    }
}
