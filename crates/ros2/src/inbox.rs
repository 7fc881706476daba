use crate::args::Args;
use crate::cloud::Cloud;
use crate::cloud_points::CloudPoints;
use crate::cloud_queue::CloudQueue;
use crate::counters::Counters;
use crate::transform_buffer::TransformBuffer;
use crate::transport::Message;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use voxtile_formats::RigidPose;
use voxtile_formats::ros::messages::{Header, MessageKind, PointCloud2, StampedPose, decode_poses};
use voxtile_formats::ros::{Wire, WireError};

/// What readers have for the mapping thread.
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
    /// The last one that came and was not taken.
    path: Option<Vec<StampedPose>>,
    fixed_frame: String,
    is_closed: bool,
}

impl Inbox {
    pub fn new(args: &Args) -> Self {
        let queue = CloudQueue::new(args.queue_bytes(), args.cloud.len(), args.when_behind);
        let (transforms, counters) = (TransformBuffer::new(args), Counters::default());
        let fixed_frame = args.frame_id.trim_start_matches('/').to_owned();
        let state = State { queue, transforms, counters, path: None, fixed_frame, is_closed: false };
        let state = Mutex::new(state);
        Self { state, changed: Condvar::new() }
    }

    pub fn put_cloud(&self, topic: usize, cdr: Vec<u8>) {
        let head = head(&cdr);
        let mut state = self.lock();
        state.counters.received += 1;
        let (header, points_bytes) = match head {
            Ok(head) => head,
            Err(error) => {
                log::debug!("a cloud cannot be decoded: {error}");
                state.counters.malformed += 1;
                return;
            }
        };
        let (stamp_ns, frame) = (header.stamp_ns, header.frame_id);
        let mut cloud =
            Cloud { topic, stamp_ns, frame, cdr, points_bytes, arrived: Instant::now(), pose: None };
        while state.queue.must_wait(&cloud) && !state.is_closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        cloud.arrived = Instant::now();
        let State { queue, counters, .. } = &mut *state;
        queue.push(cloud, counters);
        self.changed.notify_all();
    }

    pub fn put_poses(&self, kind: MessageKind, message: &Message, is_static: bool) {
        let poses = decode_poses(kind, Wire::Cdr, &message.cdr);
        let mut state = self.lock();
        let State { queue, transforms, counters, .. } = &mut *state;
        match poses {
            Ok(poses) => {
                let now = Instant::now();
                let publisher = message.publisher;
                let mut insert = |pose| transforms.insert(pose, is_static, publisher, now, queue, counters);
                poses.iter().for_each(&mut insert);
            }
            Err(error) => {
                log::debug!("transforms cannot be decoded: {error}");
                counters.malformed += 1;
            }
        }
        self.changed.notify_all();
    }

    /// A corrected path; it takes the place of one that nobody has taken.
    pub fn put_path(&self, cdr: &[u8]) {
        let poses = decode_poses(MessageKind::Path, Wire::Cdr, cdr);
        let mut state = self.lock();
        match poses {
            Ok(poses) if poses.iter().all(|pose| pose.header.frame_id == state.fixed_frame) => {
                state.path = Some(poses);
            }
            Ok(_) => {
                log::warn!("a path is left out: not all of it is in the frame {}", state.fixed_frame);
                state.counters.malformed += 1;
            }
            Err(error) => {
                log::debug!("a path cannot be decoded: {error}");
                state.counters.malformed += 1;
            }
        }
    }

    pub fn take_path(&self) -> Option<Vec<StampedPose>> {
        self.lock().path.take()
    }

    /// The next cloud that has its pose, waiting for it at most so long.
    pub fn take(&self, most_wait: Duration) -> Option<(Cloud, RigidPose)> {
        let mut state = self.lock();
        // The one before is mapped, and what waits for its room may come in.
        state.queue.let_go();
        self.changed.notify_all();
        for is_last in [false, true] {
            let State { queue, transforms, counters, .. } = &mut *state;
            let now = Instant::now();
            let taken = queue.take_ready(counters, |cloud| transforms.verdict(cloud, now));
            if taken.is_some() {
                self.changed.notify_all();
                return taken;
            }
            if !is_last {
                let waited = self.changed.wait_timeout(state, most_wait);
                state = waited.unwrap_or_else(PoisonError::into_inner).0;
            }
        }
        None
    }

    pub fn count(&self, count: impl FnOnce(&mut Counters)) {
        count(&mut self.lock().counters);
    }

    /// The counters, and the number of clouds that wait.
    pub fn counters(&self) -> (Counters, usize) {
        let state = self.lock();
        (state.counters, state.queue.len())
    }

    /// Why no cloud gets a pose, if that lasts.
    pub fn pose_trouble(&self) -> Option<String> {
        self.lock().transforms.trouble()
    }

    /// As if a sensor stood at the origin of the map.
    #[cfg(test)]
    pub fn put_mount(&self, frame: &str) {
        let header = crate::messages::Header { frame_id: "map".to_owned(), ..Default::default() };
        let mounts = vec![(header, frame, ([0.0; 3], [0.0, 0.0, 0.0, 1.0]))];
        let body = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(&mounts).unwrap();
        let cdr = [vec![0, 1, 0, 0], body].concat();
        self.put_poses(MessageKind::Tf, &Message { cdr, publisher: None }, true);
    }

    /// Lets readers go that wait for room.
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
    }

    /// What a thread that panicked left is still whole: each change is one call.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The header of a cloud that has all points that it claims, and the bytes of memory that they will take.
fn head(cdr: &[u8]) -> Result<(Header, usize), WireError> {
    let cloud = PointCloud2::decode(Wire::Cdr, cdr)?;
    // No transform will ever name it, and later clouds of its topic would wait behind it.
    if cloud.header.frame_id.is_empty() {
        return Err(WireError { byte: 0, reason: "the cloud names no frame".to_owned() });
    }
    match cloud.shortage() {
        Some(shortage) => Err(shortage),
        None => Ok((cloud.header.clone(), CloudPoints::bytes_of(&cloud))),
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
    fn a_cloud_whose_points_take_more_than_the_queue_is_too_large_however_short_it_is() {
        let inbox = Inbox::new(&Args::parse_from(["voxtile-ros2", "-o", "map", "--memory", "1MiB"]));
        // 128 KiB for all.
        inbox.put_cloud(0, messages::PointCloud2::of_bytes(header(), 8000).cdr());
        inbox.put_cloud(0, messages::PointCloud2::of_points(header(), vec![[1.0; 3]; 4000]).cdr());
        assert_eq!((inbox.counters().0.too_large, inbox.counters().1), (2, 0));
        inbox.put_cloud(0, messages::PointCloud2::of_points(header(), vec![[1.0; 3]; 3000]).cdr());
        let lies = messages::PointCloud2 { width: u32::MAX, ..messages::PointCloud2::of_bytes(header(), 9) };
        inbox.put_cloud(0, lies.cdr());
        let (counters, waiting) = inbox.counters();
        assert_eq!((counters.received, counters.too_large, counters.malformed, waiting), (4, 2, 1, 1));
    }

    #[test]
    fn a_cloud_without_a_frame_is_malformed_and_does_not_wait() {
        let inbox = Inbox::new(&Args::parse_from(["voxtile-ros2", "-o", "map"]));
        let header = messages::Header { frame_id: String::new(), ..header() };
        inbox.put_cloud(0, messages::PointCloud2::of_points(header, vec![[1.0; 3]]).cdr());
        // All zeros are an empty cloud without fields.
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
    fn what_waits_for_room_comes_in_when_the_cloud_before_is_mapped() {
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
            // Mapping one takes a while, in which the next one finds no room.
            let taken = (0..40).filter_map(|_| inbox.take(Duration::from_millis(100)));
            let taken = taken.inspect(|_| std::thread::sleep(Duration::from_millis(50))).take(4).count();
            inbox.close();
            assert_eq!((taken, inbox.counters().0.dropped_behind), (4, 0));
        });
    }
}
