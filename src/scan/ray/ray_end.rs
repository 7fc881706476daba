use super::slab_span::SlabSpan;
use crate::space::{Point, VoxelIndex};

/// Where a ray ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayEnd {
    /// In units of voxels, world frame.
    pub(crate) point: Point,
    /// The voxel of the point.
    pub(crate) voxel: VoxelIndex,
    /// The intensity at the end, if the end is evidence of a hit.
    pub(crate) hit: Option<f32>,
    /// The slabs that are to be walked.
    pub(crate) span: SlabSpan,
}
