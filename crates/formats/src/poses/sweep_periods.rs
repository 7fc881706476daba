use super::RigidPose;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use voxtile::Result;
use voxtile::nalgebra::Isometry3;
use voxtile::scan::{Pose, Sweep};

/// Periods of a scan in which points were measured, each [`Sweep::PERIOD_NS`] long, counted from the stamp. They decide
/// at which times the poses of the sensor are needed. A scan may last a tenth of a second or a minute.
#[derive(Clone, Debug, Default)]
pub struct SweepPeriods {
    periods: BTreeSet<i64>,
    /// Period of the last point.
    last: Option<i64>,
}

/// Maximum number of periods: 80 s. It bounds the memory for points with random times.
const MAX_PERIODS: usize = Sweep::MAX_POSES / 2 - 2;
/// Points further from the stamp, a day, have wrong times or none.
const LONGEST_NS: u64 = 86_400_000_000_000;
/// Accuracy of the time at which the known poses begin or end.
const EDGE_NS: u64 = 1000;

impl SweepPeriods {
    /// Returns the periods of a sweep, to find it again with other poses.
    pub fn of(sweep: &Sweep) -> Self {
        let times: BTreeSet<i64> = sweep.times_ns().collect();
        let is_whole = |time: &i64| time % Sweep::PERIOD_NS == 0;
        let ends_too =
            |time: &i64| time.checked_add(Sweep::PERIOD_NS).is_some_and(|end| times.contains(&end));
        let begins = times.iter().copied().filter(|time| is_whole(time) && ends_too(time));
        Self { periods: begins.map(|begin| begin / Sweep::PERIOD_NS).collect(), last: None }
    }

    /// Number of periods.
    pub fn len(&self) -> usize {
        self.periods.len()
    }

    /// Returns whether there are no periods.
    pub fn is_empty(&self) -> bool {
        self.periods.is_empty()
    }

    /// Returns the last time at which a pose is needed, in nanoseconds after the stamp.
    pub fn end_ns(&self) -> Option<i64> {
        self.periods.last().map(|last| last.saturating_add(1).saturating_mul(Sweep::PERIOD_NS))
    }

    /// Adds the time of a point, in nanoseconds after the stamp.
    #[inline]
    pub fn add(&mut self, after_ns: i64) {
        let period = after_ns.div_euclid(Sweep::PERIOD_NS);
        if self.last != Some(period) && after_ns.unsigned_abs() <= LONGEST_NS {
            self.last = Some(period);
            if self.periods.len() < MAX_PERIODS {
                self.periods.insert(period);
            }
        }
    }

    /// Returns the motion of a sensor with this pose at the stamp. `pose_at` returns its pose at another time, if known.
    ///
    /// # Errors
    ///
    /// Poses that are not finite.
    pub fn sweep(
        &self,
        stamp_ns: i64,
        world_from_sensor: &RigidPose,
        mut pose_at: impl FnMut(i64) -> Option<RigidPose>,
    ) -> Result<Sweep> {
        let sensor_from_world = world_from_sensor.inverse();
        let mut known = |after_ns: i64| -> Result<Option<Isometry3<f64>>> {
            let Some(pose) = stamp_ns.checked_add(after_ns).and_then(&mut pose_at) else { return Ok(None) };
            let relative = sensor_from_world.then(&pose);
            Ok(Some(*Pose::from_quaternion(relative.position_m, relative.quaternion)?.isometry()))
        };
        let mut poses = BTreeMap::new();
        for period in &self.periods {
            let begin = period.saturating_mul(Sweep::PERIOD_NS);
            let ends = [begin, begin.saturating_add(Sweep::PERIOD_NS)];
            for end in ends {
                if let Entry::Vacant(entry) = poses.entry(end) {
                    entry.insert(known(end)?);
                }
            }
            // The trajectory may begin or end within the period.
            let [mut with, mut without] = match ends.map(|end| poses.get(&end).is_some_and(Option::is_some)) {
                [true, false] => ends,
                [false, true] => [ends[1], ends[0]],
                _ => continue,
            };
            let mut edge = None;
            while with.abs_diff(without) > EDGE_NS {
                let middle = with + (without - with) / 2;
                match known(middle)? {
                    Some(pose) => (with, edge) = (middle, Some(pose)),
                    None => without = middle,
                }
            }
            if edge.is_some() {
                poses.insert(with, edge);
            }
        }
        Sweep::new(poses)
    }
}
