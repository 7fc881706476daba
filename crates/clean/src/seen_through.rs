use crate::neighborhood::HitVoxels;
use crate::reversed::ReversedMap;
use voxtile::space::VoxelIndex;
use voxtile::{MapReader, Occupancy, Queries, Result};

/// Records which of the hit voxels of a scan were seen through: the map calls them free, or the map of the scans in
/// reverse order. Voxels that the map does not know, such as those outside of its region, are removed.
pub(crate) fn find_seen_through(
    map: &MapReader,
    reversed: &ReversedMap,
    voxels: &mut HitVoxels,
) -> Result<()> {
    let grid = map.grid();
    let all: Vec<VoxelIndex> = voxels.iter().collect();
    let centers: Vec<_> = all.iter().map(|&voxel| grid.center_m(voxel)).collect();
    let before = reversed.get().occupancy_at_points(&centers)?;
    for ((&voxel, after), before) in all.iter().zip(map.occupancy_at_points(&centers)?).zip(before) {
        match (after, before) {
            (Occupancy::Unknown, _) => voxels.remove(voxel),
            (Occupancy::Free(_), _) | (_, Occupancy::Free(_)) => voxels.set_seen_through(voxel),
            _ => {}
        }
    }
    Ok(())
}
