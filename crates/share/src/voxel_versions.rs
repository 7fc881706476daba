use super::range_versions::RangeVersions;
use super::set::position_of;
use super::set_range::SetRange;
use std::collections::{HashMap, VecDeque};
use voxtile::space::{Grid, VoxelIndex};

/// Versions of recently changed voxels: for each voxel, the packet that changed it last. With them, a late packet does
/// not undo a later packet.
///
/// Packets older than the oldest kept version are refused.
#[derive(Clone, Debug)]
pub(super) struct VoxelVersions {
    /// Version of each voxel. The hash has a random seed, because other robots choose the voxels.
    last: HashMap<VoxelIndex, u64>,
    /// Voxels with their packets, in the order of arrival.
    recorded: VecDeque<(u64, VoxelIndex)>,
    max_voxels: usize,
    /// Highest number of these packets.
    newest: u64,
    /// Versions of ranges that were replaced as a whole.
    parts: RangeVersions,
    /// Packets up to this one are refused.
    forgotten: u64,
}

/// Maximum number of voxel versions: a minute of a dense lidar.
const MAX_VOXELS: usize = 1 << 18;
/// Minimum number of voxel versions, enough for a typical packet.
const MIN_VOXELS: usize = 1 << 12;
/// Maximum number of range versions.
const MAX_RANGES: usize = 4096;

/// Maximum number of bytes per voxel, reached when table and queue have both just doubled.
const BYTES_PER_VOXEL: usize =
    (size_of::<(VoxelIndex, u64)>() + 1) * 16 / 7 + 2 * size_of::<(u64, VoxelIndex)>();
/// Upper bound on the memory of all range versions, in bytes: a B-tree node has space for 11 ranges and holds at least
/// five.
const RANGE_BYTES: usize = MAX_RANGES / 5 * 11 * 2 * size_of::<SetRange>();

impl VoxelVersions {
    /// Creates the versions of a stream that starts after packet `forgotten`, with a memory limit of `bytes`.
    pub(super) fn new(forgotten: u64, bytes: usize) -> Self {
        let (last, recorded, parts) = (HashMap::new(), VecDeque::new(), RangeVersions::default());
        Self { last, recorded, max_voxels: voxels_of(bytes), newest: forgotten, parts, forgotten }
    }

    /// Returns an upper bound on the memory in bytes, for a limit of `bytes`.
    pub(super) fn max_bytes(bytes: usize) -> usize {
        voxels_of(bytes) * BYTES_PER_VOXEL + RANGE_BYTES
    }

    /// Changes the memory limit.
    pub(super) fn set_bytes(&mut self, bytes: usize) {
        let before = std::mem::replace(&mut self.max_voxels, voxels_of(bytes));
        if self.max_voxels < before {
            self.forget_all_but(self.max_voxels);
            self.last.shrink_to_fit();
            self.recorded.shrink_to_fit();
        }
    }

    pub(super) fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// Returns whether a later packet has changed a voxel.
    pub(super) fn is_later(&self, grid: &Grid, voxel: VoxelIndex, sequence: u64) -> bool {
        // A replaced range already includes the changes of packet `sequence` if its version is `sequence` or later.
        self.was_changed_after(voxel, sequence) || self.parts.is_as_of(position_of(grid, voxel), sequence)
    }

    /// Returns whether a later packet of changes has changed a voxel. Replaced ranges do not count.
    pub(super) fn was_changed_after(&self, voxel: VoxelIndex, sequence: u64) -> bool {
        self.newest > sequence && self.last.get(&voxel).is_some_and(|&version| version > sequence)
    }

    /// Returns the parts of a range that were not replaced as of packet `as_of` or a later one.
    pub(super) fn not_replaced(&self, range: SetRange, as_of: u64) -> Vec<SetRange> {
        self.parts.gaps(range, as_of)
    }

    /// Records a packet as the version of its voxels.
    pub(super) fn record(&mut self, sequence: u64, voxels: impl ExactSizeIterator<Item = VoxelIndex>) {
        // Forget old versions first, so that the limit is never exceeded.
        self.forget_all_but(self.max_voxels.saturating_sub(voxels.len()));
        self.newest = self.newest.max(sequence);
        for voxel in voxels {
            if self.recorded.len() == self.max_voxels {
                // A packet with more voxels than the limit is treated as forgotten: it and earlier packets are refused
                // from now on.
                self.forget_all_but(0);
                self.forget_up_to(sequence);
                return;
            }
            let version = self.last.entry(voxel).or_insert(sequence);
            *version = sequence.max(*version);
            self.recorded.push_back((sequence, voxel));
        }
    }

    /// Records the version of a range that was replaced.
    pub(super) fn record_range(&mut self, range: SetRange, as_of: u64) {
        self.parts.record(range, as_of);
        while self.parts.len() > MAX_RANGES
            && let Some(oldest) = self.parts.oldest()
        {
            self.forget_up_to(oldest);
        }
    }

    fn forget_all_but(&mut self, voxels: usize) {
        let mut forgotten = self.forgotten;
        while let Some(&(sequence, voxel)) = self.recorded.front() {
            if self.recorded.len() <= voxels && sequence > forgotten {
                break;
            }
            self.recorded.pop_front();
            forgotten = forgotten.max(sequence);
            if self.last.get(&voxel).is_some_and(|&version| version <= forgotten) {
                self.last.remove(&voxel);
            }
        }
        if forgotten > self.forgotten {
            self.forget_up_to(forgotten);
        }
    }

    fn forget_up_to(&mut self, sequence: u64) {
        self.forgotten = self.forgotten.max(sequence);
        self.parts.forget_up_to(self.forgotten);
    }
}

fn voxels_of(bytes: usize) -> usize {
    (bytes / BYTES_PER_VOXEL).clamp(MIN_VOXELS, MAX_VOXELS)
}
