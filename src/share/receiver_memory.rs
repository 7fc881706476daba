use super::catch_up::CatchUp;
use super::receiver::Receiver;
use super::set::VoxelSet;
use super::stream::Stream;

/// Of the memory of a receiver, the part that is for stamps of packets.
const STAMPS_PART: usize = 8;

impl Receiver {
    /// With less memory, not even small layers have room.
    pub(super) const LEAST_BYTES: usize = 4 << 20;

    /// Bytes of memory, at most: of the layer, and of what is remembered of packets and still to be asked for, as if that
    /// was as much as it may become.
    pub fn memory_bytes(&self) -> usize {
        self.layer.as_ref().map_or(0, VoxelSet::memory_bytes) + self.bytes_beside_the_layer()
    }

    /// Has a limit from now on; what is beyond it already stays.
    pub(super) fn set_memory_bytes(&mut self, bytes: usize) {
        self.limits.bytes = bytes.saturating_sub(self.bytes_beside_the_layer());
    }

    /// Has stamps for a part of the memory that the receiver may count on.
    pub(super) fn set_part_bytes(&mut self, bytes: usize) {
        self.stamp_bytes = bytes / STAMPS_PART;
        if let Some(stream) = &mut self.stream {
            stream.stamps.set_bytes(self.stamp_bytes);
        }
    }

    /// Forgets voxels from the end of the layer until there are no more than so many bytes.
    pub(super) fn cut_to_bytes(&mut self, bytes: usize) {
        let for_layer = bytes.saturating_sub(self.bytes_beside_the_layer());
        let cut = self.layer.as_mut().map_or(0, |layer| layer.cut_to_bytes(for_layer));
        self.counts.cut_voxels += cut;
        self.is_over_limit |= cut > 0;
    }

    fn bytes_beside_the_layer(&self) -> usize {
        // Before a robot has said what it is, nothing is remembered.
        let remembered =
            self.stream.as_ref().map_or(0, |_| CatchUp::MOST_BYTES + Stream::most_bytes(self.stamp_bytes));
        size_of::<Self>() + remembered
    }
}
