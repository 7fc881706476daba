use super::set::VoxelSet;
use super::set_range::{SetPosition, SetRange};
use crate::space::{TileIndex, VoxelIndex, places};

/// Voxels of a part of a set that are not as in another set, and what they are there.
pub(super) fn differences(from: &VoxelSet, to: &VoxelSet, range: SetRange) -> Vec<(VoxelIndex, bool)> {
    let (first, last) = (range.first.tile, range.last.tile);
    let mut tiles: Vec<TileIndex> = from.tiles_between(first, last);
    tiles.extend(to.tiles_between(first, last));
    tiles.sort_unstable();
    tiles.dedup();
    let mut found = Vec::new();
    for tile in tiles {
        let min = from.grid().voxels_of_tile(tile).min;
        let mut bricks: Vec<_> =
            from.bricks_of(tile).chain(to.bricks_of(tile)).map(|(brick, _)| brick).collect();
        bricks.sort_unstable();
        bricks.dedup();
        for brick in bricks {
            let (before, after) = (from.brick(tile, brick), to.brick(tile, brick));
            for place in places(std::array::from_fn(|k| before[k] ^ after[k])) {
                let code = brick.voxel(place);
                let position = SetPosition { tile, code: code.0 };
                if range.contains(position) {
                    let is_in = after[place / 64] >> (place % 64) & 1 == 1;
                    found.push((code.to_key().to_index_from(min), is_in));
                }
            }
        }
    }
    found
}
