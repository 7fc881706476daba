use super::slab_span::SlabSpan;
use crate::space::{Point, VoxelIndex};

#[derive(Clone, Copy, Debug)]
pub(crate) struct RayEnd {
    /// End point in units of voxels, world frame.
    pub(crate) point: Point,
    /// Voxel that contains the point.
    pub(crate) voxel: VoxelIndex,
    /// Intensity at the end, if it is a hit.
    pub(crate) hit: Option<f32>,
    /// Slabs to be traced.
    pub(crate) span: SlabSpan,
}
