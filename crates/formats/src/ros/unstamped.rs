use super::messages::StampedPose;

/// Handles poses with stamp 0, as from drivers without a clock. If no pose of a kind has a stamp, recording times are
/// used instead. If any pose has one, 0 is a valid time.
#[derive(Debug, Default)]
pub(super) struct Unstamped {
    held: Vec<StampedPose>,
    /// Recording times of the held poses.
    recorded_ns: Vec<i64>,
    has_stamps: bool,
    /// Number of poses that got their recording time as the stamp.
    pub(super) count: u64,
}

/// After this many poses without a stamp, the decision is made without waiting for more.
const MAX_HELD: usize = 1000;

impl Unstamped {
    /// Adds a pose with its recording time. Poses whose stamps are decided are passed to `take`.
    pub(super) fn sort(&mut self, pose: StampedPose, log_ns: i64, take: &mut dyn FnMut(StampedPose)) {
        if self.has_stamps || pose.header.stamp_ns != 0 {
            if !self.has_stamps {
                self.has_stamps = true;
                self.recorded_ns.clear();
                self.held.drain(..).for_each(&mut *take);
            }
            return take(pose);
        }
        self.held.push(pose);
        self.recorded_ns.push(log_ns);
        if self.count > 0 || self.held.len() >= MAX_HELD {
            self.finish(take);
        }
    }

    /// Passes the remaining poses to `take`.
    pub(super) fn finish(&mut self, take: &mut dyn FnMut(StampedPose)) {
        self.count += self.held.len() as u64;
        for (mut pose, log_ns) in self.held.drain(..).zip(self.recorded_ns.drain(..)) {
            pose.header.stamp_ns = log_ns;
            take(pose);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poses::RigidPose;
    use crate::ros::messages::Header;

    /// Returns the resulting stamps of poses recorded at 100, 101, ...
    fn stamps(poses: &[i64]) -> (Vec<i64>, u64) {
        let (mut unstamped, mut taken) = (Unstamped::default(), Vec::new());
        let mut take = |pose: StampedPose| taken.push(pose.header.stamp_ns);
        for (&stamp_ns, log_ns) in poses.iter().zip(100..) {
            let header = Header { stamp_ns, frame_id: "map".to_owned() };
            let (child_frame, parent_from_child) = (String::new(), RigidPose::IDENTITY);
            unstamped.sort(StampedPose { header, child_frame, parent_from_child }, log_ns, &mut take);
        }
        unstamped.finish(&mut take);
        (taken, unstamped.count)
    }

    #[test]
    fn poses_without_stamps_use_recording_times() {
        assert_eq!(stamps(&[0, 0, 0]), (vec![100, 101, 102], 3));
        assert_eq!(stamps(&[0, 0, 5, 0]), (vec![0, 0, 5, 0], 0), "a stamp of 5 makes 0 valid");
        assert_eq!(stamps(&[]), (vec![], 0));
        let (many, count) = stamps(&[0; 1500]);
        assert_eq!((many, count), ((100..1600).collect(), 1500));
    }
}
