use rustc_hash::FxHashMap;
use voxtile::space::VoxelBox;
use voxtile::{Grid, Point, VoxelIndex};

/// Voxels along the edge of a cube of positions.
const EDGE: i32 = 64;
/// Cubes around a box that are searched one layer after another; farther positions are found in the list of all cubes.
const MAX_LAYERS: i64 = 8;

/// Positions of a sensor by cubes of voxels; of those in one voxel, the first.
pub(crate) struct Positions {
    by_cube: FxHashMap<[i32; 3], Vec<Point>>,
}

/// The positions of which one is the nearest to any point of a box.
pub(crate) struct NearPositions(Vec<Point>);

impl Positions {
    /// Positions outside of the map's space are ignored.
    pub(crate) fn new(grid: &Grid, positions: &[Point]) -> Self {
        let mut by_voxel: FxHashMap<VoxelIndex, Point> = FxHashMap::default();
        for &position in positions {
            if let Some(voxel) = grid.voxel_of(position) {
                by_voxel.entry(voxel).or_insert(position);
            }
        }
        let mut by_cube: FxHashMap<[i32; 3], Vec<Point>> = FxHashMap::default();
        for (voxel, position) in by_voxel {
            by_cube.entry(voxel.map(|k| k.div_euclid(EDGE))).or_default().push(position);
        }
        Self { by_cube }
    }

    /// Returns the positions that may be the nearest to a point in a box of voxels.
    pub(crate) fn near(&self, voxels: &VoxelBox, grid: &Grid) -> NearPositions {
        let [min, max] = [voxels.min, voxels.end].map(|corner| corner.map(|k| grid.corner_m(k)));
        // The nearest position to any point of the box is at most as far from it as this one.
        let farthest = |position: &Point| -> f64 {
            (0..3).map(|k| (position[k] - min[k]).abs().max((position[k] - max[k]).abs()).powi(2)).sum()
        };
        let nearest = |position: &Point| -> f64 {
            (0..3).map(|k| (min[k] - position[k]).max(position[k] - max[k]).max(0.0).powi(2)).sum()
        };
        let some = self.some_near(voxels);
        let least = some.iter().map(farthest).fold(f64::INFINITY, f64::min);
        let reach = (least.sqrt() / grid.resolution_m()).ceil();
        let grown = |k: i32, by: f64| (f64::from(k) + by) as i32;
        let first = voxels.min.map(|k| grown(k, -reach).div_euclid(EDGE));
        let last = voxels.end.map(|k| grown(k, reach).div_euclid(EDGE));
        let near = self.in_cubes(first, last).filter(|position| nearest(position) <= least);
        NearPositions(near.copied().collect())
    }

    /// Returns positions near a box: those of the first layer of cubes around it that has any, or else all.
    fn some_near(&self, voxels: &VoxelBox) -> Vec<Point> {
        let [first, last] =
            [voxels.min, voxels.end].map(|corner| corner.map(|k| i64::from(k.div_euclid(EDGE))));
        for layer in 0..=MAX_LAYERS {
            let clamped = |k: i64| k.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
            let (first, last) = (first.map(|k| clamped(k - layer)), last.map(|k| clamped(k + layer)));
            let found: Vec<Point> = self.in_cubes(first, last).copied().collect();
            if !found.is_empty() {
                return found;
            }
        }
        self.by_cube.values().flatten().copied().collect()
    }

    fn in_cubes(&self, first: [i32; 3], last: [i32; 3]) -> Box<dyn Iterator<Item = &Point> + '_> {
        let count: f64 = (0..3).map(|k| f64::from(last[k]) - f64::from(first[k]) + 1.0).product();
        if count > self.by_cube.len() as f64 {
            let is_inside = move |cube: &[i32; 3]| (0..3).all(|k| (first[k]..=last[k]).contains(&cube[k]));
            return Box::new(
                self.by_cube.iter().filter(move |(cube, _)| is_inside(cube)).flat_map(|(_, own)| own),
            );
        }
        let cubes = (first[0]..=last[0]).flat_map(move |x| {
            (first[1]..=last[1]).flat_map(move |y| (first[2]..=last[2]).map(move |z| [x, y, z]))
        });
        Box::new(cubes.flat_map(|cube| self.by_cube.get(&cube).into_iter().flatten()))
    }
}

impl NearPositions {
    /// Distance in metres from a point of the box to the nearest position; `None` without positions.
    pub(crate) fn distance_m(&self, point: Point) -> Option<f64> {
        let squared = |position: &Point| (0..3).map(|k| (position[k] - point[k]).powi(2)).sum::<f64>();
        self.0.iter().map(squared).reduce(f64::min).map(f64::sqrt)
    }
}
