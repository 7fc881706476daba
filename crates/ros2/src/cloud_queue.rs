use crate::cloud::Cloud;
use crate::cloud_poses::CloudPoses;
use crate::counters::Counters;
use crate::when_behind::WhenBehind;
use std::collections::VecDeque;

/// Queue of clouds, oldest first, with bounded memory. Each cloud reserves the memory of its decoded points when it is
/// queued. A taken cloud keeps its reservation until the next one is taken, so decoded points always fit.
#[derive(Debug)]
pub struct CloudQueue {
    clouds: VecDeque<Cloud>,
    bytes: usize,
    /// Part of `bytes` that is reserved for the taken cloud.
    taken_bytes: usize,
    most_bytes: usize,
    when_behind: WhenBehind,
    /// Whether the last cloud of each topic was skipped by `thin`.
    was_thinned: Vec<bool>,
}

/// Decision about a queued cloud.
#[derive(Debug, PartialEq)]
pub enum Verdict<P> {
    /// The cloud can be mapped with this pose.
    Ready(P),
    /// The pose may still arrive. Later clouds of the same topic must wait too.
    Waits,
    /// The pose can no longer arrive.
    Expired,
}

/// Memory of a cloud in addition to its content, so that empty clouds count too.
const CLOUD_BYTES: usize = 256;
/// Maximum number of clouds that `settle` searches, which bounds its time.
const MAX_SETTLED: usize = 1000;

impl CloudQueue {
    pub fn new(most_bytes: usize, topics: usize, when_behind: WhenBehind) -> Self {
        let (clouds, was_thinned) = (VecDeque::new(), vec![false; topics]);
        Self { clouds, bytes: 0, taken_bytes: 0, most_bytes, when_behind, was_thinned }
    }

    pub fn len(&self) -> usize {
        self.clouds.len()
    }

    /// Returns the reserved memory.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Returns whether a cloud must wait outside the queue until memory is free.
    pub fn must_wait(&self, cloud: &Cloud) -> bool {
        let needed = self.bytes.saturating_add(bytes_of(cloud));
        self.when_behind == WhenBehind::Wait && self.bytes > 0 && needed > self.most_bytes
    }

    pub fn push(&mut self, cloud: Cloud, counters: &mut Counters) {
        let bytes = bytes_of(&cloud);
        if bytes > self.most_bytes {
            counters.too_large += 1;
            return;
        }
        if self.when_behind == WhenBehind::Thin
            && let Some(was_thinned) = self.was_thinned.get_mut(cloud.topic)
        {
            *was_thinned = !*was_thinned && self.bytes > self.most_bytes / 2;
            if *was_thinned {
                counters.thinned += 1;
                return;
            }
        }
        while self.bytes + bytes > self.most_bytes {
            counters.dropped_behind += 1;
            // The remaining bytes belong to the taken cloud.
            let Some(oldest) = self.clouds.pop_front() else { return };
            self.bytes -= bytes_of(&oldest);
        }
        self.bytes += bytes;
        self.clouds.push_back(cloud);
    }

    /// Looks up the poses of queued clouds and stores them in the clouds, because the caller discards old transforms
    /// next.
    pub fn settle(&mut self, poses_of: impl Fn(&Cloud) -> Option<CloudPoses>) {
        for cloud in self.clouds.iter_mut().filter(|cloud| cloud.poses.is_none()).take(MAX_SETTLED) {
            cloud.poses = poses_of(cloud);
        }
    }

    /// Releases the memory of the taken cloud.
    pub fn release_taken(&mut self) {
        self.bytes -= std::mem::take(&mut self.taken_bytes);
    }

    /// Takes the first cloud that is ready, and releases the cloud taken before. Clouds of a topic keep their order;
    /// topics do not wait for each other.
    pub fn take_ready<P>(
        &mut self,
        counters: &mut Counters,
        mut verdict: impl FnMut(&Cloud) -> Verdict<P>,
    ) -> Option<(Cloud, P)> {
        self.release_taken();
        let mut waiting: Vec<usize> = Vec::new();
        let mut at = 0;
        while let Some(cloud) = self.clouds.get(at) {
            if waiting.contains(&cloud.topic) {
                at += 1;
                continue;
            }
            match verdict(cloud) {
                Verdict::Waits => {
                    waiting.push(cloud.topic);
                    at += 1;
                }
                Verdict::Expired => {
                    counters.dropped_without_pose += 1;
                    let cloud = self.clouds.remove(at)?;
                    self.bytes -= bytes_of(&cloud);
                }
                Verdict::Ready(pose) => {
                    let cloud = self.clouds.remove(at)?;
                    self.taken_bytes = bytes_of(&cloud);
                    return Some((cloud, pose));
                }
            }
        }
        None
    }
}

/// Returns the memory that a cloud reserves in the queue.
pub fn bytes_of(cloud: &Cloud) -> usize {
    let own_bytes = cloud.cdr.capacity() + cloud.frame.capacity() + CLOUD_BYTES;
    own_bytes.saturating_add(cloud.points_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(topic: usize, stamp_ns: i64) -> Cloud {
        let (frame, cdr) = (String::new(), vec![0; 744]);
        Cloud::new(topic, stamp_ns, frame, cdr)
    }

    fn stamps(queue: &mut CloudQueue) -> Vec<i64> {
        let mut counters = Counters::default();
        std::iter::from_fn(|| queue.take_ready(&mut counters, |_| Verdict::Ready(())))
            .map(|(cloud, ())| cloud.stamp_ns)
            .collect()
    }

    #[test]
    fn the_oldest_cloud_is_dropped_and_counted() {
        let (mut queue, mut counters) =
            (CloudQueue::new(3000, 1, WhenBehind::DropOldest), Counters::default());
        (0..5).for_each(|stamp| queue.push(cloud(0, stamp), &mut counters));
        assert_eq!((queue.len(), counters.dropped_behind), (3, 2));
        assert_eq!(stamps(&mut queue), [2, 3, 4]);
        assert_eq!(queue.bytes, 0);
    }

    #[test]
    fn a_cloud_larger_than_the_queue_displaces_nothing() {
        let (mut queue, mut counters) =
            (CloudQueue::new(1500, 1, WhenBehind::DropOldest), Counters::default());
        queue.push(cloud(0, 1), &mut counters);
        queue.push(Cloud { cdr: vec![0; 2000], ..cloud(0, 2) }, &mut counters);
        assert_eq!((queue.len(), counters.too_large, counters.dropped_behind), (1, 1, 0));
    }

    #[test]
    fn thin_skips_every_second_cloud_of_a_topic_while_over_half_full() {
        let (mut queue, mut counters) = (CloudQueue::new(8000, 2, WhenBehind::Thin), Counters::default());
        (0..9).for_each(|stamp| queue.push(cloud(0, stamp), &mut counters));
        assert_eq!((counters.thinned, counters.dropped_behind), (2, 0));
        assert_eq!(stamps(&mut queue), [0, 1, 2, 3, 4, 6, 8]);
    }

    #[test]
    fn wait_blocks_when_full_but_always_accepts_one_cloud() {
        let (mut queue, mut counters) = (CloudQueue::new(1500, 1, WhenBehind::Wait), Counters::default());
        assert!(!queue.must_wait(&Cloud { points_bytes: usize::MAX, ..cloud(0, 1) }));
        queue.push(cloud(0, 1), &mut counters);
        assert!(queue.must_wait(&cloud(0, 2)));
        assert!(!CloudQueue::new(1500, 1, WhenBehind::DropOldest).must_wait(&cloud(0, 2)));
        // The taken cloud uses memory until it is released.
        assert_eq!(queue.take_ready(&mut counters, |_| Verdict::Ready(())).unwrap().0.stamp_ns, 1);
        assert!(queue.must_wait(&cloud(0, 2)));
        queue.release_taken();
        assert!(!queue.must_wait(&cloud(0, 2)));
    }

    #[test]
    fn memory_of_points_is_reserved_until_they_are_mapped() {
        let (mut queue, mut counters) =
            (CloudQueue::new(3000, 1, WhenBehind::DropOldest), Counters::default());
        let with_points = |stamp_ns| Cloud { points_bytes: 1000, ..cloud(0, stamp_ns) };
        queue.push(Cloud { points_bytes: 2001, ..cloud(0, 1) }, &mut counters);
        queue.push(Cloud { points_bytes: usize::MAX, ..cloud(0, 2) }, &mut counters);
        assert_eq!((queue.len(), counters.too_large), (0, 2));
        queue.push(with_points(3), &mut counters);
        queue.push(with_points(4), &mut counters);
        assert_eq!((queue.len(), counters.dropped_behind), (1, 1));
        let taken = queue.take_ready(&mut counters, |_| Verdict::Ready(()));
        assert_eq!((taken.unwrap().0.stamp_ns, queue.len()), (4, 0));
        // Cloud 6 does not fit in addition to the taken cloud 4: first cloud 5 is dropped, as the oldest, and then
        // cloud 6.
        queue.push(cloud(0, 5), &mut counters);
        queue.push(with_points(6), &mut counters);
        assert_eq!((queue.len(), queue.bytes, counters.dropped_behind), (0, 2000, 3));
        assert_eq!(stamps(&mut queue), [0; 0]);
        queue.push(with_points(7), &mut counters);
        assert_eq!(stamps(&mut queue), [7]);
        assert_eq!(queue.bytes, 0);
    }

    #[test]
    fn a_waiting_sensor_delays_only_its_own_clouds() {
        let (mut queue, mut counters) =
            (CloudQueue::new(1 << 20, 2, WhenBehind::DropOldest), Counters::default());
        for (topic, stamp) in [(0, 1), (0, 2), (1, 3), (1, 4)] {
            queue.push(cloud(topic, stamp), &mut counters);
        }
        let mut take = |queue: &mut CloudQueue| {
            let taken = queue.take_ready(&mut counters, |cloud| match cloud.stamp_ns {
                1 => Verdict::Waits,
                3 => Verdict::Expired,
                stamp => Verdict::Ready(stamp),
            });
            taken.map(|(_, stamp)| stamp)
        };
        assert_eq!((take(&mut queue), take(&mut queue)), (Some(4), None));
        assert_eq!((queue.len(), counters.dropped_without_pose), (2, 1));
    }
}
