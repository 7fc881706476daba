/// Red, green and blue of sRGB.
pub type Rgb = [u8; 3];

/// Where nothing has been seen, and the paper around the map.
pub const UNKNOWN: Rgb = [13, 16, 22];
/// Where only free space has been seen.
pub const FREE: Rgb = [36, 43, 54];
/// Around what is occupied: without a hue, so that no height has this color, and far from the paper.
pub const INFLATED: Rgb = [92, 98, 108];
/// Letters and bars.
pub const INK: Rgb = [226, 230, 236];
/// Letters that should not shout.
pub const FAINT_INK: Rgb = [140, 149, 163];
/// The lines between tiles, blended over what they cross.
pub const TILE_LINE: Rgb = [160, 178, 204];
/// The way of the sensor.
pub const PATH: Rgb = [255, 112, 67];

/// Viridis at even steps: lightness rises evenly, also for readers who do not see red and green apart.
const VIRIDIS: [Rgb; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];
/// The map begins here: viridis' darkest purple could not be told from the paper.
const DARKEST: f64 = 0.13;

/// The color of a share from 0 (low) to 1 (high); other numbers are cut there.
pub fn color_of(share: f64) -> Rgb {
    let share = DARKEST + (1.0 - DARKEST) * if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let at = share * (VIRIDIS.len() - 1) as f64;
    let low = (at as usize).min(VIRIDIS.len() - 2);
    mixed(VIRIDIS[low], VIRIDIS[low + 1], at - low as f64)
}

/// A color between two: `share` 0 is the first, 1 the second.
pub fn mixed(first: Rgb, second: Rgb, share: f64) -> Rgb {
    std::array::from_fn(|k| {
        let (a, b) = (f64::from(first[k]), f64::from(second[k]));
        (a + (b - a) * share).round().clamp(0.0, 255.0) as u8
    })
}

/// A color made lighter (above 1) or darker (below 1).
pub fn lit(color: Rgb, light: f64) -> Rgb {
    if light > 1.0 { mixed(color, [255; 3], light - 1.0) } else { mixed([0; 3], color, light) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn higher_is_lighter() {
        let lightness =
            |rgb: Rgb| 0.3 * f64::from(rgb[0]) + 0.59 * f64::from(rgb[1]) + 0.11 * f64::from(rgb[2]);
        let steps: Vec<f64> = (0..=20).map(|i| lightness(color_of(f64::from(i) / 20.0))).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
        assert!(lightness(UNKNOWN) + 15.0 < lightness(FREE));
        assert!(lightness(UNKNOWN) + 60.0 < lightness(INFLATED));
        assert!(lightness(FREE) + 10.0 < steps[0]);
        assert_eq!(color_of(2.0), color_of(1.0));
        assert_eq!(color_of(f64::NAN), color_of(0.0));
    }
}
