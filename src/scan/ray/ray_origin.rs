use crate::space::{Point, VoxelIndex};

/// Where the rays of a scan start, in units of voxels, world frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayOrigin {
    pub(crate) point: Point,
    /// The voxel of the point.
    pub(crate) voxel: VoxelIndex,
    /// Whether the point lies on a border between voxels: rays toward lower indices leave its voxel at once.
    pub(crate) is_on_border: bool,
    /// The same along each axis.
    pub(crate) is_on_border_along: [bool; 3],
}

impl RayOrigin {
    /// The origin at `point`, which lies in `voxel`.
    pub(crate) fn new(point: Point, voxel: VoxelIndex) -> Self {
        let is_on_border_along = std::array::from_fn(|axis| f64::from(voxel[axis]) == point[axis]);
        Self { point, voxel, is_on_border: is_on_border_along.contains(&true), is_on_border_along }
    }
}
