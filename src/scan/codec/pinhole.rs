//! Coordinates of depth images: `((pixel - center) / focal) * z`, for the column and for the row of each pixel.

use super::grid::rounded;
use super::words::{unzigzag, zigzag};

/// Number of points from which a camera is estimated.
const SAMPLE_SIZE: usize = 4096;
/// Number of points that a camera must reproduce bit by bit before all are checked.
const CHECKED_POINTS: usize = 24;
/// Maximum number of pixels along an edge of an image.
const MAX_PIXELS: usize = 4096;
/// Candidate numbers of decimals in the camera parameters.
const DECIMALS: [i32; 3] = [4, 6, 8];
/// Ratios whose difference is smaller than this are considered equal.
const SAME: f64 = 1e-7;

/// Pinhole camera along one axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pinhole {
    /// Focal length and optical centre in pixels.
    pub(super) focal: f64,
    pub(super) center: f64,
    /// Coordinate of each pixel at a depth of one metre.
    directions: Vec<f64>,
}

impl Pinhole {
    pub(super) fn new(focal: f64, center: f64) -> Self {
        let directions = (0..MAX_PIXELS).map(|pixel| (pixel as f64 - center) / focal).collect();
        Self { focal, center, directions }
    }

    /// Estimates the camera that produced these coordinates, assuming parameters with few decimals.
    pub(super) fn of(values: &[f64], depths: &[f64]) -> Option<Self> {
        let pairs: Vec<(f64, f64)> =
            values.iter().copied().zip(depths.iter().copied()).filter(|(_, z)| *z > 0.0).collect();
        let mut ratios: Vec<f64> = pairs.iter().take(SAMPLE_SIZE).map(|(value, z)| value / z).collect();
        if ratios.len() < CHECKED_POINTS || !ratios.iter().all(|ratio| ratio.abs() < 100.0) {
            return None;
        }
        ratios.sort_unstable_by(f64::total_cmp);
        ratios.dedup_by(|a, b| (*a - *b).abs() < SAME);
        let gap = ratios.windows(2).map(|pair| pair[1] - pair[0]).reduce(f64::min)?;
        let (first, last) = (*ratios.first()?, *ratios.last()?);
        // The smallest gap between two ratios is a rough pixel size. Longer and longer spans make it more exact.
        let (mut focal, mut reach) = (1.0 / gap, gap);
        for &ratio in &ratios {
            if ratio - first > 4.0 * reach || ratio == last {
                let pixels = ((ratio - first) * focal).round();
                if pixels >= 1.0 {
                    (focal, reach) = (pixels / (ratio - first), ratio - first);
                }
            }
        }
        if !(10.0..1e5).contains(&focal) {
            return None;
        }
        let tried: Vec<_> =
            pairs.iter().step_by((pairs.len() / CHECKED_POINTS).max(1)).take(CHECKED_POINTS).collect();
        let makes = |focal: f64, center: f64| {
            tried.iter().all(|&&(value, z)| {
                let pixel = (value / z * focal + center).round();
                (((pixel - center) / focal) * z).to_bits() == value.to_bits()
            })
        };
        for decimals in DECIMALS {
            let unit = 10_f64.powi(decimals);
            let focal = (focal * unit).round() / unit;
            let part = (-first * focal * unit).round().rem_euclid(unit) / unit;
            // The fractional part of the centre is known, but not its whole pixels. Pixel indices start at 0, so
            // `least` is the smallest possible centre.
            let least = (-(first * focal + part)).ceil().max(0.0);
            let mut centers = (0..MAX_PIXELS).map(|pixels| least + pixels as f64 + part);
            let center = centers.find(|center| makes(focal, *center));
            if let Some(center) = center {
                return Some(Self::new(focal, center));
            }
        }
        None
    }

    #[inline]
    fn value(&self, pixel: i64, z: f64) -> f64 {
        match usize::try_from(pixel).ok().and_then(|pixel| self.directions.get(pixel)) {
            Some(direction) => direction * z,
            None => ((pixel as f64 - self.center) / self.focal) * z,
        }
    }

    /// Returns the pixel whose coordinate equals `value` bit by bit, trying `expected` first; `None` if there is none.
    #[inline]
    fn pixel(&self, value: f64, z: f64, expected: i64) -> Option<i64> {
        // A NaN never matches: the bits of a computed NaN depend on the processor.
        let is_it = |pixel| self.value(pixel, z).to_bits() == value.to_bits() && !value.is_nan();
        if is_it(expected) {
            return Some(expected);
        }
        let pixel = rounded(value / z * self.focal + self.center);
        (pixel.abs() < 1e6 && is_it(pixel as i64)).then_some(pixel as i64)
    }

    /// Appends a word for each coordinate: the difference between its pixel and the one predicted from earlier pixels. A
    /// coordinate of a point without a depth must have the bits of the depth. Returns `false` if a coordinate cannot be
    /// encoded as a pixel.
    pub(super) fn words(&self, values: &[f64], depths: &[f64], words: &mut Vec<u64>) -> bool {
        let mut row = Expected::default();
        for (value, z) in values.iter().zip(depths) {
            let expected = row.pixel();
            let pixel = match *z > 0.0 {
                true => self.pixel(*value, *z, expected),
                false => (value.to_bits() == z.to_bits()).then_some(expected),
            };
            let Some(pixel) = pixel else { return false };
            words.push(zigzag(pixel - expected));
            row.follow(pixel);
        }
        true
    }

    /// Converts the words of [`Pinhole::words`] back to coordinates.
    pub(super) fn values(&self, words: &[u64], depths: &[f64], values: &mut Vec<f64>) {
        let mut row = Expected::default();
        for (word, z) in words.iter().zip(depths) {
            let pixel = row.pixel().wrapping_add(unzigzag(*word));
            values.push(if *z > 0.0 { self.value(pixel, *z) } else { *z });
            row.follow(pixel);
        }
    }
}

/// Predicts the next pixel: the last one plus the last step, which is 0 or 1.
#[derive(Default)]
struct Expected {
    last: i64,
    step: i64,
}

impl Expected {
    #[inline]
    fn pixel(&self) -> i64 {
        self.last.wrapping_add(self.step)
    }

    #[inline]
    fn follow(&mut self, pixel: i64) {
        let step = pixel.wrapping_sub(self.last);
        // Other steps are jumps, such as from the end of a row to its start. The step within a row is the same in the
        // next row.
        if (0..=1).contains(&step) {
            self.step = step;
        }
        self.last = pixel;
    }
}
