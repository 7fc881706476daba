use super::octree_reach::{REACH, out_of_reach};
use super::region::{for_each_occupied, for_each_voxel_in};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::octree::Octree;
use crate::space::{Aabb, MortonCode, VoxelIndex, VoxelKey};
use crate::tile::Voxel;

pub(super) fn merged_octree(view: &impl MapView, region: Option<&Aabb>, max_voxels: u64) -> Result<Octree> {
    let mut voxels: Vec<(MortonCode, f32)> = Vec::new();
    let mut count = 0;
    let mut outside: Option<VoxelIndex> = None;
    let take = |voxel: Voxel| {
        if !REACH.contains(voxel.index) {
            outside = Some(voxel.index);
            return;
        }
        count += 1;
        if count <= max_voxels {
            voxels.push((VoxelKey::from_index(voxel.index).morton(), voxel.evidence.log_odds as f32));
        }
    };
    match region {
        Some(region) => for_each_voxel_in(view, region, take)?,
        None => for_each_occupied(view, Some(0.0), None, take)?,
    }
    if let Some(voxel) = outside {
        return Err(out_of_reach(&view.config().grid, voxel, None));
    }
    if count > max_voxels {
        let hint = "use a smaller region (`region`)";
        return Err(Error::TooLarge {
            what: "number of voxels in one octree",
            size: count,
            limit: max_voxels,
            hint,
        });
    }
    voxels.sort_unstable_by_key(|&(code, _)| code);
    Ok(Octree::from_sorted(voxels))
}
