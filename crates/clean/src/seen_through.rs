use crate::neighborhood::HitVoxels;
use voxtile::space::VoxelIndex;
use voxtile::{Occupancy, Queries, Result};

/// Maps of the same scans without marks.
#[derive(Clone, Copy)]
pub(crate) struct BothOrders<'a> {
    pub(crate) forward: &'a dyn Queries,
    pub(crate) reverse: &'a dyn Queries,
}

/// Records which of the hit voxels of a scan were seen through: one of the maps calls them free. Voxels that the maps do
/// not know, such as those outside of their region, are removed.
pub(crate) fn find_seen_through(maps: BothOrders<'_>, voxels: &mut HitVoxels) -> Result<()> {
    let grid = maps.forward.grid();
    let all: Vec<VoxelIndex> = voxels.iter().collect();
    let centers: Vec<_> = all.iter().map(|&voxel| grid.center_m(voxel)).collect();
    let after = maps.forward.occupancy_at_points(&centers)?;
    let before = maps.reverse.occupancy_at_points(&centers)?;
    for ((&voxel, after), before) in all.iter().zip(after).zip(before) {
        match (after, before) {
            (Occupancy::Unknown, _) => voxels.remove(voxel),
            (Occupancy::Free(_), _) | (_, Occupancy::Free(_)) => voxels.set_seen_through(voxel),
            _ => {}
        }
    }
    Ok(())
}
