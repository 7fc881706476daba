use super::canvas::Color;

pub const UNKNOWN: Color = [18, 20, 26];
pub const FREE: Color = [44, 48, 58];
pub const GRID: Color = [120, 130, 150];
pub const INK: Color = [236, 238, 242];

/// From dark violet over green to yellow, about equally far apart to the eye (the anchors lie on the curve of the
/// widely used map viridis).
const ANCHORS: [Color; 9] = [
    [72, 36, 117],
    [65, 68, 135],
    [53, 95, 141],
    [42, 120, 142],
    [33, 145, 140],
    [34, 168, 132],
    [94, 201, 98],
    [170, 220, 50],
    [253, 231, 37],
];

/// The color of a share from 0 to 1.
pub fn color(share: f64) -> Color {
    let place = share.clamp(0.0, 1.0) * (ANCHORS.len() - 1) as f64;
    let low = (place as usize).min(ANCHORS.len() - 2);
    let weight = place - low as f64;
    std::array::from_fn(|k| {
        (f64::from(ANCHORS[low][k]) * (1.0 - weight) + f64::from(ANCHORS[low + 1][k]) * weight).round() as u8
    })
}
