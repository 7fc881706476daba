use voxtile::space::VoxelIndex;

/// Directions of the image, of length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub right: [f64; 3],
    pub up: [f64; 3],
    /// Towards the viewer.
    pub near: [f64; 3],
}

impl Camera {
    /// Returns the camera of a viewer in a direction: counterclockwise from x, and above the horizon.
    pub fn new(azimuth_deg: f64, elevation_deg: f64) -> Self {
        let ((sin, cos), (rise, run)) =
            (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
        // Exact zeros, so that views along an axis have no slope.
        let clean = |k: f64| if k.abs() < 1e-12 { 0.0 } else { k };
        Self {
            right: [-sin, cos, 0.0].map(clean),
            up: [-rise * cos, -rise * sin, run].map(clean),
            near: [run * cos, run * sin, rise].map(clean),
        }
    }

    /// Returns the position of a point in the image, right and up, and its nearness; in the unit of the point.
    #[inline]
    pub fn project(&self, point: [f64; 3]) -> [f64; 3] {
        [self.right, self.up, self.near].map(|to| to[0] * point[0] + to[1] * point[1] + to[2] * point[2])
    }

    /// Returns the middle of a voxel relative to a voxel's corner, in voxels.
    #[inline]
    pub fn middle(base: VoxelIndex, voxel: VoxelIndex) -> [f64; 3] {
        std::array::from_fn(|k| (i64::from(voxel[k]) - i64::from(base[k])) as f64 + 0.5)
    }

    /// Returns half of the extent of a voxel in the image, right and up, and in depth; in voxels.
    pub fn half_voxel(&self) -> [f64; 3] {
        [self.right, self.up, self.near].map(|to| 0.5 * to.iter().map(|k| k.abs()).sum::<f64>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_orthogonal_and_as_named() {
        let south = Camera::new(-90.0, 0.0);
        assert_eq!((south.right, south.up, south.near), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]));
        let above = Camera::new(-90.0, 90.0);
        assert_eq!((above.right, above.up, above.near), ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]));
        for (azimuth, elevation) in [(-60.0, 40.0), (33.0, 5.0), (200.0, 89.0)] {
            let Camera { right, up, near } = Camera::new(azimuth, elevation);
            let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
            for (a, b, wanted) in [
                (right, right, 1.0),
                (up, up, 1.0),
                (near, near, 1.0),
                (right, up, 0.0),
                (up, near, 0.0),
                (right, near, 0.0),
            ] {
                assert!((dot(a, b) - wanted).abs() < 1e-12);
            }
            assert!(up[2] > 0.0 && right[2] == 0.0);
        }
    }

    #[test]
    fn any_index_can_be_projected() {
        let middle = Camera::middle([i32::MIN; 3], [i32::MAX; 3]);
        assert_eq!(middle, [f64::from(u32::MAX) + 0.5; 3]);
        assert!(Camera::new(10.0, 20.0).project(middle).iter().all(|k| k.is_finite()));
    }
}
