use crate::args::Args;
use crate::counters::Counters;
use crate::repeated::{Repeated, counted};
use bytesize::ByteSize;
use std::fmt::Display;
use std::time::Instant;

/// Warnings about clouds and messages that are dropped for other reasons than a missing pose.
#[derive(Debug)]
pub struct DropWarnings {
    topics: Vec<String>,
    queue_bytes: usize,
    malformed_clouds: Vec<Repeated>,
    malformed_poses: Repeated,
    malformed_paths: Repeated,
    too_large: Repeated,
    behind: Repeated,
    thinned: Repeated,
    lost: Repeated,
}

impl DropWarnings {
    pub fn new(args: &Args) -> Self {
        Self {
            topics: args.cloud_topics(),
            queue_bytes: args.queue_bytes(),
            malformed_clouds: vec![Repeated::default(); args.cloud.len()],
            malformed_poses: Repeated::default(),
            malformed_paths: Repeated::default(),
            too_large: Repeated::default(),
            behind: Repeated::default(),
            thinned: Repeated::default(),
            lost: Repeated::default(),
        }
    }

    pub fn malformed_cloud(&mut self, topic: usize, why: &dyn Display) {
        let Some((warning, name)) = self.malformed_clouds.get_mut(topic).zip(self.topics.get(topic)) else {
            return;
        };
        if let Some(count) = warning.note(1, Instant::now()) {
            log::warn!("{name}: {} dropped: {}", counted(count, "malformed cloud"), printable(why));
        }
    }

    pub fn malformed_poses(&mut self, why: &dyn Display) {
        if let Some(count) = self.malformed_poses.note(1, Instant::now()) {
            log::warn!("{} dropped: {}", counted(count, "malformed transform message"), printable(why));
        }
    }

    pub fn malformed_path(&mut self, why: &dyn Display) {
        if let Some(count) = self.malformed_paths.note(1, Instant::now()) {
            log::warn!("{} ignored: {}", counted(count, "malformed path"), printable(why));
        }
    }

    pub fn too_large_cloud(&mut self, topic: usize, bytes: usize) {
        let name = self.topics.get(topic).cloned().unwrap_or_default();
        self.too_large(&name, bytes);
    }

    pub fn too_large(&mut self, topic: &str, bytes: usize) {
        if let Some(count) = self.too_large.note(1, Instant::now()) {
            let (bytes, queue) = (ByteSize::b(bytes as u64), ByteSize::b(self.queue_bytes as u64));
            log::warn!(
                "{} dropped: larger than the queue of {queue} (the last one on {topic}: {bytes} with its points); give \
                 more --memory, of which the queue is an eighth",
                counted(count, "cloud")
            );
        }
    }

    /// Warns of clouds that the queue dropped: the difference between two counters. `pose_problem` returns why clouds
    /// wait for poses, if they do.
    pub fn of_queue(
        &mut self,
        [before, after]: [&Counters; 2],
        pose_problem: impl FnOnce() -> Option<String>,
    ) {
        let (now, queue) = (Instant::now(), ByteSize::b(self.queue_bytes as u64));
        let dropped = after.dropped_behind.saturating_sub(before.dropped_behind);
        if dropped > 0
            && let Some(count) = self.behind.note(dropped, now)
        {
            let cause = pose_problem().unwrap_or_else(|| {
                "mapping is slower than clouds arrive. Lower --max-range or the rate, or use larger voxels".to_owned()
            });
            log::warn!("{} dropped: the queue of {queue} is full: {cause}", counted(count, "cloud"));
        }
        let thinned = after.thinned.saturating_sub(before.thinned);
        if thinned > 0
            && let Some(count) = self.thinned.note(thinned, now)
        {
            let clouds = counted(count, "cloud");
            log::warn!("{clouds} skipped (--when-behind thin): the queue of {queue} is more than half full");
        }
    }

    pub fn lost(&mut self, messages: u64, why: &str) {
        if let Some(count) = self.lost.note(messages, Instant::now()) {
            log::warn!("{} lost in transport: {}", counted(count, "message"), printable(&why));
        }
    }
}

/// Escapes control characters in received text.
fn printable(why: &dyn Display) -> String {
    why.to_string().escape_debug().to_string()
}
