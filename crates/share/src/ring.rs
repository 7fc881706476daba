use std::collections::VecDeque;
use voxtile::space::VoxelIndex;

/// Ring buffer of the voxels of recent packets and frames.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    /// Voxels of packets with consecutive numbers.
    packets: VecDeque<Vec<VoxelIndex>>,
    /// Number of the first packet, or of the next packet if the ring is empty.
    first: u64,
    /// Number of the first packet of each frame, ascending.
    frames: VecDeque<u64>,
    voxels: usize,
    max_packets: usize,
}

/// Maximum number of voxels in a ring.
const MAX_VOXELS: usize = 1 << 20;

impl Ring {
    pub(super) fn new(max_packets: usize) -> Self {
        Self { packets: VecDeque::new(), first: 1, frames: VecDeque::new(), voxels: 0, max_packets }
    }

    pub(super) fn begin_frame(&mut self) {
        self.frames.push_back(self.next());
    }

    /// Returns the number of the next packet.
    pub(super) fn next(&self) -> u64 {
        self.first + self.packets.len() as u64
    }

    /// Returns the number of the oldest packet in the ring.
    pub(super) fn oldest(&self) -> u64 {
        self.first
    }

    pub(super) fn push(&mut self, voxels: Vec<VoxelIndex>) {
        self.voxels += voxels.len();
        self.packets.push_back(voxels);
        while (self.voxels > MAX_VOXELS || self.packets.len() > self.max_packets) && self.packets.len() > 1 {
            self.voxels -= self.packets.pop_front().map_or(0, |packet| packet.len());
            self.first += 1;
        }
        // Drop frames without packets in the ring. The first remaining frame may have lost its first packets.
        while self.frames.get(1).is_some_and(|&second| second <= self.first) {
            self.frames.pop_front();
        }
    }

    pub(super) fn get(&self, sequence: u64) -> Option<&[VoxelIndex]> {
        let place = usize::try_from(sequence.checked_sub(self.first)?).ok()?;
        self.packets.get(place).map(Vec::as_slice)
    }

    /// Returns the voxels of the last `frames` frames.
    pub(super) fn last_frames(&self, frames: usize) -> impl Iterator<Item = VoxelIndex> {
        let begin = self.frames.len().saturating_sub(frames);
        let from = self.frames.get(begin).map_or(self.next(), |&first| first.max(self.first));
        (from..self.next()).filter_map(|sequence| self.get(sequence)).flatten().copied()
    }
}
