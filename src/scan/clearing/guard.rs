use super::cells::{
    between_voxels, block_of_octets, cells_of, dilated, dilated_block, eroded_block, eroded_octet, octets_of,
};
use super::marks::Marks;
use crate::config::Guard;
use crate::scan::pages::MarkedBrick;
use crate::space::{BRICK_EDGE, BrickMask, MortonCode, VoxelIndex, VoxelKey, ones, place_of_voxel};

/// Voxels along the edge of a cell.
const CELL_EDGE: i32 = 2;
/// Cells along the edge of a brick.
const CELLS_EDGE: i32 = BRICK_EDGE / CELL_EDGE;

/// Cells of 2 x 2 x 2 voxels of a brick, in Morton order.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BrickCells {
    /// Cells with a miss and without a hit.
    clear: u64,
    /// Cells with a hit.
    hit: u64,
    /// Octants of the brick with a miss and without a hit.
    clear_octants: u8,
}

impl BrickCells {
    pub(crate) fn of(brick: &MarkedBrick) -> Self {
        if is_empty(&brick.hits) {
            let clear = cells_of(&brick.passed);
            return Self { clear, hit: 0, clear_octants: octets_of(clear) };
        }
        let hit = cells_of(&brick.hits);
        let clear = cells_of(&brick.misses()) & !hit;
        Self { clear, hit, clear_octants: octets_of(clear) & !octets_of(hit) }
    }

    /// Returns the cells that are clear with the six cells around them, as cells of 2 or of 4 voxels. `around` returns
    /// the bricks below and above along each axis.
    fn eroded(self, around: impl FnOnce() -> [[Self; 2]; 3]) -> u64 {
        let Self { clear, clear_octants, .. } = self;
        // Most bricks with few rays need no look at their neighbors.
        let within_brick = eroded_block(clear, &[[u64::MAX; 2]; 3])
            | u64::from(eroded_octet(clear_octants, &[[u8::MAX; 2]; 3]));
        if within_brick == 0 {
            return 0;
        }
        let around = around();
        let octants = around.map(|pair| pair.map(|cells| cells.clear_octants));
        // Close to the sensor most bricks are like this.
        if octants.as_flattened().iter().fold(clear_octants, |all, octants| all & octants) == u8::MAX {
            return u64::MAX;
        }
        eroded_block(clear, &around.map(|pair| pair.map(|cells| cells.clear)))
            | block_of_octets(eroded_octet(clear_octants, &octants))
    }
}

/// The guard of a scan: decides which of its misses are weak.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clearance {
    guard: Guard,
    /// Voxel that contains the sensor.
    origin: VoxelIndex,
}

impl Clearance {
    pub(crate) fn new(guard: Guard, origin: VoxelIndex) -> Self {
        Self { guard, origin }
    }

    /// Returns the weak misses of a brick.
    pub(crate) fn weak_misses(&self, index: VoxelIndex, marks: &impl Marks) -> BrickMask {
        let misses = marks.misses(index);
        let full = self.full_cells(index, marks);
        let mut weak: BrickMask =
            std::array::from_fn(|word| misses[word] & !block_of_octets((full >> (8 * word)) as u8));
        if is_empty(&weak) {
            return weak;
        }
        let open = open_voxels(index, &misses, weak, marks);
        (0..8).for_each(|word| weak[word] &= !open[word]);
        weak
    }

    /// Returns the cells whose misses count in full.
    fn full_cells(&self, index: VoxelIndex, marks: &impl Marks) -> u64 {
        let cells = marks.cells(index);
        if cells.clear == 0 {
            return 0;
        }
        let full = cells.eroded(|| neighbors(index, |brick| marks.cells(brick)));
        let rest = cells.clear & !full;
        if rest == 0 || !marks.may_be_near_hits(index) {
            return full;
        }
        let approached = self.approached_cells(index, rest, marks);
        if approached == 0 {
            return full;
        }
        full | approached & !near_block(index, |brick| marks.cells(brick).hit)
    }

    /// Returns those of the given cells behind which, seen from the sensor, there is a hit cell.
    fn approached_cells(&self, index: VoxelIndex, cells: u64, marks: &impl Marks) -> u64 {
        let steps = 2..=i64::from(self.guard.approach_cells());
        let is_approached = |place: usize| {
            let VoxelKey(local) = MortonCode(place as u64).to_key();
            let cell: VoxelIndex = std::array::from_fn(|k| index[k] * CELLS_EDGE + i32::from(local[k]));
            steps.clone().any(|step| {
                let [x, y, z] = self.cell_behind(cell, step);
                let brick = [x, y, z].map(|k| k.div_euclid(CELLS_EDGE));
                let place = place_of_voxel([x, y, z].map(|k| k.rem_euclid(CELLS_EDGE)));
                marks.cells(brick).hit >> place & 1 == 1
            })
        };
        ones(cells).filter(|&place| is_approached(place)).fold(0, |found, place| found | 1 << place)
    }

    /// Returns the cell that is `step` cells farther from the sensor: along the axis of the largest distance, and
    /// rounded along the others.
    fn cell_behind(&self, cell: VoxelIndex, step: i64) -> VoxelIndex {
        // Between the centers, in half voxels. They are odd, so never zero.
        let from_sensor: [i64; 3] =
            std::array::from_fn(|k| i64::from(cell[k]) * 4 + 2 - (2 * i64::from(self.origin[k]) + 1));
        let largest = from_sensor.iter().map(|distance| distance.abs()).max().unwrap_or(1);
        std::array::from_fn(|k| {
            // `step * distance / largest`, rounded to the nearest integer. Comparisons are faster than a division.
            let twice = 2 * step * from_sensor[k].abs();
            let cells: i32 = (1..=step).map(|cells| i32::from((2 * cells - 1) * largest <= twice)).sum();
            if from_sensor[k] < 0 { cell[k] - cells } else { cell[k] + cells }
        })
    }
}

/// Returns those of some misses whose six neighbors are missed, too, and whose 26 neighbors are not hit.
fn open_voxels(index: VoxelIndex, misses: &BrickMask, mut open: BrickMask, marks: &impl Marks) -> BrickMask {
    let mut keep_between = |axis: usize, [lower, upper]: &[BrickMask; 2]| {
        let between = match axis {
            0 => between_voxels::<0>(misses, lower, upper),
            1 => between_voxels::<1>(misses, lower, upper),
            _ => between_voxels::<2>(misses, lower, upper),
        };
        (0..8).for_each(|word| open[word] &= between[word]);
        is_empty(&open)
    };
    // Most bricks with few rays need no look at their neighbors.
    const ALL: [BrickMask; 2] = [[u64::MAX; 8]; 2];
    let is_closed = (0..3).any(|axis| keep_between(axis, &ALL))
        || (0..3).any(|axis| keep_between(axis, &[-1, 1].map(|step| marks.misses(moved(index, axis, step)))));
    if is_closed {
        return [0; 8];
    }
    if marks.may_be_near_hits(index) {
        let near_hits = near_set(index, |brick| marks.hits(brick));
        (0..8).for_each(|word| open[word] &= !near_hits[word]);
    }
    open
}

/// Returns the items of a set of 8 x 8 x 8 items that are in it or have one of their 26 neighbors in it. `of` returns
/// the set at an index, for `index` and the 26 indices around it.
pub(crate) fn near_set(index: VoxelIndex, of: impl Fn(VoxelIndex) -> BrickMask) -> BrickMask {
    let along_x = |y: i32, z: i32| {
        let [lower, middle, upper] = [-1, 0, 1].map(|x| of([index[0] + x, index[1] + y, index[2] + z]));
        dilated::<0>(&middle, &lower, &upper)
    };
    let along_y = |z: i32| {
        let [lower, middle, upper] = [-1, 0, 1].map(|y| along_x(y, z));
        dilated::<1>(&middle, &lower, &upper)
    };
    let [lower, middle, upper] = [-1, 0, 1].map(along_y);
    dilated::<2>(&middle, &lower, &upper)
}

/// As [`near_set`], for blocks.
fn near_block(index: VoxelIndex, of: impl Fn(VoxelIndex) -> u64) -> u64 {
    let along_x = |y: i32, z: i32| {
        let [lower, middle, upper] = [-1, 0, 1].map(|x| of([index[0] + x, index[1] + y, index[2] + z]));
        dilated_block::<0>(middle, lower, upper)
    };
    let along_y = |z: i32| {
        let [lower, middle, upper] = [-1, 0, 1].map(|y| along_x(y, z));
        dilated_block::<1>(middle, lower, upper)
    };
    let [lower, middle, upper] = [-1, 0, 1].map(along_y);
    dilated_block::<2>(middle, lower, upper)
}

/// Returns a value for the bricks below and above along each axis.
fn neighbors<T>(index: VoxelIndex, of: impl Fn(VoxelIndex) -> T) -> [[T; 2]; 3] {
    std::array::from_fn(|axis| [-1, 1].map(|step| of(moved(index, axis, step))))
}

fn moved(mut index: VoxelIndex, axis: usize, step: i32) -> VoxelIndex {
    index[axis] += step;
    index
}

fn is_empty(mask: &BrickMask) -> bool {
    mask.iter().fold(0, |all, word| all | word) == 0
}
