use super::anti_entropy::AntiEntropy;
use super::codec::{DigestEntry, Header, MAX_LISTED, Packet, Request, Status, Update};
use super::differences::Content;
use super::layer_limits::LayerLimits;
use super::nonce::Nonce;
use super::receiver_config::{ReceiverConfig, ReceiverCounts};
use super::replace::WorkBudget;
use super::set::VoxelSet;
use super::set_range::SetRange;
use super::stream::Stream;
use std::time::Duration;
use voxtile::FormatError;
use voxtile::space::{Grid, TileIndex};

/// Receiver of one robot's packets. It keeps that robot's set of voxels as a layer. Call [`Receiver::poll`] a few times
/// a second.
#[derive(Clone, Debug)]
pub struct Receiver {
    config: ReceiverConfig,
    pub(super) limits: LayerLimits,
    pub(super) layer: Option<VoxelSet>,
    pub(super) stream: Option<Stream>,
    /// Memory for the versions of voxels, in bytes.
    pub(super) version_bytes: usize,
    anti_entropy: AntiEntropy,
    pub(super) counts: ReceiverCounts,
    nonce: Nonce,
    /// Arrival of the first packet with an unexpected epoch or number; `None` after a status has confirmed the sender.
    unconfirmed_since: Option<Duration>,
    request_missing_at: Duration,
    /// Number of the packet as of which the layer was equal to the sender's set.
    pub(super) equal_as_of: Option<u64>,
    pub(super) is_over_limit: bool,
    /// Status to compare with the layer at `compare_at` or later.
    to_compare: Option<Status>,
    compare_at: Duration,
    /// Grid that was refused last.
    refused_grid: Option<Grid>,
}

/// Time after which a status is accepted without an answer: the link may have no back channel.
const ONE_WAY_TIMEOUT: Duration = Duration::from_secs(5);
/// Time before a lost packet is requested again. Its voxels arrive in the next frame.
const RETRY: Duration = Duration::from_millis(1500);
/// Time between two comparisons, per voxel and per tile of the layer: about twenty times the cost of a comparison.
const COMPARE_NS_PER_VOXEL: u64 = 100;
const COMPARE_NS_PER_TILE: u64 = 2000;

impl Receiver {
    /// Creates a receiver without a layer.
    pub fn new(config: ReceiverConfig) -> Self {
        Self::started(config, None)
    }

    /// Creates a receiver that continues with an existing layer.
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
            version_bytes: 0,
            anti_entropy: AntiEntropy::default(),
            counts: ReceiverCounts::default(),
            nonce,
            unconfirmed_since: None,
            request_missing_at: Duration::ZERO,
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

    /// Returns the robot's voxels so far; `None` before a status was accepted.
    pub fn layer(&self) -> Option<&VoxelSet> {
        self.layer.as_ref()
    }

    /// Returns the layer mutably, to compute its digests.
    pub fn layer_mut(&mut self) -> Option<&mut VoxelSet> {
        self.layer.as_mut()
    }

    /// Consumes the receiver and returns its layer.
    pub fn into_layer(self) -> Option<VoxelSet> {
        self.layer
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> ReceiverCounts {
        self.counts
    }

    /// Returns the number of packets that are still missing.
    pub fn missing_packets(&self) -> usize {
        self.stream.as_ref().map_or(0, Stream::missing)
    }

    /// Returns whether the layer was equal to the sender's set at the last known packet.
    pub fn is_converged(&self) -> bool {
        let Some(stream) = &self.stream else { return false };
        stream.is_complete() && self.equal_as_of == Some(stream.highest) && self.unconfirmed_since.is_none()
    }

    /// Returns epoch and number of the packet as of which the layer was last equal to the sender's set.
    pub fn equal_as_of(&self) -> Option<(u32, u64)> {
        Some((self.stream.as_ref()?.epoch, self.equal_as_of?))
    }

    /// Returns whether voxels were refused or removed because of a limit. Such a layer cannot become equal, and
    /// anti-entropy stops.
    pub fn is_over_limit(&self) -> bool {
        self.is_over_limit
    }

    /// Returns the grid of the robot's voxels if it was refused.
    pub fn refused_grid(&self) -> Option<&Grid> {
        self.refused_grid.as_ref()
    }

    /// Processes the bytes of a packet.
    ///
    /// # Errors
    ///
    /// Bytes that are not a valid packet; the layer is unchanged.
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
            self.unconfirmed_since.get_or_insert(now);
            return Ok(());
        }
        match packet {
            Packet::Changes { repaired, updates, .. } => {
                self.take_changes(sequence, &repaired, &updates, now)
            }
            Packet::Content { range, voxels, .. } => {
                let Some(layer) = &self.layer else { return Ok(()) };
                let content = Content::new(layer.grid(), range, &voxels)
                    .ok_or_else(|| FormatError::at_offset(0, "the content has voxels outside its range"))?;
                self.take_content(sequence, range, &content, &mut WorkBudget::per_packet(), now);
            }
            Packet::Digests { first, entries, .. } => self.take_digests(sequence, first, &entries, now),
            Packet::Status(_) => {}
        }
        Ok(())
    }

    fn take_changes(&mut self, sequence: u64, repaired: &[u64], updates: &[Update], now: Duration) {
        let (Some(stream), Some(layer)) = (&mut self.stream, &mut self.layer) else { return };
        for &repaired in repaired {
            stream.mark_repaired(repaired);
        }
        if !stream.arrive(sequence, now, self.config.patience) {
            self.counts.repeated += 1;
            return;
        }
        let grid = *layer.grid();
        for update in updates {
            if !stream.versions.is_later(&grid, update.voxel, sequence)
                && !self.limits.put(layer, update.voxel, update.is_in)
            {
                self.counts.refused_voxels += 1;
                self.is_over_limit = true;
            }
        }
        stream.versions.record(sequence, updates.iter().map(|update| update.voxel));
    }

    /// Replaces a range of the layer with a packet's content, except for voxels that a later packet changed.
    fn take_content(
        &mut self,
        as_of: u64,
        range: SetRange,
        content: &Content,
        work: &mut WorkBudget,
        now: Duration,
    ) {
        let Some(stream) = &mut self.stream else { return };
        if as_of < stream.versions.forgotten() {
            return;
        }
        stream.reach(as_of, now, self.config.patience);
        let Some(done) = self.replace(as_of, range, content, work) else { return };
        if let Some(stream) = &mut self.stream {
            stream.versions.record_range(done, as_of);
        }
        self.anti_entropy.take_content(done, now);
    }

    fn take_digests(&mut self, as_of: u64, first: TileIndex, entries: &[DigestEntry], now: Duration) {
        let Some(layer) = &mut self.layer else { return };
        let mut work = WorkBudget::per_packet();
        for range in self.anti_entropy.take_digests(first, entries, layer, now) {
            // Keep requesting the range until it is done: the removal may exceed the work limit.
            self.anti_entropy.request_content(range);
            self.take_content(as_of, range, &Content::default(), &mut work, now);
        }
    }

    fn take_status(&mut self, status: &Status, now: Duration) {
        let Header { epoch, sequence } = status.header;
        let requested_at = self.nonce.take(status.nonce);
        let Some(stream) = self.stream.as_mut().filter(|stream| stream.can_be(epoch, sequence)) else {
            let is_one_way = self.unconfirmed_since.is_some_and(|since| now >= since + ONE_WAY_TIMEOUT);
            self.counts.unconfirmed += 1;
            self.unconfirmed_since.get_or_insert(now);
            if requested_at.is_some() || (is_one_way && status.nonce == 0) {
                self.restart(status, now);
            }
            return;
        };
        // If the answer to a later request has a smaller number, the highest number was forged.
        if sequence < stream.highest
            && requested_at.is_some_and(|requested_at| stream.highest_at < requested_at)
        {
            self.restart(status, now);
            return;
        }
        if requested_at.is_some() {
            self.unconfirmed_since = None;
        }
        stream.reach(sequence, now, self.config.patience);
        let is_lost = stream.give_up_before(status.oldest);
        self.compare(status, is_lost, now);
    }

    /// Starts a new stream from a sender's status.
    fn restart(&mut self, status: &Status, now: Duration) {
        // The farthest voxels must have finite coordinates, too.
        let has_coordinates = |grid: &Grid| grid.center_m([i32::MIN; 3]).iter().all(|k| k.is_finite());
        let grid = Grid::new(status.resolution_m, status.tile_size_m).ok().filter(has_coordinates);
        let Some(grid) = grid.filter(|grid| self.config.grid.is_none_or(|accepted| accepted == *grid)) else {
            self.refused_grid = grid.or(self.refused_grid);
            self.counts.refused_grids += 1;
            return;
        };
        if self.layer.as_ref().is_none_or(|layer| *layer.grid() != grid) {
            self.layer = Some(VoxelSet::new(grid));
        }
        self.equal_as_of = None;
        self.stream = Some(Stream::new(status.header.epoch, status.header.sequence, now, self.version_bytes));
        self.anti_entropy = AntiEntropy::default();
        self.unconfirmed_since = None;
        self.to_compare = None;
        self.compare(status, false, now);
    }

    /// Compares the layer with a status once all earlier packets have arrived; starts anti-entropy if they differ. The
    /// comparison may be delayed, because its cost grows with voxels and tiles.
    fn compare(&mut self, status: &Status, is_lost: bool, now: Duration) {
        let (Some(stream), Some(layer)) = (&self.stream, &mut self.layer) else { return };
        let can_compare = stream.is_complete() && stream.highest == status.header.sequence;
        let mut differs = is_lost;
        if can_compare && now < self.compare_at {
            self.to_compare = Some(*status);
        } else if can_compare {
            let wait_ns = COMPARE_NS_PER_VOXEL.saturating_mul(layer.len())
                + COMPARE_NS_PER_TILE.saturating_mul(layer.tile_count() as u64);
            self.compare_at = now + Duration::from_nanos(wait_ns);
            let is_equal = layer.len() == status.voxels && layer.digest().to_bytes() == status.digest;
            self.equal_as_of = is_equal.then_some(stream.highest);
            differs |= !is_equal;
            if is_equal {
                self.anti_entropy = AntiEntropy::default();
                return;
            }
        }
        if differs && self.anti_entropy.is_done() && !self.is_over_limit {
            self.anti_entropy.begin(layer);
            self.counts.catch_ups += 1;
        }
    }

    /// Returns the requests to send to the robot now.
    pub fn poll(&mut self, now: Duration) -> Vec<Vec<u8>> {
        if now >= self.compare_at
            && let Some(status) = self.to_compare.take()
        {
            self.compare(&status, false, now);
        }
        if !self.config.sends_requests {
            return Vec::new();
        }
        let mut requests = Vec::new();
        let mut wants_status = self.unconfirmed_since.is_some() || self.stream.is_none();
        if let Some(stream) = &mut self.stream {
            if now >= self.request_missing_at {
                let (sequences, is_hopeless) = stream.due(now, MAX_LISTED, RETRY);
                wants_status |= is_hopeless;
                if !sequences.is_empty() {
                    self.request_missing_at = now + self.config.request_interval;
                    requests.push(Request::Missing { epoch: stream.epoch, sequences });
                }
            }
            let patience = self.config.patience + self.config.request_interval;
            requests.extend(self.anti_entropy.poll(
                stream.epoch,
                now,
                self.config.request_interval,
                patience,
            ));
        }
        if wants_status {
            requests.extend(self.nonce.request(now));
        }
        let requests: Vec<Vec<u8>> = requests.iter().map(Request::encode).collect();
        self.counts.asks += requests.len() as u64;
        self.counts.ask_bytes += requests.iter().map(|request| request.len() as u64).sum::<u64>();
        requests
    }
}
