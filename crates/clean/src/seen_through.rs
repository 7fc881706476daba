use crate::neighborhood::HitVoxels;
use voxtile::space::VoxelIndex;
use voxtile::{MapReader, Occupancy, Queries, Result};

/// Records which of the hit voxels of a scan were seen through: the map calls them free. Voxels that the map does not
/// know, such as those outside of its region, are removed.
pub(crate) fn find_seen_through(map: &MapReader, voxels: &mut HitVoxels) -> Result<()> {
    let grid = map.grid();
    let all: Vec<VoxelIndex> = voxels.iter().collect();
    let centers: Vec<_> = all.iter().map(|&voxel| grid.center_m(voxel)).collect();
    for (&voxel, occupancy) in all.iter().zip(map.occupancy_at_points(&centers)?) {
        match occupancy {
            Occupancy::Free(_) => voxels.set_seen_through(voxel),
            Occupancy::Unknown => voxels.remove(voxel),
            Occupancy::Occupied(_) => {}
        }
    }
    Ok(())
}
