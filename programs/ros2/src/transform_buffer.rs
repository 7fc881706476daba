use crate::args::Args;
use crate::cloud::Cloud;
use crate::cloud_queue::Verdict;
use crate::counters::Counters;
use crate::stamp_check::{StampCheck, StampVerdict};
use std::time::{Duration, Instant};
use voxtile_clouds::RigidPose;
use voxtile_clouds::poses::most_gap_ns;
use voxtile_clouds::ros::messages::StampedPose;
use voxtile_clouds::ros::{Transforms, WhyNot};

/// The last seconds of tf, and how long clouds wait for more of it.
#[derive(Debug)]
pub struct TransformBuffer {
    transforms: Transforms,
    stamps: StampCheck,
    fixed_frame: String,
    most_wait: Duration,
    /// Samples since the last time that old ones were forgotten, and those left then.
    samples: (usize, usize),
}

/// As long as the buffers of tf2 are.
const SPAN_NS: i64 = 10_000_000_000;
/// Old samples are forgotten after so many new ones.
const FORGET_EVERY: usize = 1000;
/// Bounds of what a flood can fill.
const MOST_SAMPLES: usize = 200_000;
const MOST_FRAMES: usize = 2000;
const MOST_NAME_BYTES: usize = 256;

impl TransformBuffer {
    pub fn new(args: &Args) -> Self {
        let mut transforms = Transforms::default();
        transforms.set_most_gap_ns(Some(most_gap_ns((args.pose_tolerance * 1e9) as i64)));
        let most_wait = Duration::try_from_secs_f64(args.transform_wait).unwrap_or_default();
        let fixed_frame = args.frame_id.trim_start_matches('/').to_owned();
        Self { transforms, stamps: StampCheck::default(), fixed_frame, most_wait, samples: (0, 0) }
    }

    pub fn insert(&mut self, pose: &StampedPose, is_static: bool, now: Instant, counters: &mut Counters) {
        let (new, kept) = self.samples;
        if new >= FORGET_EVERY {
            self.samples = (0, self.transforms.forget_older_than(SPAN_NS));
        }
        let (parent, child) = (&pose.header.frame_id, &pose.child_frame);
        // Frames that are known stay in use, whoever floods the rest.
        let is_new = !self.transforms.knows(child);
        let is_full = new + kept >= MOST_SAMPLES || (is_new && self.transforms.frames() >= MOST_FRAMES);
        let is_refused = parent.len().max(child.len()) > MOST_NAME_BYTES
            || is_full
            || !(is_static || self.is_of_now(child, pose.header.stamp_ns, now))
            || !self.transforms.insert(
                parent,
                child,
                pose.header.stamp_ns,
                pose.parent_from_child,
                is_static,
            );
        counters.transforms_refused += u64::from(is_refused);
        self.samples.0 += 1;
    }

    /// Whether a stamp is one of the robot's clock. If that of a frame has jumped, what was before it is forgotten.
    fn is_of_now(&mut self, child: &str, stamp_ns: i64, now: Instant) -> bool {
        match self.stamps.verdict(child, stamp_ns, now) {
            StampVerdict::Take => true,
            StampVerdict::Refuse => false,
            StampVerdict::Jump(children) => {
                let (count, of) = (children.len(), if children.len() > 1 { " and others" } else { "" });
                log::warn!(
                    "the clock of {child}{of} has jumped: the transforms of {count} frames before are forgotten"
                );
                for child in children {
                    if self.transforms.is_moving(&child) {
                        self.transforms.detach(&child);
                    }
                }
                true
            }
        }
    }

    /// Whether a cloud has its pose, may still get it, or never will.
    pub fn verdict(&self, cloud: &Cloud, now: Instant) -> Verdict<RigidPose> {
        match self.transforms.lookup(&self.fixed_frame, &cloud.frame, cloud.stamp_ns) {
            Ok(pose) => Verdict::Ready(pose),
            // Transforms may come late and out of order.
            Err(why) if now.saturating_duration_since(cloud.arrived) < self.most_wait => {
                log::trace!("a cloud of {} waits: {why}", cloud.frame);
                Verdict::Waits
            }
            Err(why) => {
                self.tell(&why);
                Verdict::Hopeless
            }
        }
    }

    fn tell(&self, why: &WhyNot) {
        log::debug!("a cloud is dropped, it has no pose in {}: {why}", self.fixed_frame);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use voxtile_clouds::ros::messages::Header;

    fn buffer() -> TransformBuffer {
        TransformBuffer::new(&Args::parse_from(["voxtile-ros2", "-o", "map"]))
    }

    fn pose(parent: &str, child: &str, stamp_ns: i64, x: f64) -> StampedPose {
        StampedPose {
            header: Header { stamp_ns, frame_id: parent.to_owned() },
            child_frame: child.to_owned(),
            parent_from_child: RigidPose { position_m: [x, 0.0, 0.0], ..RigidPose::IDENTITY },
        }
    }

    fn cloud(stamp_ns: i64) -> Cloud {
        let (frame, cdr) = ("lidar".to_owned(), Vec::new());
        Cloud { topic: 0, stamp_ns, frame, cdr, points_bytes: 0, arrived: Instant::now() }
    }

    #[test]
    fn a_cloud_waits_for_the_transform_behind_its_stamp_and_then_is_dropped() {
        let (mut buffer, mut counters) = (buffer(), Counters::default());
        let cloud = cloud(150_000_000);
        buffer.insert(&pose("base", "lidar", 0, 1.0), true, Instant::now(), &mut counters);
        buffer.insert(&pose("map", "base", 100_000_000, 0.0), false, Instant::now(), &mut counters);
        assert_eq!(buffer.verdict(&cloud, cloud.arrived), Verdict::Waits);
        assert_eq!(buffer.verdict(&cloud, cloud.arrived + Duration::from_secs(2)), Verdict::Hopeless);
        buffer.insert(&pose("map", "base", 200_000_000, 2.0), false, Instant::now(), &mut counters);
        let Verdict::Ready(found) = buffer.verdict(&cloud, cloud.arrived) else { panic!("no pose") };
        assert_eq!(found.position_m, [2.0, 0.0, 0.0]);
        assert_eq!(counters, Counters::default());
    }

    #[test]
    fn a_stamp_in_the_future_costs_no_history_and_a_restart_forgets_it() {
        const S: i64 = 1_000_000_000;
        let (mut buffer, mut counters, start) = (buffer(), Counters::default(), Instant::now());
        buffer.insert(&pose("base", "lidar", 0, 1.0), true, start, &mut counters);
        let mut tick = |buffer: &mut TransformBuffer, number: i64, stamp_ns: i64, x: f64| {
            let now = start + Duration::from_millis(20) * number as u32;
            buffer.insert(&pose("map", "base", stamp_ns, x), false, now, &mut counters);
        };
        for number in 0..3000 {
            tick(&mut buffer, number, 5 * S + number * S / 50, 3.0);
            if number % 10 == 0 {
                tick(&mut buffer, number, 900_000 * S, 9.0);
            }
        }
        let found = |buffer: &TransformBuffer, stamp_ns: i64| match buffer.verdict(&cloud(stamp_ns), start) {
            Verdict::Ready(pose) => Some(pose.position_m[0]),
            _ => None,
        };
        assert_eq!(found(&buffer, 60 * S), Some(4.0));
        // The simulation begins anew, and passes the same stamps.
        for number in 3000..6000 {
            tick(&mut buffer, number, 5 * S + (number - 3000) * S / 50 + 7, 5.0);
        }
        assert_eq!(found(&buffer, 60 * S), Some(6.0));
        assert_eq!(found(&buffer, 5 * S + S / 10), None);
        assert!((300..330).contains(&counters.transforms_refused), "{counters}");
    }

    #[test]
    fn a_frame_whose_clock_falls_back_costs_the_others_no_history() {
        const S: i64 = 1_000_000_000;
        let (mut buffer, mut counters, start) = (buffer(), Counters::default(), Instant::now());
        buffer.insert(&pose("base", "lidar", 0, 1.0), true, start, &mut counters);
        for number in 0..500 {
            let now = start + Duration::from_millis(20) * number as u32;
            let stamp_ns = 1000 * S + number * S / 50;
            let of_arm = if number < 250 { stamp_ns } else { number * S / 50 };
            buffer.insert(&pose("base", "arm", of_arm, 0.0), false, now, &mut counters);
            buffer.insert(&pose("map", "base", stamp_ns, 3.0), false, now, &mut counters);
            let found = buffer.verdict(&cloud(stamp_ns), now);
            assert!(
                matches!(found, Verdict::Ready(pose) if pose.position_m[0] == 4.0),
                "{number}: {found:?}"
            );
        }
        assert_eq!(counters.transforms_refused, 25);
    }

    #[test]
    fn a_flood_of_frames_or_samples_fills_the_buffer_and_no_more() {
        let (mut buffer, mut counters) = (buffer(), Counters::default());
        for frame in 0..MOST_FRAMES + 7 {
            buffer.insert(&pose("map", &format!("f{frame}"), 0, 0.0), false, Instant::now(), &mut counters);
        }
        assert_eq!((buffer.transforms.frames(), counters.transforms_refused), (MOST_FRAMES, 7));
        buffer.insert(&pose("map", "f3", 1, 0.0), false, Instant::now(), &mut counters);
        assert_eq!(counters.transforms_refused, 7);
        let (mut buffer, mut counters) = (self::buffer(), Counters::default());
        for stamp_ns in 0..MOST_SAMPLES as i64 + 3000 {
            buffer.insert(&pose("map", "base", stamp_ns, 0.0), false, Instant::now(), &mut counters);
        }
        assert!(counters.transforms_refused > 0);
        assert!(buffer.transforms.forget_older_than(SPAN_NS) <= MOST_SAMPLES);
        buffer.insert(&pose("map", &"x".repeat(1 << 20), 0, 0.0), true, Instant::now(), &mut counters);
        assert_eq!(buffer.transforms.frames(), 1);
    }
}
