use super::anti_entropy::AntiEntropy;
use super::receiver::Receiver;
use super::set::VoxelSet;
use super::stream::Stream;

/// The part of a receiver's memory for versions of voxels: one over this.
const VERSIONS_PART: usize = 8;

impl Receiver {
    /// With less memory, not even small layers have room.
    pub(super) const MIN_BYTES: usize = 4 << 20;

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
        if cut > 0 {
            self.is_over_limit = true;
            // It was equal before.
            self.equal_as_of = None;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ReceiverConfig, Sender, SenderConfig};
    use std::time::Duration;
    use voxtile::space::Grid;

    #[test]
    fn a_layer_that_was_cut_is_not_equal_any_more() {
        let mut sender = Sender::new(Grid::new(0.1, 10.0).unwrap(), 1, SenderConfig::default()).unwrap();
        let mut receiver = Receiver::new(ReceiverConfig::default());
        (0..100).for_each(|k| sender.put([8 * k, 0, 0], true));
        for now in (1..10).map(Duration::from_secs) {
            let requests = receiver.poll(now);
            let answers = requests.iter().flat_map(|request| sender.answer(7, request, now).unwrap());
            let packets: Vec<_> = answers.collect();
            for packet in sender.poll(now).iter().chain(&packets) {
                receiver.take(&packet.bytes, now).unwrap();
            }
        }
        assert!(receiver.is_converged());
        receiver.cut_to_bytes(receiver.memory_bytes());
        assert!(receiver.is_converged(), "nothing was cut");
        receiver.cut_to_bytes(receiver.memory_bytes() - 10_000);
        assert!(receiver.counts().cut_voxels > 0 && receiver.layer().is_some_and(|layer| !layer.is_empty()));
        assert!(!receiver.is_converged() && receiver.equal_as_of().is_none());
    }
}
