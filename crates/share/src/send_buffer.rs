use rustc_hash::{FxHashMap, FxHashSet};
use std::time::Duration;
use voxtile::space::VoxelIndex;

/// Changes and repairs for the next frame.
#[derive(Clone, Debug, Default)]
pub(super) struct SendBuffer {
    /// New state of the voxels that differ from the state sent last.
    changed: FxHashMap<VoxelIndex, bool>,
    /// Voxels of lost packets, to send again.
    resent: FxHashSet<VoxelIndex>,
    /// Numbers of the lost packets.
    repaired: Vec<u64>,
    /// Time when the buffer was first seen with a change.
    since: Option<Duration>,
}

/// Maximum number of packets that one frame repairs. Receivers request the others again.
const MAX_REPAIRED: usize = 64;

impl SendBuffer {
    pub(super) fn len(&self) -> usize {
        self.changed.len() + self.resent.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.changed.is_empty() && self.resent.is_empty()
    }

    /// Sets a voxel's state. `was_sent` is the state that was sent last.
    pub(super) fn put(&mut self, voxel: VoxelIndex, is_in: bool, was_sent: bool) {
        if is_in == was_sent {
            self.changed.remove(&voxel);
        } else {
            self.changed.insert(voxel, is_in);
        }
    }

    /// Adds the voxels of a lost packet.
    pub(super) fn repair(&mut self, sequence: u64, voxels: &[VoxelIndex]) {
        if self.repaired.len() < MAX_REPAIRED && !self.repaired.contains(&sequence) {
            self.repaired.push(sequence);
            self.resent.extend(voxels);
        }
    }

    /// Returns the age of the oldest change.
    pub(super) fn waited(&mut self, now: Duration) -> Duration {
        if self.is_empty() {
            self.since = None;
            return Duration::ZERO;
        }
        now.saturating_sub(*self.since.get_or_insert(now))
    }

    /// Empties the buffer. Returns the changed voxels, the voxels to send again, and the numbers of the packets that
    /// these repair.
    pub(super) fn take(&mut self) -> (FxHashMap<VoxelIndex, bool>, FxHashSet<VoxelIndex>, Vec<u64>) {
        let Self { changed, resent, repaired, .. } = std::mem::take(self);
        (changed, resent, repaired)
    }
}
