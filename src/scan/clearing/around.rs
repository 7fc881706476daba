//! A brick and the 26 bricks around it, and sets of items in them.

use super::cells::{dilated, dilated_block, lower_step, sides_of, upper_step};
use crate::space::{BrickMask, VoxelIndex};

/// Step to a brick from another one: -1, 0 or 1 along each axis.
pub(crate) type Step = [i32; 3];

/// Step of a brick to itself.
pub(crate) const HERE: Step = [0; 3];

/// Returns the index of the brick at a step from another one.
#[inline]
pub(crate) fn moved(brick: VoxelIndex, step: Step) -> VoxelIndex {
    std::array::from_fn(|axis| brick[axis] + step[axis])
}

/// Returns a step along one axis.
pub(super) fn along(axis: usize, step: i32) -> Step {
    let mut steps = HERE;
    steps[axis] = step;
    steps
}

/// Whether the brick below and the brick above along an axis are considered.
pub(crate) type Sides = [bool; 2];

/// All bricks around a brick.
pub(crate) const AROUND: [Sides; 3] = [[true; 2]; 3];

/// Returns the values at the steps -1, 0 and 1 along an axis, and default values at those that are not considered.
#[inline(always)]
fn row<T: Default>([below, above]: Sides, of: impl Fn(i32) -> T) -> [T; 3] {
    let value_at = |is_used, step| if is_used { of(step) } else { T::default() };
    [value_at(below, -1), of(0), value_at(above, 1)]
}

/// A block and the 26 blocks around it.
pub(super) struct Blocks([[[u64; 3]; 3]; 3]);

impl Blocks {
    /// The blocks on these sides; the others are empty.
    #[inline]
    pub(super) fn on_sides([x, y, z]: [Sides; 3], of: impl Fn(Step) -> u64) -> Self {
        Self(row(z, |z| row(y, |y| row(x, |x| of([x, y, z])))))
    }

    pub(super) fn are_empty(&self) -> bool {
        self.0.as_flattened().as_flattened().iter().fold(0, |all, block| all | block) == 0
    }

    pub(super) fn at(&self, step: Step) -> u64 {
        let [x, y, z] = step.map(|step| (step + 1) as usize);
        self.0[z][y][x]
    }

    /// Returns the items of the middle block from which an item of the blocks is at most `reach` items away along each
    /// axis, on these sides.
    pub(super) fn reached(&self, [x, y, z]: [Sides; 3], reach: i32) -> u64 {
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
pub(super) fn sides_of_voxels(voxels: &BrickMask) -> [Sides; 3] {
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
pub(super) fn without_near(items: u64, of: impl Fn(Step) -> u64) -> u64 {
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
pub(super) fn neighbors_along_axes<T>(of: impl Fn(Step) -> T) -> [[T; 2]; 3] {
    std::array::from_fn(|axis| [-1, 1].map(|step| of(along(axis, step))))
}

pub(super) fn is_empty(mask: &BrickMask) -> bool {
    mask.iter().fold(0, |all, word| all | word) == 0
}
