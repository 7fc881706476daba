use super::RigidPose;
use crate::read::cloud::CloudPoint;
use std::collections::HashMap;

/// Motion compensation: moves each point to its position in the sensor frame at the time stamp of the cloud. Poses are
/// looked up as points need them, so a cloud may last a tenth of a second or a minute.
pub struct Deskew<F> {
    stamp_ns: i64,
    sensor_from_world: RigidPose,
    pose_at: F,
    /// Sensor poses at the start of each period used so far. Keys count periods from the stamp of the cloud.
    poses: HashMap<i64, Option<RigidPose>>,
    stayed: u64,
}

/// Period between two looked-up poses; the motion within it is linear.
const POSE_PERIOD_NS: i64 = 1_000_000;
/// Capacity of the cache: the poses of one minute. It bounds the memory for points with random times.
const MAX_POSES: usize = 1 << 16;

impl<F: FnMut(i64) -> Option<RigidPose>> Deskew<F> {
    /// Creates the compensation for a cloud with this stamp and sensor pose. `pose_at` returns the sensor pose at
    /// another time, if known.
    pub fn new(stamp_ns: i64, world_from_sensor: &RigidPose, pose_at: F) -> Self {
        let sensor_from_world = world_from_sensor.inverse();
        Self { stamp_ns, sensor_from_world, pose_at, poses: HashMap::new(), stayed: 0 }
    }

    /// Returns the compensated position of a point. If there is no pose for the point's time, its position is unchanged
    /// and the point is counted.
    pub fn apply(&mut self, point: &CloudPoint) -> [f64; 3] {
        let after_ns = (point.time_s * 1e9).round();
        if after_ns == 0.0 {
            return point.position_m;
        }
        // The cast saturates; such times are outside all poses.
        match after_ns.is_finite().then(|| self.pose_after(after_ns as i64)).flatten() {
            Some(sensor) => self.sensor_from_world.apply(sensor.apply(point.position_m)),
            None => {
                self.stayed += 1;
                point.position_m
            }
        }
    }

    /// Returns the number of points left unchanged because there was no pose at their time.
    pub fn stayed(&self) -> u64 {
        self.stayed
    }

    /// Returns the sensor pose at this time after the stamp.
    fn pose_after(&mut self, after_ns: i64) -> Option<RigidPose> {
        let (period, rest_ns) = (after_ns.div_euclid(POSE_PERIOD_NS), after_ns.rem_euclid(POSE_PERIOD_NS));
        let from = self.pose_of(period);
        if rest_ns == 0 {
            return from;
        }
        match (from, self.pose_of(period.saturating_add(1))) {
            (Some(from), Some(to)) => Some(from.towards(&to, rest_ns as f64 / POSE_PERIOD_NS as f64)),
            (None, None) => None,
            // The trajectory begins or ends within this period.
            _ => (self.pose_at)(self.stamp_ns.checked_add(after_ns)?),
        }
    }

    /// Returns the sensor pose at the start of a period, from the cache if possible.
    fn pose_of(&mut self, period: i64) -> Option<RigidPose> {
        if self.poses.len() >= MAX_POSES {
            self.poses.clear();
        }
        let Self { stamp_ns, pose_at, poses, .. } = self;
        *poses.entry(period).or_insert_with(|| {
            let at_ns = stamp_ns.checked_add(period.checked_mul(POSE_PERIOD_NS)?)?;
            pose_at(at_ns)
        })
    }
}
