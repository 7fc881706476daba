use voxtile::{Aabb, Point};

/// Published part of the map, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Half the edge of the box around the sensor.
    pub radius_m: f64,
    /// Published range of heights, for outputs with a height limit.
    pub heights_m: [f64; 2],
}

impl Extent {
    pub fn around(&self, center_m: Point) -> Aabb {
        Aabb { min: center_m.map(|at| at - self.radius_m), max: center_m.map(|at| at + self.radius_m) }
    }

    /// Returns whether a voxel overlaps the range of heights, by the rule of octomap_server.
    pub fn reaches(&self, center_z_m: f64, edge_m: f64) -> bool {
        let [least, most] = self.heights_m;
        center_z_m + 0.5 * edge_m > least && center_z_m - 0.5 * edge_m < most
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_that_overlap_the_heights_count() {
        let extent = Extent { radius_m: 2.0, heights_m: [0.0, 1.0] };
        let counts: Vec<bool> = [-0.25, -0.2, 0.5, 1.2, 1.25].map(|z| extent.reaches(z, 0.5)).into();
        assert_eq!(counts, [false, true, true, true, false]);
        assert_eq!(extent.around([1.0, 0.0, 0.0]).max, [3.0, 2.0, 2.0]);
    }
}
