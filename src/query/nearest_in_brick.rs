use super::Hit;
use crate::sensor::Evidence;
use crate::space::{BRICK_EDGE, Grid, Point, VoxelBox, VoxelIndex};
use crate::tile::{BrickView, MarkedBlock};

/// Nearest voxel to a point among those examined so far.
pub(super) struct Nearest {
    grid: Grid,
    point: Point,
    /// Minimum log-odds of the voxels to find.
    threshold: f64,
    /// Maximum distance of the voxel; decreases with each better one.
    limit_m: f64,
    best: Option<(Hit, Evidence)>,
}

/// Voxels along an edge of an octant: a word of a brick's mask.
const OCTANT_EDGE: usize = BRICK_EDGE as usize / 2;

/// Bricks along an edge of a block.
const BLOCK_STEPS: usize = 4;

/// Coordinates of a bit in a word of 4 x 4 x 4 bits in Morton order: voxels of an octant, bricks of a block.
const PLACES: [[u8; 3]; 64] = {
    let mut voxels = [[0; 3]; 64];
    let mut bit = 0;
    while bit < 64 {
        let mut axis = 0;
        while axis < 3 {
            voxels[bit][axis] = (bit >> axis & 1 | (bit >> (axis + 3) & 1) << 1) as u8;
            axis += 1;
        }
        bit += 1;
    }
    voxels
};

impl Nearest {
    pub(super) fn new(grid: Grid, point: Point, threshold: f64, max_distance_m: f64) -> Self {
        Self { grid, point, threshold, limit_m: max_distance_m, best: None }
    }

    /// Distance in metres from which voxels need not be examined.
    pub(super) fn limit_m(&self) -> f64 {
        self.limit_m
    }

    pub(super) fn into_best(self) -> Option<(Hit, Evidence)> {
        self.best
    }

    /// Minimum log-odds of the voxels to find.
    pub(super) fn threshold(&self) -> f64 {
        self.threshold
    }

    /// Lower bound of the squared distances to the centers of the voxels of a box.
    pub(super) fn least_square(&self, voxels: &VoxelBox) -> f64 {
        let least = |axis| self.least_along(axis, voxels.min[axis], voxels.end[axis].saturating_sub(1));
        least(0) + least(1) + least(2)
    }

    /// Lower bound of the squared distances along an axis to the centers of the voxels from `first` to `last`.
    #[inline]
    fn least_along(&self, axis: usize, first: i32, last: i32) -> f64 {
        // Centers are rounded in the same way as those of single voxels, and rounding keeps their order.
        let center_m = |voxel: i32| self.grid.center_along_m(voxel);
        let outside_m = (center_m(first) - self.point[axis]).max(self.point[axis] - center_m(last)).max(0.0);
        outside_m * outside_m
    }

    /// Visits the marked bricks of a block that may contain a nearer voxel: a lower bound of the squared distances of
    /// their voxels, and their position in the block.
    pub(super) fn for_each_brick(&self, block: &MarkedBlock, mut visit: impl FnMut(f64, usize)) {
        let least: [[f64; BLOCK_STEPS]; 3] = std::array::from_fn(|axis| {
            std::array::from_fn(|step| {
                let first = block.min[axis].saturating_add(BRICK_EDGE * step as i32);
                self.least_along(axis, first, first.saturating_add(BRICK_EDGE - 1))
            })
        });
        let mut marks = block.marks;
        while marks != 0 {
            let place = marks.trailing_zeros() as usize;
            marks &= marks - 1;
            let [x, y, z] = PLACES[place].map(usize::from);
            let square = least[0][x] + least[1][y] + least[2][z];
            if !self.is_too_far(square) {
                visit(square, place);
            }
        }
    }

    /// Examines the voxels of a brick, starting with the octant closest to the point.
    pub(super) fn look_at(&mut self, brick: BrickView<'_>, lowest: VoxelIndex) {
        if brick.is_below(self.threshold) {
            return;
        }
        let squares = self.squared_distances(lowest);
        let next_to_point = (0..3).fold(0, |octant, axis| {
            let [low, high] = [OCTANT_EDGE - 1, OCTANT_EDGE].map(|k| squares[axis][k]);
            octant | usize::from(high < low) << axis
        });
        // The nearest octant first, then those that share a face with it, an edge, and a corner.
        for away in [0, 1, 2, 4, 3, 5, 6, 7] {
            let octant: usize = next_to_point ^ away;
            let first: [usize; 3] = std::array::from_fn(|axis| (octant >> axis & 1) * OCTANT_EDGE);
            let of_axis = |axis: usize| &squares[axis][first[axis]..first[axis] + OCTANT_EDGE];
            let least = |axis| of_axis(axis).iter().copied().fold(f64::INFINITY, f64::min);
            if self.is_too_far(least(0) + least(1) + least(2)) {
                continue;
            }
            let mut bits = brick.word_from(octant, self.threshold);
            while bits != 0 {
                let bit = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let [x, y, z] = PLACES[bit].map(usize::from);
                if !self.is_too_far(of_axis(0)[x] + of_axis(1)[y] + of_axis(2)[z]) {
                    let steps = [first[0] + x, first[1] + y, first[2] + z];
                    let voxel = std::array::from_fn(|axis| lowest[axis].saturating_add(steps[axis] as i32));
                    self.compare(voxel, || brick.get(octant * 64 + bit));
                }
            }
        }
    }

    /// Squared distances along each axis to the centers of a brick's voxels.
    fn squared_distances(&self, lowest: VoxelIndex) -> [[f64; BRICK_EDGE as usize]; 3] {
        let mut squares = [[0.0; BRICK_EDGE as usize]; 3];
        for step in 0..BRICK_EDGE {
            let center_m = self.grid.center_m(lowest.map(|k| k.saturating_add(step)));
            for axis in 0..3 {
                squares[axis][step as usize] = (center_m[axis] - self.point[axis]).powi(2);
            }
        }
        squares
    }

    /// Returns whether a squared distance certainly exceeds the limit, with a margin for rounding.
    pub(super) fn is_too_far(&self, distance_squared: f64) -> bool {
        distance_squared > self.limit_m * self.limit_m * (1.0 + 1e-12)
    }

    fn compare(&mut self, voxel: VoxelIndex, evidence: impl FnOnce() -> Option<Evidence>) {
        let hit = Hit::from(&self.grid, self.point, voxel, None);
        if hit.distance_m <= self.limit_m
            && hit.is_nearer_than(self.best.as_ref().map(|(hit, _)| hit))
            && let Some(evidence) = evidence()
        {
            self.limit_m = hit.distance_m;
            self.best = Some((hit, evidence));
        }
    }
}
