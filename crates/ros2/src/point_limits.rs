/// Minimum and maximum of each coordinate in the map frame. Points outside are ignored, as in octomap_server: they are
/// neither hits nor free space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLimits(pub [[f64; 2]; 3]);

impl PointLimits {
    /// Returns whether all points are inside.
    pub fn is_none(&self) -> bool {
        self.0 == [[f64::NEG_INFINITY, f64::INFINITY]; 3]
    }

    /// Returns whether a position in the map frame is inside.
    pub fn contain(&self, in_map_m: [f64; 3]) -> bool {
        in_map_m.iter().zip(&self.0).all(|(m, [min, max])| (min..=max).contains(&m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile_formats::RigidPose;

    #[test]
    fn limits_are_in_the_map_frame_and_inclusive() {
        // The sensor is upside down at a height of 2 m.
        let pose = RigidPose { position_m: [1.0, 0.0, 2.0], quaternion: [1.0, 0.0, 0.0, 0.0] };
        let mut limits = PointLimits([[f64::NEG_INFINITY, f64::INFINITY]; 3]);
        let points = [[1.0, 1.0, 2.0], [1.0, 1.0, 1.5], [1.0, 1.0, 2.5], [7.0, 1.0, 1.0]];
        let inside = |limits: &PointLimits| points.map(|point| limits.contain(pose.apply(point)));
        assert!(limits.is_none());
        assert_eq!(inside(&limits), [true; 4]);
        limits.0[2] = [0.0, 0.75];
        assert!(!limits.is_none());
        assert_eq!(inside(&limits), [true, true, false, false]);
    }
}
