use crate::args::Args;
use crate::cloud::Cloud;
use crate::cloud_queue::CloudQueue;
use crate::counters::Counters;
use crate::transform_buffer::TransformBuffer;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use voxtile_clouds::RigidPose;
use voxtile_clouds::ros::Wire;
use voxtile_clouds::ros::messages::{MessageKind, PointCloud2, StampedPose, decode_poses};

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
        let head = PointCloud2::decode(Wire::Cdr, &cdr).map(|cloud| cloud.header);
        let mut state = self.lock();
        state.counters.received += 1;
        let header = match head {
            Ok(header) => header,
            Err(error) => {
                log::debug!("a cloud cannot be decoded: {error}");
                state.counters.malformed += 1;
                return;
            }
        };
        while state.queue.must_wait(cdr.capacity()) && !state.is_closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        let cloud =
            Cloud { topic, stamp_ns: header.stamp_ns, frame: header.frame_id, cdr, arrived: Instant::now() };
        let State { queue, counters, .. } = &mut *state;
        queue.push(cloud, counters);
        self.changed.notify_all();
    }

    pub fn put_poses(&self, kind: MessageKind, cdr: &[u8], is_static: bool) {
        let poses = decode_poses(kind, Wire::Cdr, cdr);
        let mut state = self.lock();
        let State { transforms, counters, .. } = &mut *state;
        match poses {
            Ok(poses) => {
                let now = Instant::now();
                poses.iter().for_each(|pose| transforms.insert(pose, is_static, now, counters));
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
