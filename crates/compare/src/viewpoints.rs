use rustc_hash::FxHashMap;
use std::sync::Arc;
use voxtile::{Aabb, Error, Point, Result};

/// Positions of a map's sensor. A voxel is hidden if something is between it and all near positions.
///
/// Of positions close together, one is kept: each cube of a twentieth of the range keeps the one with the lowest
/// coordinates. So a long trajectory takes little memory.
#[derive(Clone, Debug)]
pub struct Viewpoints {
    range_m: f64,
    /// The positions by cube of the edge `range_m`, in order.
    by_cube: Arc<FxHashMap<[i64; 3], Vec<Point>>>,
}

impl Viewpoints {
    /// Range in metres if the sensor's is not known.
    pub const DEFAULT_RANGE_M: f64 = 50.0;
    /// Maximum number of positions from which a voxel is examined: the nearest.
    pub(crate) const MAX_PER_VOXEL: usize = 16;
    /// Cubes along the range that keep one position each.
    const CUBES_PER_RANGE: f64 = 20.0;

    /// Creates the positions in metres, of a sensor that sees as far as `range_m`
    /// ([`Viewpoints::DEFAULT_RANGE_M`] if `None`). Positions that are not finite are ignored.
    ///
    /// # Errors
    ///
    /// The range is not a positive number.
    pub fn new(positions: impl IntoIterator<Item = Point>, range_m: Option<f64>) -> Result<Self> {
        let range_m = range_m.unwrap_or(Self::DEFAULT_RANGE_M);
        if !(range_m.is_finite() && range_m > 0.0) {
            return Err(Error::argument("range", format!("must be a length above 0 m, not {range_m}")));
        }
        let mut kept: FxHashMap<[i64; 3], Point> = FxHashMap::default();
        for position in positions.into_iter().filter(|position| position.iter().all(|k| k.is_finite())) {
            let lowest = kept.entry(cube_of(position, range_m / Self::CUBES_PER_RANGE)).or_insert(position);
            if order(&position, lowest).is_lt() {
                *lowest = position;
            }
        }
        let mut by_cube: FxHashMap<[i64; 3], Vec<Point>> = FxHashMap::default();
        for position in kept.into_values() {
            by_cube.entry(cube_of(position, range_m)).or_default().push(position);
        }
        Ok(Self { range_m, by_cube: Arc::new(by_cube) })
    }

    /// The range in metres.
    pub fn range_m(&self) -> f64 {
        self.range_m
    }

    /// Returns the positions that are within the range of a point in a box, and perhaps a few others.
    pub(crate) fn near(&self, place_m: &Aabb) -> Vec<Point> {
        let first = cube_of(place_m.min.map(|k| k - self.range_m), self.range_m);
        let last = cube_of(place_m.max.map(|k| k + self.range_m), self.range_m);
        let is_near = |cube: &[i64; 3]| (0..3).all(|k| (first[k]..=last[k]).contains(&cube[k]));
        let wanted =
            (0..3).try_fold(1_i64, |all, k| all.checked_mul(last[k].checked_sub(first[k])?.checked_add(1)?));
        if wanted.is_none_or(|wanted| wanted as u64 > self.by_cube.len() as u64) {
            let near = self.by_cube.iter().filter(|(cube, _)| is_near(cube));
            return near.flat_map(|(_, positions)| positions).copied().collect();
        }
        let mut near = Vec::new();
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                for z in first[2]..=last[2] {
                    near.extend(self.by_cube.get(&[x, y, z]).into_iter().flatten().copied());
                }
            }
        }
        near
    }

    /// Of some positions, returns those within the range of a point, at most [`Viewpoints::MAX_PER_VOXEL`]: the nearest
    /// first, of equally near ones the one with the lowest coordinates.
    pub(crate) fn nearest(&self, near: &[Point], point: Point, range_m: f64) -> Vec<Point> {
        let range_m = self.range_m.min(range_m);
        let squared = |position: &Point| (0..3).map(|k| (position[k] - point[k]).powi(2)).sum::<f64>();
        let in_range = near.iter().map(|position| (squared(position), *position));
        let mut in_range: Vec<_> = in_range.filter(|(squared, _)| *squared <= range_m * range_m).collect();
        let by_distance =
            |a: &(f64, Point), b: &(f64, Point)| a.0.total_cmp(&b.0).then_with(|| order(&a.1, &b.1));
        if in_range.len() > Self::MAX_PER_VOXEL {
            in_range.select_nth_unstable_by(Self::MAX_PER_VOXEL, by_distance);
            in_range.truncate(Self::MAX_PER_VOXEL);
        }
        in_range.sort_unstable_by(by_distance);
        in_range.into_iter().map(|(_, position)| position).collect()
    }
}

fn cube_of(position: Point, edge_m: f64) -> [i64; 3] {
    position.map(|k| (k / edge_m).floor() as i64)
}

fn order(a: &Point, b: &Point) -> std::cmp::Ordering {
    a.iter()
        .zip(b)
        .map(|(a, b)| a.total_cmp(b))
        .find(|order| order.is_ne())
        .unwrap_or(std::cmp::Ordering::Equal)
}
