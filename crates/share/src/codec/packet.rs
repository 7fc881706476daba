use super::bytes::{Reader, put_number, put_signed};
use super::voxel_tree::{Update, decode_updates, encode_updates};
use crate::set_range::{SetPosition, SetRange};
use voxtile::space::{TileIndex, VoxelIndex};
use voxtile::{FormatError, Result};

/// Version of the format: the first byte of every packet and request. Other versions are refused.
pub const VERSION: u8 = 1;

/// A packet from a sender to receivers.
#[derive(Clone, Debug, PartialEq)]
pub enum Packet {
    /// Voxels that were added to or removed from the set.
    Changes {
        /// Epoch and sequence number.
        header: Header,
        /// Earlier packets that this packet's frame repairs: the frame has the current state of their voxels.
        repaired: Vec<u64>,
        /// The updates, one per voxel.
        updates: Vec<Update>,
    },
    /// All voxels in a range of the set.
    Content {
        /// Epoch, and the last packet of changes that is included.
        header: Header,
        /// The range.
        range: SetRange,
        /// The voxels, without duplicates.
        voxels: Vec<VoxelIndex>,
    },
    /// Digests of consecutive tiles.
    Digests {
        /// Epoch, and the last packet of changes that is included.
        header: Header,
        /// First tile of the first entry.
        first: TileIndex,
        /// Consecutive entries.
        entries: Vec<DigestEntry>,
    },
    /// The sender's status.
    Status(Status),
}

/// Epoch of the sender and a packet number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Epoch of the sender, which differs for each start.
    pub epoch: u32,
    /// For changes, the number of the packet, from 1. For other packets, the number of the last packet of changes.
    pub sequence: u64,
}

/// Digest of consecutive tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DigestEntry {
    /// Last tile. The first tile follows the last tile of the previous entry.
    pub last: TileIndex,
    /// Number of voxels in these tiles.
    pub voxels: u64,
    /// The first eight bytes of BLAKE3 over these tiles' indices and digests.
    pub digest: [u8; 8],
}

/// The status of a sender.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// Epoch, and the last packet of changes that is included.
    pub header: Header,
    /// Nonce of the request; 0 without a request.
    pub nonce: u64,
    /// Number of the first packet that can still be repaired.
    pub oldest: u64,
    /// Edge of a voxel in metres.
    pub resolution_m: f64,
    /// Edge of a tile in metres.
    pub tile_size_m: f64,
    /// Number of voxels in the set.
    pub voxels: u64,
    /// Digest of the set.
    pub digest: [u8; 32],
}

const CHANGES: u8 = 1;
const CONTENT: u8 = 2;
const DIGESTS: u8 = 3;
const STATUS: u8 = 4;

/// Maximum number of repaired packets that one packet lists.
pub(crate) const MAX_REPAIRED: usize = 256;

impl Packet {
    /// Encodes the packet.
    ///
    /// # Errors
    ///
    /// Too many voxels, or voxels too far apart, for one packet.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let mut bytes = vec![VERSION];
        match self {
            Self::Changes { header, repaired, updates } => {
                put_header(&mut bytes, CHANGES, *header);
                put_number(&mut bytes, repaired.len() as u64);
                repaired
                    .iter()
                    .for_each(|&number| put_number(&mut bytes, header.sequence.wrapping_sub(number)));
                bytes.extend(encode_updates(updates)?);
            }
            Self::Content { header, range, voxels } => {
                put_header(&mut bytes, CONTENT, *header);
                put_range(&mut bytes, *range);
                let updates: Vec<Update> =
                    voxels.iter().map(|&voxel| Update { voxel, is_in: true }).collect();
                bytes.extend(encode_updates(&updates)?);
            }
            Self::Digests { header, first, entries } => {
                put_header(&mut bytes, DIGESTS, *header);
                put_tile(&mut bytes, TileIndex::default(), *first);
                let mut before = *first;
                for entry in entries {
                    put_tile(&mut bytes, before, entry.last);
                    put_number(&mut bytes, entry.voxels);
                    bytes.extend(entry.digest);
                    before = entry.last;
                }
            }
            Self::Status(status) => put_status(&mut bytes, status),
        }
        seal(&mut bytes);
        Ok(bytes)
    }

    /// Decodes a packet.
    ///
    /// # Errors
    ///
    /// Another version, or bytes that are damaged or not a valid packet.
    pub fn decode(bytes: &[u8]) -> std::result::Result<Self, FormatError> {
        let mut reader = unseal(bytes)?;
        let kind = reader.byte()?;
        let header = Header { epoch: u32::from_le_bytes(reader.array()?), sequence: reader.number()? };
        match kind {
            CHANGES => read_changes(&mut reader, header),
            CONTENT => read_content(&mut reader, header),
            DIGESTS => read_digests(&mut reader, header),
            STATUS => read_status(&mut reader, header),
            other => Err(reader.error(format!("unknown packet kind {other}"))),
        }
    }

    /// Returns the epoch and the packet number.
    pub fn header(&self) -> Header {
        match self {
            Self::Changes { header, .. } | Self::Content { header, .. } | Self::Digests { header, .. } => {
                *header
            }
            Self::Status(status) => status.header,
        }
    }
}

/// Appends the checksum.
pub(super) fn seal(bytes: &mut Vec<u8>) {
    bytes.extend(crc32fast::hash(bytes).to_le_bytes());
}

/// Checks version and checksum. Returns a reader of the bytes between them.
pub(super) fn unseal(bytes: &[u8]) -> std::result::Result<Reader<'_>, FormatError> {
    let Some((content, checksum)) = bytes.split_last_chunk::<4>() else {
        return Err(FormatError::at_offset(0, "the packet is too short"));
    };
    // Check the version first: another version may have its checksum elsewhere.
    match content.first() {
        Some(&VERSION) => {}
        Some(other) => {
            let reason =
                format!("packet version {other} is not supported; this program uses version {VERSION}");
            return Err(FormatError::at_offset(0, reason));
        }
        None => return Err(FormatError::at_offset(0, "the packet is too short")),
    }
    if crc32fast::hash(content).to_le_bytes() != *checksum {
        return Err(FormatError::at_offset(content.len() as u64, "the checksum is wrong"));
    }
    Ok(Reader::new(&content[1..], 1))
}

fn put_header(bytes: &mut Vec<u8>, kind: u8, header: Header) {
    bytes.push(kind);
    bytes.extend(header.epoch.to_le_bytes());
    put_number(bytes, header.sequence);
}

/// Writes a tile index as the difference from another index.
fn put_tile(bytes: &mut Vec<u8>, before: TileIndex, tile: TileIndex) {
    for (before, k) in before.to_array().into_iter().zip(tile.to_array()) {
        put_signed(bytes, i64::from(k) - i64::from(before));
    }
}

fn read_tile(reader: &mut Reader<'_>, before: TileIndex) -> std::result::Result<TileIndex, FormatError> {
    let mut tile = before.to_array();
    for k in &mut tile {
        let number = i64::from(*k).checked_add(reader.signed()?);
        let index = number.and_then(|number| i32::try_from(number).ok());
        *k = index.ok_or_else(|| reader.error("a tile index of more than 32 bits"))?;
    }
    Ok(tile.into())
}

pub(super) fn put_range(bytes: &mut Vec<u8>, range: SetRange) {
    put_tile(bytes, TileIndex::default(), range.first.tile);
    put_number(bytes, range.first.code);
    put_tile(bytes, range.first.tile, range.last.tile);
    // Stored as the distance from the last code of a tile: most ranges end there, and 0 takes one byte.
    put_number(bytes, super::super::set_range::LAST_CODE - range.last.code);
}

pub(super) fn read_range(reader: &mut Reader<'_>) -> std::result::Result<SetRange, FormatError> {
    let first = SetPosition { tile: read_tile(reader, TileIndex::default())?, code: reader.number()? };
    let tile = read_tile(reader, first.tile)?;
    let code = super::super::set_range::LAST_CODE.checked_sub(reader.number()?);
    let code = code.ok_or_else(|| reader.error("a code of more than 48 bits"))?;
    let range = SetRange { first, last: SetPosition { tile, code } };
    if !range.is_valid() {
        return Err(reader.error("a range that ends before it begins"));
    }
    Ok(range)
}

fn read_changes(reader: &mut Reader<'_>, header: Header) -> std::result::Result<Packet, FormatError> {
    if header.sequence == 0 {
        return Err(reader.error("the packet has number 0; packets of changes are numbered from 1"));
    }
    let count = reader.number()?;
    if count > MAX_REPAIRED as u64 {
        return Err(reader.error(format!("{count} repaired packets; the maximum is {MAX_REPAIRED}")));
    }
    let mut repaired = Vec::new();
    for _ in 0..count {
        let number = header.sequence.checked_sub(reader.number()?);
        repaired.push(number.ok_or_else(|| reader.error("a repaired packet before the first"))?);
    }
    let updates = decode_updates(reader.rest(), reader.offset())?;
    Ok(Packet::Changes { header, repaired, updates })
}

fn read_content(reader: &mut Reader<'_>, header: Header) -> std::result::Result<Packet, FormatError> {
    let range = read_range(reader)?;
    let updates = decode_updates(reader.rest(), reader.offset())?;
    if updates.iter().any(|update| !update.is_in) {
        return Err(reader.error("a packet of content removes voxels"));
    }
    Ok(Packet::Content { header, range, voxels: updates.into_iter().map(|update| update.voxel).collect() })
}

fn read_digests(reader: &mut Reader<'_>, header: Header) -> std::result::Result<Packet, FormatError> {
    let first = read_tile(reader, TileIndex::default())?;
    let (mut before, mut entries) = (first, Vec::<DigestEntry>::new());
    while !reader.rest().is_empty() {
        let last = read_tile(reader, before)?;
        if last < before || (last == before && !entries.is_empty()) {
            return Err(reader.error("the tiles of the digests are not in order"));
        }
        entries.push(DigestEntry { last, voxels: reader.number()?, digest: reader.array()? });
        before = last;
    }
    Ok(Packet::Digests { header, first, entries })
}

fn put_status(bytes: &mut Vec<u8>, status: &Status) {
    put_header(bytes, STATUS, status.header);
    bytes.extend(status.nonce.to_le_bytes());
    put_number(bytes, status.oldest);
    bytes.extend(status.resolution_m.to_bits().to_le_bytes());
    bytes.extend(status.tile_size_m.to_bits().to_le_bytes());
    put_number(bytes, status.voxels);
    bytes.extend(status.digest);
}

fn read_status(reader: &mut Reader<'_>, header: Header) -> std::result::Result<Packet, FormatError> {
    let nonce = u64::from_le_bytes(reader.array()?);
    let oldest = reader.number()?;
    let mut length = || reader.array().map(|bits| f64::from_bits(u64::from_le_bytes(bits)));
    let (resolution_m, tile_size_m) = (length()?, length()?);
    let (voxels, digest) = (reader.number()?, reader.array()?);
    reader.end()?;
    Ok(Packet::Status(Status { header, nonce, oldest, resolution_m, tile_size_m, voxels, digest }))
}
