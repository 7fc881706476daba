use super::messages::StampedPose;

/// Poses whose stamp is 0, as drivers without a clock leave it. Where no pose of a kind has a stamp, each is taken as
/// of when it was recorded; where one has, 0 is a time as any other.
#[derive(Debug, Default)]
pub(super) struct Unstamped {
    held: Vec<StampedPose>,
    /// When those that are held were recorded.
    recorded_ns: Vec<i64>,
    has_stamps: bool,
    /// Number of poses that are taken as of when they were recorded.
    pub(super) count: u64,
}

/// After so many poses without a stamp none is waited for.
const MAX_HELD: usize = 1000;

impl Unstamped {
    /// Takes a pose that was recorded then, and gives those whose stamps are decided to `take`.
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

    /// Gives those that are still held.
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

    /// The stamps that come of poses with these stamps, recorded at 100, 101, ..
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
    fn poses_without_stamps_are_of_when_they_were_recorded() {
        assert_eq!(stamps(&[0, 0, 0]), (vec![100, 101, 102], 3));
        assert_eq!(stamps(&[0, 0, 5, 0]), (vec![0, 0, 5, 0], 0), "simulations begin at 0");
        assert_eq!(stamps(&[]), (vec![], 0));
        let (many, count) = stamps(&[0; 1500]);
        assert_eq!((many, count), ((100..1600).collect(), 1500));
    }
}
