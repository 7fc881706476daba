use crate::space::{Point, VoxelIndex};

/// Where a ray that counts ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayEnd {
    /// In units of voxels, world frame.
    pub(super) point: Point,
    /// The voxel of the point.
    pub(super) voxel: VoxelIndex,
    /// The intensity at the end, if that is evidence.
    pub(super) hit: Option<f32>,
}
