use super::anti_entropy::AntiEntropy;
use super::receiver::Receiver;
use super::set::VoxelSet;
use super::stream::Stream;

/// The part of a receiver's memory for versions of voxels: one over this.
const VERSIONS_PART: usize = 8;

impl Receiver {
    /// With less memory, not even small layers have room.
    pub(super) const LEAST_BYTES: usize = 4 << 20;

    /// Upper bound of the bytes of memory: the layer, and the full size of versions and outstanding requests.
    pub fn memory_bytes(&self) -> usize {
        self.layer.as_ref().map_or(0, VoxelSet::memory_bytes) + self.bytes_beside_the_layer()
    }

    /// Sets the limit; what exceeds it already stays.
    pub(super) fn set_memory_bytes(&mut self, bytes: usize) {
        self.limits.bytes = bytes.saturating_sub(self.bytes_beside_the_layer());
    }

    /// Sizes the versions by the memory that the receiver may count on.
    pub(super) fn set_part_bytes(&mut self, bytes: usize) {
        self.version_bytes = bytes / VERSIONS_PART;
        if let Some(stream) = &mut self.stream {
            stream.versions.set_bytes(self.version_bytes);
        }
    }

    /// Removes voxels from the end of the layer until it takes at most so many bytes.
    pub(super) fn cut_to_bytes(&mut self, bytes: usize) {
        let for_layer = bytes.saturating_sub(self.bytes_beside_the_layer());
        let cut = self.layer.as_mut().map_or(0, |layer| layer.cut_to_bytes(for_layer));
        self.counts.cut_voxels += cut;
        self.is_over_limit |= cut > 0;
    }

    fn bytes_beside_the_layer(&self) -> usize {
        // Before the robot's first status there is nothing else.
        let remembered = self
            .stream
            .as_ref()
            .map_or(0, |_| AntiEntropy::MAX_BYTES + Stream::max_bytes(self.version_bytes));
        size_of::<Self>() + remembered
    }
}
