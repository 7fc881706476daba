use super::voxel_versions::VoxelVersions;
use std::collections::BTreeMap;
use std::time::Duration;

/// State of a sender's packets at a receiver, for one epoch.
#[derive(Clone, Debug)]
pub(super) struct Stream {
    pub(super) epoch: u32,
    /// Number of the last packet known to have been sent.
    pub(super) highest: u64,
    /// Time when this number became known.
    pub(super) highest_at: Duration,
    /// Missing packets up to `highest`.
    missing: BTreeMap<u64, Missing>,
    pub(super) versions: VoxelVersions,
}

#[derive(Clone, Copy, Debug)]
struct Missing {
    request_at: Duration,
    requests: u32,
}

/// Maximum distance of a packet number from the highest known number. Beyond it, the receiver requests a status.
pub(super) const WINDOW: u64 = 4096;

/// Upper bound on the memory of missing packets, in bytes: a B-tree node has space for 11 packets and holds at least
/// five.
const MISSING_BYTES: usize = WINDOW as usize / 5 * 11 * size_of::<(u64, Missing)>() * 5 / 4;

impl Stream {
    /// Returns an upper bound on the memory in bytes, with `version_bytes` for versions.
    pub(super) fn max_bytes(version_bytes: usize) -> usize {
        VoxelVersions::max_bytes(version_bytes) + MISSING_BYTES
    }

    /// Creates a stream that starts after a packet confirmed by the sender.
    pub(super) fn new(epoch: u32, sequence: u64, now: Duration, version_bytes: usize) -> Self {
        let versions = VoxelVersions::new(sequence, version_bytes);
        Self { epoch, highest: sequence, highest_at: now, missing: BTreeMap::new(), versions }
    }

    /// Returns whether a packet may belong to this stream.
    pub(super) fn can_be(&self, epoch: u32, sequence: u64) -> bool {
        epoch == self.epoch && sequence.abs_diff(self.highest) <= WINDOW
    }

    /// Records that the packets up to `sequence` were sent; those that have not arrived are missing.
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

    /// Records the arrival of a packet. Returns `false` if it is a duplicate or too late.
    pub(super) fn arrive(&mut self, sequence: u64, now: Duration, patience: Duration) -> bool {
        self.reach(sequence, now, patience);
        self.missing.remove(&sequence).is_some() && sequence > self.versions.forgotten()
    }

    /// Records that other packets have repaired a packet.
    pub(super) fn mark_repaired(&mut self, sequence: u64) {
        self.missing.remove(&sequence);
    }

    /// Gives up the missing packets before `oldest`. Returns whether there were any.
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

    /// Returns the packets to request now, the oldest first and at most `limit`, and whether one of them was requested
    /// three times before.
    pub(super) fn due(&mut self, now: Duration, limit: usize, retry: Duration) -> (Vec<u64>, bool) {
        let mut due = Vec::new();
        let mut is_hopeless = false;
        for (&sequence, missing) in
            self.missing.iter_mut().filter(|(_, missing)| missing.request_at <= now).take(limit)
        {
            missing.requests = (missing.requests + 1).min(16);
            missing.request_at = now + retry * 2_u32.pow((missing.requests - 1).min(3));
            is_hopeless |= missing.requests > 3;
            due.push(sequence);
        }
        (due, is_hopeless)
    }
}
