use super::row::VoxelRow;

/// Relation between voxel indices and coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    /// Lower corner of the voxel with index 0.
    origin_m: [f64; 3],
    resolution_m: f64,
}

impl Lattice {
    /// Derives the lattice from a voxel.
    pub(super) fn of(voxel: &VoxelRow, resolution_m: f64) -> Self {
        let origin = |k: usize| voxel.center_m[k] - (f64::from(voxel.index[k]) + 0.5) * resolution_m;
        Self { origin_m: std::array::from_fn(origin), resolution_m }
    }

    /// Returns the voxel that contains a point. Saturates far outside.
    pub(super) fn index_at(&self, point_m: [f64; 3]) -> [i64; 3] {
        std::array::from_fn(|k| ((point_m[k] - self.origin_m[k]) / self.resolution_m).floor() as i64)
    }

    /// Returns the lower corner of a voxel, rounded to a tenth of a micrometre to remove floating-point noise of large
    /// indices.
    pub(super) fn corner_m(&self, index: [i64; 3]) -> [f64; 3] {
        let corner = |k: usize| self.origin_m[k] + index[k] as f64 * self.resolution_m;
        std::array::from_fn(|k| (corner(k) * 1e7).round() / 1e7)
    }
}
