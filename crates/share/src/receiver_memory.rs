use super::anti_entropy::AntiEntropy;
use super::receiver::Receiver;
use super::set::VoxelSet;
use super::stream::Stream;

/// Share of a receiver's memory for the versions of voxels: one over this number.
const VERSIONS_DIVISOR: usize = 8;

impl Receiver {
    /// Minimum memory of a receiver, in bytes. With less, even small layers do not fit.
    pub(super) const MIN_BYTES: usize = 4 << 20;

    /// Returns an upper bound on the memory, in bytes: the layer, plus the maximum size of versions and outstanding
    /// requests.
    pub fn memory_bytes(&self) -> usize {
        self.layer.as_ref().map_or(0, VoxelSet::memory_bytes) + self.bytes_without_layer()
    }

    /// Sets the memory limit. Existing voxels beyond the limit are kept.
    pub(super) fn set_memory_bytes(&mut self, bytes: usize) {
        self.limits.bytes = bytes.saturating_sub(self.bytes_without_layer());
    }

    /// Sets the maximum size of the versions to a share of `bytes`, the memory that the receiver is guaranteed.
    pub(super) fn set_part_bytes(&mut self, bytes: usize) {
        self.version_bytes = bytes / VERSIONS_DIVISOR;
        if let Some(stream) = &mut self.stream {
            stream.versions.set_bytes(self.version_bytes);
        }
    }

    /// Removes voxels from the end of the layer until the receiver takes at most `bytes`.
    pub(super) fn cut_to_bytes(&mut self, bytes: usize) {
        let for_layer = bytes.saturating_sub(self.bytes_without_layer());
        let cut = self.layer.as_mut().map_or(0, |layer| layer.cut_to_bytes(for_layer));
        self.counts.cut_voxels += cut;
        if cut > 0 {
            self.is_over_limit = true;
            // A layer without some of its voxels is no longer equal to the sender's set.
            self.equal_as_of = None;
        }
    }

    fn bytes_without_layer(&self) -> usize {
        // Versions and requests exist only after the robot's first status.
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
    fn a_cut_layer_is_no_longer_converged() {
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
