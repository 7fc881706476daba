use super::index::chunks_of;
use crate::cap::Cap;
use crate::extent::Extent;
use crate::line::{LANES, Line};
use crate::voxel_distance::{BEYOND, UNKNOWN};
use voxtile::space::VoxelBox;

/// Makes the distances unknown that a damaged tile could change: those that are not less than the distance to the
/// nearest voxel of the tile.
pub(super) fn make_unknown(lines: &mut [Line], extent: Extent, damaged: &VoxelBox, cap: Cap) {
    let tile = Extent::of(damaged);
    let around = tile.grown(cap.reach);
    let range = |k: usize| {
        let first = (around.min[k] - extent.min[k]).max(0);
        let end = (around.min[k] + around.size[k] as i64 - extent.min[k]).min(extent.size[k] as i64);
        first..end.max(first)
    };
    // Steps along an axis from a voxel to the tile.
    let steps = |k: usize, at: i64| {
        let voxel = extent.min[k] + at;
        (tile.min[k] - voxel).max(voxel - (tile.min[k] + tile.size[k] as i64 - 1)).max(0)
    };
    let chunks = chunks_of(extent.size[0]);
    let distances = lines.as_flattened_mut();
    for y in range(1) {
        for z in range(2) {
            let square = steps(1, y).pow(2) + steps(2, z).pow(2);
            let row = (y as usize * extent.size[2] + z as usize) * chunks * LANES;
            for x in range(0) {
                let to_tile = square + steps(0, x).pow(2);
                let distance = &mut distances[row + x as usize];
                let is_within = to_tile <= i64::from(cap.squared);
                if is_within && (*distance >= BEYOND || i64::from(distance.unsigned_abs()) >= to_tile) {
                    *distance = UNKNOWN;
                }
            }
        }
    }
}
