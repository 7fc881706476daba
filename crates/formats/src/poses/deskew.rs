use super::RigidPose;
use crate::read::cloud::CloudPoint;
use std::collections::HashMap;

/// Takes points to where they were in the sensor's frame at the time of their cloud. Poses are looked up as points need
/// them, whenever that was: a cloud may take a tenth of a second or a minute.
pub struct Deskew<F> {
    stamp_ns: i64,
    sensor_from_world: RigidPose,
    pose_at: F,
    /// Where the sensor was at the periods that were asked for, counted from the stamp.
    poses: HashMap<i64, Option<RigidPose>>,
    stayed: u64,
}

/// Between two poses so far apart the sensor moves along a line.
const POSE_PERIOD_NS: i64 = 1_000_000;
/// Poses that are kept: those of a minute. Points with times at random would fill the memory otherwise.
const MAX_POSES: usize = 1 << 16;

impl<F: FnMut(i64) -> Option<RigidPose>> Deskew<F> {
    /// For a cloud with its stamp, and where the sensor was then. `pose_at` says where the sensor was at another time,
    /// if that is known.
    pub fn new(stamp_ns: i64, world_from_sensor: &RigidPose, pose_at: F) -> Self {
        let sensor_from_world = world_from_sensor.inverse();
        Self { stamp_ns, sensor_from_world, pose_at, poses: HashMap::new(), stayed: 0 }
    }

    /// Where a point was. One whose own pose is not known stays where it is, and is counted.
    pub fn apply(&mut self, point: &CloudPoint) -> [f64; 3] {
        let after_ns = (point.time_s * 1e9).round();
        if after_ns == 0.0 {
            return point.position_m;
        }
        // Saturates where the time is beyond all poses.
        match after_ns.is_finite().then(|| self.pose_after(after_ns as i64)).flatten() {
            Some(sensor) => self.sensor_from_world.apply(sensor.apply(point.position_m)),
            None => {
                self.stayed += 1;
                point.position_m
            }
        }
    }

    /// Number of points that stayed where they were, for want of a pose at their time.
    pub fn stayed(&self) -> u64 {
        self.stayed
    }

    /// Where the sensor was so long after the stamp.
    fn pose_after(&mut self, after_ns: i64) -> Option<RigidPose> {
        let (period, rest_ns) = (after_ns.div_euclid(POSE_PERIOD_NS), after_ns.rem_euclid(POSE_PERIOD_NS));
        let from = self.pose_of(period);
        if rest_ns == 0 {
            return from;
        }
        match (from, self.pose_of(period.saturating_add(1))) {
            (Some(from), Some(to)) => Some(from.towards(&to, rest_ns as f64 / POSE_PERIOD_NS as f64)),
            (None, None) => None,
            // The first or the last pose lies within this period.
            _ => (self.pose_at)(self.stamp_ns.checked_add(after_ns)?),
        }
    }

    /// Where the sensor was at the start of a period.
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
