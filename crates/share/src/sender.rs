use super::ExportPolicy;
use super::codec::{Header, MAX_VOXELS_PER_PACKET, Packet, Status, Update};
use super::ring::Ring;
use super::send_buffer::SendBuffer;
use super::sender_config::{SenderConfig, SenderCounts};
use super::set::VoxelSet;
use super::token_bucket::TokenBucket;
use std::time::Duration;
use voxtile::space::{BrickCode, BrickMask, Grid, TileIndex, VoxelIndex, VoxelKey, is_in_mask, places};
use voxtile::{Error, Result};

/// Identifies the receiver that sent a request; any number unique to it.
pub type ReceiverId = u64;

/// A packet to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outgoing {
    /// The receiver; `None` for all receivers.
    pub to: Option<ReceiverId>,
    /// The packet's bytes.
    pub bytes: Vec<u8>,
}

/// Sender of a set of voxels. It consumes requests and produces packets as bytes. Call [`Sender::poll`] a few times a
/// second.
#[derive(Clone, Debug)]
pub struct Sender {
    pub(super) config: SenderConfig,
    epoch: u32,
    /// The current set.
    current: VoxelSet,
    /// The set as sent: the layer of a receiver that has every packet.
    pub(super) sent: VoxelSet,
    pub(super) send_buffer: SendBuffer,
    pub(super) ring: Ring,
    pub(super) counts: SenderCounts,
    next_status: Duration,
    /// Number of the last packet at the time of the last status.
    status_sequence: Option<u64>,
    /// Estimated number of voxels that fit into a packet.
    voxels_per_packet: usize,
    pub(super) token_bucket: TokenBucket,
}

/// Number of buffered changes at which a frame is sent early.
const MAX_BUFFERED: usize = 1 << 18;

impl Sender {
    /// Creates a sender with an empty set. The epoch must differ at each start of the robot.
    ///
    /// # Errors
    ///
    /// An invalid configuration.
    pub fn new(grid: Grid, epoch: u32, config: SenderConfig) -> Result<Self> {
        Self::with_set(VoxelSet::new(grid), epoch, config)
    }

    /// Creates a sender of an existing set, which receivers fetch by requests.
    ///
    /// # Errors
    ///
    /// An invalid configuration.
    pub fn with_set(set: VoxelSet, epoch: u32, config: SenderConfig) -> Result<Self> {
        if !(256..=60_000).contains(&config.max_packet_bytes) {
            let reason = format!("{} bytes; use 256 to 60000 bytes", config.max_packet_bytes);
            return Err(Error::argument("packet size", reason));
        }
        if config.ring_packets == 0
            || config.packets_per_answer == 0
            || config.policy == ExportPolicy::Ring(0)
        {
            return Err(Error::argument("ring, packets per answer", "0 is too small; use at least 1"));
        }
        Ok(Self {
            ring: Ring::new(config.ring_packets),
            config,
            epoch,
            current: set.clone(),
            sent: set,
            send_buffer: SendBuffer::default(),
            counts: SenderCounts::default(),
            next_status: Duration::ZERO,
            status_sequence: None,
            voxels_per_packet: 1000,
            token_bucket: TokenBucket::default(),
        })
    }

    /// Returns the grid of the set.
    pub fn grid(&self) -> &Grid {
        self.sent.grid()
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> SenderCounts {
        self.counts
    }

    /// Returns the set as sent: the layer of a receiver that has every packet.
    pub fn sent(&mut self) -> &mut VoxelSet {
        &mut self.sent
    }

    /// Returns whether no changes are buffered for a frame.
    pub fn is_idle(&self) -> bool {
        self.send_buffer.is_empty()
    }

    /// Returns whether a voxel is in the set.
    pub fn contains(&self, voxel: VoxelIndex) -> bool {
        self.current.contains(voxel)
    }

    /// Adds a voxel to the set or removes it.
    pub fn put(&mut self, voxel: VoxelIndex, is_in: bool) {
        if self.current.put(voxel, is_in) {
            self.send_buffer.put(voxel, is_in, self.sent.contains(voxel));
        }
    }

    /// Replaces the voxels of a brick in a tile.
    pub fn put_brick(&mut self, tile: TileIndex, brick: BrickCode, mask: BrickMask) {
        let before = self.current.brick(tile, brick);
        if before == mask {
            return;
        }
        let sent = self.sent.brick(tile, brick);
        let min = self.grid().voxels_of_tile(tile).min;
        for place in places(std::array::from_fn(|k| before[k] ^ mask[k])) {
            let voxel = brick.voxel(place).to_key().to_index_from(min);
            self.send_buffer.put(voxel, is_in_mask(&mask, place), is_in_mask(&sent, place));
        }
        self.current.put_brick(tile, brick, mask);
    }

    /// Returns the packets to send now: a frame and a status, if they are due.
    pub fn poll(&mut self, now: Duration) -> Vec<Outgoing> {
        let waited = self.send_buffer.waited(now);
        let is_due = !self.send_buffer.is_empty()
            && (waited >= self.config.latency || self.send_buffer.len() >= MAX_BUFFERED);
        let mut out = if is_due { self.frame() } else { Vec::new() };
        let is_quiet = self.status_sequence == Some(self.last_sequence());
        if now >= self.next_status || (is_quiet && !out.is_empty()) {
            let status = self.status(0);
            self.counts.status_bytes += status.len() as u64;
            out.push(Outgoing { to: None, bytes: status });
            let factor = if is_quiet && out.len() == 1 { 4 } else { 1 };
            self.next_status = now + self.config.status_interval * factor;
            self.status_sequence = Some(self.last_sequence());
        }
        out
    }

    /// Returns packets with all buffered changes and a status, without waiting. Use it before a sender ends.
    pub fn flush(&mut self, now: Duration) -> Vec<Outgoing> {
        let mut out = if self.send_buffer.is_empty() { Vec::new() } else { self.frame() };
        self.next_status = now;
        out.extend(self.poll(now));
        out
    }

    /// Returns epoch and number of the last packet of changes; the number is 0 before the first packet. A receiver that
    /// has everything returns the same from [`Receiver::equal_as_of`](super::Receiver::equal_as_of).
    pub fn last_packet(&self) -> (u32, u64) {
        (self.epoch, self.last_sequence())
    }

    /// Returns the number of the last packet of changes; 0 before the first packet.
    fn last_sequence(&self) -> u64 {
        self.ring.next() - 1
    }

    pub(super) fn header(&self) -> Header {
        Header { epoch: self.epoch, sequence: self.last_sequence() }
    }

    pub(super) fn status(&mut self, nonce: u64) -> Vec<u8> {
        let grid = *self.grid();
        let status = Status {
            header: self.header(),
            nonce,
            oldest: self.ring.oldest(),
            resolution_m: grid.resolution_m(),
            tile_size_m: grid.tile_size_m(),
            voxels: self.sent.len(),
            digest: self.sent.digest().to_bytes(),
        };
        // Cannot fail: a status has no voxels.
        Packet::Status(status).encode().unwrap_or_default()
    }

    fn frame(&mut self) -> Vec<Outgoing> {
        let (changed, resent, repaired) = self.send_buffer.take();
        let has_changes = !changed.is_empty();
        for (&voxel, &is_in) in &changed {
            self.sent.put(voxel, is_in);
        }
        let mut voxels: Vec<VoxelIndex> = changed.into_keys().chain(resent.iter().copied()).collect();
        self.counts.updates_again += resent.len() as u64;
        match self.config.policy {
            // A frame with only repairs gets no other voxels. Otherwise, each time that a repair is lost, the next
            // repair would be larger.
            _ if !has_changes => {}
            ExportPolicy::LastFrame => {}
            ExportPolicy::Ring(frames) => voxels.extend(self.ring.last_frames(frames - 1)),
            ExportPolicy::Everything => voxels.extend(self.sent.iter()),
        }
        self.counts.frames += 1;
        self.ring.begin_frame();
        self.packets_of(voxels, &repaired)
    }

    /// Encodes the current state of voxels in as many packets as needed. Voxels that are close together share a packet.
    fn packets_of(&mut self, mut voxels: Vec<VoxelIndex>, repaired: &[u64]) -> Vec<Outgoing> {
        voxels.sort_by_cached_key(|&voxel| morton_position(voxel));
        voxels.dedup();
        let updates: Vec<Update> =
            voxels.iter().map(|&voxel| Update { voxel, is_in: self.sent.contains(voxel) }).collect();
        let mut rest = updates.as_slice();
        let mut out = Vec::new();
        while !rest.is_empty() {
            let header = Header { epoch: self.epoch, sequence: self.ring.next() };
            let repaired = repaired.to_vec();
            let packet = |updates: &[Update]| Packet::Changes {
                header,
                repaired: repaired.clone(),
                updates: updates.to_vec(),
            };
            let (bytes, taken) = self.fit(rest, packet);
            self.ring.push(rest[..taken].iter().map(|update| update.voxel).collect());
            rest = &rest[taken..];
            self.counts.packets += 1;
            self.counts.packet_bytes += bytes.len() as u64;
            self.counts.updates += taken as u64;
            out.push(Outgoing { to: None, bytes });
        }
        out
    }

    /// Encodes a packet with as many items as fit, at least one. Returns the packet and the number of items.
    pub(super) fn fit<T>(&mut self, items: &[T], packet: impl Fn(&[T]) -> Packet) -> (Vec<u8>, usize) {
        let limit = self.config.max_packet_bytes;
        let mut count = self.voxels_per_packet.clamp(1, MAX_VOXELS_PER_PACKET).min(items.len());
        loop {
            match packet(&items[..count]).encode() {
                Ok(bytes) if bytes.len() <= limit || count <= 1 => {
                    // Estimate for the next packet: the number of items that would have filled this one.
                    self.voxels_per_packet =
                        (count * (limit - limit / 64) / bytes.len().max(limit / 8)).max(1);
                    return (bytes, count);
                }
                Ok(bytes) => count = (count * (limit - limit / 64) / bytes.len()).clamp(1, count - 1),
                // The items are too far apart for one packet. A single item fails only at the end of the index range.
                Err(_) if count > 1 => count /= 2,
                Err(_) => return (Vec::new(), 1),
            }
        }
    }
}

/// Returns the position of a voxel on the Morton curve through all voxel indices.
fn morton_position(voxel: VoxelIndex) -> (u64, u64) {
    let part = |shift: u32| {
        let [x, y, z] = voxel.map(|k| ((k as u32 ^ 1 << 31) >> shift) as u16);
        VoxelKey([x, y, z]).morton().0
    };
    (part(16), part(0))
}
