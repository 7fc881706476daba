use super::Occupancy;
use super::region::tiles_in;
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::space::{Point, VoxelBox, VoxelIndex};

/// Depth of a voxel in OctoMap's tree.
const FINEST_DEPTH: u8 = 16;

pub(super) fn occupancy_at_depth(view: &impl MapView, point: Point, depth: u8) -> Result<Occupancy> {
    if !(1..=FINEST_DEPTH).contains(&depth) {
        return Err(Error::argument("depth", format!("{depth} is not in the range 1 to {FINEST_DEPTH}")));
    }
    let config = view.config();
    let Some(voxel) = config.grid.voxel_of(point) else { return Ok(Occupancy::Unknown) };
    if depth == FINEST_DEPTH {
        // The table has the exact value of the voxel, the octree only an `f32`.
        return Ok(Occupancy::of(config, view.evidence(voxel)?));
    }
    let mut max: Option<f32> = None;
    let node = voxels_of_node(voxel, depth);
    for index in tiles_in(view, &node) {
        let Some(tile) = view.tile(index)? else { continue };
        // Any voxel of the node in this tile identifies the node.
        let inside = tile.voxel_box().intersection(&node).min;
        if let Some(log_odds) = tile.max_log_odds_under(inside, depth) {
            max = Some(max.map_or(log_odds, |max| max.max(log_odds)));
        }
    }
    Ok(Occupancy::of_log_odds(config, max.map(f64::from)))
}

/// Returns the voxels under the node at `depth` that contains a voxel. Like keys, nodes are aligned to multiples of
/// their size from index -32768.
fn voxels_of_node(voxel: VoxelIndex, depth: u8) -> VoxelBox {
    let size = 1_i64 << (FINEST_DEPTH - depth);
    let min = voxel.map(|index| i64::from(index).div_euclid(size) * size);
    let limit = |index: i64| index.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
    VoxelBox { min: min.map(limit), end: min.map(|index| limit(index + size)) }
}
