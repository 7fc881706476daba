use crate::config::Layers;
use crate::scan::OFFSETS_PER_VOXEL;
use serde::{Deserialize, Serialize};

/// What a map's layers store of the points that hit a voxel. Sums of layers that the map does not have are zero.
///
/// None of the sums can overflow: an observation count has 31 bits, and squares of intensities and offsets at most 32.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct VoxelLayers {
    /// Number of points that hit the voxel.
    pub points: u64,
    /// Sums of the colours.
    pub colour: ColourSums,
    /// Sums of the intensities.
    pub intensity: IntensitySums,
    /// Votes of the points with a class, by class in ascending order.
    pub classes: Vec<ClassVotes>,
    /// `None` if no scan with a hit had a time stamp.
    pub time: Option<TimeSpan>,
    /// Sums of the offsets from the center.
    pub shape: ShapeSums,
}

/// Sums of the colours of the points in a voxel, 0 to 255 each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ColourSums {
    /// Number of points with a colour.
    pub points: u64,
    /// Sum of red.
    pub red: u64,
    /// Sum of green.
    pub green: u64,
    /// Sum of blue.
    pub blue: u64,
}

/// Sums of the stored intensities of the points in a voxel, 0 to 65535 each ([`Layers::intensity_max`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct IntensitySums {
    /// Number of points with an intensity.
    pub points: u64,
    /// Sum of the intensities.
    pub sum: u64,
    /// Sum of their squares.
    pub squares: u64,
}

/// Number of points with a class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClassVotes {
    /// Class.
    pub class: u8,
    /// Number of points.
    pub votes: u64,
}

/// Time stamps of the first and last scan that hit a voxel, in nanoseconds since the epoch of their source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimeSpan {
    /// The first.
    pub first_ns: i64,
    /// The last.
    pub last_ns: i64,
}

/// Sums of the offsets of the points in a voxel from its center, in units of 1/1024 of its edge, and of their products.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShapeSums {
    /// Sums of the offsets along x, y and z.
    pub offsets: [i64; 3],
    /// Sums of the products xx, yy, zz, xy, xz and yz.
    pub products: [i64; 6],
}

impl TimeSpan {
    /// The span that covers both.
    pub(super) fn joined(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        match (a, b) {
            (Some(a), Some(b)) => {
                Some(Self { first_ns: a.first_ns.min(b.first_ns), last_ns: a.last_ns.max(b.last_ns) })
            }
            (a, b) => a.or(b),
        }
    }
}

impl VoxelLayers {
    /// Mean colour, rounded; `None` if no point had a colour.
    pub fn mean_colour(&self) -> Option<[u8; 3]> {
        let ColourSums { points, red, green, blue } = self.colour;
        (points > 0)
            .then(|| [red, green, blue].map(|sum| (sum.saturating_add(points / 2) / points).min(255) as u8))
    }

    /// Mean intensity in the unit of the points; `None` if no point had an intensity.
    pub fn mean_intensity(&self, layers: &Layers) -> Option<f64> {
        let IntensitySums { points, sum, .. } = self.intensity;
        let max = layers.intensity_max.filter(|_| points > 0)?;
        Some(sum as f64 / points as f64 * (f64::from(max) / f64::from(u16::MAX)))
    }

    /// Standard deviation of the intensities in the unit of the points; `None` if no point had an intensity.
    pub fn intensity_deviation(&self, layers: &Layers) -> Option<f64> {
        let IntensitySums { points, sum, squares } = self.intensity;
        let max = layers.intensity_max.filter(|_| points > 0)?;
        // n * squares - sum * sum, without rounding.
        let spread =
            (u128::from(points) * u128::from(squares)).saturating_sub(u128::from(sum) * u128::from(sum));
        Some((spread as f64).sqrt() / points as f64 * (f64::from(max) / f64::from(u16::MAX)))
    }

    /// Class with most votes, the lowest of several; `None` if no point had a class.
    pub fn class(&self) -> Option<u8> {
        // `max_by_key` returns the last of several.
        self.classes.iter().rev().max_by_key(|votes| votes.votes).map(|votes| votes.class)
    }

    /// Mean offset of the points from the center of the voxel, as a share of its edge; `None` without points or without
    /// this layer.
    pub fn mean_offset(&self, layers: &Layers) -> Option<[f64; 3]> {
        let mean = |sum: i64| (sum as f64 / self.points as f64 + 0.5) / f64::from(OFFSETS_PER_VOXEL);
        (layers.shape && self.points > 0).then(|| self.shape.offsets.map(mean))
    }

    /// Covariance of the offsets as a share of the squared edge of a voxel: xx, yy, zz, xy, xz and yz. `None` with fewer
    /// than two points or without this layer.
    pub fn covariance(&self, layers: &Layers) -> Option<[f64; 6]> {
        if !layers.shape || self.points < 2 {
            return None;
        }
        let (points, sums) = (i128::from(self.points), self.shape.offsets.map(i128::from));
        let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
        let scale = self.points as f64 * (self.points - 1) as f64 * f64::from(OFFSETS_PER_VOXEL).powi(2);
        Some(std::array::from_fn(|k| {
            let (a, b) = pairs[k];
            (points * i128::from(self.shape.products[k]) - sums[a] * sums[b]) as f64 / scale
        }))
    }

    /// Adds the sums of other points in the same voxel.
    pub fn add(&mut self, other: &Self) {
        // Sums can only saturate if a damaged file has impossible ones.
        let add = |sum: &mut u64, more: u64| *sum = sum.saturating_add(more);
        add(&mut self.points, other.points);
        let (a, b) = (&mut self.colour, &other.colour);
        add(&mut a.points, b.points);
        add(&mut a.red, b.red);
        add(&mut a.green, b.green);
        add(&mut a.blue, b.blue);
        let (a, b) = (&mut self.intensity, &other.intensity);
        add(&mut a.points, b.points);
        add(&mut a.sum, b.sum);
        add(&mut a.squares, b.squares);
        for &ClassVotes { class, votes } in &other.classes {
            match self.classes.binary_search_by_key(&class, |own| own.class) {
                Ok(at) => add(&mut self.classes[at].votes, votes),
                Err(at) => self.classes.insert(at, ClassVotes { class, votes }),
            }
        }
        self.time = TimeSpan::joined(self.time, other.time);
        let add = |sum: &mut i64, more: i64| *sum = sum.saturating_add(more);
        (0..3).for_each(|k| add(&mut self.shape.offsets[k], other.shape.offsets[k]));
        (0..6).for_each(|k| add(&mut self.shape.products[k], other.shape.products[k]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_the_points() {
        let layers = Layers { intensity_max: Some(65535.0), shape: true, ..Layers::NONE };
        let voxel = VoxelLayers {
            points: 3,
            colour: ColourSums { points: 2, red: 3, green: 510, blue: 0 },
            intensity: IntensitySums { points: 2, sum: 30, squares: 500 },
            classes: vec![ClassVotes { class: 2, votes: 5 }, ClassVotes { class: 6, votes: 5 }],
            time: None,
            shape: ShapeSums { offsets: [-3, 0, 3], products: [9, 0, 9, 0, -9, 0] },
        };
        assert_eq!(voxel.mean_colour(), Some([2, 255, 0]));
        assert_eq!(
            (voxel.mean_intensity(&layers), voxel.intensity_deviation(&layers)),
            (Some(15.0), Some(5.0))
        );
        assert_eq!(voxel.class(), Some(2));
        assert_eq!(voxel.mean_offset(&layers), Some([-0.5, 0.5, 1.5].map(|k| k / 1024.0)));
        let covariance = voxel.covariance(&layers).unwrap().map(|k| k * 1024.0 * 1024.0);
        assert_eq!(covariance, [3.0, 0.0, 3.0, 0.0, -3.0, 0.0]);
        let none = VoxelLayers::default();
        assert_eq!((none.mean_colour(), none.mean_intensity(&layers), none.class()), (None, None, None));
        assert_eq!((none.mean_offset(&layers), none.covariance(&layers)), (None, None));
    }

    #[test]
    fn sums_of_the_largest_values_fit() {
        // 2^31 points with the largest intensity, and with the lowest offset.
        assert!((1_u64 << 31).checked_mul(65535 * 65535).is_some());
        assert!((1_i64 << 31).checked_mul(512 * 512).is_some());
    }
}
