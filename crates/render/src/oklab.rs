//! Colors by lightness, chroma and hue in OKLab.

use crate::colors::Rgb;

/// Maximum chroma; with more, the limits of the sRGB gamut cause kinks in a scale.
pub const CHROMA: f64 = 0.13;

/// Returns the most vivid color in sRGB, up to [`CHROMA`]; the hue is in radians.
pub fn vivid(lightness: f64, hue: f64) -> Rgb {
    with_chroma(lightness, CHROMA, hue)
}

/// Returns a color with this chroma, or with less if sRGB has none; the hue is in radians.
pub fn with_chroma(lightness: f64, chroma: f64, hue: f64) -> Rgb {
    let (mut low, mut high) = (0.0, chroma);
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
