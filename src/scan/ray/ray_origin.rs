use crate::space::{Point, VoxelIndex};

/// Common origin of the rays of a scan, in units of voxels, world frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayOrigin {
    pub(crate) point: Point,
    /// Voxel that contains the point.
    pub(crate) voxel: VoxelIndex,
    /// Whether the point is on a border between voxels: rays toward lower indices leave its voxel immediately.
    pub(crate) is_on_border: bool,
    /// Whether the point is on a border between voxels, for each axis.
    pub(crate) is_on_border_along: [bool; 3],
}

impl RayOrigin {
    /// The origin at `point`, which lies in `voxel`.
    pub(crate) fn new(point: Point, voxel: VoxelIndex) -> Self {
        let is_on_border_along = std::array::from_fn(|axis| f64::from(voxel[axis]) == point[axis]);
        Self { point, voxel, is_on_border: is_on_border_along.contains(&true), is_on_border_along }
    }
}
