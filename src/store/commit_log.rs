use super::disk::Disk;
use super::metadata::Metadata;
use super::tile_stamp::{MAX_NUMBER, TileStamp};
use crate::error::{DecodeError, FormatError};
use crate::space::TileIndex;
use rustc_hash::FxHashMap;
use std::io::{self, Read, Write};
use std::path::Path;

/// The append-only record of flushes, `commits.log`. A record that is whole is a commit.
///
/// ```text
/// header  32 bytes  magic "VXTCOMIT", version u32 1, map id 16 bytes, CRC-32 of these
/// record            payload length u32, its complement u32, payload, CRC-32 of the payload
/// payload           kind u32 (bit 0: whole map, else a change; bit 1: tiles were removed), tile count u32,
///                   flush number u64, scan number u64, a tile: index 3 x i32, stamp 48 bytes;
///                   where tiles were removed, their count u32 and the index of each, 3 x i32;
///                   then, where it changed, the text of metadata.json
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommitLog {
    map_id: [u8; 16],
    /// Length of the valid part in bytes: the next record goes here.
    bytes: u64,
}

/// All commits of a log, taken together.
#[derive(Clone, Debug, Default)]
pub struct Commits {
    /// Number of the last flush; 0 before the first.
    pub flush_number: u64,
    /// Number of the last scan in the last flush; 0 before the first.
    pub scan_number: u64,
    /// Every tile of the map.
    pub tiles: FxHashMap<TileIndex, TileStamp>,
    /// The tiles that the last record names.
    pub last_changed: Vec<TileIndex>,
    /// The tiles that the last record takes out of the map: their files may still be there.
    pub last_removed: Vec<TileIndex>,
    /// The last metadata in the log: its parameters are the map's, its bounds and numbers may be older ones.
    pub metadata: Option<Metadata>,
    /// What is wrong with the end of the log, where a flush may have been cut short: it never happened, unless
    /// something else names it.
    pub torn: Option<FormatError>,
}

/// A flush to be appended to a log.
#[derive(Clone, Copy, Debug)]
pub struct Flush<'a> {
    /// Its number.
    pub number: u64,
    /// Number of the last scan in it.
    pub scan_number: u64,
    /// The tiles that changed.
    pub changed: &'a [(TileIndex, TileStamp)],
    /// The tiles that are no part of the map any more.
    pub removed: &'a [TileIndex],
    /// The text of `metadata.json`, if more of it changed than every flush changes.
    pub metadata_text: Option<&'a str>,
}

const MAGIC: &[u8; 8] = b"VXTCOMIT";
const VERSION: u32 = 1;
const HEADER_BYTES: usize = 32;
const PAYLOAD_HEADER_BYTES: usize = 24;
const INDEX_BYTES: usize = 12;
const TILE_BYTES: usize = INDEX_BYTES + TileStamp::BYTES;
/// Bits of a record's kind.
const WHOLE_MAP: u32 = 1;
const NAMES_REMOVED: u32 = 2;

impl CommitLog {
    /// The log of a map of which nothing is written yet.
    pub(super) fn of_map(map_id: [u8; 16]) -> Self {
        Self { map_id, bytes: 0 }
    }

    /// Length of the valid part in bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The map that the log belongs to.
    pub fn map_id(&self) -> [u8; 16] {
        self.map_id
    }

    /// Writes a log with one record of the whole map, synced, in place of nothing or of a temporary name.
    pub fn write_whole(
        disk: &dyn Disk,
        path: &Path,
        map_id: [u8; 16],
        commits: &Commits,
        metadata_text: &str,
    ) -> io::Result<Self> {
        let mut tiles: Vec<_> = commits.tiles.iter().map(|(&tile, &stamp)| (tile, stamp)).collect();
        tiles.sort_unstable_by_key(|&(tile, _)| tile);
        let (number, scan_number) = (commits.flush_number, commits.scan_number);
        let (removed, metadata_text) = (&*commits.last_removed, Some(metadata_text));
        let whole = Flush { number, scan_number, changed: &tiles, removed, metadata_text };
        let mut bytes = header(map_id).to_vec();
        bytes.extend(record(WHOLE_MAP, &whole)?);
        let mut out = disk.create(path)?;
        out.write_all(&bytes)?;
        out.sync()?;
        Ok(Self { map_id, bytes: bytes.len() as u64 })
    }

    /// Appends a record of changed and removed tiles and syncs it: when this returns, the flush is committed. After an error
    /// the record may be in the file or not, until [`CommitLog::cut`] has taken it out.
    pub fn append(&mut self, disk: &dyn Disk, path: &Path, flush: &Flush<'_>) -> io::Result<()> {
        let record = record(0, flush)?;
        let mut out = disk.append(path, self.bytes)?;
        out.write_all(&record)?;
        out.sync()?;
        self.bytes += record.len() as u64;
        Ok(())
    }

    /// Cuts off what a failed attempt may have left behind the valid part, durably.
    pub fn cut(&self, disk: &dyn Disk, path: &Path) -> io::Result<()> {
        disk.append(path, self.bytes)?.sync()
    }

    /// Reads a log of `file_bytes` bytes. An incomplete record at the end is a flush that never happened and is left
    /// out.
    ///
    /// # Errors
    ///
    /// A wrong header, or a record that is complete and does not match its checksum.
    pub fn read(input: &mut impl Read, file_bytes: u64) -> Result<(Self, Commits), DecodeError> {
        let mut commits = Commits::default();
        let log = commits.read_from(input, file_bytes)?;
        Ok((log, commits))
    }
}

impl Commits {
    /// Takes in the records of a log. After an error, those before the damage have been taken in.
    ///
    /// # Errors
    ///
    /// As for [`CommitLog::read`].
    pub fn read_from(&mut self, input: &mut impl Read, file_bytes: u64) -> Result<CommitLog, DecodeError> {
        let map_id = read_header(input, file_bytes)?;
        let mut bytes = HEADER_BYTES as u64;
        loop {
            match read_record(input, bytes, file_bytes)? {
                Next::Record(payload) => {
                    self.take(&payload, bytes + 8)?;
                    bytes += payload.len() as u64 + 12;
                }
                Next::Torn(error) => {
                    self.torn = Some(error);
                    break;
                }
                Next::End => break,
            }
        }
        Ok(CommitLog { map_id, bytes })
    }

    fn take(&mut self, payload: &[u8], offset: u64) -> Result<(), FormatError> {
        let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| payload[at + k]));
        let u64_at = |at: usize| u64::from_le_bytes(std::array::from_fn(|k| payload[at + k]));
        let wrong = |at: u64, reason: &str| Err(FormatError::at_offset(offset + at, reason));
        if payload.len() < PAYLOAD_HEADER_BYTES {
            return wrong(0, "the record is too short");
        }
        let tiles_bytes = u64::from(u32_at(4)) * TILE_BYTES as u64;
        if tiles_bytes > (payload.len() - PAYLOAD_HEADER_BYTES) as u64 {
            return wrong(4, "the number of tiles does not fit the record");
        }
        let (tiles, rest) = payload[PAYLOAD_HEADER_BYTES..].split_at(tiles_bytes as usize);
        let kind = u32_at(0);
        if kind & !(WHOLE_MAP | NAMES_REMOVED) != 0 {
            return wrong(0, "a record of unknown kind");
        }
        let at = PAYLOAD_HEADER_BYTES as u64 + tiles_bytes;
        let Some((removed, text)) = split_removed(kind, rest) else {
            return wrong(at, "the number of removed tiles does not fit the record");
        };
        if kind & WHOLE_MAP != 0 {
            self.tiles.clear();
        }
        if u64_at(8) > MAX_NUMBER || u64_at(16) > MAX_NUMBER {
            return wrong(8, "flush or scan number is too high to be true");
        }
        if u64_at(8) < self.flush_number {
            return wrong(8, "the flush number is lower than in the record before");
        }
        self.flush_number = u64_at(8);
        self.scan_number = u64_at(16);
        self.last_changed.clear();
        if !text.is_empty() {
            let at = (payload.len() - text.len()) as u64;
            let text = std::str::from_utf8(text);
            match text.ok().and_then(|text| Metadata::from_text(text).ok()) {
                Some(metadata) => self.metadata = Some(metadata),
                None => return wrong(at, "the metadata in the record cannot be read"),
            }
        }
        for (number, tile) in (0..).zip(tiles.chunks_exact(TILE_BYTES)) {
            let index = index_from(tile);
            let Some(stamp) = TileStamp::from_bytes(&std::array::from_fn(|k| tile[INDEX_BYTES + k])) else {
                let at = (PAYLOAD_HEADER_BYTES + TILE_BYTES * number) as u64;
                return wrong(at, "numbers that no tile has");
            };
            self.tiles.insert(index, stamp);
            self.last_changed.push(index);
        }
        self.last_removed = removed.chunks_exact(INDEX_BYTES).map(index_from).collect();
        for tile in &self.last_removed {
            self.tiles.remove(tile);
        }
        Ok(())
    }
}

/// The indices of removed tiles, and what stands behind them; `None` if there are fewer than announced.
fn split_removed(kind: u32, bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    if kind & NAMES_REMOVED == 0 {
        return Some((&[], bytes));
    }
    let (count, bytes) = bytes.split_first_chunk()?;
    let removed_bytes = u64::from(u32::from_le_bytes(*count)) * INDEX_BYTES as u64;
    bytes.split_at_checked(usize::try_from(removed_bytes).ok()?)
}

fn index_from(bytes: &[u8]) -> TileIndex {
    let index = |axis: usize| i32::from_le_bytes(std::array::from_fn(|k| bytes[4 * axis + k]));
    TileIndex::new(index(0), index(1), index(2))
}

fn header(map_id: [u8; 16]) -> [u8; HEADER_BYTES] {
    let mut bytes = [0; HEADER_BYTES];
    bytes[0..8].copy_from_slice(MAGIC);
    bytes[8..12].copy_from_slice(&VERSION.to_le_bytes());
    bytes[12..28].copy_from_slice(&map_id);
    let crc = crc32fast::hash(&bytes[..28]);
    bytes[28..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

fn record(kind: u32, flush: &Flush<'_>) -> io::Result<Vec<u8>> {
    let text = flush.metadata_text.unwrap_or_default();
    let kind = if flush.removed.is_empty() { kind } else { kind | NAMES_REMOVED };
    let removed_bytes = if flush.removed.is_empty() { 0 } else { 4 + flush.removed.len() * INDEX_BYTES };
    let payload_bytes = PAYLOAD_HEADER_BYTES + flush.changed.len() * TILE_BYTES + removed_bytes + text.len();
    let Ok(payload_bytes) = u32::try_from(payload_bytes) else {
        return Err(io::Error::other("more tiles than one record of the log can name"));
    };
    let mut bytes = Vec::with_capacity(payload_bytes as usize + 12);
    bytes.extend_from_slice(&payload_bytes.to_le_bytes());
    bytes.extend_from_slice(&(!payload_bytes).to_le_bytes());
    bytes.extend_from_slice(&kind.to_le_bytes());
    bytes.extend_from_slice(&(flush.changed.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&flush.number.to_le_bytes());
    bytes.extend_from_slice(&flush.scan_number.to_le_bytes());
    let put_index = |bytes: &mut Vec<u8>, tile: TileIndex| {
        tile.to_array().iter().for_each(|index| bytes.extend_from_slice(&index.to_le_bytes()));
    };
    for (tile, stamp) in flush.changed {
        put_index(&mut bytes, *tile);
        bytes.extend_from_slice(&stamp.to_bytes());
    }
    if !flush.removed.is_empty() {
        bytes.extend_from_slice(&(flush.removed.len() as u32).to_le_bytes());
        flush.removed.iter().for_each(|tile| put_index(&mut bytes, *tile));
    }
    bytes.extend_from_slice(text.as_bytes());
    let crc = crc32fast::hash(&bytes[8..]);
    bytes.extend_from_slice(&crc.to_le_bytes());
    Ok(bytes)
}

fn read_header(input: &mut impl Read, file_bytes: u64) -> Result<[u8; 16], DecodeError> {
    let mut bytes = [0; HEADER_BYTES];
    if file_bytes < HEADER_BYTES as u64 {
        return Err(FormatError::at_offset(0, "too short for the header of a commit log").into());
    }
    input.read_exact(&mut bytes)?;
    let map_id = std::array::from_fn(|k| bytes[12 + k]);
    if bytes != header(map_id) {
        return Err(FormatError::at_offset(0, "not the header of a commit log of version 1").into());
    }
    Ok(map_id)
}

/// What stands where a record may begin.
enum Next {
    Record(Vec<u8>),
    End,
    /// Something that is no whole record, with nothing behind it.
    Torn(FormatError),
}

fn read_record(input: &mut impl Read, offset: u64, file_bytes: u64) -> Result<Next, DecodeError> {
    let wrong = |reason| FormatError::at_offset(offset, reason);
    let remaining = file_bytes - offset;
    if remaining < 8 {
        return Ok(if remaining == 0 { Next::End } else { Next::Torn(wrong("the record is not whole")) });
    }
    let mut lengths = [0; 8];
    input.read_exact(&mut lengths)?;
    let length = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| lengths[at + k]));
    if length(0) != !length(4) {
        return Ok(Next::Torn(wrong("the length of the record does not match its complement")));
    }
    let payload_bytes = u64::from(length(0));
    if remaining < payload_bytes + 12 {
        return Ok(Next::Torn(wrong("the record is longer than what is left of the file")));
    }
    // The length is within the file's, which bounds the allocation.
    let mut payload = vec![0; payload_bytes as usize];
    input.read_exact(&mut payload)?;
    let mut crc = [0; 4];
    input.read_exact(&mut crc)?;
    if u32::from_le_bytes(crc) == crc32fast::hash(&payload) {
        return Ok(Next::Record(payload));
    }
    let error = wrong("the record does not match its checksum");
    // A crash tears only the last record: its length can come to disk before its content.
    if remaining == payload_bytes + 12 { Ok(Next::Torn(error)) } else { Err(error.into()) }
}
