use crate::args::Args;
use crate::cloud::Cloud;
use crate::cloud_poses::{CloudPoses, Motion};
use crate::cloud_queue::{CloudQueue, Verdict};
use crate::counters::Counters;
use crate::frame_owners::FrameOwners;
use crate::parent_warnings::ParentWarnings;
use crate::pose_miss::PoseMiss;
use crate::pose_watch::{Missed, PoseWatch};
use crate::stamp_check::{StampCheck, StampVerdict};
use crate::transport::Gid;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::time::{Duration, Instant};
use voxtile_formats::poses::most_gap_ns;
use voxtile_formats::ros::messages::StampedPose;
use voxtile_formats::ros::{BadTransform, Transforms, WhyNot};
use voxtile_formats::{RigidPose, SweepPeriods};

/// Buffer of recent transforms. Also decides how long clouds wait for their poses.
#[derive(Debug)]
pub struct TransformBuffer {
    transforms: Transforms,
    stamps: StampCheck,
    fixed_frame: String,
    /// Frame of the ground filter.
    base_frame: Option<String>,
    max_wait: Duration,
    /// Topics of transforms, for messages.
    sources: String,
    /// Number of samples inserted since old ones were last removed, and number of samples left by that removal.
    samples: (usize, usize),
    owners: FrameOwners,
    /// Frames of clouds, each with the stamp of the last cloud that had a pose.
    sensors: HashMap<String, Option<i64>>,
    parents: ParentWarnings,
    watch: PoseWatch,
    refused_at: Option<Instant>,
}

/// Length of the buffer, as in tf2.
const SPAN_NS: i64 = 10_000_000_000;
/// Number of new samples after which old ones are removed.
const FORGET_EVERY: usize = 1000;
/// Limits on memory under a flood of transforms.
const MAX_SAMPLES: usize = 200_000;
const MAX_FRAMES: usize = 2000;
const MAX_SENSORS: usize = 100;
const MAX_NAME_BYTES: usize = 256;
/// Interval between warnings about invalid transforms.
const WARN_REFUSED_EVERY: Duration = Duration::from_secs(30);

impl TransformBuffer {
    pub fn new(args: &Args) -> Self {
        let mut transforms = Transforms::default();
        let tolerance_ns = i64::try_from(args.pose_tolerance.as_nanos()).unwrap_or(i64::MAX);
        transforms.set_most_gap_ns(Some(most_gap_ns(tolerance_ns)));
        Self {
            transforms,
            stamps: StampCheck::default(),
            fixed_frame: bare(&args.frame_id).to_owned(),
            base_frame: args.filter_ground_plane.then(|| bare(&args.base_frame_id).to_owned()),
            max_wait: args.transform_wait,
            sources: format!("{} and /tf_static", args.odometry.as_deref().unwrap_or("/tf")),
            samples: (0, 0),
            owners: FrameOwners::default(),
            sensors: HashMap::new(),
            parents: ParentWarnings::default(),
            watch: PoseWatch::new(args.cloud_topics()),
            refused_at: None,
        }
    }

    /// Inserts a transform. If old samples must be removed, waiting clouds get their poses first.
    pub fn insert(
        &mut self,
        pose: &StampedPose,
        is_static: bool,
        publisher: Option<Gid>,
        now: Instant,
        queue: &mut CloudQueue,
        counters: &mut Counters,
    ) {
        if self.samples.0 >= FORGET_EVERY {
            self.remove_old(now, queue, counters);
        }
        let (new, kept) = self.samples;
        let (parent, child) = (&pose.header.frame_id, &pose.child_frame);
        let is_long = parent.len().max(child.len()) > MAX_NAME_BYTES;
        if !is_long && !self.owners.knows(bare(child)) && self.owners.len() >= MAX_FRAMES {
            self.remove_frames(counters);
        }
        let is_new = !self.owners.knows(bare(child));
        let is_full = new + kept >= MAX_SAMPLES || (is_new && self.owners.len() >= MAX_FRAMES);
        if is_long || is_full || !(is_static || self.has_valid_stamp(child, pose.header.stamp_ns, now, queue))
        {
            counters.transforms_refused += 1;
        } else {
            let stamp_ns = pose.header.stamp_ns;
            match self.transforms.insert(parent, child, stamp_ns, pose.parent_from_child, is_static) {
                Ok(false) => self.owners.note(bare(parent), bare(child), publisher, is_static),
                Ok(true) => {
                    self.owners.note(bare(parent), bare(child), publisher, is_static);
                    self.parents.check(&self.transforms, [parent, child].map(|of| bare(of)), publisher)
                }
                Err(why) => {
                    counters.transforms_refused += 1;
                    self.warn_of_refused(&why, publisher, now);
                }
            }
        }
        self.samples.0 += 1;
    }

    /// Removes old samples. If too many are left, also removes samples of the frames with most samples.
    fn remove_old(&mut self, now: Instant, queue: &mut CloudQueue, counters: &mut Counters) {
        queue.settle(|cloud| self.find(cloud, self.is_late(cloud, now)).ok());
        let mut left = self.transforms.forget_older_than(SPAN_NS);
        while left > MAX_SAMPLES - FORGET_EVERY {
            let lost = self.transforms.shrink_largest();
            if lost == 0 {
                break;
            }
            left -= lost;
            counters.transforms_refused += lost as u64;
        }
        self.samples = (0, left);
    }

    /// Removes frames of the publishers with most frames. Frames that connect a sensor to the map are kept.
    fn remove_frames(&mut self, counters: &mut Counters) {
        let fixed = self.fixed_frame.as_str();
        let mut needed = HashSet::new();
        for (sensor, stamp_ns) in &self.sensors {
            needed.extend(self.transforms.frames_between(fixed, sensor).unwrap_or_default());
            // Also keep the frames of the last pose, because a flood of ancestors can make `frames_between` fail.
            let last = stamp_ns.map(|stamp_ns| self.transforms.links_between(fixed, sensor, stamp_ns));
            needed.extend(last.and_then(Result::ok).into_iter().flatten().flatten());
        }
        for child in self.owners.forget_some(&needed, fixed) {
            self.transforms.detach(&child);
            self.stamps.forget(&child);
            counters.transforms_refused += 1;
        }
    }

    /// Returns whether a stamp is of the current clock. If the clock of a frame has jumped, removes its earlier
    /// samples.
    fn has_valid_stamp(&mut self, child: &str, stamp_ns: i64, now: Instant, queue: &mut CloudQueue) -> bool {
        match self.stamps.verdict(child, stamp_ns, now) {
            StampVerdict::Take => true,
            StampVerdict::Refuse => false,
            StampVerdict::Jump { children, since } => {
                let (count, of) = (children.len(), if children.len() > 1 { " and others" } else { "" });
                log::warn!(
                    "the clock of {child}{of} has jumped: dropped the earlier transforms of {count} frames"
                );
                queue.settle(
                    |cloud| if cloud.arrived < since { self.look_up(cloud, true).ok() } else { None },
                );
                for child in children {
                    self.transforms.forget_samples(&child);
                }
                true
            }
        }
    }

    /// Returns the poses of a cloud, or whether they may still arrive.
    pub fn verdict(&mut self, cloud: &Cloud, now: Instant) -> Verdict<CloudPoses> {
        if !self.sensors.contains_key(bare(&cloud.frame)) && self.sensors.len() < MAX_SENSORS {
            self.sensors.insert(bare(&cloud.frame).to_owned(), None);
        }
        let is_late = self.is_late(cloud, now);
        let why = match cloud.poses.clone().map_or_else(|| self.find(cloud, is_late), Ok) {
            Ok(poses) => {
                if let Some(stamp_ns) = self.sensors.get_mut(bare(&cloud.frame)) {
                    *stamp_ns = Some(cloud.stamp_ns);
                }
                self.watch.note_found(cloud.topic);
                return Verdict::Ready(poses);
            }
            Err(why) => why,
        };
        let may_pass = !matches!(why, WhyNot::AlreadyFixed(_));
        // Transforms may arrive late and out of order.
        let is_dropped = !may_pass || is_late;
        let missed = Missed { topic: cloud.topic, may_pass, is_dropped };
        let miss = PoseMiss {
            why: &why,
            cloud,
            map_frame: &self.fixed_frame,
            owners: &self.owners,
            stamps: &self.stamps,
            sources: &self.sources,
            max_wait: self.max_wait,
        };
        if let Some(warning) = self.watch.note_missed(missed, now, || miss.to_string()) {
            log::warn!("{warning}");
        }
        if !is_dropped {
            log::trace!("a cloud of {} is waiting: {why}", cloud.frame.escape_debug());
            return Verdict::Waits;
        }
        log::debug!("cloud dropped without a pose in {}: {}", self.fixed_frame, printable(&why));
        Verdict::Expired
    }

    /// Returns whether a cloud has waited for its transforms long enough.
    fn is_late(&self, cloud: &Cloud, now: Instant) -> bool {
        now.saturating_duration_since(cloud.arrived) >= self.max_wait
    }

    /// Warns of clouds that were dropped without a pose, if a warning is due.
    pub fn warn_of_drops(&mut self, now: Instant) {
        if let Some(warning) = self.watch.warning(now) {
            log::warn!("{warning}");
        }
    }

    /// Returns the reasons for which clouds get no poses, if they persist.
    pub fn problem(&self) -> Option<String> {
        self.watch.problem()
    }

    fn warn_of_refused(&mut self, why: &BadTransform, publisher: Option<Gid>, now: Instant) {
        if self.refused_at.is_some_and(|at| now.saturating_duration_since(at) < WARN_REFUSED_EVERY) {
            return;
        }
        self.refused_at = Some(now);
        let publisher = publisher.map(|gid| format!(" (publisher {gid})")).unwrap_or_default();
        log::warn!("transform refused{publisher}: {}", printable(why));
    }

    /// Returns the poses of a cloud, unless the clock of one of its frames may have jumped.
    fn find(&self, cloud: &Cloud, is_late: bool) -> Result<CloudPoses, WhyNot> {
        let poses = self.look_up(cloud, is_late)?;
        // Transforms since then may be of a new clock that repeats the same stamps.
        let mut off = self.stamps.off().filter(|(_, since)| *since <= cloud.arrived).peekable();
        if off.peek().is_some() {
            let links = self.transforms.links_between(&self.fixed_frame, &cloud.frame, cloud.stamp_ns)?;
            let is_between = |child: &str| links.iter().flatten().any(|link| link == bare(child));
            if let Some((child, _)) = off.find(|(child, _)| is_between(child)) {
                return Err(WhyNot::After(bare(child).to_owned()));
            }
        }
        Ok(poses)
    }

    /// Returns the poses of a cloud. Unless it is late, those at the times of all its points must be known or lost.
    fn look_up(&self, cloud: &Cloud, is_late: bool) -> Result<CloudPoses, WhyNot> {
        // Without a sensor position, the rays of a cloud in the map frame would begin at the origin.
        if bare(&cloud.frame) == self.fixed_frame {
            return Err(WhyNot::AlreadyFixed(self.fixed_frame.clone()));
        }
        let pose_in = |frame: &str| self.transforms.lookup(frame, &cloud.frame, cloud.stamp_ns);
        let map_from_sensor = pose_in(&self.fixed_frame)?;
        let base_from_sensor = self.base_frame.as_deref().map(pose_in).transpose()?;
        let motion = match &cloud.periods {
            Some(periods) => self.motion(cloud, periods, &map_from_sensor, is_late)?,
            None => None,
        };
        Ok(CloudPoses { map_from_sensor, base_from_sensor, motion })
    }

    fn motion(
        &self,
        cloud: &Cloud,
        periods: &SweepPeriods,
        map_from_sensor: &RigidPose,
        is_late: bool,
    ) -> Result<Option<Motion>, WhyNot> {
        let pose_at = |at_ns: i64| self.transforms.lookup(&self.fixed_frame, &cloud.frame, at_ns);
        let mut is_partial = false;
        if let Some(end_ns) = periods.end_ns()
            && let Err(why @ WhyNot::After(_)) = pose_at(cloud.stamp_ns.saturating_add(end_ns))
        {
            if !is_late {
                return Err(why);
            }
            is_partial = true;
        }
        // A pose that is not finite in single precision: the points stay as measured.
        let sweep = periods.sweep(cloud.stamp_ns, map_from_sensor, |at_ns| pose_at(at_ns).ok()).ok();
        Ok(sweep.map(|sweep| Motion { sweep: Arc::new(sweep), is_partial }))
    }
}

/// Escapes control characters in received names.
fn printable(why: &dyn std::fmt::Display) -> String {
    why.to_string().escape_debug().to_string()
}

/// Removes leading slashes from a frame name: tf 1 has them, tf 2 does not.
fn bare(frame: &str) -> &str {
    frame.trim_start_matches('/')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::when_behind::WhenBehind;
    use clap::Parser;
    use voxtile_formats::ros::messages::Header;

    fn buffer() -> TransformBuffer {
        TransformBuffer::new(&Args::parse_from(["voxtile-ros2", "-o", "map"]))
    }

    fn queue() -> CloudQueue {
        CloudQueue::new(1 << 20, 1, WhenBehind::DropOldest)
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
        Cloud::new(0, stamp_ns, frame, cdr)
    }

    #[test]
    fn a_cloud_waits_for_a_later_transform_and_is_dropped_after_the_limit() {
        let (mut buffer, mut counters) = (buffer(), Counters::default());
        let cloud = cloud(150_000_000);
        buffer.insert(
            &pose("base", "lidar", 0, 1.0),
            true,
            None,
            Instant::now(),
            &mut queue(),
            &mut counters,
        );
        buffer.insert(
            &pose("map", "base", 100_000_000, 0.0),
            false,
            None,
            Instant::now(),
            &mut queue(),
            &mut counters,
        );
        assert_eq!(buffer.verdict(&cloud, cloud.arrived), Verdict::Waits);
        assert_eq!(buffer.verdict(&cloud, cloud.arrived + Duration::from_secs(2)), Verdict::Expired);
        buffer.insert(
            &pose("map", "base", 200_000_000, 2.0),
            false,
            None,
            Instant::now(),
            &mut queue(),
            &mut counters,
        );
        let Verdict::Ready(found) = buffer.verdict(&cloud, cloud.arrived) else { panic!("no pose") };
        assert_eq!(found.map_from_sensor.position_m, [2.0, 0.0, 0.0]);
        assert_eq!(counters, Counters::default());
    }

    #[test]
    fn a_future_stamp_keeps_history_and_a_restart_clears_it() {
        const S: i64 = 1_000_000_000;
        let (mut buffer, mut counters, start) = (buffer(), Counters::default(), Instant::now());
        buffer.insert(&pose("base", "lidar", 0, 1.0), true, None, start, &mut queue(), &mut counters);
        let mut tick = |buffer: &mut TransformBuffer, number: i64, stamp_ns: i64, x: f64| {
            let now = start + Duration::from_millis(20) * number as u32;
            buffer.insert(&pose("map", "base", stamp_ns, x), false, None, now, &mut queue(), &mut counters);
        };
        for number in 0..3000 {
            tick(&mut buffer, number, 5 * S + number * S / 50, 3.0);
            if number % 10 == 0 {
                tick(&mut buffer, number, 900_000 * S, 9.0);
            }
        }
        let found =
            |buffer: &mut TransformBuffer, stamp_ns: i64| match buffer.verdict(&cloud(stamp_ns), start) {
                Verdict::Ready(pose) => Some(pose.map_from_sensor.position_m[0]),
                _ => None,
            };
        assert_eq!(found(&mut buffer, 60 * S), Some(4.0));
        // The simulation restarts and repeats the same stamps.
        for number in 3000..6000 {
            tick(&mut buffer, number, 5 * S + (number - 3000) * S / 50 + 7, 5.0);
        }
        assert_eq!(found(&mut buffer, 60 * S), Some(6.0));
        assert_eq!(found(&mut buffer, 5 * S + S / 10), None);
        assert!((300..330).contains(&counters.transforms_refused), "{counters}");
    }

    #[test]
    fn a_deskewed_cloud_waits_for_the_transforms_of_its_last_points() {
        const MS: i64 = 1_000_000;
        let (mut buffer, mut counters, start) = (buffer(), Counters::default(), Instant::now());
        let mut insert = |buffer: &mut TransformBuffer, stamp_ns: i64| {
            let pose = pose("map", "lidar", stamp_ns, stamp_ns as f64 * 1e-9);
            buffer.insert(&pose, false, None, start, &mut queue(), &mut counters);
        };
        let mut periods = SweepPeriods::default();
        (0..=100).for_each(|ms| periods.add(ms * MS));
        let cloud = Cloud { periods: Some(periods), arrived: start, ..cloud(50 * MS) };
        (0..=140).step_by(20).for_each(|ms| insert(&mut buffer, ms * MS));
        assert!(matches!(buffer.verdict(&cloud, start), Verdict::Waits));
        let late = buffer.verdict(&cloud, start + Duration::from_secs(2));
        let Verdict::Ready(CloudPoses { motion: Some(motion), .. }) = late else { panic!("{late:?}") };
        // The poses up to the last transform are known.
        assert!(motion.is_partial && motion.sweep.covers(89 * MS) && !motion.sweep.covers(91 * MS));
        insert(&mut buffer, 160 * MS);
        let Verdict::Ready(CloudPoses { motion: Some(motion), .. }) = buffer.verdict(&cloud, start) else {
            panic!("all transforms are there");
        };
        assert!(!motion.is_partial && motion.sweep.covers(100 * MS));
        let mut to_stamp = motion.sweep.to_stamp();
        let moved_m = to_stamp.apply([10.0, 0.0, 0.0], 100 * MS)[0];
        assert!((moved_m - 10.1).abs() < 1e-6, "{moved_m}");
    }

    #[test]
    fn a_clock_that_jumps_back_keeps_the_history_of_other_frames() {
        const S: i64 = 1_000_000_000;
        let (mut buffer, mut counters, start) = (buffer(), Counters::default(), Instant::now());
        buffer.insert(&pose("base", "lidar", 0, 1.0), true, None, start, &mut queue(), &mut counters);
        for number in 0..500 {
            let now = start + Duration::from_millis(20) * number as u32;
            let stamp_ns = 1000 * S + number * S / 50;
            let of_arm = if number < 250 { stamp_ns } else { number * S / 50 };
            buffer.insert(&pose("base", "arm", of_arm, 0.0), false, None, now, &mut queue(), &mut counters);
            buffer.insert(&pose("map", "base", stamp_ns, 3.0), false, None, now, &mut queue(), &mut counters);
            let found = buffer.verdict(&cloud(stamp_ns), now);
            assert!(
                matches!(&found, Verdict::Ready(pose) if pose.map_from_sensor.position_m[0] == 4.0),
                "{number}: {found:?}"
            );
        }
        assert_eq!(counters.transforms_refused, 25);
    }

    #[test]
    fn a_flood_of_frames_is_limited_by_the_buffer() {
        let (mut buffer, mut counters) = (buffer(), Counters::default());
        for frame in 0..MAX_FRAMES + 7 {
            buffer.insert(
                &pose("map", &format!("f{frame}"), 0, 0.0),
                false,
                None,
                Instant::now(),
                &mut queue(),
                &mut counters,
            );
        }
        assert_eq!((buffer.transforms.frames(), counters.transforms_refused), (1507, 500));
        // The last frame is still known.
        let last = format!("f{}", MAX_FRAMES + 6);
        buffer.insert(&pose("map", &last, 1, 0.0), false, None, Instant::now(), &mut queue(), &mut counters);
        assert_eq!((buffer.transforms.frames(), counters.transforms_refused), (1507, 500));
    }

    #[test]
    fn unknown_frames_do_not_displace_the_robots_frames() {
        const S: i64 = 1_000_000_000;
        let [flood, robot, state] = [1, 2, 3].map(|k| Some(Gid([k; 16])));
        // The flood comes before and after the robot's transforms, from known and unknown publishers.
        for publishers in [[flood, robot, state], [None; 3]] {
            let [flood, robot, state] = publishers;
            let (mut buffer, mut counters, start) = (buffer(), Counters::default(), Instant::now());
            let mut number = 0;
            let mut put = |buffer: &mut TransformBuffer, pose: &StampedPose, is_static, publisher| {
                number += 1;
                let now = start + Duration::from_micros(number);
                buffer.insert(pose, is_static, publisher, now, &mut queue(), &mut counters);
            };
            for k in 0..MAX_FRAMES + 500 {
                put(&mut buffer, &pose("x", &format!("f{k}"), 0, 0.0), k % 2 == 0, flood);
            }
            put(&mut buffer, &pose("base", "lidar", 0, 1.0), true, state);
            // A loop above the map frame, and a waiting cloud.
            put(&mut buffer, &pose("world", "map", 0, 9.0), true, flood);
            put(&mut buffer, &pose("map", "world", 0, 9.0), true, flood);
            assert_eq!(buffer.verdict(&cloud(S / 2), start), Verdict::Waits);
            put(&mut buffer, &pose("map", "base", 0, 2.0), false, robot);
            for k in 0..3 * MAX_FRAMES {
                put(&mut buffer, &pose("x", &format!("g{k}"), 0, 0.0), k % 2 == 0, flood);
            }
            put(&mut buffer, &pose("map", "base", S, 2.0), false, robot);
            let found = buffer.verdict(&cloud(S / 2), start);
            assert!(
                matches!(&found, Verdict::Ready(pose) if pose.map_from_sensor.position_m[0] == 3.0),
                "{found:?}"
            );
            assert!(buffer.transforms.frames() <= MAX_FRAMES);
        }
    }

    /// The frames of the last pose are kept, however many other frames connect the sensor to the map.
    #[test]
    fn a_flood_of_ancestors_of_the_sensor_keeps_its_pose() {
        const S: i64 = 1_000_000_000;
        let [flood, robot] = [1, 2].map(|k| Some(Gid([k; 16])));
        let (mut buffer, mut counters, start) = (buffer(), Counters::default(), Instant::now());
        let mut put = |buffer: &mut TransformBuffer, pose: &StampedPose, is_static, publisher| {
            buffer.insert(pose, is_static, publisher, start, &mut queue(), &mut counters);
        };
        put(&mut buffer, &pose("base", "lidar", 0, 1.0), true, robot);
        put(&mut buffer, &pose("odom", "base", 0, 1.0), true, robot);
        for stamp_ns in [0, S] {
            put(&mut buffer, &pose("map", "odom", stamp_ns, 1.0), false, robot);
        }
        assert!(matches!(buffer.verdict(&cloud(S / 2), start), Verdict::Ready(_)));
        put(&mut buffer, &pose("g0", "lidar", 0, 0.0), false, flood);
        for k in 0..3 * MAX_FRAMES {
            put(&mut buffer, &pose("map", &format!("g{k}"), 0, 0.0), false, flood);
            put(&mut buffer, &pose(&format!("g{}", k + 1), &format!("g{k}"), 0, 0.0), false, flood);
        }
        let found = buffer.verdict(&cloud(S / 2), start);
        assert!(
            matches!(&found, Verdict::Ready(pose) if pose.map_from_sensor.position_m[0] == 3.0),
            "{found:?}"
        );
    }

    #[test]
    fn a_flooding_frame_loses_only_its_own_history() {
        const S: i64 = 1_000_000_000;
        let (mut buffer, mut counters, now) = (buffer(), Counters::default(), Instant::now());
        buffer.insert(&pose("base", "lidar", 0, 1.0), true, None, now, &mut queue(), &mut counters);
        for tick in 0..100 {
            buffer.insert(
                &pose("map", "base", tick * S / 50, 2.0),
                false,
                None,
                now,
                &mut queue(),
                &mut counters,
            );
        }
        for stamp_ns in 0..2 * MAX_SAMPLES as i64 {
            buffer.insert(
                &pose("map", "flood", stamp_ns, 0.0),
                false,
                None,
                now,
                &mut queue(),
                &mut counters,
            );
        }
        for tick in 100..200 {
            buffer.insert(
                &pose("map", "base", tick * S / 50, 2.0),
                false,
                None,
                now,
                &mut queue(),
                &mut counters,
            );
        }
        for stamp_ns in [S / 100, 2 * S - S / 100, 3 * S + S / 100] {
            let found = buffer.verdict(&cloud(stamp_ns), now);
            assert!(
                matches!(&found, Verdict::Ready(pose) if pose.map_from_sensor.position_m[0] == 3.0),
                "{stamp_ns}: {found:?}"
            );
        }
        assert!(counters.transforms_refused >= MAX_SAMPLES as u64, "{counters}");
        assert!(buffer.transforms.forget_older_than(SPAN_NS) <= MAX_SAMPLES);
        // A change of parents adds samples too.
        for parent in 0..MAX_SAMPLES + 2 * FORGET_EVERY {
            let pose = pose(&format!("p{parent}"), "flood", 0, 0.0);
            buffer.insert(&pose, true, None, now, &mut queue(), &mut counters);
        }
        assert!(buffer.transforms.forget_older_than(SPAN_NS) <= MAX_SAMPLES);
        assert!(matches!(buffer.verdict(&cloud(S / 100), now), Verdict::Ready(_)));
    }

    #[test]
    fn loops_drop_no_cloud_and_cause_few_warnings() {
        const S: i64 = 1_000_000_000;
        let (mut buffer, mut counters, mut queue, start) =
            (buffer(), Counters::default(), queue(), Instant::now());
        // Wrong transforms arrive before and between the others, and 1000 times a second.
        let wrong = [("lidar", "map"), ("base", "map"), ("lidar", "base"), ("lidar", "odom"), ("x", "lidar")];
        let mut put = |buffer: &mut TransformBuffer, parent: &str, child: &str, stamp_ns: i64, is_static| {
            let now = start + Duration::from_nanos(stamp_ns as u64);
            let pose = pose(parent, child, stamp_ns, 1.0);
            buffer.insert(&pose, is_static, None, now, &mut queue, &mut counters);
        };
        for (parent, child) in wrong {
            put(&mut buffer, parent, child, 0, false);
        }
        put(&mut buffer, "base", "lidar", 0, true);
        for tick in 0..150 {
            put(&mut buffer, "map", "odom", tick * S / 50, false);
            put(&mut buffer, "odom", "base", tick * S / 50, false);
            for k in 0..20 {
                let (parent, child) = wrong[k as usize % wrong.len()];
                put(&mut buffer, parent, child, tick * S / 50 + k * S / 1000, false);
            }
            let stamp_ns = tick * S / 50 - S / 100;
            if tick > 0 {
                let now = start + Duration::from_nanos(stamp_ns as u64);
                let found = buffer.verdict(&Cloud { arrived: now, ..cloud(stamp_ns) }, now);
                assert!(
                    matches!(&found, Verdict::Ready(pose) if pose.map_from_sensor.position_m[0] == 3.0),
                    "{tick}: {found:?}"
                );
            }
        }
        assert!((3..=6).contains(&buffer.parents.len()), "{}", buffer.parents.len());
        assert_eq!(counters, Counters::default());
    }

    #[test]
    fn the_reason_for_missing_poses_is_reported() {
        let (mut buffer, mut counters) = (buffer(), Counters::default());
        let now = Instant::now();
        buffer.insert(&pose("base", "lidar", 0, 1.0), true, None, now, &mut queue(), &mut counters);
        let mut problem_after = |seconds| {
            let now = now + Duration::from_secs(seconds);
            buffer.verdict(&Cloud { arrived: now, ..cloud(0) }, now);
            buffer.problem()
        };
        assert_eq!((problem_after(0), problem_after(2)), (None, None));
        let why = "no cloud gets a pose: no transform from \"lidar\" to \"map\": no transform names the frame map; \
                   frames known: base, lidar";
        assert_eq!(problem_after(4).as_deref(), Some(why));
    }

    #[test]
    fn long_frame_names_are_refused() {
        let (mut buffer, mut counters) = (buffer(), Counters::default());
        buffer.insert(
            &pose("map", &"x".repeat(1 << 20), 0, 0.0),
            true,
            None,
            Instant::now(),
            &mut queue(),
            &mut counters,
        );
        assert_eq!((buffer.transforms.frames(), counters.transforms_refused), (0, 1));
    }

    #[test]
    fn clouds_that_wait_long_keep_their_poses() {
        const S: i64 = 1_000_000_000;
        let (mut buffer, mut counters, mut queue, start) =
            (buffer(), Counters::default(), queue(), Instant::now());
        let mut tick = |buffer: &mut TransformBuffer, queue: &mut CloudQueue, number: i64| {
            let now = start + Duration::from_millis(20) * number as u32;
            let pose = pose("map", "lidar", number * S / 50, number as f64 / 50.0);
            buffer.insert(&pose, false, None, now, queue, &mut counters);
        };
        queue.push(cloud(2 * S), &mut Counters::default());
        queue.push(cloud(70 * S + S / 100), &mut Counters::default());
        // The clouds are taken after two minutes.
        (0..6000).for_each(|number| tick(&mut buffer, &mut queue, number));
        let now = start + Duration::from_secs(120);
        let mut take = || queue.take_ready(&mut Counters::default(), |cloud| buffer.verdict(cloud, now));
        let mut positions_m = Vec::new();
        while let Some((_, pose)) = take() {
            positions_m.push(pose.map_from_sensor.position_m[0]);
        }
        assert_eq!(positions_m.len(), 2);
        assert!((positions_m[0] - 2.0).abs() + (positions_m[1] - 70.01).abs() < 1e-9, "{positions_m:?}");
    }

    #[test]
    fn a_cloud_after_a_clock_reset_gets_no_earlier_pose() {
        const S: i64 = 1_000_000_000;
        let (mut buffer, mut counters, mut queue, start) =
            (buffer(), Counters::default(), queue(), Instant::now());
        let at = |number: i64| start + Duration::from_millis(20) * number as u32;
        let mut tick = |buffer: &mut TransformBuffer, queue: &mut CloudQueue, number: i64, stamp_ns, x| {
            buffer.insert(&pose("map", "lidar", stamp_ns, x), false, None, at(number), queue, &mut counters);
        };
        (0..300).for_each(|number| tick(&mut buffer, &mut queue, number, number * S / 50, 1.0));
        let before = Cloud { arrived: at(299), ..cloud(5 * S + S / 100) };
        queue.push(before.clone(), &mut Counters::default());
        assert!(matches!(buffer.verdict(&before, at(299)), Verdict::Ready(_)));
        // A bag is replayed from its first second.
        tick(&mut buffer, &mut queue, 300, S, 9.0);
        let again = Cloud { arrived: at(301), ..cloud(2 * S + S / 100) };
        assert_eq!(buffer.verdict(&again, at(301)), Verdict::Waits);
        assert!(matches!(buffer.verdict(&before, at(301)), Verdict::Ready(_)));
        (301..400).for_each(|number| tick(&mut buffer, &mut queue, number, (number - 250) * S / 50, 9.0));
        let found = buffer.verdict(&again, at(301));
        assert!(
            matches!(&found, Verdict::Ready(pose) if pose.map_from_sensor.position_m[0] == 9.0),
            "{found:?}"
        );
        let taken = queue.take_ready(&mut Counters::default(), |cloud| buffer.verdict(cloud, at(400)));
        assert_eq!(taken.map(|(_, pose)| pose.map_from_sensor.position_m[0]), Some(1.0));
    }
}
