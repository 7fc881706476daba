use crate::args::Args;
use crate::cloud::Cloud;
use crate::cloud_points::CloudPoints;
use crate::cloud_poses::CloudPoses;
use crate::cloud_queue::{CloudQueue, bytes_of};
use crate::counters::Counters;
use crate::drop_warnings::DropWarnings;
use crate::transform_buffer::TransformBuffer;
use crate::transport::Message;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use voxtile::scan::AttributeSet;
use voxtile_formats::SweepPeriods;
use voxtile_formats::read::AttributeValues;
use voxtile_formats::ros::messages::{Header, MessageKind, PointCloud2, StampedPose, decode_poses};
use voxtile_formats::ros::{Wire, WireError};

/// Memory of a period of a cloud: the period, and two poses.
const BYTES_OF_PERIOD: usize = 128;

/// Messages from the transport threads for the mapping thread.
#[derive(Debug)]
pub struct Inbox {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    queue: CloudQueue,
    transforms: TransformBuffer,
    counters: Counters,
    /// Topics of clouds, each with the number of received clouds.
    arrived: Vec<(String, u64)>,
    warnings: DropWarnings,
    /// Last received path, until it is taken.
    path: Option<Vec<StampedPose>>,
    fixed_frame: String,
    /// Attributes of points that the map takes.
    attributes: AttributeSet,
    is_deskewed: bool,
    is_closed: bool,
}

impl Inbox {
    pub fn new(args: &Args) -> Self {
        let queue = CloudQueue::new(args.queue_bytes(), args.cloud.len(), args.when_behind);
        let (transforms, counters) = (TransformBuffer::new(args), Counters::default());
        let fixed_frame = args.frame_id.trim_start_matches('/').to_owned();
        let arrived = args.cloud_topics().into_iter().map(|topic| (topic, 0)).collect();
        let warnings = DropWarnings::new(args);
        let state = State {
            queue,
            transforms,
            counters,
            arrived,
            warnings,
            path: None,
            fixed_frame,
            attributes: AttributeSet::NONE,
            is_deskewed: args.deskew,
            is_closed: false,
        };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Sets the attributes of points that the map takes.
    pub fn want_attributes(&self, attributes: AttributeSet) {
        self.lock().attributes = attributes;
    }

    pub fn put_cloud(&self, topic: usize, cdr: Vec<u8>) {
        let (attributes, is_deskewed) = {
            let state = self.lock();
            (state.attributes, state.is_deskewed)
        };
        let head = head(&cdr, attributes, is_deskewed);
        let mut state = self.lock();
        state.counters.received += 1;
        if let Some((_, arrived)) = state.arrived.get_mut(topic) {
            *arrived += 1;
        }
        let CloudFacts { header, points_bytes, periods } = match head {
            Ok(head) => head,
            Err(error) => {
                state.counters.malformed += 1;
                state.warnings.malformed_cloud(topic, &error);
                return;
            }
        };
        let (stamp_ns, frame) = (header.stamp_ns, header.frame_id);
        let mut cloud = Cloud { points_bytes, periods, ..Cloud::new(topic, stamp_ns, frame, cdr) };
        while state.queue.must_wait(&cloud) && !state.is_closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        cloud.arrived = Instant::now();
        let State { queue, counters, warnings, transforms, .. } = &mut *state;
        let (before, bytes) = (*counters, bytes_of(&cloud));
        queue.push(cloud, counters);
        if counters.too_large > before.too_large {
            warnings.too_large_cloud(topic, bytes);
        }
        warnings.of_queue([&before, counters], || transforms.problem());
        self.changed.notify_all();
    }

    pub fn put_poses(&self, kind: MessageKind, message: &Message, is_static: bool) {
        let poses = decode_poses(kind, Wire::Cdr, &message.cdr);
        let mut state = self.lock();
        let State { queue, transforms, counters, warnings, .. } = &mut *state;
        match poses {
            Ok(poses) => {
                let now = Instant::now();
                let publisher = message.publisher;
                let mut insert = |pose| transforms.insert(pose, is_static, publisher, now, queue, counters);
                poses.iter().for_each(&mut insert);
            }
            Err(error) => {
                counters.malformed += 1;
                warnings.malformed_poses(&error);
            }
        }
        self.changed.notify_all();
    }

    /// Stores a corrected path. Replaces a path that is not taken yet.
    pub fn put_path(&self, cdr: &[u8]) {
        let poses = decode_poses(MessageKind::Path, Wire::Cdr, cdr);
        let mut state = self.lock();
        match poses {
            Ok(poses) if poses.iter().all(|pose| pose.header.frame_id == state.fixed_frame) => {
                state.path = Some(poses);
            }
            Ok(_) => {
                log::warn!("path ignored: some of its poses are not in the frame {}", state.fixed_frame);
                state.counters.malformed += 1;
            }
            Err(error) => {
                state.counters.malformed += 1;
                state.warnings.malformed_path(&error);
            }
        }
    }

    pub fn take_path(&self) -> Option<Vec<StampedPose>> {
        self.lock().path.take()
    }

    /// Returns the next cloud with its poses, or `None` after `max_wait`.
    pub fn take(&self, max_wait: Duration) -> Option<(Cloud, CloudPoses)> {
        let mut state = self.lock();
        // The previous cloud is mapped: release its memory and wake the threads that wait for memory.
        state.queue.release_taken();
        self.changed.notify_all();
        for is_last in [false, true] {
            let State { queue, transforms, counters, .. } = &mut *state;
            let now = Instant::now();
            let taken = queue.take_ready(counters, |cloud| transforms.verdict(cloud, now));
            transforms.warn_of_drops(now);
            if taken.is_some() {
                self.changed.notify_all();
                return taken;
            }
            if !is_last {
                let waited = self.changed.wait_timeout(state, max_wait);
                state = waited.unwrap_or_else(PoisonError::into_inner).0;
            }
        }
        None
    }

    /// Counts messages that the transport lost.
    pub fn note_lost(&self, messages: u64, why: &str) {
        let mut state = self.lock();
        state.counters.transport_errors += messages;
        state.warnings.lost(messages, why);
    }

    /// Counts a message that is larger than the queue.
    #[cfg(feature = "zenoh")]
    pub fn note_too_large(&self, topic: &str, bytes: usize) {
        let mut state = self.lock();
        state.counters.too_large += 1;
        state.warnings.too_large(topic, bytes);
    }

    /// Returns the topics of clouds, each with the number of received clouds.
    pub fn arrived(&self) -> Vec<(String, u64)> {
        self.lock().arrived.clone()
    }

    /// Returns the memory of the queued clouds.
    pub fn queue_bytes(&self) -> usize {
        self.lock().queue.bytes()
    }

    pub fn count(&self, count: impl FnOnce(&mut Counters)) {
        count(&mut self.lock().counters);
    }

    /// Returns the counters and the number of queued clouds.
    pub fn counters(&self) -> (Counters, usize) {
        let state = self.lock();
        (state.counters, state.queue.len())
    }

    /// Returns the reason why clouds get no pose, if the problem persists.
    pub fn pose_problem(&self) -> Option<String> {
        self.lock().transforms.problem()
    }

    /// Places a sensor at the origin of the map.
    #[cfg(test)]
    pub fn put_mount(&self, frame: &str) {
        let header = crate::messages::Header { frame_id: "map".to_owned(), ..Default::default() };
        let mounts = vec![(header, frame, ([0.0; 3], [0.0, 0.0, 0.0, 1.0]))];
        let body = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(&mounts).unwrap();
        let cdr = [vec![0, 1, 0, 0], body].concat();
        self.put_poses(MessageKind::Tf, &Message { cdr, publisher: None }, true);
    }

    /// Closes the inbox and wakes the threads that wait for memory.
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
    }

    /// Ignores poisoning: each change is one call, so a panicked thread leaves a consistent state.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Properties of a cloud that are needed before it is mapped.
struct CloudFacts {
    header: Header,
    /// Memory of its decoded points and periods.
    points_bytes: usize,
    periods: Option<SweepPeriods>,
}

/// Returns the facts of a complete cloud.
fn head(cdr: &[u8], attributes: AttributeSet, is_deskewed: bool) -> Result<CloudFacts, WireError> {
    let mut cloud = PointCloud2::decode(Wire::Cdr, cdr)?;
    cloud.read_attributes(attributes, AttributeValues::default());
    // No transform can match an empty frame, and later clouds of the topic would wait behind this one.
    if cloud.header.frame_id.is_empty() {
        return Err(WireError { byte: 0, reason: "the cloud has an empty frame_id".to_owned() });
    }
    match cloud.shortage() {
        Some(shortage) => Err(shortage),
        None => {
            let mut periods = (is_deskewed && cloud.has_times()).then(SweepPeriods::default);
            if let Some(periods) = &mut periods {
                cloud.points().for_each(|point| periods.add(point.after_stamp_ns()));
            }
            let of_periods = periods.as_ref().map_or(0, |periods| periods.len() * BYTES_OF_PERIOD);
            let points_bytes = CloudPoints::bytes_of(&cloud, periods.is_some()).saturating_add(of_periods);
            Ok(CloudFacts { header: cloud.header.clone(), points_bytes, periods })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages;
    use clap::Parser;

    fn header() -> messages::Header {
        messages::Header { frame_id: "lidar".to_owned(), ..messages::Header::default() }
    }

    #[test]
    fn a_short_cloud_whose_decoded_points_exceed_the_queue_is_too_large() {
        let inbox = Inbox::new(&Args::parse_from(["voxtile-ros2", "-o", "map", "--memory", "1MiB"]));
        // The queue has 128 KiB.
        inbox.put_cloud(0, messages::PointCloud2::of_bytes(header(), 8000).cdr());
        inbox.put_cloud(0, messages::PointCloud2::of_points(header(), vec![[1.0; 3]; 4000]).cdr());
        assert_eq!((inbox.counters().0.too_large, inbox.counters().1), (2, 0));
        inbox.put_cloud(0, messages::PointCloud2::of_points(header(), vec![[1.0; 3]; 3000]).cdr());
        let invalid =
            messages::PointCloud2 { width: u32::MAX, ..messages::PointCloud2::of_bytes(header(), 9) };
        inbox.put_cloud(0, invalid.cdr());
        let (counters, waiting) = inbox.counters();
        assert_eq!((counters.received, counters.too_large, counters.malformed, waiting), (4, 2, 1, 1));
    }

    #[test]
    fn a_cloud_without_a_frame_is_malformed_and_does_not_wait() {
        let inbox = Inbox::new(&Args::parse_from(["voxtile-ros2", "-o", "map"]));
        let header = messages::Header { frame_id: String::new(), ..header() };
        inbox.put_cloud(0, messages::PointCloud2::of_points(header, vec![[1.0; 3]]).cdr());
        // A body of zeros is an empty cloud without fields.
        inbox.put_cloud(0, [&[0, 1, 0, 0][..], &[0; 60]].concat());
        let (counters, waiting) = inbox.counters();
        assert_eq!((counters.received, counters.malformed, waiting), (2, 2, 0));
    }

    #[test]
    fn clouds_in_the_frame_of_the_map_are_dropped_and_counted_at_once() {
        let inbox = Inbox::new(&Args::parse_from(["voxtile-ros2", "-o", "map"]));
        inbox.put_mount("lidar");
        for frame in ["map", "/map", "lidar"] {
            let header = messages::Header { frame_id: frame.to_owned(), ..header() };
            inbox.put_cloud(0, messages::PointCloud2::of_points(header, vec![[1.0; 3]]).cdr());
        }
        assert_eq!(inbox.take(Duration::ZERO).unwrap().0.frame, "lidar");
        let (counters, waiting) = inbox.counters();
        assert_eq!((counters.received, counters.dropped_without_pose, waiting), (3, 2, 0));
    }

    #[test]
    fn a_blocked_cloud_is_accepted_after_the_previous_one_is_mapped() {
        let inbox = Inbox::new(&Args::parse_from([
            "voxtile-ros2",
            "-o",
            "map",
            "--memory",
            "1MiB",
            "--when-behind",
            "wait",
        ]));
        inbox.put_mount("lidar");
        let cloud = messages::PointCloud2::of_points(header(), vec![[1.0; 3]; 3000]).cdr();
        std::thread::scope(|scope| {
            scope.spawn(|| (0..4).for_each(|_| inbox.put_cloud(0, cloud.clone())));
            // Mapping takes a while, during which the queue is full.
            let taken = (0..40).filter_map(|_| inbox.take(Duration::from_millis(100)));
            let taken = taken.inspect(|_| std::thread::sleep(Duration::from_millis(50))).take(4).count();
            inbox.close();
            assert_eq!((taken, inbox.counters().0.dropped_behind), (4, 0));
        });
    }
}
