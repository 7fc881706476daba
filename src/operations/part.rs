use crate::error::{Error, Result};
use crate::space::{Aabb, Grid, VoxelBox};

/// A part of space: the voxels whose center is in a box, half-open, as for queries of a region; or all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// What is in the box.
    Inside(Aabb),
    /// All but what is in the box.
    Outside(Aabb),
}

/// A part of space in voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct VoxelPart {
    pub(super) voxels: VoxelBox,
    pub(super) is_outside: bool,
}

/// How much of a tile belongs to a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Share {
    Nothing,
    Some,
    Everything,
}

impl Part {
    /// The part in voxels of a grid.
    ///
    /// # Errors
    ///
    /// A box that is empty, has no voxel's center in it, or has a corner that is no number.
    pub(super) fn voxels(&self, grid: &Grid) -> Result<VoxelPart> {
        let (region, is_outside) = match self {
            Self::Inside(region) => (region, false),
            Self::Outside(region) => (region, true),
        };
        if !(0..3).all(|k| region.min[k] < region.max[k]) {
            let reason = format!("{:?} is not below {:?} along every axis", region.min, region.max);
            return Err(Error::argument("region", reason));
        }
        let voxels = grid.voxels_in(region);
        if voxels.is_empty() {
            let reason = format!("between {:?} and {:?} there is no voxel's center", region.min, region.max);
            return Err(Error::argument("region", reason));
        }
        Ok(VoxelPart { voxels, is_outside })
    }
}

impl VoxelPart {
    /// All that is not of this part.
    pub(super) fn rest(self) -> Self {
        Self { is_outside: !self.is_outside, ..self }
    }

    /// How much of a tile belongs to the part, told from the tile's voxels.
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
