use crate::ColorMap;

/// Red, green and blue in sRGB.
pub type Rgb = [u8; 3];

/// Unknown space, and the background of the map.
pub const UNKNOWN: Rgb = [13, 16, 22];
/// Free space.
pub const FREE: Rgb = [36, 43, 54];
/// Inflated space: gray, unlike any height, and distinct from the background.
pub(super) const INFLATED: Rgb = NO_VALUE;
/// Letters and bars.
pub(super) const INK: Rgb = [226, 230, 236];
/// Secondary text.
pub(super) const FAINT_INK: Rgb = [140, 149, 163];
/// Grid lines between tiles, blended over the map.
pub(super) const TILE_LINE: Rgb = [160, 178, 204];
/// Trajectory.
pub const PATH: Rgb = [255, 112, 67];
/// Occupied before and after. Grey, blue and orange are also distinct with color blindness.
pub const SAME: Rgb = [118, 124, 134];
/// Occupied only before.
pub const VANISHED: Rgb = [255, 153, 31];
/// Occupied only after.
pub const APPEARED: Rgb = [74, 144, 255];

/// In a comparison, occupied in both maps. It is dark, so that the other classes stand out.
pub const UNCHANGED: Rgb = [74, 82, 96];
/// In a comparison, occupied in one map and unknown in the other.
pub const NOT_SEEN: Rgb = [158, 162, 170];
/// In a comparison, occupied in one map and hidden from the sensor of the other.
pub const HIDDEN: Rgb = [156, 216, 252];
/// In a comparison, occupied in one map and perhaps free in the other.
pub const UNCERTAIN: Rgb = [255, 240, 178];

/// Occupied voxels without a value of the layer that is shown.
pub const NO_VALUE: Rgb = [92, 98, 108];

/// Points of scans on moving objects, drawn with a light rim. No other color is similar, also with color blindness.
pub const MOVING: Rgb = [190, 18, 24];

/// Returns the color of a share from 0 (low) to 1 (high) in the default color map; other values are clamped.
pub fn color_of(share: f64) -> Rgb {
    ColorMap::voxtile().color_of(share)
}

/// Mixes two colors: `share` 0 is the first, 1 the second.
pub(crate) fn mixed(first: Rgb, second: Rgb, share: f64) -> Rgb {
    std::array::from_fn(|k| {
        let (a, b) = (f64::from(first[k]), f64::from(second[k]));
        (a + (b - a) * share).round().clamp(0.0, 255.0) as u8
    })
}

/// Makes a color lighter (above 1) or darker (below 1).
pub(super) fn lit(color: Rgb, light: f64) -> Rgb {
    if light > 1.0 { mixed(color, [255; 3], light - 1.0) } else { mixed([0; 3], color, light) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sight::{SIGHTS, distance, lightness};

    #[test]
    fn higher_is_lighter() {
        let steps: Vec<f64> = (0..=64).map(|i| lightness(color_of(f64::from(i) / 64.0))).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
        assert!(lightness(UNKNOWN) + 10.0 < lightness(FREE));
        assert!(lightness(UNKNOWN) + 30.0 < lightness(INFLATED));
        assert!(lightness(FREE) + 5.0 < steps[0], "{steps:?}");
        assert_eq!(color_of(2.0), color_of(1.0));
        assert_eq!(color_of(f64::NAN), color_of(0.0));
    }

    /// With red-green color blindness only blue against yellow and lightness remain.
    #[test]
    fn changes_are_distinct_with_red_green_color_blindness() {
        let seen =
            |rgb: Rgb| [f64::from(rgb[2]) - f64::from(rgb[0]).midpoint(f64::from(rgb[1])), lightness(rgb)];
        let colors = [SAME, VANISHED, APPEARED].map(seen);
        for (k, first) in colors.iter().enumerate() {
            for second in &colors[..k] {
                assert!((first[0] - second[0]).hypot(first[1] - second[1]) > 60.0, "{colors:?}");
            }
        }
    }

    #[test]
    fn moving_points_are_distinct_with_color_blindness() {
        let heights = (0..=64).map(|i| color_of(f64::from(i) / 64.0));
        for other in heights.chain([UNKNOWN, FREE, PATH, SAME, VANISHED, APPEARED, INK]) {
            for sight in &SIGHTS {
                let distance = distance(MOVING, other, sight);
                assert!(distance > 0.11, "{other:?}: {distance}");
            }
        }
    }

    #[test]
    fn classes_of_a_comparison_are_distinct_with_color_blindness() {
        // The limits of relief shading, which only unchanged voxels have.
        let unchanged = [0.72, 1.0, 1.22].map(|light| lit(UNCHANGED, light));
        let others = [UNKNOWN, NOT_SEEN, HIDDEN, UNCERTAIN, VANISHED, APPEARED];
        for (number, color) in others.into_iter().enumerate() {
            for other in others[..number].iter().copied().chain(unchanged) {
                for sight in &SIGHTS {
                    let distance = distance(color, other, sight);
                    assert!(distance > 0.11, "{color:?} and {other:?}: {distance}");
                }
            }
        }
    }
}
