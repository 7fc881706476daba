use voxtile::{Aabb, Point};

/// How much of the map is published, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Half of the edge of a box around the sensor.
    pub radius_m: f64,
    /// Voxels that reach between these heights count, where heights do.
    pub heights_m: [f64; 2],
}

impl Extent {
    /// The box around a place.
    pub fn around(&self, place_m: Point) -> Aabb {
        Aabb { min: place_m.map(|at| at - self.radius_m), max: place_m.map(|at| at + self.radius_m) }
    }

    /// Whether a voxel reaches between the heights, by the rule of octomap_server.
    pub fn reaches(&self, center_z_m: f64, edge_m: f64) -> bool {
        let [least, most] = self.heights_m;
        center_z_m + 0.5 * edge_m > least && center_z_m - 0.5 * edge_m < most
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_voxel_counts_that_reaches_between_the_heights() {
        let extent = Extent { radius_m: 2.0, heights_m: [0.0, 1.0] };
        let counts: Vec<bool> = [-0.25, -0.2, 0.5, 1.2, 1.25].map(|z| extent.reaches(z, 0.5)).into();
        assert_eq!(counts, [false, true, true, true, false]);
        assert_eq!(extent.around([1.0, 0.0, 0.0]).max, [3.0, 2.0, 2.0]);
    }
}
