//! How colors appear, for tests.

use crate::colors::Rgb;

/// Returns the CIE lightness, 0 to 100.
pub fn lightness(rgb: Rgb) -> f64 {
    let [red, green, blue] = rgb.map(|value| {
        let value = f64::from(value) / 255.0;
        if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    });
    116.0 * (0.2126 * red + 0.7152 * green + 0.0722 * blue).cbrt() - 16.0
}

pub type Matrix = [[f64; 3]; 3];

/// Normal sight, and protanopia, deuteranopia and tritanopia by Machado et al. (2009), for linear sRGB.
pub const SIGHTS: [Matrix; 4] = [
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

/// Returns the distance of two colors in OKLab, as they appear to a kind of sight.
pub fn distance(first: Rgb, second: Rgb, sight: &Matrix) -> f64 {
    let [first, second] = [first, second].map(|rgb| seen(rgb, sight));
    (0..3).map(|k| (first[k] - second[k]).powi(2)).sum::<f64>().sqrt()
}
