//! Color maps of values.

use crate::colors::{Rgb, mixed};
use crate::oklab::{CHROMA, vivid, with_chroma};
use serde::Serialize;
use std::sync::LazyLock;

/// A color map: colors of values from low to high, all readable with color blindness.
///
/// Serialized, a map has the fields of this structure.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ColorMap {
    /// Name, as in `picture --color-map`.
    pub name: &'static str,
    /// What the map is good for, in a few words.
    pub purpose: &'static str,
    /// Whether the map has a neutral middle, for values around a reference. Other maps rise evenly in lightness.
    pub is_diverging: bool,
    /// Colors in sRGB at even distances; between them, each channel is interpolated linearly.
    pub stops: Vec<Rgb>,
}

/// Number of stops. With linear interpolation, no channel is off by more than 2 of 255.
const STOPS: usize = 33;

/// Lightness of the lowest and of the highest color of [`ColorMap::voxtile`] in OKLab. The lowest must be distinct from
/// a dark background.
const LIGHTNESS: [f64; 2] = [0.36, 0.94];
/// Hue of the lowest and of the highest color in degrees: from violet over green to yellow.
const HUE: [f64; 2] = [305.0, 103.0];
/// Lightness of grays.
const GRAY: [f64; 2] = [0.34, 0.98];
/// Hues below and above the middle of the diverging map, in degrees: blue and orange.
const SIDES: [f64; 2] = [255.0, 60.0];
/// Lightness of the middle and of the ends of the diverging map.
const DIVERGING: [f64; 2] = [0.95, 0.5];

static MAPS: LazyLock<[ColorMap; 6]> = LazyLock::new(|| {
    [
        ColorMap::new("voxtile", "any value; the colors differ from a dark background", |share| {
            vivid(between(LIGHTNESS, share), between(HUE, share).to_radians())
        }),
        ColorMap::of("viridis", "any value, in the usual colors of matplotlib", colorous::VIRIDIS),
        ColorMap::of(
            "cividis",
            "any value, in colors that color blindness hardly changes",
            colorous::CIVIDIS,
        ),
        ColorMap::of("inferno", "large ranges, such as counts", colorous::INFERNO),
        ColorMap::new("gray", "print without color", |share| with_chroma(between(GRAY, share), 0.0, 0.0)),
        ColorMap {
            is_diverging: true,
            ..ColorMap::new("blue-orange", "differences from the middle of the range", |share| {
                let from_middle = (2.0 * share - 1.0).abs();
                let [middle, end] = DIVERGING;
                let hue = SIDES[usize::from(share > 0.5)].to_radians();
                with_chroma(middle + (end - middle) * from_middle, CHROMA * from_middle, hue)
            })
        },
    ]
});

/// Returns the number at a share of a range.
fn between([low, high]: [f64; 2], share: f64) -> f64 {
    low + (high - low) * share
}

impl ColorMap {
    /// Returns a map of the colors of shares from 0 to 1.
    fn new(name: &'static str, purpose: &'static str, color: impl Fn(f64) -> Rgb) -> Self {
        let stops = (0..STOPS).map(|stop| color(stop as f64 / (STOPS - 1) as f64)).collect();
        Self { name, purpose, is_diverging: false, stops }
    }

    fn of(name: &'static str, purpose: &'static str, gradient: colorous::Gradient) -> Self {
        Self::new(name, purpose, |share| gradient.eval_continuous(share).as_array())
    }

    /// All maps, the default first.
    pub fn all() -> &'static [Self] {
        MAPS.as_slice()
    }

    /// The default: from violet over green to yellow.
    pub fn voxtile() -> &'static Self {
        &MAPS[0]
    }

    /// Returns the map of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        MAPS.iter().find(|map| map.name == name)
    }

    /// Returns the color of a share from 0 (low) to 1 (high); other values are clamped, NaN is low.
    pub fn color_of(&self, share: f64) -> Rgb {
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        let along = share * (self.stops.len() - 1) as f64;
        let low = (along as usize).min(self.stops.len() - 2);
        mixed(self.stops[low], self.stops[low + 1], along - low as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sight::{SIGHTS, distance, lightness};

    #[test]
    fn maps_have_names_and_purposes() {
        let names: Vec<&str> = ColorMap::all().iter().map(|map| map.name).collect();
        assert_eq!(names, ["voxtile", "viridis", "cividis", "inferno", "gray", "blue-orange"]);
        assert!(ColorMap::all().iter().all(|map| map.stops.len() == STOPS && !map.purpose.is_empty()));
        assert_eq!(ColorMap::named("cividis").map(|map| map.name), Some("cividis"));
        assert_eq!(ColorMap::named("turbo"), None);
        let json = serde_json::to_value(ColorMap::voxtile()).unwrap();
        assert_eq!((&json["name"], json["stops"][0].as_array().unwrap().len()), (&"voxtile".into(), 3));
    }

    #[test]
    fn interpolated_stops_have_the_published_colors() {
        for (name, gradient) in
            [("viridis", colorous::VIRIDIS), ("cividis", colorous::CIVIDIS), ("inferno", colorous::INFERNO)]
        {
            let map = ColorMap::named(name).unwrap();
            for step in 0..=1000 {
                let share = f64::from(step) / 1000.0;
                let (found, wanted) = (map.color_of(share), gradient.eval_continuous(share).as_array());
                let off = (0..3).map(|k| found[k].abs_diff(wanted[k])).max();
                assert!(off <= Some(2), "{name} at {share}: {found:?} for {wanted:?}");
            }
        }
        // As matplotlib has them.
        assert_eq!(ColorMap::named("viridis").unwrap().color_of(0.0), [68, 1, 84]);
        assert_eq!(ColorMap::named("viridis").unwrap().color_of(1.0), [253, 231, 37]);
    }

    #[test]
    fn lightness_rises_evenly_or_from_a_neutral_middle() {
        for map in ColorMap::all() {
            let steps: Vec<f64> = (0..=64).map(|i| lightness(map.color_of(f64::from(i) / 64.0))).collect();
            let is_rising = |steps: &[f64]| steps.windows(2).all(|pair| pair[0] < pair[1]);
            if map.is_diverging {
                let down: Vec<f64> = steps[32..].iter().rev().copied().collect();
                assert!(is_rising(&steps[..=32]) && is_rising(&down), "{}: {steps:?}", map.name);
                let [red, green, blue] = map.color_of(0.5);
                assert!(red.abs_diff(green).max(green.abs_diff(blue)) <= 1, "{}", map.name);
            } else {
                assert!(is_rising(&steps), "{}: {steps:?}", map.name);
            }
        }
    }

    #[test]
    fn sixths_are_distinct_with_color_blindness() {
        for map in ColorMap::all() {
            let colors: Vec<Rgb> = (0..=6).map(|i| map.color_of(f64::from(i) / 6.0)).collect();
            for (number, &color) in colors.iter().enumerate() {
                for &other in &colors[..number] {
                    for sight in &SIGHTS {
                        let distance = distance(color, other, sight);
                        assert!(distance > 0.07, "{}, {color:?} and {other:?}: {distance}", map.name);
                    }
                }
            }
        }
    }

    #[test]
    fn other_shares_are_clamped() {
        for map in ColorMap::all() {
            assert_eq!(map.color_of(f64::NAN), map.stops[0]);
            assert_eq!(map.color_of(-1.0), map.stops[0]);
            assert_eq!(map.color_of(f64::INFINITY), map.stops[STOPS - 1]);
        }
    }
}
