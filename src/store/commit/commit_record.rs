use super::commits::Commits;
use super::metadata::Metadata;
use crate::error::{DecodeError, FormatError};
use crate::space::{TileIndex, TileTable};
use crate::store::scans::CatalogVersion;
use crate::store::tiles::file_checksum::Checksumming;
use crate::store::tiles::tile_version::{MAX_NUMBER, TileVersion};
use std::io::{self, Read, Write};

/// Flush to be appended to a log.
#[derive(Clone, Copy, Debug)]
pub struct Flush<'a> {
    /// Number of the flush.
    pub number: u64,
    /// Number of the last scan in the flush.
    pub scan_number: u64,
    /// Changed tiles.
    pub changed: &'a TileTable<TileVersion>,
    /// Tiles that the flush removes from the map.
    pub removed: &'a [TileIndex],
    /// Catalog of kept scans; `None` if the map does not keep its scans.
    pub catalog: Option<CatalogVersion>,
    /// Text of `metadata.json`, if more changed than the fields that every flush changes.
    pub metadata_text: Option<&'a str>,
}

/// Flush as read from a log.
#[derive(Debug)]
pub(in crate::store) struct Record {
    /// Whether the record lists all tiles of the map.
    pub(in crate::store) is_whole_map: bool,
    pub(in crate::store) flush_number: u64,
    pub(in crate::store) scan_number: u64,
    pub(in crate::store) changed: TileTable<TileVersion>,
    pub(in crate::store) removed: Vec<TileIndex>,
    pub(in crate::store) catalog: Option<CatalogVersion>,
    pub(in crate::store) metadata: Option<Metadata>,
}

/// Content of a log at an offset.
pub(in crate::store) enum Next {
    /// A record with its length in bytes.
    Record(Box<Record>, u64),
    End,
    /// An incomplete record, with nothing after it.
    Torn(FormatError),
}

/// Length of the fields before the payload: its length and the complement.
pub(in crate::store) const LENGTHS_BYTES: u64 = 8;
const CRC_BYTES: u64 = 4;
const PAYLOAD_HEADER_BYTES: usize = 24;
const INDEX_BYTES: usize = 12;
const TILE_BYTES: usize = INDEX_BYTES + TileVersion::BYTES;
/// Bits of a record's kind.
const WHOLE_MAP: u32 = 1;
const NAMES_REMOVED: u32 = 2;
const NAMES_CATALOG: u32 = 4;
/// Bytes written to the file at a time. Records of large maps are too long to buffer as a whole.
const CHUNK_BYTES: usize = 1 << 16;

/// Approximate length of a record of a whole map of `tiles` tiles.
pub(in crate::store) fn whole_map_bytes(tiles: usize) -> u64 {
    (tiles * TILE_BYTES) as u64
}

impl<'a> Flush<'a> {
    pub(in crate::store) fn of_all(commits: &'a Commits, metadata_text: &'a str) -> Self {
        Self {
            number: commits.flush_number,
            scan_number: commits.scan_number,
            changed: &commits.tiles,
            removed: &commits.last_removed,
            catalog: commits.catalog,
            metadata_text: Some(metadata_text),
        }
    }

    /// Writes `front` (the header of a new log, else empty) and then the record. Returns the length of the record in
    /// bytes.
    pub(in crate::store) fn write(
        &self,
        is_whole_map: bool,
        front: &[u8],
        out: &mut dyn Write,
    ) -> io::Result<u64> {
        let text = self.metadata_text.unwrap_or_default();
        let mut kind = if is_whole_map { WHOLE_MAP } else { 0 };
        let mut payload_bytes = PAYLOAD_HEADER_BYTES + self.changed.len() * TILE_BYTES + text.len();
        if !self.removed.is_empty() {
            kind |= NAMES_REMOVED;
            payload_bytes += 4 + self.removed.len() * INDEX_BYTES;
        }
        if self.catalog.is_some() {
            kind |= NAMES_CATALOG;
            payload_bytes += CatalogVersion::BYTES;
        }
        let (Ok(payload_bytes), Ok(changed)) =
            (u32::try_from(payload_bytes), u32::try_from(self.changed.len()))
        else {
            return Err(io::Error::other("more tiles than one record of the log can contain"));
        };
        let mut out = Chunks { out, waiting: front.to_vec(), crc: crc32fast::Hasher::new() };
        out.waiting.extend_from_slice(&payload_bytes.to_le_bytes());
        out.waiting.extend_from_slice(&(!payload_bytes).to_le_bytes());
        out.put(&kind.to_le_bytes())?;
        out.put(&changed.to_le_bytes())?;
        out.put(&self.number.to_le_bytes())?;
        out.put(&self.scan_number.to_le_bytes())?;
        for (tile, version) in self.changed.iter() {
            out.put(&index_bytes(tile))?;
            out.put(&version.to_bytes())?;
        }
        if !self.removed.is_empty() {
            out.put(&(self.removed.len() as u32).to_le_bytes())?;
            self.removed.iter().try_for_each(|tile| out.put(&index_bytes(*tile)))?;
        }
        if let Some(catalog) = self.catalog {
            out.put(&catalog.to_bytes())?;
        }
        out.put(text.as_bytes())?;
        out.finish()?;
        Ok(LENGTHS_BYTES + u64::from(payload_bytes) + CRC_BYTES)
    }
}

/// Buffered writer with a checksum.
struct Chunks<'a> {
    out: &'a mut dyn Write,
    waiting: Vec<u8>,
    crc: crc32fast::Hasher,
}

impl Chunks<'_> {
    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.crc.update(bytes);
        self.waiting.extend_from_slice(bytes);
        if self.waiting.len() < CHUNK_BYTES {
            return Ok(());
        }
        self.out.write_all(&self.waiting)?;
        self.waiting.clear();
        Ok(())
    }

    fn finish(mut self) -> io::Result<()> {
        let crc = self.crc.finalize();
        self.waiting.extend_from_slice(&crc.to_le_bytes());
        self.out.write_all(&self.waiting)
    }
}

impl Next {
    /// Reads the content at `offset` of a log of `file_bytes` bytes.
    pub(in crate::store) fn read(
        input: &mut impl Read,
        offset: u64,
        file_bytes: u64,
    ) -> Result<Self, DecodeError> {
        let wrong = |reason| FormatError::at_offset(offset, reason);
        let remaining = file_bytes - offset;
        if remaining < LENGTHS_BYTES {
            let torn = || Self::Torn(wrong("the record is incomplete"));
            return Ok(if remaining == 0 { Self::End } else { torn() });
        }
        let [length, complement] = [read_u32(input)?, read_u32(input)?];
        if length != !complement {
            return Ok(Self::Torn(wrong("the length of the record does not match its complement")));
        }
        let record_bytes = LENGTHS_BYTES + u64::from(length) + CRC_BYTES;
        if remaining < record_bytes {
            return Ok(Self::Torn(wrong("the record is longer than the rest of the file")));
        }
        let mut payload =
            Payload { input: Checksumming::new(input), left: u64::from(length), at: offset + LENGTHS_BYTES };
        let record = Record::read(&mut payload);
        if let Err(error @ DecodeError::Io(_)) = record {
            return Err(error);
        }
        let (checksum, input) = payload.skip_rest()?;
        if read_u32(input)? == checksum.crc {
            return Ok(Self::Record(Box::new(record?), record_bytes));
        }
        let error = wrong("the record does not match its checksum");
        // Only the last record can be incomplete after a crash: its length may be on the disk without its content.
        if remaining == record_bytes { Ok(Self::Torn(error)) } else { Err(error.into()) }
    }
}

impl Record {
    fn read(payload: &mut Payload<impl Read>) -> Result<Self, DecodeError> {
        if payload.left < PAYLOAD_HEADER_BYTES as u64 {
            return Err(payload.wrong(0, "the record is too short"));
        }
        let kind = u32::from_le_bytes(payload.take()?);
        if kind & !(WHOLE_MAP | NAMES_REMOVED | NAMES_CATALOG) != 0 {
            return Err(payload.wrong(4, "a record of unknown kind"));
        }
        let tiles = u64::from(u32::from_le_bytes(payload.take()?));
        let [flush_number, scan_number] =
            [u64::from_le_bytes(payload.take()?), u64::from_le_bytes(payload.take()?)];
        if flush_number > MAX_NUMBER || scan_number > MAX_NUMBER {
            return Err(payload.wrong(16, "flush or scan number exceeds 2^62"));
        }
        if tiles * TILE_BYTES as u64 > payload.left {
            return Err(payload.wrong(20, "the number of tiles does not fit the record"));
        }
        let changed = (0..tiles).map(|_| {
            let tile = index_from(payload.take()?);
            let version = TileVersion::from_bytes(&payload.take()?);
            let out_of_range = || payload.wrong(TILE_BYTES as u64, "tile sizes or counts out of range");
            Ok((tile, version.ok_or_else(out_of_range)?))
        });
        let changed = changed.collect::<Result<_, DecodeError>>()?;
        let mut removed = Vec::new();
        if kind & NAMES_REMOVED != 0 {
            let does_not_fit = "the number of removed tiles does not fit the record";
            if payload.left < 4 {
                return Err(payload.wrong(0, does_not_fit));
            }
            let count = u64::from(u32::from_le_bytes(payload.take()?));
            if count * INDEX_BYTES as u64 > payload.left {
                return Err(payload.wrong(4, does_not_fit));
            }
            for _ in 0..count {
                removed.push(index_from(payload.take()?));
            }
        }
        let catalog = match kind & NAMES_CATALOG {
            0 => None,
            _ if payload.left < CatalogVersion::BYTES as u64 => {
                return Err(payload.wrong(0, "the record is too short for the catalog that it names"));
            }
            _ => Some(CatalogVersion::from_bytes(payload.take()?)),
        };
        if catalog.is_some_and(|catalog| catalog.generation > MAX_NUMBER || catalog.bytes > MAX_NUMBER) {
            return Err(
                payload.wrong(CatalogVersion::BYTES as u64, "generation or length of a catalog exceeds 2^62")
            );
        }
        let metadata = payload.metadata()?;
        let is_whole_map = kind & WHOLE_MAP != 0;
        Ok(Self { is_whole_map, flush_number, scan_number, changed, removed, catalog, metadata })
    }
}

/// Payload of a record, read incrementally.
struct Payload<R> {
    input: Checksumming<R>,
    left: u64,
    /// Offset in the file.
    at: u64,
}

impl<R: Read> Payload<R> {
    /// Returns the next `N` bytes. The caller has checked that they exist.
    fn take<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.input.read_exact(&mut bytes)?;
        self.left -= N as u64;
        self.at += N as u64;
        Ok(bytes)
    }

    /// Reads the rest of the payload as metadata; `None` if nothing is left.
    fn metadata(&mut self) -> Result<Option<Metadata>, DecodeError> {
        let mut text = String::new();
        let at = self.at;
        let length = (&mut self.input).take(self.left).read_to_string(&mut text);
        let unreadable = || FormatError::at_offset(at, "the metadata in the record cannot be read");
        match length {
            Ok(length) => self.left -= length as u64,
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                self.left = 0;
                return Err(unreadable().into());
            }
            Err(error) => return Err(error.into()),
        }
        if text.is_empty() {
            return Ok(None);
        }
        Metadata::from_text(&text).map(Some).map_err(|_| unreadable().into())
    }

    fn skip_rest(mut self) -> io::Result<(crate::store::tiles::file_checksum::FileChecksum, R)> {
        let skipped = io::copy(&mut (&mut self.input).take(self.left), &mut io::sink())?;
        if skipped < self.left {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(self.input.finish())
    }

    /// Returns an error at the offset `bytes_before` bytes before the current one.
    fn wrong(&self, bytes_before: u64, reason: &str) -> DecodeError {
        FormatError::at_offset(self.at - bytes_before, reason).into()
    }
}

fn read_u32(input: &mut impl Read) -> io::Result<u32> {
    let mut bytes = [0; 4];
    input.read_exact(&mut bytes)?;
    Ok(u32::from_le_bytes(bytes))
}

fn index_bytes(tile: TileIndex) -> [u8; INDEX_BYTES] {
    let mut bytes = [0; INDEX_BYTES];
    for (bytes, index) in bytes.chunks_exact_mut(4).zip(tile.to_array()) {
        bytes.copy_from_slice(&index.to_le_bytes());
    }
    bytes
}

fn index_from(bytes: [u8; INDEX_BYTES]) -> TileIndex {
    let index = |axis: usize| i32::from_le_bytes(std::array::from_fn(|k| bytes[4 * axis + k]));
    TileIndex::new(index(0), index(1), index(2))
}
