use crate::space::{Point, VoxelIndex};

/// Where a ray that counts ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayEnd {
    /// In units of voxels, world frame.
    pub(crate) point: Point,
    /// The voxel of the point.
    pub(crate) voxel: VoxelIndex,
    /// The intensity at the end, if that is evidence.
    pub(crate) hit: Option<f32>,
}
