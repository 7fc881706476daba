use super::commit_record::{Flush, Next, Record};
use super::commits::Commits;
use crate::error::{DecodeError, FormatError};
use crate::space::TileTable;
use crate::store::disk::Disk;
use crate::store::tiles::tile_version::TileVersion;
use std::io::{self, Read};
use std::path::Path;

/// Append-only log of flushes, `commits.log`. Each complete record is a commit.
///
/// ```text
/// header  32 bytes  magic "VXTCOMIT", version u32 1, map id 16 bytes, CRC-32 of these
/// record            payload length u32, its complement u32, payload, CRC-32 of the payload
/// payload           kind u32 (bit 0: whole map, else a change; bit 1: tiles were removed; bit 2: names a
///                   catalog), tile count u32,
///                   flush number u64, scan number u64;
///                   for each tile: index 3 x i32, version 48 bytes;
///                   if tiles were removed: their count u32 and the index of each, 3 x i32;
///                   if the map keeps its scans: generation u64, length u64 and CRC-32 of its catalog;
///                   if it changed: the text of metadata.json
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommitLog {
    map_id: [u8; 16],
    /// Length of the valid part in bytes. The next record is written here.
    bytes: u64,
}

const MAGIC: &[u8; 8] = b"VXTCOMIT";
const VERSION: u32 = 1;
const HEADER_BYTES: usize = 32;

impl CommitLog {
    /// Returns the log of a map that has no file yet.
    pub(in crate::store) fn of_map(map_id: [u8; 16]) -> Self {
        Self { map_id, bytes: 0 }
    }

    /// Length of the valid part in bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Id of the map that the log belongs to.
    pub fn map_id(&self) -> [u8; 16] {
        self.map_id
    }

    /// Writes and syncs a log with one record of the whole map. An existing file at `path` is overwritten, so it must
    /// not be the log in use.
    pub fn write_whole(
        disk: &dyn Disk,
        path: &Path,
        map_id: [u8; 16],
        commits: &Commits,
        metadata_text: &str,
    ) -> io::Result<Self> {
        let mut out = disk.create(path)?;
        let record_bytes = Flush::of_all(commits, metadata_text).write(true, &header(map_id), &mut out)?;
        out.sync()?;
        Ok(Self { map_id, bytes: HEADER_BYTES as u64 + record_bytes })
    }

    /// Returns the bytes that [`CommitLog::write_whole`] writes.
    pub(in crate::store) fn to_bytes(
        map_id: [u8; 16],
        commits: &Commits,
        metadata_text: &str,
    ) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        Flush::of_all(commits, metadata_text).write(true, &header(map_id), &mut bytes)?;
        Ok(bytes)
    }

    /// Appends and syncs a record of changed and removed tiles: when this returns, the flush is committed. After an
    /// error the file may contain the record until [`CommitLog::cut`] removes it.
    pub fn append(&mut self, disk: &dyn Disk, path: &Path, flush: &Flush<'_>) -> io::Result<()> {
        let mut out = disk.append(path, self.bytes)?;
        let record_bytes = flush.write(false, &[], &mut out)?;
        out.sync()?;
        self.bytes += record_bytes;
        Ok(())
    }

    /// Truncates the file durably to the valid part.
    pub fn cut(&self, disk: &dyn Disk, path: &Path) -> io::Result<()> {
        disk.append(path, self.bytes)?.sync()
    }

    /// Reads a log of `file_bytes` bytes. An incomplete record at the end is ignored: its flush was not committed.
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
    /// Adds the records of a log. After an error, the records before the damage are included.
    ///
    /// # Errors
    ///
    /// As for [`CommitLog::read`].
    pub fn read_from(&mut self, input: &mut impl Read, file_bytes: u64) -> Result<CommitLog, DecodeError> {
        let map_id = read_header(input, file_bytes)?;
        let mut last = LastChanged::None;
        let bytes = self.read_records(input, file_bytes, &mut last);
        match last {
            LastChanged::None => {}
            LastChanged::All => self.last_changed = self.tiles.tiles().map(|tile| (tile, ())).collect(),
            LastChanged::Some(changed) => {
                self.last_changed = changed.tiles().map(|tile| (tile, ())).collect();
            }
        }
        Ok(CommitLog { map_id, bytes: bytes? })
    }

    /// Reads the records after the header; returns the length of the valid part.
    fn read_records(
        &mut self,
        input: &mut impl Read,
        file_bytes: u64,
        last: &mut LastChanged,
    ) -> Result<u64, DecodeError> {
        let mut bytes = HEADER_BYTES as u64;
        loop {
            match Next::read(input, bytes, file_bytes)? {
                Next::Record(record, record_bytes) => {
                    *last = self.take(*record, bytes)?;
                    bytes += record_bytes;
                }
                Next::Torn(error) => {
                    self.torn = Some(error);
                    return Ok(bytes);
                }
                Next::End => return Ok(bytes),
            }
        }
    }

    fn take(&mut self, record: Record, offset: u64) -> Result<LastChanged, FormatError> {
        if record.flush_number < self.flush_number {
            let reason = "the flush number is lower than in the previous record";
            return Err(FormatError::at_offset(offset, reason));
        }
        self.flush_number = record.flush_number;
        self.scan_number = record.scan_number;
        self.metadata = record.metadata.or(self.metadata.take());
        let last = match record.is_whole_map {
            true => {
                self.tiles = record.changed;
                LastChanged::All
            }
            false => {
                self.tiles.extend(record.changed.iter());
                LastChanged::Some(record.changed)
            }
        };
        for &tile in &record.removed {
            self.tiles.remove(tile);
        }
        self.last_removed = record.removed;
        self.catalog = record.catalog;
        Ok(last)
    }
}

/// Tiles that the last record of a log changes.
enum LastChanged {
    None,
    All,
    Some(TileTable<TileVersion>),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{TileIndex, TileTable};
    use crate::store::{CatalogVersion, FileChecksum, FsDisk, TileVersion};
    use std::fs;

    fn version(number: u64) -> TileVersion {
        let file = FileChecksum { bytes: 100 + number, crc: number as u32 };
        TileVersion { scan_number: number, table: file, octree: file, voxels: number, occupied: number / 2 }
    }

    /// The records are larger than the read and write buffers.
    #[test]
    fn truncated_logs_end_with_a_complete_record_and_wrong_bytes_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("commits.log");
        let tiles = |of: std::ops::Range<i32>| {
            of.map(|k| (TileIndex::new(k % 50, k / 50, -k), version(k as u64))).collect::<TileTable<_>>()
        };
        let first = Commits { flush_number: 3, tiles: tiles(0..4000), ..Commits::default() };
        let mut log = CommitLog::write_whole(&FsDisk, &path, [7; 16], &first, "").unwrap();
        let end_of_first = log.bytes();
        let changed = tiles(3000..5500);
        let removed: Vec<_> = first.tiles.tiles().step_by(3).collect();
        let catalog = Some(CatalogVersion { generation: 2, bytes: 77, crc32: 5 });
        let flush = Flush {
            number: 4,
            scan_number: 9,
            changed: &changed,
            removed: &removed,
            catalog,
            metadata_text: None,
        };
        log.append(&FsDisk, &path, &flush).unwrap();

        let mut second = first.tiles.clone();
        second.extend(changed.iter());
        removed.iter().for_each(|tile| assert!(second.remove(*tile)));
        let bytes = fs::read(&path).unwrap();
        let read = |bytes: &[u8]| CommitLog::read(&mut &*bytes, bytes.len() as u64);
        let (again, commits) = read(&bytes).unwrap();
        assert_eq!((again, commits.flush_number, commits.torn.is_none()), (log, 4, true));
        assert!(commits.tiles == second && commits.last_removed == removed && commits.catalog == catalog);
        assert!(commits.last_changed.tiles().eq(changed.tiles()));

        for end in (end_of_first as usize..bytes.len()).step_by(7001) {
            let (cut, commits) = read(&bytes[..end]).unwrap();
            assert_eq!((cut.bytes(), commits.torn.is_some()), (end_of_first, end as u64 > end_of_first));
            assert!(commits.tiles == first.tiles);
        }
        for at in (0..bytes.len()).step_by(6007).chain([33, 60, bytes.len() - 1]) {
            let mut wrong = bytes.clone();
            wrong[at] ^= 1;
            let found = read(&wrong).map(|(_, commits)| commits.torn.is_some());
            let is_last = at as u64 >= end_of_first;
            assert!(if is_last { found.unwrap() } else { found.unwrap_or(true) }, "byte {at}");
        }
    }
}
