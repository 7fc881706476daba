use super::region::{bricks_in, tiles_in};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::space::{Aabb, BrickMask, VoxelBox, ones};
use crate::tile::Tile;
use rustc_hash::FxHashMap;

/// State of a column of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    /// No voxel was observed.
    Unknown,
    /// Voxels were observed, and none of them is occupied.
    Free,
    /// At least one voxel is occupied.
    Occupied,
}

/// 2D occupancy grid of a part of a map: a state for each column of voxels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Columns {
    first: [i32; 2],
    size: [usize; 2],
    states: Vec<Column>,
}

/// Maximum number of columns in a grid.
const MAX_COLUMNS: i64 = 1 << 31;

/// Columns of a brick, one bit each, in Morton order: the bits of x and y alternate.
#[derive(Clone, Copy, Debug, Default)]
struct BrickColumns {
    /// Columns with an observed voxel at any height.
    known: u64,
    /// Columns with an observed voxel between the two heights.
    seen: u64,
    occupied: u64,
}

impl Columns {
    /// Lowest voxel index along x and y.
    pub fn first(&self) -> [i32; 2] {
        self.first
    }

    /// Number of columns along x and y; 0 if the region has no observed voxel.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// States, row by row from the smallest y, each row from the smallest x.
    pub fn states(&self) -> &[Column] {
        &self.states
    }
}

pub(super) fn columns_in(view: &impl MapView, region: &Aabb, heights_m: [f64; 2]) -> Result<Columns> {
    let grid = view.config().grid;
    let around = grid.voxels_in(region);
    let mut columns = FxHashMap::<[i32; 2], BrickColumns>::default();
    for index in tiles_in(view, &around) {
        if let Some(tile) = view.tile_uncached(index)? {
            let within = tile.voxel_box().intersection(&around);
            let half_m = 0.5 * grid.resolution_m();
            let reaches = |z: i32| {
                let [_, _, center_m] = grid.center_m([0, 0, z]);
                center_m + half_m > heights_m[0] && center_m - half_m < heights_m[1]
            };
            // The layers that reach between the heights are contiguous.
            let layers = within.min[2]..within.end[2];
            let first = layers.clone().find(|z| reaches(*z)).unwrap_or(layers.end);
            let end = (first..layers.end).find(|z| !reaches(*z)).unwrap_or(layers.end);
            let mut between = within;
            (between.min[2], between.end[2]) = (first, end);
            let occupied_from = view.config().occupied_log_odds();
            collect(&tile, &within, &between, occupied_from, &mut columns);
        }
    }
    spread(&columns, grid.resolution_m())
}

/// Adds the observed voxels of a tile within a box; those in `between` determine the state of their columns.
fn collect(
    tile: &Tile,
    within: &VoxelBox,
    between: &VoxelBox,
    occupied_from: f64,
    columns: &mut FxHashMap<[i32; 2], BrickColumns>,
) {
    for part in bricks_in(tile, within) {
        let Some(brick) = part.look(tile) else { continue };
        let known = both(&brick.observed(), &part.mask_in(within));
        if known == [0; 8] {
            continue;
        }
        let seen = both(&known, &part.mask_in(between));
        let [x, y, _] = part.voxels.min;
        let column = columns.entry([x, y]).or_default();
        column.known |= from_above(&known);
        column.seen |= from_above(&seen);
        if !brick.is_below(occupied_from) {
            column.occupied |= from_above(&both(&seen, &brick.mask_from(occupied_from)));
        }
    }
}

fn both(a: &BrickMask, b: &BrickMask) -> BrickMask {
    std::array::from_fn(|word| a[word] & b[word])
}

/// Returns the columns of a brick that have a voxel in a mask.
fn from_above(mask: &BrickMask) -> u64 {
    // Bits three, six and nine of a position belong to z; voxels that differ only in these bits are in one column.
    (0..8).fold(0, |columns, word| {
        let low = mask[word] | mask[word] >> 4;
        let low = (low | low >> 32) & 0x0f0f_0f0f;
        let low = (low | low >> 4) & 0x00ff_00ff;
        let low = (low | low >> 8) & 0xffff;
        columns | low << (16 * (word & 3))
    })
}

/// Position of a column within a brick, along x and y.
fn place_of(column: usize) -> [i64; 2] {
    [0, 1].map(|axis| (0..3).map(|k| ((column >> (2 * k + axis) & 1) << k) as i64).sum())
}

/// Combines the columns of bricks in the smallest rectangle around all observed voxels.
fn spread(bricks: &FxHashMap<[i32; 2], BrickColumns>, resolution_m: f64) -> Result<Columns> {
    let at = |corner: &[i32; 2], column: usize| {
        let place = place_of(column);
        [0, 1].map(|k| i64::from(corner[k]) + place[k])
    };
    let (mut first, mut last) = ([i64::MAX; 2], [i64::MIN; 2]);
    for (corner, columns) in bricks {
        for place in ones(columns.known).map(|column| at(corner, column)) {
            first = [0, 1].map(|k| first[k].min(place[k]));
            last = [0, 1].map(|k| last[k].max(place[k]));
        }
    }
    if bricks.is_empty() {
        return Ok(Columns { first: [0; 2], size: [0; 2], states: Vec::new() });
    }
    let [width, height] = [0, 1].map(|k| last[k] - first[k] + 1);
    let too_many = || {
        let reason = format!(
            "{width} x {height} columns of {resolution_m} m exceed the limit of {MAX_COLUMNS}; use a smaller region"
        );
        Error::argument("region", reason)
    };
    let count = width.checked_mul(height).filter(|&count| count <= MAX_COLUMNS);
    let count = count.and_then(|count| usize::try_from(count).ok()).ok_or_else(too_many)?;
    let mut states = Vec::new();
    states.try_reserve_exact(count).map_err(|_| too_many())?;
    states.resize(count, Column::Unknown);
    for (corner, columns) in bricks {
        for column in ones(columns.seen) {
            let [x, y] = at(corner, column);
            let is_occupied = columns.occupied >> column & 1 == 1;
            let state = if is_occupied { Column::Occupied } else { Column::Free };
            states[((y - first[1]) * width + (x - first[0])) as usize] = state;
        }
    }
    // These are voxel indices, which have 32 bits.
    Ok(Columns { first: first.map(|k| k as i32), size: [width as usize, height as usize], states })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{BRICK_EDGE, add_to_mask, place_of_voxel};

    #[test]
    fn voxels_of_a_brick_are_in_their_columns() {
        for x in 0..BRICK_EDGE {
            for y in 0..BRICK_EDGE {
                for z in 0..BRICK_EDGE {
                    let mut mask = [0; 8];
                    add_to_mask(&mut mask, place_of_voxel([x, y, z]));
                    let columns: Vec<_> = ones(from_above(&mask)).map(place_of).collect();
                    assert_eq!(columns, [[i64::from(x), i64::from(y)]], "{z}");
                }
            }
        }
        assert_eq!(from_above(&[u64::MAX; 8]), u64::MAX);
    }
}
