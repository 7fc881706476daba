use super::chosen::Offset;
use voxtile::space::{Grid, Point, VoxelBox, VoxelIndex};
use voxtile::{Error, Result};
use voxtile_formats::write::PCD_REACH_VOXELS;

/// Origin of a file's coordinates in the map: the lower corner of a voxel, so that the file's voxels are those of the
/// map, shifted by whole voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExportOrigin {
    pub voxel: VoxelIndex,
    /// Lower corner of the voxel, in metres.
    pub corner_m: Point,
    /// Requested origin, if it is not a voxel corner.
    pub requested_m: Option<Point>,
}

/// Up to this distance from the map's origin, in voxels, `f32` is sufficiently precise: to a 128th of a voxel.
const NEAR_VOXELS: i64 = 1 << 17;
/// Step of automatically chosen origins, in voxels. They are also round in metres if the resolution is.
const STEP_VOXELS: i64 = 10_000;

impl ExportOrigin {
    /// Returns the voxel corner nearest to a point in metres.
    ///
    /// # Errors
    ///
    /// The point is not finite or is outside of the range of voxel indices.
    pub fn near(requested_m: Point, grid: &Grid) -> Result<Self> {
        let units = grid.to_voxel_units(requested_m);
        let voxel = units.map(f64::round);
        // The comparisons are also false for NaN.
        let is_index = |x: &f64| *x >= f64::from(i32::MIN) && *x <= f64::from(i32::MAX);
        if !voxel.iter().all(is_index) {
            let reason = format!(
                "{requested_m:?} m is not finite, or exceeds the range of indices of voxels of {} m",
                grid.resolution_m()
            );
            return Err(Error::argument("origin", reason));
        }
        // Tolerance of a thousandth of a voxel: metres as typed are rarely exact.
        let is_corner = (0..3).all(|k| (units[k] - voxel[k]).abs() < 1e-3);
        let origin = Self::at(voxel.map(|x| x as i32), grid);
        Ok(Self { requested_m: (!is_corner).then_some(requested_m), ..origin })
    }

    /// Chooses the origin of a single precision file for voxels in a box: the map's own if `f32` is sufficient for the
    /// coordinates, else a round point near their middle.
    ///
    /// # Errors
    ///
    /// The voxels are too far apart for any origin.
    pub fn nearby(voxels: &VoxelBox, grid: &Grid) -> Result<Self> {
        let reach = i64::from(PCD_REACH_VOXELS);
        let mut voxel = [0; 3];
        for (axis, origin) in voxel.iter_mut().enumerate() {
            let (min, end) = (i64::from(voxels.min[axis]), i64::from(voxels.end[axis]));
            if min >= -NEAR_VOXELS && end <= NEAR_VOXELS {
                continue;
            }
            let middle = ((min + end).div_euclid(2) + STEP_VOXELS / 2).div_euclid(STEP_VOXELS) * STEP_VOXELS;
            if min - middle < -reach || end - middle > reach {
                let width_m = 2.0 * reach as f64 * grid.resolution_m();
                let reason = format!(
                    "the float32 coordinates of .pcd resolve voxels of {} m only within {width_m} m, and the map is \
                     wider: export .ply, or single regions (`region`)",
                    grid.resolution_m()
                );
                return Err(Error::argument("output", reason));
            }
            *origin = middle.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        }
        Ok(Self::at(voxel, grid))
    }

    fn at(voxel: VoxelIndex, grid: &Grid) -> Self {
        Self { voxel, corner_m: voxel.map(|index| grid.corner_m(index)), requested_m: None }
    }

    pub fn is_moved(&self) -> bool {
        self.voxel != [0; 3]
    }

    /// Returns a point of a voxel in the file's coordinates: `(index - origin + 0.5 + offset) * resolution`.
    pub fn point_m(&self, voxel: VoxelIndex, offset: Offset, grid: &Grid) -> Point {
        std::array::from_fn(|k| {
            // Differences of indices are exact in f64.
            (f64::from(voxel[k]) - f64::from(self.voxel[k]) + 0.5 + offset[k]) * grid.resolution_m()
        })
    }
}
