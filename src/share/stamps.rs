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
    /// In the order in which they came.
    packets: VecDeque<(u64, Vec<VoxelIndex>)>,
    voxels: usize,
    /// Parts of the set that were replaced whole, and as of which packet.
    parts: VecDeque<(SetRange, u64)>,
    /// Packets up to this one are not taken.
    forgotten: u64,
}

/// Voxels of packets that are remembered: a minute of a dense lidar.
const MAX_VOXELS: usize = 1 << 18;
const MAX_PARTS: usize = 4096;

impl Stamps {
    pub(super) fn new(forgotten: u64) -> Self {
        Self { last: HashMap::new(), packets: VecDeque::new(), voxels: 0, parts: VecDeque::new(), forgotten }
    }

    pub(super) fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// Whether a voxel is as a later packet than this one left it.
    pub(super) fn is_later(&self, grid: &Grid, voxel: VoxelIndex, sequence: u64) -> bool {
        if self.last.get(&voxel).is_some_and(|&stamp| stamp > sequence) {
            return true;
        }
        // A part holds the packet that it is as of. Few packets are older than a part.
        let mut parts = self.parts.iter().filter(|(_, as_of)| *as_of >= sequence).peekable();
        if parts.peek().is_none() {
            return false;
        }
        let position = position_of(grid, voxel);
        parts.any(|(range, _)| range.contains(position))
    }

    /// Notes the voxels of a packet.
    pub(super) fn note(&mut self, sequence: u64, voxels: Vec<VoxelIndex>) {
        for &voxel in &voxels {
            let stamp = self.last.entry(voxel).or_insert(sequence);
            *stamp = sequence.max(*stamp);
        }
        self.voxels += voxels.len();
        self.packets.push_back((sequence, voxels));
        while self.voxels > MAX_VOXELS {
            self.forget_one();
        }
    }

    /// Notes that a part of the set is as of a packet.
    pub(super) fn note_part(&mut self, range: SetRange, as_of: u64) {
        self.parts.push_back((range, as_of));
        if self.parts.len() > MAX_PARTS
            && let Some((_, as_of)) = self.parts.pop_front()
        {
            self.forget_up_to(as_of);
        }
    }

    fn forget_one(&mut self) {
        let Some((sequence, voxels)) = self.packets.pop_front() else { return };
        self.voxels -= voxels.len();
        self.forget_up_to(sequence);
        for voxel in voxels {
            if self.last.get(&voxel).is_some_and(|&stamp| stamp <= self.forgotten) {
                self.last.remove(&voxel);
            }
        }
    }

    fn forget_up_to(&mut self, sequence: u64) {
        self.forgotten = self.forgotten.max(sequence);
        let forgotten = self.forgotten;
        self.parts.retain(|(_, as_of)| *as_of > forgotten);
    }
}
