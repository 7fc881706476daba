use crate::space::VoxelIndex;
use rustc_hash::{FxHashMap, FxHashSet};
use std::time::Duration;

/// What waits for the next frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Pending {
    /// Voxels that are no longer as last sent, and what they are.
    changed: FxHashMap<VoxelIndex, bool>,
    /// Voxels of packets that did not come, to be sent once more.
    again: FxHashSet<VoxelIndex>,
    /// These packets.
    repaired: Vec<u64>,
    /// When the first of it was seen.
    since: Option<Duration>,
}

/// Packets that one frame repairs; more are asked for once more.
const MAX_REPAIRED: usize = 64;

impl Pending {
    pub(super) fn len(&self) -> usize {
        self.changed.len() + self.again.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.changed.is_empty() && self.again.is_empty()
    }

    /// Notes what a voxel is; `was_sent` is what receivers know.
    pub(super) fn put(&mut self, voxel: VoxelIndex, is_in: bool, was_sent: bool) {
        if is_in == was_sent {
            self.changed.remove(&voxel);
        } else {
            self.changed.insert(voxel, is_in);
        }
    }

    /// Has the voxels of a lost packet sent again.
    pub(super) fn repair(&mut self, sequence: u64, voxels: &[VoxelIndex]) {
        if self.repaired.len() < MAX_REPAIRED && !self.repaired.contains(&sequence) {
            self.repaired.push(sequence);
            self.again.extend(voxels);
        }
    }

    /// How long something has waited.
    pub(super) fn waited(&mut self, now: Duration) -> Duration {
        if self.is_empty() {
            self.since = None;
            return Duration::ZERO;
        }
        now.saturating_sub(*self.since.get_or_insert(now))
    }

    /// All of it: changed voxels, voxels to be sent again, and the packets that these repair.
    pub(super) fn take(&mut self) -> (FxHashMap<VoxelIndex, bool>, FxHashSet<VoxelIndex>, Vec<u64>) {
        let Self { changed, again, repaired, .. } = std::mem::take(self);
        (changed, again, repaired)
    }
}
