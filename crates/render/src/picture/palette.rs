use std::sync::LazyLock;

/// Red, green and blue in sRGB.
pub type Rgb = [u8; 3];

/// Unknown space, and the background of the map.
pub const UNKNOWN: Rgb = [13, 16, 22];
/// Free space.
pub const FREE: Rgb = [36, 43, 54];
/// Inflated space: gray, unlike any height, and distinct from the background.
pub(super) const INFLATED: Rgb = [92, 98, 108];
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

/// Lightness of the lowest and of the highest color in OKLab. The lowest must be distinct from the background.
const LIGHTNESS: [f64; 2] = [0.36, 0.94];
/// Hue of the lowest and of the highest color in degrees: from violet over green to yellow.
const HUE: [f64; 2] = [305.0, 103.0];
/// Maximum chroma; with more, the limits of the sRGB gamut cause kinks in the scale.
const CHROMA: f64 = 0.13;

/// Colors from low to high with evenly rising perceived lightness, also readable with red-green color blindness and in
/// grayscale.
static SCALE: LazyLock<[Rgb; 256]> = LazyLock::new(|| {
    std::array::from_fn(|step| {
        let share = step as f64 / 255.0;
        let between = |[low, high]: [f64; 2]| low + (high - low) * share;
        vivid(between(LIGHTNESS), between(HUE).to_radians())
    })
});

/// Returns the color of a share from 0 (low) to 1 (high); other values are clamped.
pub fn color_of(share: f64) -> Rgb {
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    SCALE[(share * 255.0).round() as usize]
}

/// Returns the most vivid color in sRGB, up to [`CHROMA`].
fn vivid(lightness: f64, hue: f64) -> Rgb {
    let (mut low, mut high) = (0.0, CHROMA);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        let fits = linear_rgb(lightness, middle, hue).iter().all(|value| (0.0..=1.0).contains(value));
        if fits { low = middle } else { high = middle }
    }
    linear_rgb(lightness, low, hue).map(|value| {
        let value = value.clamp(0.0, 1.0);
        let encoded =
            if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded).round() as u8
    })
}

/// Converts OKLab (Björn Ottosson, 2020), as lightness, chroma and hue in radians, to linear sRGB.
fn linear_rgb(lightness: f64, chroma: f64, hue: f64) -> [f64; 3] {
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let long = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let medium = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let short = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * long - 3.307_711_591_3 * medium + 0.230_969_929_2 * short,
        -1.268_438_004_6 * long + 2.609_757_401_1 * medium - 0.341_319_396_5 * short,
        -0.004_196_086_3 * long - 0.703_418_614_7 * medium + 1.707_614_701_0 * short,
    ]
}

/// Mixes two colors: `share` 0 is the first, 1 the second.
pub(super) fn mixed(first: Rgb, second: Rgb, share: f64) -> Rgb {
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

    /// Returns the CIE lightness, 0 to 100.
    fn lightness(rgb: Rgb) -> f64 {
        let [red, green, blue] = rgb.map(|value| {
            let value = f64::from(value) / 255.0;
            if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        });
        116.0 * (0.2126 * red + 0.7152 * green + 0.0722 * blue).cbrt() - 16.0
    }

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
}
