use voxtile::space::{Grid, Point, VoxelIndex};

/// Ball around the sensor; contains the voxels whose centers are inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub(super) grid: Grid,
    /// Center in metres.
    pub(super) center: Point,
    /// Radius in metres; may be infinite.
    pub(super) radius_m: f64,
}

/// Position of a cube of voxels relative to a ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Relation {
    Inside,
    Outside,
    /// Some voxels may be inside and some outside.
    Border,
}

impl Ball {
    /// Returns whether a voxel's center is within the radius.
    #[inline]
    pub(super) fn holds(&self, voxel: VoxelIndex) -> bool {
        let center_m = self.grid.center_m(voxel);
        let [x, y, z]: Point = std::array::from_fn(|k| center_m[k] - self.center[k]);
        x * x + y * y + z * z <= self.radius_m * self.radius_m
    }

    /// Classifies the cube of `edge` voxels per side whose lowest voxel is `min`.
    #[inline]
    pub(super) fn relation(&self, min: VoxelIndex, edge: i32) -> Relation {
        // Much larger than the rounding error of squares and sums.
        const MARGIN: f64 = 1e-9;
        let squared = self.radius_m * self.radius_m;
        let (mut nearest, mut farthest) = (0.0, 0.0);
        let (low, high) = (self.grid.center_m(min), self.grid.center_m(min.map(|k| k + edge - 1)));
        for axis in 0..3 {
            let (low, high) = (low[axis] - self.center[axis], high[axis] - self.center[axis]);
            let near = low.max(-high).max(0.0);
            let far = high.max(-low);
            nearest += near * near;
            farthest += far * far;
        }
        if farthest <= squared * (1.0 - MARGIN) {
            Relation::Inside
        } else if nearest > squared * (1.0 + MARGIN) {
            Relation::Outside
        } else {
            Relation::Border
        }
    }
}
