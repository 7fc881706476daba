//! Derives tables from others, voxel by voxel.

use super::part::VoxelPart;
use crate::sensor::Evidence;
use crate::space::{BRICK_EDGE, MortonCode, VoxelBox};
use crate::tile::Table;

/// Returns the table of the voxels in a part of space. `tile` is the box of the tile's voxels.
pub(super) fn voxels_of_part(table: &Table, tile: &VoxelBox, part: &VoxelPart) -> Table {
    let mut kept = Table::default();
    let mut run = Vec::new();
    for brick in table.bricks() {
        // A brick can extend beyond the tile, so its position is computed from a voxel inside.
        let Some((code, _)) = table.voxels_of_brick(brick).next() else { continue };
        let first = code.to_key().to_index_from(tile.min).map(|k| k & !(BRICK_EDGE - 1));
        let mask = part.mask_of_brick(first, tile);
        run.clear();
        let voxels = table.voxels_of_mask(brick, mask);
        run.extend(voxels.map(|(code, evidence)| (code.place_in_brick(), evidence)));
        kept.insert(brick, &run);
    }
    keep_layers(&mut kept, table);
    kept
}

/// Applies `change` to each voxel and its evidence. Voxels without a result are removed.
pub(super) fn changed(
    table: &Table,
    mut change: impl FnMut(MortonCode, Evidence) -> Option<Evidence>,
) -> Table {
    let mut after = Table::default();
    let mut run = Vec::new();
    for brick in table.bricks() {
        run.clear();
        table.for_each_in(brick, |place, evidence| {
            run.extend(change(brick.voxel(place), evidence).map(|after| (place, after)));
        });
        after.insert(brick, &run);
    }
    keep_layers(&mut after, table);
    after
}

/// Gives the voxels of `kept` their layers in `before`.
fn keep_layers(kept: &mut Table, before: &Table) {
    let layers = before.layers().map(|layers| layers.filtered(|code| kept.get(code).is_some()));
    kept.set_layers(layers);
}
