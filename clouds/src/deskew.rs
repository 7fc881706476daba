use crate::cloud::CloudPoint;
use crate::pose::RigidPose;

/// Takes points to where they were in the sensor's frame at the time of their cloud.
#[derive(Clone, Debug)]
pub struct Deskew {
    stamp_ns: i64,
    sensor_from_world: RigidPose,
    /// Where the sensor was around that time, in order.
    world_from_sensor: Vec<(i64, RigidPose)>,
}

/// Points are measured so long before or after the stamp of their cloud at most.
const SWEEP_NS: i64 = 300_000_000;
/// Between two poses so far apart the sensor moves along a line.
const POSE_PERIOD_NS: i64 = 1_000_000;

impl Deskew {
    /// For a cloud with its stamp, and where the sensor was then. `pose_at` says where the sensor was at another time,
    /// if that is known.
    pub fn new(
        stamp_ns: i64,
        world_from_sensor: &RigidPose,
        mut pose_at: impl FnMut(i64) -> Option<RigidPose>,
    ) -> Self {
        let periods = -SWEEP_NS / POSE_PERIOD_NS..=SWEEP_NS / POSE_PERIOD_NS;
        let times = periods.map(|period| stamp_ns.saturating_add(period * POSE_PERIOD_NS));
        let around = times.filter_map(|at_ns| Some((at_ns, pose_at(at_ns)?))).collect();
        Self { stamp_ns, sensor_from_world: world_from_sensor.inverse(), world_from_sensor: around }
    }

    /// Where a point was. One whose own pose is not known stays where it is.
    pub fn apply(&self, point: &CloudPoint) -> [f64; 3] {
        let after_ns = (point.time_s * 1e9).round();
        if after_ns == 0.0 || !after_ns.is_finite() {
            return point.position_m;
        }
        // Saturates where the time is beyond all poses.
        let at_ns = self.stamp_ns.saturating_add(after_ns as i64);
        let next = self.world_from_sensor.partition_point(|(pose_ns, _)| *pose_ns < at_ns);
        let before = next.checked_sub(1).and_then(|before| self.world_from_sensor.get(before));
        let sensor = match (before, self.world_from_sensor.get(next)) {
            (_, Some((pose_ns, pose))) if *pose_ns == at_ns => *pose,
            (Some((from_ns, from)), Some((to_ns, to))) if to_ns - from_ns <= 2 * POSE_PERIOD_NS => {
                from.towards(to, (at_ns - from_ns) as f64 / (to_ns - from_ns) as f64)
            }
            _ => return point.position_m,
        };
        self.sensor_from_world.apply(sensor.apply(point.position_m))
    }
}
