use super::range_versions::RangeVersions;
use super::set::position_of;
use super::set_range::SetRange;
use std::collections::{HashMap, VecDeque};
use voxtile::space::{Grid, VoxelIndex};

/// The version of each recently changed voxel: the packet that changed it last. A late packet must not undo a later
/// one.
///
/// Packets older than the oldest version kept are refused.
#[derive(Clone, Debug)]
pub(super) struct VoxelVersions {
    /// Hashed with a seed, because others choose the voxels.
    last: HashMap<VoxelIndex, u64>,
    /// Packets and their voxels, in the order of arrival.
    noted: VecDeque<(u64, VoxelIndex)>,
    max_voxels: usize,
    /// The latest of these packets.
    newest: u64,
    /// Versions of ranges that were replaced as a whole.
    parts: RangeVersions,
    /// Packets up to this one are refused.
    forgotten: u64,
}

/// Most versions of voxels: a minute of a dense lidar.
const MAX_VOXELS: usize = 1 << 18;
/// Fewest versions of voxels: those of a packet.
const MIN_VOXELS: usize = 1 << 12;
/// Most versions of ranges.
const MAX_PARTS: usize = 4096;

/// Most bytes per voxel: in a table and a queue that just doubled.
const BYTES_PER_VOXEL: usize =
    (size_of::<(VoxelIndex, u64)>() + 1) * 16 / 7 + 2 * size_of::<(u64, VoxelIndex)>();
/// Upper bound of the bytes of all ranges: a node has room for 11 and holds at least five.
const BYTES_OF_PARTS: usize = MAX_PARTS / 5 * 11 * 2 * size_of::<SetRange>();

impl VoxelVersions {
    /// The versions of a stream after packet `forgotten`, in at most so many bytes.
    pub(super) fn new(forgotten: u64, bytes: usize) -> Self {
        let (last, noted, parts) = (HashMap::new(), VecDeque::new(), RangeVersions::default());
        Self { last, noted, max_voxels: voxels_of(bytes), newest: forgotten, parts, forgotten }
    }

    /// Upper bound of the bytes of memory for a limit of `bytes`.
    pub(super) fn max_bytes(bytes: usize) -> usize {
        voxels_of(bytes) * BYTES_PER_VOXEL + BYTES_OF_PARTS
    }

    /// Changes the limit.
    pub(super) fn set_bytes(&mut self, bytes: usize) {
        let before = std::mem::replace(&mut self.max_voxels, voxels_of(bytes));
        if self.max_voxels < before {
            self.forget_all_but(self.max_voxels);
            self.last.shrink_to_fit();
            self.noted.shrink_to_fit();
        }
    }

    pub(super) fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// Whether a later packet has changed a voxel.
    pub(super) fn is_later(&self, grid: &Grid, voxel: VoxelIndex, sequence: u64) -> bool {
        // A range includes the packet of its version.
        self.was_changed_after(voxel, sequence) || self.parts.is_as_of(position_of(grid, voxel), sequence)
    }

    /// Whether a later packet has changed a voxel by itself, not with a range.
    pub(super) fn was_changed_after(&self, voxel: VoxelIndex, sequence: u64) -> bool {
        self.newest > sequence && self.last.get(&voxel).is_some_and(|&version| version > sequence)
    }

    /// The parts of a range that were not replaced as of this packet or a later one.
    pub(super) fn not_replaced(&self, range: SetRange, as_of: u64) -> Vec<SetRange> {
        self.parts.gaps(range, as_of)
    }

    /// Sets the version of a packet's voxels.
    pub(super) fn note(&mut self, sequence: u64, voxels: impl ExactSizeIterator<Item = VoxelIndex>) {
        // First, so that the limit is never exceeded.
        self.forget_all_but(self.max_voxels.saturating_sub(voxels.len()));
        self.newest = self.newest.max(sequence);
        for voxel in voxels {
            if self.noted.len() == self.max_voxels {
                // A packet that exceeds the limit is treated as forgotten.
                self.forget_all_but(0);
                self.forget_up_to(sequence);
                return;
            }
            let version = self.last.entry(voxel).or_insert(sequence);
            *version = sequence.max(*version);
            self.noted.push_back((sequence, voxel));
        }
    }

    /// Sets the version of a range of the set.
    pub(super) fn note_part(&mut self, range: SetRange, as_of: u64) {
        self.parts.note(range, as_of);
        while self.parts.len() > MAX_PARTS
            && let Some(oldest) = self.parts.oldest()
        {
            self.forget_up_to(oldest);
        }
    }

    fn forget_all_but(&mut self, voxels: usize) {
        let mut forgotten = self.forgotten;
        while let Some(&(sequence, voxel)) = self.noted.front() {
            if self.noted.len() <= voxels && sequence > forgotten {
                break;
            }
            self.noted.pop_front();
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
