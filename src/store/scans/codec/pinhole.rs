//! Coordinates of depth images: `((pixel - center) / focal) * z`, for the column and for the row of each pixel.

use super::grid::rounded;

/// Points from which a camera is found.
const LOOKED_AT: usize = 4096;
/// Points that it must give to the bit before all are tried.
const TRIED: usize = 24;
/// Centers of images of more pixels are not looked for.
const MOST_PIXELS: usize = 4096;
/// How many decimals the numbers of a camera may have.
const DECIMALS: [i32; 3] = [4, 6, 8];
/// Two ratios nearer to each other than this are one.
const SAME: f64 = 1e-7;

/// A camera along one axis, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pinhole {
    pub(super) focal: f64,
    pub(super) center: f64,
}

impl Pinhole {
    /// Finds the camera that made these coordinates; its numbers have few decimals.
    pub(super) fn of(values: &[f64], depths: &[f64]) -> Option<Self> {
        let pairs = values.iter().zip(depths);
        let mut ratios: Vec<f64> = pairs.clone().take(LOOKED_AT).map(|(value, z)| value / z).collect();
        if ratios.len() < TRIED || !ratios.iter().all(|ratio| ratio.abs() < 100.0) {
            return None;
        }
        ratios.sort_unstable_by(f64::total_cmp);
        ratios.dedup_by(|a, b| (*a - *b).abs() < SAME);
        let gap = ratios.windows(2).map(|pair| pair[1] - pair[0]).reduce(f64::min)?;
        let (first, last) = (*ratios.first()?, *ratios.last()?);
        // The whole span tells the gap far more exactly than two neighbours do.
        let mut focal = 1.0 / gap;
        let mut reach = gap;
        for &ratio in &ratios {
            if ratio - first > 4.0 * reach || ratio == last {
                let pixels = ((ratio - first) * focal).round();
                if pixels >= 1.0 {
                    focal = pixels / (ratio - first);
                    reach = ratio - first;
                }
            }
        }
        if !(10.0..1e5).contains(&focal) {
            return None;
        }
        let mut cameras = DECIMALS.into_iter().flat_map(|decimals| {
            let unit = 10_f64.powi(decimals);
            let focal = (focal * unit).round() / unit;
            let center = (-(first * focal) * unit).round() / unit;
            (0..MOST_PIXELS).map(move |pixels| Self { focal, center: pixels as f64 + fraction(center, unit) })
        });
        let every = (values.len() / TRIED).max(1);
        let tried: Vec<_> = pairs.step_by(every).take(TRIED).collect();
        cameras.find(|camera| tried.iter().all(|(value, z)| camera.pixel(**value, **z).is_some()))
    }

    /// The pixel of a coordinate; `None` if it is not the coordinate to the bit.
    #[inline]
    pub(super) fn pixel(&self, value: f64, z: f64) -> Option<i64> {
        let pixel = rounded(value / z * self.focal + self.center);
        let is_it = pixel.abs() < 1e6 && self.value(pixel as i64, z).to_bits() == value.to_bits();
        is_it.then_some(pixel as i64)
    }

    #[inline]
    pub(super) fn value(&self, pixel: i64, z: f64) -> f64 {
        ((pixel as f64 - self.center) / self.focal) * z
    }
}

/// What is behind the point, from 0 to 1, in so many parts.
fn fraction(number: f64, unit: f64) -> f64 {
    ((number * unit).round().rem_euclid(unit)) / unit
}
