use std::sync::LazyLock;

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
pub(crate) fn vivid(lightness: f64, hue: f64) -> Rgb {
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

    type Matrix = [[f64; 3]; 3];

    /// Normal sight, and protanopia, deuteranopia and tritanopia by Machado et al. (2009), for linear sRGB.
    const SIGHTS: [Matrix; 4] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    ];

    fn applied(matrix: &Matrix, vector: [f64; 3]) -> [f64; 3] {
        matrix.map(|row| row.iter().zip(vector).map(|(factor, value)| factor * value).sum())
    }

    /// Returns a color in OKLab, as it appears to a kind of sight.
    fn seen(rgb: Rgb, sight: &Matrix) -> [f64; 3] {
        let linear = rgb.map(|value| {
            let value = f64::from(value) / 255.0;
            if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        });
        let linear = applied(sight, linear).map(|value| value.clamp(0.0, 1.0));
        let cones = [
            [0.412_221_470_8, 0.536_332_536_3, 0.051_445_992_9],
            [0.211_903_498_2, 0.680_699_545_1, 0.107_396_956_6],
            [0.088_302_461_9, 0.281_718_837_6, 0.629_978_700_5],
        ];
        let lab = [
            [0.210_454_255_3, 0.793_617_785_0, -0.004_072_046_8],
            [1.977_998_495_1, -2.428_592_205_0, 0.450_593_709_9],
            [0.025_904_037_1, 0.782_771_766_2, -0.808_675_766_0],
        ];
        applied(&lab, applied(&cones, linear).map(f64::cbrt))
    }

    #[test]
    fn moving_points_are_distinct_with_color_blindness() {
        let heights = (0..=64).map(|i| color_of(f64::from(i) / 64.0));
        for other in heights.chain([UNKNOWN, FREE, PATH, SAME, VANISHED, APPEARED, INK]) {
            for sight in &SIGHTS {
                let [first, second] = [MOVING, other].map(|rgb| seen(rgb, sight));
                let distance = (0..3).map(|k| (first[k] - second[k]).powi(2)).sum::<f64>().sqrt();
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
                    let [first, second] = [color, other].map(|rgb| seen(rgb, sight));
                    let distance = (0..3).map(|k| (first[k] - second[k]).powi(2)).sum::<f64>().sqrt();
                    assert!(distance > 0.11, "{color:?} and {other:?}: {distance}");
                }
            }
        }
    }
}
