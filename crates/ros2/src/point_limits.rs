use voxtile_formats::RigidPose;

/// Minimum and maximum of each coordinate in the map frame. Points outside are ignored, as in octomap_server: they are
/// neither hits nor free space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLimits(pub [[f64; 2]; 3]);

impl PointLimits {
    /// Replaces points outside by the sensor's origin, which means no return.
    pub fn apply(&self, positions_m: &mut [[f64; 3]], world_from_sensor: &RigidPose) {
        let Self(limits_m) = self;
        if *limits_m == [[f64::NEG_INFINITY, f64::INFINITY]; 3] {
            return;
        }
        for position_m in positions_m {
            let in_map_m = world_from_sensor.apply(*position_m);
            if !in_map_m.iter().zip(limits_m).all(|(m, [min, max])| (min..=max).contains(&m)) {
                *position_m = [0.0; 3];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_in_the_map_frame_and_inclusive() {
        // The sensor is upside down at a height of 2 m.
        let pose = RigidPose { position_m: [1.0, 0.0, 2.0], quaternion: [1.0, 0.0, 0.0, 0.0] };
        let mut limits = PointLimits([[f64::NEG_INFINITY, f64::INFINITY]; 3]);
        let points = [[1.0, 1.0, 2.0], [1.0, 1.0, 1.5], [1.0, 1.0, 2.5], [7.0, 1.0, 1.0]];
        let mut kept = points;
        limits.apply(&mut kept, &pose);
        assert_eq!(kept, points);
        limits.0[2] = [0.0, 0.75];
        limits.apply(&mut kept, &pose);
        assert_eq!(kept, [points[0], points[1], [0.0; 3], [0.0; 3]]);
    }
}
