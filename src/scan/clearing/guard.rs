use super::around::{
    Blocks, HERE, Sides, along, is_empty, near_set, neighbors_along_axes, sides_of_voxels, without_near,
};
use super::cells::{above, between_voxels, block_of_octets, cells_of, eroded_block, eroded_octet, octets_of};
use super::marks::{Marks, MarksAround};
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
    pub(crate) hit: u64,
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
        let marks = &marks.around(index);
        let misses = marks.misses(HERE);
        let full = self.full_cells(index, marks);
        let mut weak = misses;
        if full != 0 {
            (0..8).for_each(|word| weak[word] &= !block_of_octets((full >> (8 * word)) as u8));
        }
        if is_empty(&weak) {
            return weak;
        }
        let open = open_voxels(&misses, weak, marks);
        (0..8).for_each(|word| weak[word] &= !open[word]);
        weak
    }

    /// Returns the cells whose misses count in full.
    fn full_cells(&self, index: VoxelIndex, marks: &impl MarksAround) -> u64 {
        let cells = marks.cells(HERE);
        if cells.clear == 0 {
            return 0;
        }
        let full = cells.eroded(|| neighbors_along_axes(|step| marks.cells(step)));
        let rest = cells.clear & !full;
        if rest == 0 {
            return full;
        }
        let raised = rest & above::<2>(cells.clear, marks.cells(along(2, -1)).clear);
        if !marks.may_have_hits() {
            return full | raised;
        }
        let mut found = raised;
        if self.guard.approach_cells() > 0 && rest & !raised != 0 {
            found |= self.approached_cells(index, rest & !raised, marks);
        }
        if found == 0 {
            return full;
        }
        full | without_near(found, |step| marks.hit_cells(step))
    }

    /// Returns those of the given cells behind which, seen from the sensor, there is a hit cell. Leaves out most cells
    /// that are next to a hit.
    fn approached_cells(&self, index: VoxelIndex, cells: u64, marks: &impl MarksAround) -> u64 {
        let first: VoxelIndex = index.map(|k| k * CELLS_EDGE);
        let sides = std::array::from_fn(|axis| sides_behind(first[axis], self.origin[axis]));
        let hits = Blocks::on_sides(sides, |step| marks.hit_cells(step));
        if hits.are_empty() {
            return 0;
        }
        let reach = i32::from(self.guard.approach_cells());
        // Few cells have a hit on these sides at the right distance.
        let mut candidates = cells & hits.reached(sides, reach);
        if candidates != 0 {
            candidates &= !hits.reached(sides, 1);
        }
        let is_approached = |place: usize| {
            let VoxelKey(local) = MortonCode(place as u64).to_key();
            let cell: VoxelIndex = std::array::from_fn(|k| first[k] + i32::from(local[k]));
            (2..=i64::from(reach)).any(|step| {
                let behind = self.cell_behind(cell, step);
                let brick = std::array::from_fn(|k| behind[k].div_euclid(CELLS_EDGE) - index[k]);
                let place = place_of_voxel(behind.map(|k| k.rem_euclid(CELLS_EDGE)));
                hits.at(brick) >> place & 1 == 1
            })
        };
        ones(candidates).filter(|&place| is_approached(place)).fold(0, |found, place| found | 1 << place)
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

/// Returns in which directions along an axis the cells of a brick are farther from the sensor: downward if a cell of
/// the brick is below the sensor, upward if one is above it. `first_cell` is the brick's lowest cell, `origin` the
/// sensor's voxel.
fn sides_behind(first_cell: i32, origin: i32) -> Sides {
    // The sensor is at the center of its voxel, so a cell is above it if its lower voxel is not below it.
    let lower_voxel = |cell: i32| i64::from(cell) * i64::from(CELL_EDGE);
    let origin = i64::from(origin);
    [lower_voxel(first_cell) < origin, lower_voxel(first_cell + CELLS_EDGE - 1) >= origin]
}

/// Returns those of some misses whose six neighbors are missed, too, and whose 26 neighbors are not hit.
fn open_voxels(misses: &BrickMask, mut open: BrickMask, marks: &impl MarksAround) -> BrickMask {
    let mut keep_between = |axis: usize, [lower, upper]: &[BrickMask; 2]| {
        let between = match axis {
            0 => between_voxels::<0>(misses, lower, upper),
            1 => between_voxels::<1>(misses, lower, upper),
            _ => between_voxels::<2>(misses, lower, upper),
        };
        (0..8).for_each(|word| open[word] &= between[word]);
        is_empty(&open)
    };
    // Most bricks with few rays need no look at their neighbors. Rays are mostly level, so gaps are mostly along z.
    const ALL: [BrickMask; 2] = [[u64::MAX; 8]; 2];
    let is_closed = [2, 1, 0].into_iter().any(|axis| keep_between(axis, &ALL))
        || [2, 1, 0]
            .into_iter()
            .any(|axis| keep_between(axis, &[-1, 1].map(|step| marks.misses(along(axis, step)))));
    if is_closed {
        return [0; 8];
    }
    if marks.may_have_hits() {
        let near_hits = near_set(sides_of_voxels(&open), |step| marks.hits(step));
        (0..8).for_each(|word| open[word] &= !near_hits[word]);
    }
    open
}
