use super::part_stamps::PartStamps;
use super::set::position_of;
use super::set_range::SetRange;
use crate::space::{Grid, VoxelIndex};
use std::collections::{HashMap, VecDeque};

/// By which packet each voxel was last changed, for recent packets: what comes late must not undo what came before it.
///
/// What is older than the oldest stamp is not to be taken any more.
#[derive(Clone, Debug)]
pub(super) struct Stamps {
    /// Hashed with a seed, since the voxels are others' choice.
    last: HashMap<VoxelIndex, u64>,
    /// Packets and their voxels, in the order in which they came.
    noted: VecDeque<(u64, VoxelIndex)>,
    max_voxels: usize,
    /// The latest packet of them.
    newest: u64,
    /// Parts of the set that were replaced whole, and as of which packet.
    parts: PartStamps,
    /// Packets up to this one are not taken.
    forgotten: u64,
}

/// Voxels of packets that are remembered, at most: a minute of a dense lidar.
const MAX_VOXELS: usize = 1 << 18;
/// And at least: those of a packet.
const MIN_VOXELS: usize = 1 << 12;
/// Parts that are remembered.
const MAX_PARTS: usize = 4096;

/// Bytes that a voxel takes at most: in a table that was just doubled, and in a queue that was.
const BYTES_A_VOXEL: usize =
    (size_of::<(VoxelIndex, u64)>() + 1) * 16 / 7 + 2 * size_of::<(u64, VoxelIndex)>();
/// Bytes of all parts, at most: 11 in a node, five at least.
const BYTES_OF_PARTS: usize = MAX_PARTS / 5 * 11 * 2 * size_of::<SetRange>();

impl Stamps {
    /// Of a stream from a packet on, which remembers as much as so many bytes take.
    pub(super) fn new(forgotten: u64, bytes: usize) -> Self {
        let (last, noted, parts) = (HashMap::new(), VecDeque::new(), PartStamps::default());
        Self { last, noted, max_voxels: voxels_of(bytes), newest: forgotten, parts, forgotten }
    }

    /// Bytes of memory, at most, of stamps that were given so many.
    pub(super) fn most_bytes(bytes: usize) -> usize {
        voxels_of(bytes) * BYTES_A_VOXEL + BYTES_OF_PARTS
    }

    /// Goes on with other room.
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

    /// Whether a voxel is as a later packet than this one left it.
    pub(super) fn is_later(&self, grid: &Grid, voxel: VoxelIndex, sequence: u64) -> bool {
        // A part holds the packet that it is as of.
        self.was_changed_after(voxel, sequence) || self.parts.is_as_of(position_of(grid, voxel), sequence)
    }

    /// Whether a later packet than this one changed a voxel by itself, not as one of a part.
    pub(super) fn was_changed_after(&self, voxel: VoxelIndex, sequence: u64) -> bool {
        self.newest > sequence && self.last.get(&voxel).is_some_and(|&stamp| stamp > sequence)
    }

    /// What of a range was not replaced as of this packet or a later one.
    pub(super) fn not_replaced(&self, range: SetRange, as_of: u64) -> Vec<SetRange> {
        self.parts.gaps(range, as_of)
    }

    /// Notes the voxels of a packet.
    pub(super) fn note(&mut self, sequence: u64, voxels: impl ExactSizeIterator<Item = VoxelIndex>) {
        // First, so that there never are more.
        self.forget_all_but(self.max_voxels.saturating_sub(voxels.len()));
        self.newest = self.newest.max(sequence);
        for voxel in voxels {
            if self.noted.len() == self.max_voxels {
                // A packet of more than all: as good as forgotten.
                self.forget_all_but(0);
                self.forget_up_to(sequence);
                return;
            }
            let stamp = self.last.entry(voxel).or_insert(sequence);
            *stamp = sequence.max(*stamp);
            self.noted.push_back((sequence, voxel));
        }
    }

    /// Notes that a part of the set is as of a packet.
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
            if self.last.get(&voxel).is_some_and(|&stamp| stamp <= forgotten) {
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
    (bytes / BYTES_A_VOXEL).clamp(MIN_VOXELS, MAX_VOXELS)
}
