use crate::error::{Error, Result};
use crate::space::{Aabb, Grid, VoxelBox};

/// Part of space: the voxels whose centers are in a half-open box, as for region queries, or all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// The voxels in the box.
    Inside(Aabb),
    /// The voxels outside the box.
    Outside(Aabb),
}

/// Part of space in voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct VoxelPart {
    pub(super) voxels: VoxelBox,
    pub(super) is_outside: bool,
}

/// Share of a tile that belongs to a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Share {
    Nothing,
    Some,
    Everything,
}

impl Part {
    /// Converts the part to voxels of a grid.
    ///
    /// # Errors
    ///
    /// An empty box, a box without a voxel's center, or coordinates that are not finite.
    pub(super) fn voxels(&self, grid: &Grid) -> Result<VoxelPart> {
        let (region, is_outside) = match self {
            Self::Inside(region) => (region, false),
            Self::Outside(region) => (region, true),
        };
        if !(0..3).all(|k| region.min[k] < region.max[k]) {
            let reason = format!(
                "the minimum corner {:?} must be below the maximum corner {:?} on every axis",
                region.min, region.max
            );
            return Err(Error::argument("region", reason));
        }
        let voxels = grid.voxels_in(region);
        if voxels.is_empty() {
            let reason =
                format!("the box from {:?} to {:?} contains no center of a voxel", region.min, region.max);
            return Err(Error::argument("region", reason));
        }
        Ok(VoxelPart { voxels, is_outside })
    }
}

impl VoxelPart {
    /// Returns the complement of the part.
    pub(super) fn rest(self) -> Self {
        Self { is_outside: !self.is_outside, ..self }
    }

    pub(super) fn share_of(&self, tile: &VoxelBox) -> Share {
        let common = self.voxels.intersection(tile);
        match (common.is_empty(), common == *tile) {
            (true, _) if self.is_outside => Share::Everything,
            (true, _) => Share::Nothing,
            (_, true) if self.is_outside => Share::Nothing,
            (_, true) => Share::Everything,
            _ => Share::Some,
        }
    }
}
