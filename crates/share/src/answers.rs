use super::codec::{DigestEntry, Packet, Request};
use super::sender::{Outgoing, ReceiverId, Sender};
use super::set_range::SetRange;
use std::time::Duration;
use voxtile::FormatError;
use voxtile::space::{TileIndex, VoxelIndex};

/// Largest number of tiles in a range for which each tile gets its own digest.
const MAX_SINGLE_TILES: usize = 1024;
/// Number of digests for a range with more than [`MAX_SINGLE_TILES`] tiles.
const GROUPS: usize = 64;
/// The rate limit counts this many tiles of a digest as one byte, because a short answer may need the digests of many
/// tiles.
const TILES_PER_BYTE: usize = 4;

impl Sender {
    /// Answers a receiver's request.
    ///
    /// # Errors
    ///
    /// Bytes that are not a valid request; the sender is unchanged.
    pub fn answer(
        &mut self,
        from: ReceiverId,
        request: &[u8],
        now: Duration,
    ) -> Result<Vec<Outgoing>, FormatError> {
        let request = Request::decode(request)?;
        self.counts.asks += 1;
        if !self.token_bucket.refill(self.config.answer_bytes_per_s, now) {
            self.counts.refused_asks += 1;
            return Ok(Vec::new());
        }
        let epoch = self.header().epoch;
        let packets = match request {
            Request::Status { nonce } => vec![self.status(nonce)],
            Request::Missing { epoch: requested, sequences } if requested == epoch => self.repair(&sequences),
            Request::Digests { epoch: requested, range } if requested == epoch => self.digests(range),
            Request::Content { epoch: requested, ranges } if requested == epoch => self.content(&ranges),
            // The request refers to an earlier epoch of the sender.
            _ => vec![self.status(0)],
        };
        let bytes = packets.iter().map(|packet| packet.len() as u64).sum();
        self.token_bucket.spend(bytes);
        self.counts.answer_bytes += bytes;
        Ok(packets.into_iter().map(|bytes| Outgoing { to: Some(from), bytes }).collect())
    }

    /// Adds the voxels of lost packets to the next frame. Returns a status if some packets cannot be repaired.
    fn repair(&mut self, sequences: &[u64]) -> Vec<Vec<u8>> {
        let mut is_known = true;
        for &sequence in sequences {
            match self.ring.get(sequence) {
                Some(voxels) => self.send_buffer.repair(sequence, voxels),
                None => is_known = false,
            }
        }
        if is_known { Vec::new() } else { vec![self.status(0)] }
    }

    fn digests(&mut self, range: SetRange) -> Vec<Vec<u8>> {
        let (mut first, last) = (range.first.tile, range.last.tile);
        let tiles = self.sent.tiles_between(first, last);
        self.token_bucket.spend((tiles.len() / TILES_PER_BYTE) as u64);
        let group = if tiles.len() <= MAX_SINGLE_TILES { 1 } else { tiles.len().div_ceil(GROUPS) };
        let mut entries = Vec::new();
        let mut begin = first;
        let groups: Vec<&[TileIndex]> = tiles.chunks(group).collect();
        for (number, group) in groups.iter().enumerate() {
            // The last entry ends at the end of the range, the others end at their last tile.
            let end = group.last().filter(|_| number + 1 < groups.len()).copied().unwrap_or(last);
            entries.push(self.entry(begin, end));
            begin = after(end);
        }
        if entries.is_empty() {
            entries.push(self.entry(first, last));
        }
        // An entry takes 13 to 32 bytes, and the other parts of a packet at most 64.
        let per_packet = (self.config.max_packet_bytes - 64) / 32;
        let header = self.header();
        let mut packets = Vec::new();
        for entries in entries.chunks(per_packet.max(1)).take(4 * self.config.packets_per_answer) {
            let packet = Packet::Digests { header, first, entries: entries.to_vec() };
            packets.extend(packet.encode());
            first = entries.last().map_or(first, |entry| after(entry.last));
        }
        packets
    }

    fn entry(&mut self, first: TileIndex, last: TileIndex) -> DigestEntry {
        let (voxels, digest) = self.sent.short_digest(first, last);
        DigestEntry { last, voxels, digest }
    }

    fn content(&mut self, ranges: &[SetRange]) -> Vec<Vec<u8>> {
        let header = self.header();
        let mut packets = Vec::new();
        for &range in ranges {
            let mut range = range;
            loop {
                if packets.len() >= self.config.packets_per_answer {
                    return packets;
                }
                // Read one voxel more than fits into a packet, to detect whether more voxels follow.
                let limit = super::codec::MAX_VOXELS_PER_PACKET + 1;
                let voxels: Vec<VoxelIndex> = self.sent.in_range(range).take(limit).collect();
                let grid = *self.grid();
                let end_of = |taken: &[VoxelIndex]| match taken.last() {
                    Some(&last) if taken.len() < voxels.len() => super::set::position_of(&grid, last),
                    _ => range.last,
                };
                let packet = |taken: &[VoxelIndex]| {
                    let range = SetRange { first: range.first, last: end_of(taken) };
                    Packet::Content { header, range, voxels: taken.to_vec() }
                };
                let (bytes, taken) = match voxels.is_empty() {
                    true => (packet(&[]).encode().unwrap_or_default(), 0),
                    false => self.fit(&voxels, packet),
                };
                packets.push(bytes);
                if taken == voxels.len() {
                    break;
                }
                range.first = super::set::position_of(&grid, voxels[taken - 1]).next();
            }
        }
        packets
    }
}

/// Returns the next tile in the order of a set.
pub(super) fn after(tile: TileIndex) -> TileIndex {
    super::set_range::SetPosition { tile, code: super::set_range::LAST_CODE }.next().tile
}
