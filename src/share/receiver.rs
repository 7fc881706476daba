use super::catch_up::CatchUp;
use super::codec::{Ask, DigestEntry, Header, MAX_LISTED, Packet, Status, Update};
use super::differences::Content;
use super::layer_limits::LayerLimits;
use super::nonce::Nonce;
use super::receiver_config::{ReceiverConfig, ReceiverCounts};
use super::replace::Work;
use super::set::VoxelSet;
use super::set_range::SetRange;
use super::stream::Stream;
use crate::error::FormatError;
use crate::space::{Grid, TileIndex};
use std::time::Duration;

/// Listens to one robot and keeps a layer: its set of voxels. Whoever has it calls [`Receiver::poll`] a few times a
/// second.
#[derive(Clone, Debug)]
pub struct Receiver {
    config: ReceiverConfig,
    pub(super) limits: LayerLimits,
    pub(super) layer: Option<VoxelSet>,
    pub(super) stream: Option<Stream>,
    /// Bytes of memory for what is remembered of packets.
    pub(super) stamp_bytes: usize,
    catch_up: CatchUp,
    pub(super) counts: ReceiverCounts,
    nonce: Nonce,
    /// Since when there is something that only the sender can explain.
    puzzled_since: Option<Duration>,
    ask_missing_at: Duration,
    /// The layer was the sender's set as of this packet.
    equal_as_of: Option<u64>,
    pub(super) is_over_limit: bool,
    /// A status that the layer is still to be compared with, and when there may be work for that.
    to_compare: Option<Status>,
    compare_at: Duration,
    /// The last one that was refused.
    refused_grid: Option<Grid>,
}

/// After so long without an answer a sender is believed, since there may be no way back to it.
const ONE_WAY: Duration = Duration::from_secs(5);
/// First time between two asks for the same packet: its voxels come with a frame.
const RETRY: Duration = Duration::from_millis(1500);
/// Time between two comparisons of a layer, by voxel and by tile: some twenty times what a comparison takes.
const COMPARE_NS_A_VOXEL: u64 = 100;
const COMPARE_NS_A_TILE: u64 = 2000;

impl Receiver {
    /// A receiver that has heard nothing.
    pub fn new(config: ReceiverConfig) -> Self {
        Self::started(config, None)
    }

    /// A receiver that goes on with the layer of an earlier one.
    pub fn with_layer(config: ReceiverConfig, layer: VoxelSet) -> Self {
        Self::started(config, Some(layer))
    }

    pub(super) fn started(config: ReceiverConfig, layer: Option<VoxelSet>) -> Self {
        let nonce = Nonce::new(config.nonce_seed);
        let mut receiver = Self {
            limits: LayerLimits::new(&config, 0),
            config,
            layer,
            stream: None,
            stamp_bytes: 0,
            catch_up: CatchUp::default(),
            counts: ReceiverCounts::default(),
            nonce,
            puzzled_since: None,
            ask_missing_at: Duration::ZERO,
            equal_as_of: None,
            is_over_limit: false,
            to_compare: None,
            compare_at: Duration::ZERO,
            refused_grid: None,
        };
        receiver.set_part_bytes(receiver.config.memory_bytes);
        receiver.set_memory_bytes(receiver.config.memory_bytes);
        receiver.cut_to_bytes(receiver.config.memory_bytes);
        receiver
    }

    /// The robot's voxels as far as they came; `None` before anything came.
    pub fn layer(&self) -> Option<&VoxelSet> {
        self.layer.as_ref()
    }

    /// The layer, for its digests.
    pub fn layer_mut(&mut self) -> Option<&mut VoxelSet> {
        self.layer.as_mut()
    }

    /// The layer, for whoever listens no more.
    pub fn into_layer(self) -> Option<VoxelSet> {
        self.layer
    }

    /// What was seen so far.
    pub fn counts(&self) -> ReceiverCounts {
        self.counts
    }

    /// Packets that were sent and did not come.
    pub fn missing_packets(&self) -> usize {
        self.stream.as_ref().map_or(0, Stream::missing)
    }

    /// Whether the layer was compared with the set of the sender, and equal, and nothing came since.
    pub fn is_converged(&self) -> bool {
        let Some(stream) = &self.stream else { return false };
        stream.is_complete() && self.equal_as_of == Some(stream.highest) && self.puzzled_since.is_none()
    }

    /// Epoch and number of the packet as of which the layer was last found equal to the sender's set.
    pub fn equal_as_of(&self) -> Option<(u32, u64)> {
        Some((self.stream.as_ref()?.epoch, self.equal_as_of?))
    }

    /// Whether voxels were refused: the layer cannot become equal then, and is not compared any more.
    pub fn is_over_limit(&self) -> bool {
        self.is_over_limit
    }

    /// The grid of the robot's voxels, if it was refused.
    pub fn refused_grid(&self) -> Option<&Grid> {
        self.refused_grid.as_ref()
    }

    /// Takes the bytes of a packet.
    ///
    /// # Errors
    ///
    /// Bytes that are no packet; the layer stays as it was.
    pub fn take(&mut self, bytes: &[u8], now: Duration) -> Result<(), FormatError> {
        self.counts.bytes += bytes.len() as u64;
        let taken = Packet::decode(bytes).and_then(|packet| self.take_packet(packet, now));
        match &taken {
            Ok(()) => self.counts.packets += 1,
            Err(_) => self.counts.malformed += 1,
        }
        taken
    }

    fn take_packet(&mut self, packet: Packet, now: Duration) -> Result<(), FormatError> {
        let Header { epoch, sequence } = packet.header();
        if let Packet::Status(status) = packet {
            self.take_status(&status, now);
            return Ok(());
        }
        if !self.stream.as_ref().is_some_and(|stream| stream.can_be(epoch, sequence)) {
            self.counts.unconfirmed += 1;
            self.puzzled_since.get_or_insert(now);
            return Ok(());
        }
        match packet {
            Packet::Changes { repaired, updates, .. } => {
                self.take_changes(sequence, &repaired, &updates, now)
            }
            Packet::Content { range, voxels, .. } => {
                let Some(layer) = &self.layer else { return Ok(()) };
                let content = Content::new(layer.grid(), range, &voxels)
                    .ok_or_else(|| FormatError::at_offset(0, "content with voxels outside of its range"))?;
                self.take_content(sequence, range, &content, &mut Work::of_a_packet(), now);
            }
            Packet::Digests { first, entries, .. } => self.take_digests(sequence, first, &entries, now),
            Packet::Status(_) => {}
        }
        Ok(())
    }

    fn take_changes(&mut self, sequence: u64, repaired: &[u64], updates: &[Update], now: Duration) {
        let (Some(stream), Some(layer)) = (&mut self.stream, &mut self.layer) else { return };
        for &repaired in repaired {
            stream.is_repaired(repaired);
        }
        if !stream.arrive(sequence, now, self.config.patience) {
            self.counts.repeated += 1;
            return;
        }
        let grid = *layer.grid();
        for update in updates {
            if !stream.stamps.is_later(&grid, update.voxel, sequence)
                && !self.limits.put(layer, update.voxel, update.is_in)
            {
                self.counts.refused_voxels += 1;
                self.is_over_limit = true;
            }
        }
        stream.stamps.note(sequence, updates.iter().map(|update| update.voxel));
    }

    /// Replaces a part of the layer, but for what came after the packet that the part is as of.
    fn take_content(
        &mut self,
        as_of: u64,
        range: SetRange,
        content: &Content,
        work: &mut Work,
        now: Duration,
    ) {
        let Some(stream) = &mut self.stream else { return };
        if as_of < stream.stamps.forgotten() {
            return;
        }
        stream.reach(as_of, now, self.config.patience);
        let Some(done) = self.replace(as_of, range, content, work) else { return };
        if let Some(stream) = &mut self.stream {
            stream.stamps.note_part(done, as_of);
        }
        self.catch_up.take_content(done, now);
    }

    fn take_digests(&mut self, as_of: u64, first: TileIndex, entries: &[DigestEntry], now: Duration) {
        let Some(layer) = &mut self.layer else { return };
        let mut work = Work::of_a_packet();
        for range in self.catch_up.take_digests(first, entries, layer, now) {
            // Until it is done: there may not be work left for it.
            self.catch_up.want_content(range);
            self.take_content(as_of, range, &Content::default(), &mut work, now);
        }
    }

    fn take_status(&mut self, status: &Status, now: Duration) {
        let Header { epoch, sequence } = status.header;
        let asked_at = self.nonce.take(status.nonce);
        let Some(stream) = self.stream.as_mut().filter(|stream| stream.can_be(epoch, sequence)) else {
            let is_one_way = self.puzzled_since.is_some_and(|since| now >= since + ONE_WAY);
            self.counts.unconfirmed += 1;
            self.puzzled_since.get_or_insert(now);
            if asked_at.is_some() || (is_one_way && status.nonce == 0) {
                self.adopt(status, now);
            }
            return;
        };
        // Somebody has invented numbers, if the sender says later that it has not come to them.
        if sequence < stream.highest && asked_at.is_some_and(|asked_at| stream.highest_at < asked_at) {
            self.adopt(status, now);
            return;
        }
        if asked_at.is_some() {
            self.puzzled_since = None;
        }
        stream.reach(sequence, now, self.config.patience);
        let is_lost = stream.give_up_before(status.oldest);
        self.compare(status, is_lost, now);
    }

    /// Begins anew with what a sender says of itself.
    fn adopt(&mut self, status: &Status, now: Duration) {
        // The voxels farthest away have a place, too.
        let has_places = |grid: &Grid| grid.center_m([i32::MIN; 3]).iter().all(|k| k.is_finite());
        let grid = Grid::new(status.resolution_m, status.tile_size_m).ok().filter(has_places);
        let Some(grid) = grid.filter(|grid| self.config.grid.is_none_or(|accepted| accepted == *grid)) else {
            self.refused_grid = grid.or(self.refused_grid);
            self.counts.refused_grids += 1;
            return;
        };
        if self.layer.as_ref().is_none_or(|layer| *layer.grid() != grid) {
            self.layer = Some(VoxelSet::new(grid));
        }
        self.equal_as_of = None;
        self.stream = Some(Stream::new(status.header.epoch, status.header.sequence, now, self.stamp_bytes));
        self.catch_up = CatchUp::default();
        self.puzzled_since = None;
        self.to_compare = None;
        self.compare(status, false, now);
    }

    /// Compares the layer with a status, once all packets before it are there; catches up if they differ. That takes work
    /// by voxels and tiles, so that it may have to wait.
    fn compare(&mut self, status: &Status, is_lost: bool, now: Duration) {
        let (Some(stream), Some(layer)) = (&self.stream, &mut self.layer) else { return };
        let can_compare = stream.is_complete() && stream.highest == status.header.sequence;
        let mut differs = is_lost;
        if can_compare && now < self.compare_at {
            self.to_compare = Some(*status);
        } else if can_compare {
            let wait_ns = COMPARE_NS_A_VOXEL.saturating_mul(layer.len())
                + COMPARE_NS_A_TILE.saturating_mul(layer.tile_count() as u64);
            self.compare_at = now + Duration::from_nanos(wait_ns);
            let is_equal = layer.len() == status.voxels && *layer.digest().as_bytes() == status.digest;
            self.equal_as_of = is_equal.then_some(stream.highest);
            differs |= !is_equal;
            if is_equal {
                self.catch_up = CatchUp::default();
                return;
            }
        }
        if differs && self.catch_up.is_done() && !self.is_over_limit {
            self.catch_up.begin(layer);
            self.counts.catch_ups += 1;
        }
    }

    /// Asks to be sent now, to the robot.
    pub fn poll(&mut self, now: Duration) -> Vec<Vec<u8>> {
        if now >= self.compare_at
            && let Some(status) = self.to_compare.take()
        {
            self.compare(&status, false, now);
        }
        if !self.config.asks {
            return Vec::new();
        }
        let mut asks = Vec::new();
        let mut wants_status = self.puzzled_since.is_some() || self.stream.is_none();
        if let Some(stream) = &mut self.stream {
            if now >= self.ask_missing_at {
                let (sequences, is_in_vain) = stream.due(now, MAX_LISTED, RETRY);
                wants_status |= is_in_vain;
                if !sequences.is_empty() {
                    self.ask_missing_at = now + self.config.ask_interval;
                    asks.push(Ask::Missing { epoch: stream.epoch, sequences });
                }
            }
            let patience = self.config.patience + self.config.ask_interval;
            asks.extend(self.catch_up.poll(stream.epoch, now, self.config.ask_interval, patience));
        }
        if wants_status {
            asks.extend(self.nonce.ask(now));
        }
        let asks: Vec<Vec<u8>> = asks.iter().map(Ask::encode).collect();
        self.counts.asks += asks.len() as u64;
        self.counts.ask_bytes += asks.iter().map(|ask| ask.len() as u64).sum::<u64>();
        asks
    }
}
