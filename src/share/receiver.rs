use super::catch_up::CatchUp;
use super::codec::{Ask, Header, MAX_LISTED, Packet, Status, Update};
use super::set::{VoxelSet, position_of};
use super::set_range::SetRange;
use super::stream::Stream;
use crate::error::FormatError;
use crate::space::{Grid, TileIndex, VoxelBox, VoxelIndex, places};
use std::time::Duration;

/// What a receiver accepts, and how it asks.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReceiverConfig {
    /// The only grid that is accepted; `None` for any. Default: any.
    pub grid: Option<Grid>,
    /// Most voxels of a robot. Default: 2^26, some 400 MB.
    pub max_voxels: u64,
    /// Most tiles of a robot. Default: 2^17.
    pub max_tiles: usize,
    /// Voxels outside of it are refused; `None` for no limit. Default: none.
    pub region: Option<VoxelBox>,
    /// Whether to ask for what is lacking. Without it a receiver only listens. Default: yes.
    pub asks: bool,
    /// How long to wait for packets that may only be late. Default: 0.3 s.
    pub patience: Duration,
    /// Time between two asks of a kind: with 1200 bytes at most an ask, the most that asks take. Default: 0.2 s.
    pub ask_interval: Duration,
    /// Where the numbers begin that tell answers from old or invented ones; others should not be able to guess it.
    pub nonce_seed: u64,
}

impl Default for ReceiverConfig {
    fn default() -> Self {
        Self {
            grid: None,
            max_voxels: 1 << 26,
            max_tiles: 1 << 17,
            region: None,
            asks: true,
            patience: Duration::from_millis(300),
            ask_interval: Duration::from_millis(200),
            nonce_seed: 1,
        }
    }
}

/// What a receiver has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct ReceiverCounts {
    /// Packets taken in.
    pub packets: u64,
    /// Bytes of all that came.
    pub bytes: u64,
    /// Packets of changes that came twice, or too late.
    pub repeated: u64,
    /// Packets that are not what packets should be.
    pub malformed: u64,
    /// Packets of a life of the sender, or with a number, that the sender has not confirmed.
    pub unconfirmed: u64,
    /// Voxels beyond the limits on region, tiles and voxels.
    pub refused_voxels: u64,
    /// Statuses with another grid than the one that is accepted.
    pub refused_grids: u64,
    /// Asks.
    pub asks: u64,
    /// Bytes of these.
    pub ask_bytes: u64,
    /// Times that the set was compared by digests, or fetched.
    pub catch_ups: u64,
}

/// Listens to one robot and keeps a layer: its set of voxels. Whoever has it calls [`Receiver::poll`] a few times a
/// second.
#[derive(Clone, Debug)]
pub struct Receiver {
    config: ReceiverConfig,
    layer: Option<VoxelSet>,
    stream: Option<Stream>,
    catch_up: CatchUp,
    counts: ReceiverCounts,
    nonce: Nonce,
    /// Since when there is something that only the sender can explain.
    puzzled_since: Option<Duration>,
    ask_missing_at: Duration,
    /// The layer was the sender's set as of this packet.
    equal_as_of: Option<u64>,
    is_over_limit: bool,
}

/// Numbers that only an answer has.
#[derive(Clone, Debug)]
struct Nonce {
    state: u64,
    /// The last one, while it was not answered, and when it was sent.
    waiting: Option<(u64, Duration)>,
    next_at: Duration,
}

/// Time between two questions for a status.
const STATUS_INTERVAL: Duration = Duration::from_secs(1);
/// After so long without an answer a sender is believed, since there may be no way back to it.
const ONE_WAY: Duration = Duration::from_secs(5);
/// First time between two asks for the same packet: its voxels come with a frame.
const RETRY: Duration = Duration::from_millis(1500);

impl Receiver {
    /// A receiver that has heard nothing.
    pub fn new(config: ReceiverConfig) -> Self {
        let nonce = Nonce { state: config.nonce_seed, waiting: None, next_at: Duration::ZERO };
        Self {
            config,
            layer: None,
            stream: None,
            catch_up: CatchUp::default(),
            counts: ReceiverCounts::default(),
            nonce,
            puzzled_since: None,
            ask_missing_at: Duration::ZERO,
            equal_as_of: None,
            is_over_limit: false,
        }
    }

    /// A receiver that goes on with the layer of an earlier one.
    pub fn with_layer(config: ReceiverConfig, layer: VoxelSet) -> Self {
        Self { layer: Some(layer), ..Self::new(config) }
    }

    /// The robot's voxels as far as they came; `None` before anything came.
    pub fn layer(&self) -> Option<&VoxelSet> {
        self.layer.as_ref()
    }

    /// The layer, for its digests.
    pub fn layer_mut(&mut self) -> Option<&mut VoxelSet> {
        self.layer.as_mut()
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
            Packet::Content { range, voxels, .. } => return self.take_content(sequence, range, &voxels, now),
            Packet::Digests { first, entries, .. } => {
                let Some(layer) = &mut self.layer else { return Ok(()) };
                for range in self.catch_up.take_digests(first, &entries, layer, now) {
                    self.take_content(sequence, range, &[], now)?;
                }
            }
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
                && !put_within(&self.config, layer, update.voxel, update.is_in)
            {
                self.counts.refused_voxels += 1;
                self.is_over_limit = true;
            }
        }
        stream.stamps.note(sequence, updates.iter().map(|update| update.voxel).collect());
    }

    /// Replaces a part of the layer, but for what came after the packet that the part is as of.
    fn take_content(
        &mut self,
        as_of: u64,
        range: SetRange,
        voxels: &[VoxelIndex],
        now: Duration,
    ) -> Result<(), FormatError> {
        let (Some(stream), Some(layer)) = (&mut self.stream, &mut self.layer) else { return Ok(()) };
        let grid = *layer.grid();
        if voxels.iter().any(|&voxel| !range.contains(position_of(&grid, voxel))) {
            return Err(FormatError::at_offset(0, "content with voxels outside of its range"));
        }
        if as_of < stream.stamps.forgotten() {
            return Ok(());
        }
        stream.reach(as_of, now, self.config.patience);
        let mut content = VoxelSet::new(grid);
        voxels.iter().for_each(|&voxel| {
            content.put(voxel, true);
        });
        for (voxel, is_in) in differences(layer, &content, range) {
            if !stream.stamps.is_later(&grid, voxel, as_of) && !put_within(&self.config, layer, voxel, is_in)
            {
                self.counts.refused_voxels += 1;
                self.is_over_limit = true;
            }
        }
        stream.stamps.note_part(range, as_of);
        self.catch_up.take_content(range, now);
        Ok(())
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
        self.compare(status, is_lost);
    }

    /// Begins anew with what a sender says of itself.
    fn adopt(&mut self, status: &Status, now: Duration) {
        let grid = Grid::new(status.resolution_m, status.tile_size_m).ok();
        let Some(grid) = grid.filter(|grid| self.config.grid.is_none_or(|accepted| accepted == *grid)) else {
            self.counts.refused_grids += 1;
            return;
        };
        if self.layer.as_ref().is_none_or(|layer| *layer.grid() != grid) {
            self.layer = Some(VoxelSet::new(grid));
        }
        self.equal_as_of = None;
        self.stream = Some(Stream::new(status.header.epoch, status.header.sequence, now));
        self.catch_up = CatchUp::default();
        self.puzzled_since = None;
        self.compare(status, false);
    }

    /// Compares the layer with a status, once all packets before it are there; catches up if they differ.
    fn compare(&mut self, status: &Status, is_lost: bool) {
        let (Some(stream), Some(layer)) = (&self.stream, &mut self.layer) else { return };
        let can_compare = stream.is_complete() && stream.highest == status.header.sequence;
        let mut differs = is_lost;
        if can_compare {
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

impl Nonce {
    fn ask(&mut self, now: Duration) -> Option<Ask> {
        if now < self.next_at {
            return None;
        }
        self.next_at = now + STATUS_INTERVAL;
        // splitmix64: never twice the same in a receiver's life.
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.state;
        bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        let nonce = (bits ^ bits >> 31).max(1);
        self.waiting = Some((nonce, now));
        Some(Ask::Status { nonce })
    }

    /// When the ask was sent that a number answers.
    fn take(&mut self, nonce: u64) -> Option<Duration> {
        let (_, at) = self.waiting.filter(|(waiting, _)| *waiting == nonce)?;
        self.waiting = None;
        Some(at)
    }
}

/// Puts a voxel into a layer, or takes it out; `false` if that is beyond the limits.
fn put_within(config: &ReceiverConfig, layer: &mut VoxelSet, voxel: VoxelIndex, is_in: bool) -> bool {
    let is_inside = config.region.as_ref().is_none_or(|region| region.contains(voxel));
    let tile = layer.grid().tile_of_voxel(voxel);
    let has_room =
        || layer.len() < config.max_voxels && (layer.tile_count() < config.max_tiles || layer.has_tile(tile));
    let is_allowed = !is_in || (is_inside && (has_room() || layer.contains(voxel)));
    if is_allowed {
        layer.put(voxel, is_in);
    }
    is_allowed
}

/// Voxels of a part of a set that are not as in another set, and what they are there.
fn differences(from: &VoxelSet, to: &VoxelSet, range: SetRange) -> Vec<(VoxelIndex, bool)> {
    let (first, last) = (range.first.tile, range.last.tile);
    let mut tiles: Vec<TileIndex> = from.tiles_between(first, last);
    tiles.extend(to.tiles_between(first, last));
    tiles.sort_unstable();
    tiles.dedup();
    let mut found = Vec::new();
    for tile in tiles {
        let min = from.grid().voxels_of_tile(tile).min;
        let mut bricks: Vec<_> =
            from.bricks_of(tile).chain(to.bricks_of(tile)).map(|(brick, _)| brick).collect();
        bricks.sort_unstable();
        bricks.dedup();
        for brick in bricks {
            let (before, after) = (from.brick(tile, brick), to.brick(tile, brick));
            for place in places(std::array::from_fn(|k| before[k] ^ after[k])) {
                let code = brick.voxel(place);
                let position = super::SetPosition { tile, code: code.0 };
                if range.contains(position) {
                    let is_in = after[place / 64] >> (place % 64) & 1 == 1;
                    found.push((code.to_key().to_index_from(min), is_in));
                }
            }
        }
    }
    found
}
