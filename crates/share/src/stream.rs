use super::voxel_versions::VoxelVersions;
use std::collections::BTreeMap;
use std::time::Duration;

/// The state of a sender's packets at a receiver, for one epoch.
#[derive(Clone, Debug)]
pub(super) struct Stream {
    pub(super) epoch: u32,
    /// The last packet known to have been sent.
    pub(super) highest: u64,
    /// When that became known.
    pub(super) highest_at: Duration,
    /// Lost packets up to it.
    missing: BTreeMap<u64, Missing>,
    pub(super) versions: VoxelVersions,
}

#[derive(Clone, Copy, Debug)]
struct Missing {
    request_at: Duration,
    requests: u32,
}

/// How far a packet number may be from the last one. Beyond it the receiver requests a status.
pub(super) const WINDOW: u64 = 4096;

/// Upper bound of the bytes for missing packets: a node has room for 11 and holds at least five.
const MISSING_BYTES: usize = WINDOW as usize / 5 * 11 * size_of::<(u64, Missing)>() * 5 / 4;

impl Stream {
    /// Upper bound of the bytes of memory, with so many for versions.
    pub(super) fn max_bytes(version_bytes: usize) -> usize {
        VoxelVersions::max_bytes(version_bytes) + MISSING_BYTES
    }

    /// A stream after a packet that the sender has confirmed.
    pub(super) fn new(epoch: u32, sequence: u64, now: Duration, version_bytes: usize) -> Self {
        let versions = VoxelVersions::new(sequence, version_bytes);
        Self { epoch, highest: sequence, highest_at: now, missing: BTreeMap::new(), versions }
    }

    /// Whether a packet may belong to this stream.
    pub(super) fn can_be(&self, epoch: u32, sequence: u64) -> bool {
        epoch == self.epoch && sequence.abs_diff(self.highest) <= WINDOW
    }

    /// Learns that packets up to one were sent; those in between are missing.
    pub(super) fn reach(&mut self, sequence: u64, now: Duration, patience: Duration) {
        if sequence <= self.highest {
            return;
        }
        for missing in self.highest + 1..=sequence {
            self.missing.insert(missing, Missing { request_at: now + patience, requests: 0 });
        }
        (self.highest, self.highest_at) = (sequence, now);
        while self.missing.len() as u64 > WINDOW {
            self.missing.pop_first();
        }
    }

    /// Learns that a packet arrived; `false` if it is a duplicate or too late.
    pub(super) fn arrive(&mut self, sequence: u64, now: Duration, patience: Duration) -> bool {
        self.reach(sequence, now, patience);
        self.missing.remove(&sequence).is_some() && sequence > self.versions.forgotten()
    }

    /// Learns that other packets have repaired a packet.
    pub(super) fn is_repaired(&mut self, sequence: u64) {
        self.missing.remove(&sequence);
    }

    /// Gives up missing packets before one; returns whether there were any.
    pub(super) fn give_up_before(&mut self, oldest: u64) -> bool {
        let kept = self.missing.split_off(&oldest);
        let given_up = std::mem::replace(&mut self.missing, kept);
        !given_up.is_empty()
    }

    pub(super) fn is_complete(&self) -> bool {
        self.missing.is_empty()
    }

    pub(super) fn missing(&self) -> usize {
        self.missing.len()
    }

    /// Packets to request now, the oldest first, and whether one of them was requested often in vain.
    pub(super) fn due(&mut self, now: Duration, most: usize, retry: Duration) -> (Vec<u64>, bool) {
        let mut due = Vec::new();
        let mut is_hopeless = false;
        for (&sequence, missing) in
            self.missing.iter_mut().filter(|(_, missing)| missing.request_at <= now).take(most)
        {
            missing.requests = (missing.requests + 1).min(16);
            missing.request_at = now + retry * 2_u32.pow((missing.requests - 1).min(3));
            is_hopeless |= missing.requests > 3;
            due.push(sequence);
        }
        (due, is_hopeless)
    }
}
