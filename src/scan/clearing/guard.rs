use super::cells::{
    between_voxels, block_of_octets, cells_of, dilated, dilated_block, eroded_block, eroded_octet,
    lower_step, octets_of, sides_of, upper_step,
};
use super::marks::{HERE, Marks, MarksAround, Step};
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
        let full = cells.eroded(|| beside(|step| marks.cells(step)));
        let rest = cells.clear & !full;
        if rest == 0 || self.guard.approach_cells() == 0 || !marks.may_have_hits() {
            return full;
        }
        let approached = self.approached_cells(index, rest, marks);
        if approached == 0 {
            return full;
        }
        full | without_near(approached, |step| marks.hit_cells(step))
    }

    /// Returns those of the given cells behind which, seen from the sensor, there is a hit cell, and none next to them.
    /// Cells next to a hit in a brick that is not behind may be among them.
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

/// Whether the brick below and the brick above along an axis are considered.
type Sides = [bool; 2];

/// All bricks around a brick.
pub(crate) const AROUND: [Sides; 3] = [[true; 2]; 3];

/// Returns the values at the steps -1, 0 and 1 along an axis, and default values at those that are not considered.
#[inline(always)]
fn row<T: Default>([below, above]: Sides, of: impl Fn(i32) -> T) -> [T; 3] {
    let value_at = |is_used, step| if is_used { of(step) } else { T::default() };
    [value_at(below, -1), of(0), value_at(above, 1)]
}

/// Returns on which sides of a brick's cells, along an axis, there are cells farther from the sensor: some cells of the
/// brick may be below the sensor, and some above. `first_cell` is the lowest of them, `origin` the sensor's voxel.
fn sides_behind(first_cell: i32, origin: i32) -> Sides {
    // The sensor is at the center of its voxel, so a cell is above it if its lower voxel is not below it.
    let lower_voxel = |cell: i32| i64::from(cell) * i64::from(CELL_EDGE);
    let origin = i64::from(origin);
    [lower_voxel(first_cell) < origin, lower_voxel(first_cell + CELLS_EDGE - 1) >= origin]
}

/// A block and the 26 blocks around it.
struct Blocks([[[u64; 3]; 3]; 3]);

impl Blocks {
    /// The blocks on these sides; the others are empty.
    #[inline]
    fn on_sides([x, y, z]: [Sides; 3], of: impl Fn(Step) -> u64) -> Self {
        Self(row(z, |z| row(y, |y| row(x, |x| of([x, y, z])))))
    }

    fn are_empty(&self) -> bool {
        self.0.as_flattened().as_flattened().iter().fold(0, |all, block| all | block) == 0
    }

    fn at(&self, step: Step) -> u64 {
        let [x, y, z] = step.map(|step| (step + 1) as usize);
        self.0[z][y][x]
    }

    /// Returns the items of the middle block from which an item of the blocks is at most `reach` items away along each
    /// axis, on these sides.
    fn reached(&self, [x, y, z]: [Sides; 3], reach: i32) -> u64 {
        let along_x = |y: i32, z: i32| reached::<0>(x, reach, self.0[(z + 1) as usize][(y + 1) as usize]);
        let along_y = |z: i32| reached::<1>(y, reach, row(y, |y| along_x(y, z)));
        reached::<2>(z, reach, row(z, along_y))
    }
}

/// As [`Blocks::reached`], along one axis.
#[inline]
fn reached<const AXIS: usize>([below, above]: Sides, reach: i32, [lower, block, upper]: [u64; 3]) -> u64 {
    let mut found = block;
    if below {
        found |= (0..reach).fold((block, lower), lower_step::<AXIS>).0;
    }
    if above {
        found |= (0..reach).fold((block, upper), upper_step::<AXIS>).0;
    }
    found
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

/// Returns the items of a set of 8 x 8 x 8 items that are in it or have one of their 26 neighbors in it. `of` returns
/// the set at a step, and is called for the bricks on these sides.
pub(crate) fn near_set([x, y, z]: [Sides; 3], of: impl Fn(Step) -> BrickMask) -> BrickMask {
    let along_x = |y: i32, z: i32| dilated_row::<0>(&row(x, |x| of([x, y, z])));
    let along_y = |z: i32| dilated_row::<1>(&row(y, |y| along_x(y, z)));
    dilated_row::<2>(&row(z, along_y))
}

/// As [`dilated`], for the bricks below, in the middle and above. Few rows have hits.
fn dilated_row<const AXIS: usize>(row: &[BrickMask; 3]) -> BrickMask {
    if row.iter().all(is_empty) { [0; 8] } else { dilated::<AXIS>(&row[1], &row[0], &row[2]) }
}

/// Returns on which sides a brick's voxels have neighbors in other bricks.
fn sides_of_voxels(voxels: &BrickMask) -> [Sides; 3] {
    std::array::from_fn(|axis| {
        // Bit `axis` of a word's number is its position along the axis.
        let half = |upper: usize| {
            (0..8).filter(|word| word >> axis & 1 == upper).fold(0, |all, word| all | voxels[word])
        };
        [sides_of(half(0))[axis][0], sides_of(half(1))[axis][1]]
    })
}

/// Returns those of some items of a block that are not in a set of items, nor have one of their 26 neighbors in it.
/// `of` returns the set of the brick at a step.
fn without_near(items: u64, of: impl Fn(Step) -> u64) -> u64 {
    // Most neighbors of few items are in the same brick.
    let [x, y, z] = sides_of(items);
    let along_x = |y: i32, z: i32| {
        let [lower, middle, upper] = row(x, |x| of([x, y, z]));
        dilated_block::<0>(middle, lower, upper)
    };
    let along_y = |z: i32| {
        let [lower, middle, upper] = row(y, |y| along_x(y, z));
        dilated_block::<1>(middle, lower, upper)
    };
    let [lower, middle, upper] = row(z, along_y);
    items & !dilated_block::<2>(middle, lower, upper)
}

/// Returns a value for the bricks below and above along each axis.
fn beside<T>(of: impl Fn(Step) -> T) -> [[T; 2]; 3] {
    std::array::from_fn(|axis| [-1, 1].map(|step| of(along(axis, step))))
}

fn along(axis: usize, step: i32) -> Step {
    let mut steps = HERE;
    steps[axis] = step;
    steps
}

fn is_empty(mask: &BrickMask) -> bool {
    mask.iter().fold(0, |all, word| all | word) == 0
}
