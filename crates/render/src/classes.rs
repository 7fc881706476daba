//! Names and colors of classes, by the standard of ASPRS for LAS files.

use crate::colors::Rgb;
use crate::oklab::vivid;

/// Names and colors of the classes 0 to 18.
const CLASSES: [(&str, Rgb); 19] = [
    ("never classified", [120, 120, 128]),
    ("unclassified", [176, 176, 182]),
    ("ground", [166, 124, 82]),
    ("low vegetation", [190, 222, 110]),
    ("medium vegetation", [104, 184, 70]),
    ("high vegetation", [30, 122, 54]),
    ("building", [236, 126, 84]),
    ("low noise", [255, 70, 220]),
    ("model key point", [116, 92, 190]),
    ("water", [46, 120, 224]),
    ("rail", [150, 70, 140]),
    ("road surface", [84, 92, 116]),
    ("overlap", [206, 206, 140]),
    ("wire guard", [250, 236, 110]),
    ("wire conductor", [250, 190, 40]),
    ("transmission tower", [40, 186, 196]),
    ("wire connector", [150, 228, 226]),
    ("bridge deck", [196, 150, 236]),
    ("high noise", [255, 150, 190]),
];

/// Angle between the hues of further classes, in degrees: any number of consecutive ones differ.
const GOLDEN_ANGLE: f64 = 137.507_764;

/// Returns the name of a class; `None` for classes that the standard reserves or leaves to the user.
pub fn class_name(class: u8) -> Option<&'static str> {
    CLASSES.get(usize::from(class)).map(|(name, _)| *name)
}

/// Returns the number of a class and its name, such as `2 ground`.
pub fn class_label(class: u8) -> String {
    class_name(class).map_or_else(|| class.to_string(), |name| format!("{class} {name}"))
}

/// Returns the color of a class.
pub fn class_color(class: u8) -> Rgb {
    let further = || {
        let lightness = 0.6 + 0.1 * f64::from(class % 3);
        vivid(lightness, (f64::from(class) * GOLDEN_ANGLE).to_radians())
    };
    CLASSES.get(usize::from(class)).map_or_else(further, |(_, color)| *color)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_of_the_standard_have_names() {
        assert_eq!(
            [class_label(2), class_label(6), class_label(18)],
            ["2 ground", "6 building", "18 high noise"]
        );
        assert_eq!((class_name(19), class_label(200)), (None, "200".to_owned()));
    }

    #[test]
    fn colors_of_classes_are_distinct() {
        let colors: Vec<Rgb> = (0..=40).map(class_color).collect();
        for (class, color) in colors.iter().enumerate() {
            for (other, before) in colors[..class].iter().enumerate() {
                let distance: i32 = (0..3).map(|k| (i32::from(color[k]) - i32::from(before[k])).pow(2)).sum();
                let least = if class < 19 { 35_i32.pow(2) } else { 1 };
                assert!(distance >= least, "{class} and {other}: {color:?}, {before:?}");
            }
        }
    }
}
