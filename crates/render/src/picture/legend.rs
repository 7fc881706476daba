use super::canvas::Canvas;
use super::font;
use super::palette::{self, Rgb, color_of};
use super::scale::{length_label, round_length_m};
use super::time_labels::short_time_labels;
use super::view::ColorBy;
use crate::Layer;

/// Legend below the map.
pub struct Legend {
    pub metres_a_pixel: f64,
    /// Distance between grid lines in metres, if there are any.
    pub lines_m: Option<f64>,
    /// Axes to the right and up: 0 is x.
    pub axes: [usize; 2],
    /// Whether the trajectory is drawn.
    pub has_path: bool,
    pub scale: Scale,
    /// Further colors with their meaning, in rows below the other parts.
    pub entries: Vec<Entry>,
}

/// A color and its meaning, or a remark without a color.
pub struct Entry {
    pub color: Option<Rgb>,
    pub label: String,
}

/// Meaning of the colors.
pub enum Scale {
    /// Quantity, with the values of the first and the last color if there are any.
    Values { color_by: ColorBy, range: Option<[f64; 2]> },
    /// Change from one state to another.
    Change,
    /// Classes of a comparison, which are entries.
    Comparison,
}

/// Top of the first row of entries, below the other parts of the legend, in dots.
const FIRST_ROW: usize = 29;
/// Distance between rows of entries, in dots.
const ROW: usize = font::HEIGHT + 5;

/// Returns the height of the legend of an image in dots.
pub fn legend_height(entries: &[Entry], width: usize, dot: usize) -> usize {
    match places_of(entries, width, dot).last() {
        Some([_, top]) => top + font::HEIGHT + 2,
        None => 24,
    }
}

/// Returns the upper left corners of the entries in dots, in rows that fit the width of the image.
fn places_of(entries: &[Entry], width: usize, dot: usize) -> Vec<[usize; 2]> {
    let most = (width / dot).saturating_sub(MARGIN);
    let (mut left, mut top) = (MARGIN, FIRST_ROW);
    let place = |entry: &Entry| {
        let width = SWATCH + font::width_of(&entry.label);
        if left + width > most && left > MARGIN {
            (left, top) = (MARGIN, top + ROW);
        }
        let place = [left, top];
        left += width + 12;
        place
    };
    entries.iter().map(place).collect()
}

/// Returns the entry of points on moving objects.
pub fn moving_entry(points: u64) -> Entry {
    Entry { color: Some(palette::MOVING), label: format!("moving points: {}", grouped(points)) }
}

/// Space at both sides of the legend, in dots.
const MARGIN: usize = 10;
/// Distance from the left border of a swatch to its label, in dots.
const SWATCH: usize = 11;

impl Legend {
    /// Draws the legend below the row `foot` with dots of `dot` pixels: axes, scale bar, free and unknown, colors.
    pub fn draw(&self, canvas: &mut Canvas, foot: usize, dot: usize) {
        let margin = MARGIN * dot;
        let bottom = foot + 22 * dot;
        let line = bottom - font::HEIGHT * dot;
        // Axes.
        let arm = 16 * dot;
        canvas.fill(margin, bottom - arm, [dot, arm], palette::INK, 1.0);
        canvas.fill(margin, bottom - dot, [arm, dot], palette::INK, 1.0);
        for step in 0..3 {
            let (back, wide) = (step * dot, [(1 + 2 * step) * dot, dot]);
            canvas.fill(margin - back, bottom - arm - 2 * dot + back, wide, palette::INK, 1.0);
            canvas.fill(
                margin + arm + dot - back,
                bottom - dot - back,
                [wide[1], wide[0]],
                palette::INK,
                1.0,
            );
        }
        canvas.text(margin + arm + 5 * dot, line, dot, palette::INK, name_of(self.axes[0]));
        canvas.text(margin + 5 * dot, bottom - arm - 3 * dot, dot, palette::INK, name_of(self.axes[1]));
        // Scale bar.
        let length_m = round_length_m(canvas.width() as f64 * 0.2 * self.metres_a_pixel);
        let length = ((length_m / self.metres_a_pixel).round() as usize).max(1);
        let left = margin + arm + 20 * dot;
        canvas.text(left, foot + 4 * dot, dot, palette::INK, &length_label(length_m));
        canvas.fill(left, bottom - 2 * dot, [length, 2 * dot], palette::INK, 1.0);
        canvas.fill(left, bottom - 6 * dot, [dot, 6 * dot], palette::INK, 1.0);
        canvas.fill(left + length.saturating_sub(dot), bottom - 6 * dot, [dot, 6 * dot], palette::INK, 1.0);
        if let Some(every_m) = self.lines_m {
            let label = format!("lines {}", length_label(every_m));
            canvas.text(left + length + 8 * dot, line, dot, palette::FAINT_INK, &label);
        }
        let right = canvas.width() - margin;
        let bar = self.bar_width(canvas.width(), dot);
        self.draw_scale(canvas, [right, bar], foot, dot);
        // Colors of free and unknown space.
        let swatch = right.saturating_sub(bar + 74 * dot);
        let is_of_distances = matches!(self.scale, Scale::Values { color_by: ColorBy::Distance, .. });
        let first = if is_of_distances { (palette::INK, "obstacle") } else { (palette::FREE, "free") };
        if !matches!(self.scale, Scale::Comparison) {
            for (top, (color, label)) in [(foot + 4 * dot, first), (line, (palette::UNKNOWN, "unknown"))] {
                draw_swatch(canvas, [swatch, top], dot, color, label);
            }
        }
        if self.has_path {
            let (sensor, top) = (swatch.saturating_sub(60 * dot), foot + 4 * dot);
            let color = if matches!(self.scale, Scale::Change) { palette::INK } else { palette::PATH };
            canvas.path(std::iter::once([sensor + 3 * dot, top + 3 * dot]), dot + 1, color);
            canvas.text(sensor + 11 * dot, top, dot, palette::FAINT_INK, "sensor");
        }
        for (entry, [left, row]) in self.entries.iter().zip(places_of(&self.entries, canvas.width(), dot)) {
            let place = [left * dot, foot + row * dot];
            match entry.color {
                Some(color) => draw_swatch(canvas, place, dot, color, &entry.label),
                None => canvas.text(place[0], place[1], dot, palette::FAINT_INK, &entry.label),
            }
        }
    }

    fn draw_scale(&self, canvas: &mut Canvas, [right, bar]: [usize; 2], foot: usize, dot: usize) {
        let (top, bottom) = (foot + 4 * dot, foot + 22 * dot);
        let Scale::Values { color_by, range } = &self.scale else {
            if matches!(self.scale, Scale::Comparison) {
                return;
            }
            let (left, line) = (right - bar, bottom - font::HEIGHT * dot);
            draw_swatch(canvas, [left, top], dot, palette::APPEARED, "appeared");
            draw_swatch(canvas, [left, line], dot, palette::VANISHED, "vanished");
            draw_swatch(canvas, [left + 68 * dot, top], dot, palette::SAME, "same");
            return;
        };
        let Some(range) = *range else {
            let name = match color_by {
                ColorBy::Layer(Layer::Colour) => "mean color of the points",
                ColorBy::Layer(Layer::Class) => "class",
                _ => return,
            };
            canvas.text_before(right, top, dot, palette::FAINT_INK, name);
            return;
        };
        for x in 0..bar {
            let color = color_of(x as f64 / (bar - 1).max(1) as f64);
            canvas.fill(right - bar + x, bottom - 7 * dot, [1, 7 * dot], color, 1.0);
        }
        let (name, [low, high]) = labels(*color_by, range);
        canvas.text(right - bar, top, dot, palette::INK, &low);
        canvas.text_before(right, top, dot, palette::INK, &high);
        if bar >= needed_width(name, [&low, &high], dot) {
            let space = [font::width_of(&low), font::width_of(&high)];
            let middle = right - bar / 2 + (space[0] + font::width_of(name)) * dot / 2 - space[1] * dot / 2;
            canvas.text_before(middle, top, dot, palette::FAINT_INK, name);
        }
    }

    /// Returns the width of the color bar: a quarter of the picture, or up to half of it if its labels need more.
    fn bar_width(&self, width: usize, dot: usize) -> usize {
        let needed = match &self.scale {
            Scale::Values { color_by, range: Some(range) } => {
                let (name, [low, high]) = labels(*color_by, *range);
                needed_width(name, [&low, &high], dot)
            }
            _ => 0,
        };
        needed.min(width / 2).max(width / 4).max(1)
    }
}

/// Returns the labels above the color bar: its quantity, and the first and the last value.
fn labels(color_by: ColorBy, [least, most]: [f64; 2]) -> (&'static str, [String; 2]) {
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

/// Returns the width of a name between two values in pixels, with gaps.
fn needed_width(name: &str, ends: [&str; 2], dot: usize) -> usize {
    let letters = font::width_of(name) + ends.map(font::width_of).iter().sum::<usize>();
    (letters + 2 * 6) * dot
}

fn draw_swatch(canvas: &mut Canvas, [left, top]: [usize; 2], dot: usize, color: palette::Rgb, label: &str) {
    canvas.fill(left, top, [7 * dot; 2], palette::FAINT_INK, 1.0);
    canvas.fill(left + 1, top + 1, [7 * dot - 2; 2], color, 1.0);
    canvas.text(left + SWATCH * dot, top, dot, palette::FAINT_INK, label);
}

fn name_of(axis: usize) -> &'static str {
    ["x", "y", "z"].get(axis).copied().unwrap_or_default()
}

/// Formats a number with a comma before every third digit.
fn grouped(number: u64) -> String {
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

    #[test]
    fn entries_fill_rows() {
        let entry = |label: &str| Entry { color: Some([0; 3]), label: label.to_owned() };
        let entries = ["2 ground", "6 building", "5 high vegetation", "9 water"].map(entry);
        let places = places_of(&entries, 400, 2);
        assert_eq!((places[0], places[2][1]), ([MARGIN, FIRST_ROW], FIRST_ROW + ROW));
        for (entry, [left, _]) in entries.iter().zip(&places) {
            assert!(left + SWATCH + font::width_of(&entry.label) <= 190);
        }
        assert_eq!(legend_height(&entries, 400, 2), places[3][1] + 9);
        assert_eq!(places_of(&entries, 10, 2).len(), 4);
    }

    #[test]
    fn a_name_and_its_values_do_not_overlap() {
        for (width, dot, is_named) in [(2000, 2, true), (600, 2, true), (600, 3, false), (240, 2, false)] {
            let scale = Scale::Values { color_by: ColorBy::Height, range: Some([-12.5, 108.6]) };
            let (lines_m, has_path, entries) = (None, false, Vec::new());
            let legend = Legend { metres_a_pixel: 0.1, lines_m, axes: [0, 2], has_path, scale, entries };
            let bar = legend.bar_width(width, dot);
            assert!(bar <= width / 2);
            assert_eq!(bar >= needed_width("height", ["-12.5 m", "108.6 m"], dot), is_named, "{width}");
        }
    }
}
