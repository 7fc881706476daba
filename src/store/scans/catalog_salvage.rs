//! Reading of damaged catalogs.

use super::catalog::{
    FRAME_BYTES, HEADER, IS_ANOTHER, IS_MISSING, IS_OF_ANOTHER, KeptAsOf, checksum_of_front,
};
use super::catalog_entry::CatalogEntry;
use crate::error::{Error, FormatError, Result, is_of_medium};
use crate::store::disk::{Disk, DiskRead};
use crate::store::layout::Layout;
use std::io::{self, BufReader, Read};
use std::path::PathBuf;

/// Length of the search for the next record after one with an invalid length. No record is longer.
const SEARCHED_BYTES: u64 = 16 << 20;

/// Entry of a damaged catalog.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Salvaged {
    /// An intact entry.
    Whole(CatalogEntry),
    /// A placeholder for damaged entries.
    Lost(CatalogEntry),
}

/// Passes the readable entries of a flush's catalog to `put`, in order. Damaged records are skipped. Missing scans are
/// passed as unlisted, so that scan numbers are contiguous up to the flush's last scan. A file that is not the
/// catalog named in the log is skipped as a whole, because it may contain removed scans. Returns the errors found.
///
/// # Errors
///
/// An I/O error outside the catalog, and errors of `put`.
pub(crate) fn salvage_entries(
    disk: &dyn Disk,
    layout: &Layout,
    as_of: KeptAsOf,
    put: &mut dyn FnMut(Salvaged) -> Result<()>,
) -> Result<Vec<Error>> {
    let lost = CatalogEntry::Unlisted(1, as_of.scan_number);
    let Some(generation) = as_of.generation(disk, layout)? else {
        if as_of.scan_number == 0 {
            return Ok(Vec::new());
        }
        put(Salvaged::Lost(lost))?;
        return Ok(vec![KeptAsOf::no_catalog(layout)]);
    };
    let path = layout.catalog(generation);
    let begin = || Salvage {
        disk,
        path: path.clone(),
        as_of,
        last: 0,
        doubtful: None,
        has_hole: false,
        is_another: false,
        damage: Vec::new(),
    };
    let mut salvage = begin();
    if let Some(named) = as_of.catalog
        && !matches!(checksum_of_front(disk, &path, named.bytes), Ok(found) if found == named.checksum())
    {
        salvage.read(&mut |_| Ok(()))?;
        salvage.end(&mut |_| Ok(()))?;
        if salvage.damage.is_empty() || salvage.is_another {
            put(Salvaged::Lost(if as_of.scan_number == 0 { lost_operation() } else { lost }))?;
            return Ok(vec![salvage.wrong(0, IS_ANOTHER)]);
        }
        salvage = begin();
    }
    salvage.read(put)?;
    salvage.end(put)?;
    Ok(salvage.damage)
}

struct Salvage<'a> {
    disk: &'a dyn Disk,
    path: PathBuf,
    as_of: KeptAsOf,
    /// Number of the last scan so far.
    last: u64,
    /// Error of a damaged record that may belong to an uncommitted flush. It is damage if a committed record follows.
    doubtful: Option<Error>,
    /// Whether entries are missing before the next one.
    has_hole: bool,
    /// Whether the file has records of another catalog.
    is_another: bool,
    damage: Vec<Error>,
}

/// Content at the expected start of a record.
enum Found {
    /// A record, its flush, and the offset of the next record.
    Record(CatalogEntry, u64, u64),
    /// Damage, the flush number if readable, and the offset of the next record if its length is readable.
    Damage(&'static str, u64, Option<u64>),
    End,
}

impl Salvage<'_> {
    fn read(&mut self, put: &mut dyn FnMut(Salvaged) -> Result<()>) -> Result<()> {
        let mut at = HEADER.len() as u64;
        let Some(mut input) = self.begin()? else { return Ok(()) };
        let (named, last_flush) = (self.as_of.catalog, self.as_of.flush_number);
        loop {
            // Bytes after the part that the log names are not committed.
            if named.is_some_and(|named| at >= named.bytes) {
                return Ok(());
            }
            let found = find_record(&mut input, at);
            let Some(found) = self.unless_unreadable(found, "read")? else { return Ok(()) };
            match found {
                Found::Record(_, flush_number, next)
                    if named.is_some_and(|named| {
                        !named.has_flush(flush_number, last_flush) || next > named.bytes
                    }) =>
                {
                    self.damage.push(self.wrong(at, IS_OF_ANOTHER));
                    (self.has_hole, self.is_another) = (true, true);
                    at = next;
                }
                Found::Record(entry, flush_number, next) if named.is_some() || flush_number <= last_flush => {
                    self.take(at, entry, put)?;
                    at = next;
                }
                Found::End if named.is_some() => {
                    self.damage.push(self.wrong(at, "the end of the file is missing"));
                    self.has_hole = true;
                    return Ok(());
                }
                Found::Record(..) | Found::End => return Ok(()),
                Found::Damage(reason, flush_number, next) => {
                    let error = self.wrong(at, reason);
                    if named.is_none() && (flush_number == 0 || flush_number > last_flush) {
                        self.doubtful.get_or_insert(error);
                    } else {
                        self.damage.push(error);
                        self.has_hole = true;
                    }
                    if let Some(next) = next {
                        at = next;
                        continue;
                    }
                    let Some(next) = self.look_for_record(at + 1)? else { return Ok(()) };
                    let reopened = self.disk.open_at(&self.path, next).map(BufReader::new);
                    let Some(reopened) = self.unless_unreadable(reopened, "open")? else { return Ok(()) };
                    (input, at) = (reopened, next);
                }
            }
        }
    }

    /// Opens the catalog after its header. A damaged header is reported, but reading continues, because all headers are
    /// equal.
    fn begin(&mut self) -> Result<Option<BufReader<Box<dyn DiskRead>>>> {
        let opened = self.disk.open(&self.path).map(BufReader::new);
        if let Err(error) = &opened
            && matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
        {
            self.damage.push(self.wrong(0, IS_MISSING));
            self.has_hole = true;
            return Ok(None);
        }
        let Some(mut input) = self.unless_unreadable(opened, "open")? else { return Ok(None) };
        let mut header = [0; HEADER.len()];
        let is_there = read_whole(&mut input, &mut header);
        let Some(is_there) = self.unless_unreadable(is_there, "read")? else { return Ok(None) };
        if !is_there || header != HEADER {
            self.damage.push(self.wrong(0, "not a catalog of kept scans"));
        }
        Ok(is_there.then_some(input))
    }

    /// Passes an intact entry to `put`, after a placeholder for missing ones before it.
    fn take(
        &mut self,
        at: u64,
        entry: CatalogEntry,
        put: &mut dyn FnMut(Salvaged) -> Result<()>,
    ) -> Result<()> {
        if let Some(error) = self.doubtful.take() {
            self.damage.push(error);
            self.has_hole = true;
        }
        if let Some((first, last)) = entry.numbers() {
            let is_possible = first > self.last && last >= first && last <= self.as_of.scan_number;
            if !is_possible || first > self.last + 1 && !self.has_hole {
                self.damage.push(self.wrong(at, "the scan numbers are not in order"));
            }
            if !is_possible {
                return Ok(());
            }
            if first > self.last + 1 {
                put(Salvaged::Lost(CatalogEntry::Unlisted(self.last + 1, first - 1)))?;
            } else if self.has_hole {
                put(Salvaged::Lost(lost_operation()))?;
            }
            (self.last, self.has_hole) = (last, false);
        }
        put(Salvaged::Whole(entry))
    }

    /// Passes a placeholder for the rest, after the last readable entry.
    fn end(&mut self, put: &mut dyn FnMut(Salvaged) -> Result<()>) -> Result<()> {
        let (last, scan_number) = (self.last, self.as_of.scan_number);
        if last < scan_number {
            if !self.has_hole {
                let doubtful = self.doubtful.take();
                let reason =
                    format!("the catalog ends with scan {last}, but the map with scan {scan_number}");
                let error = doubtful.unwrap_or_else(|| self.wrong(0, &reason));
                self.damage.push(error);
            }
            put(Salvaged::Lost(CatalogEntry::Unlisted(last + 1, scan_number)))
        } else if self.has_hole {
            put(Salvaged::Lost(lost_operation()))
        } else {
            Ok(())
        }
    }

    /// Searches for the next intact record after damage.
    fn look_for_record(&mut self, from: u64) -> Result<Option<u64>> {
        let mut bytes = Vec::new();
        let read = self
            .disk
            .open_at(&self.path, from)
            .and_then(|input| input.take(SEARCHED_BYTES).read_to_end(&mut bytes));
        // Even if the read failed, the bytes before the error are searched.
        self.unless_unreadable(read, "read")?;
        let is_record = |at: &usize| bytes.get(*at..).is_some_and(begins_with_record);
        Ok((0..bytes.len()).find(is_record).map(|at| from + at as u64))
    }

    /// Returns the result of a read, or records a media error as damage and returns `None`.
    fn unless_unreadable<T>(&mut self, read: io::Result<T>, action: &'static str) -> Result<Option<T>> {
        match read {
            Ok(read) => Ok(Some(read)),
            Err(error) => {
                let is_of_file = is_of_medium(&error) || error.kind() == io::ErrorKind::InvalidInput;
                let error = Error::io(&self.path, action, error);
                if !is_of_file {
                    return Err(error);
                }
                self.damage.push(error);
                self.has_hole = true;
                Ok(None)
            }
        }
    }

    fn wrong(&self, at: u64, reason: &str) -> Error {
        FormatError::at_offset(at, reason).in_map(&self.path, None)
    }
}

/// Returns the placeholder for a damaged record that has no scans.
fn lost_operation() -> CatalogEntry {
    CatalogEntry::Operation("an operation with a damaged record".to_owned())
}

/// Reads the record at an offset, which must be the position of the input.
fn find_record(input: &mut BufReader<Box<dyn DiskRead>>, at: u64) -> io::Result<Found> {
    let left = input.get_ref().file_bytes().saturating_sub(at);
    let mut lengths = [0; 8];
    if left < FRAME_BYTES || !read_whole(input, &mut lengths)? {
        return Ok(Found::End);
    }
    let length = length_of(lengths).filter(|&length| u64::from(length) <= left - FRAME_BYTES);
    // With an invalid length, read as far as the flush number.
    let bytes = length.map_or(size_of::<u64>().min((left - FRAME_BYTES) as usize), |length| length as usize);
    let (mut payload, mut checksum) = (vec![0; bytes], [0; 4]);
    if !read_whole(input, &mut payload)? || !read_whole(input, &mut checksum)? {
        return Ok(Found::End);
    }
    let flush_number = payload.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
    let Some(length) = length else {
        return Ok(Found::Damage("a record with an invalid length", flush_number, None));
    };
    let next = at + FRAME_BYTES + u64::from(length);
    if crc32fast::hash(&payload) != u32::from_le_bytes(checksum) {
        let reason = "the checksum of a record does not match";
        return Ok(Found::Damage(reason, flush_number, Some(next)));
    }
    Ok(match CatalogEntry::read(&payload) {
        Some((flush_number, entry)) => Found::Record(entry, flush_number, next),
        None => Found::Damage("a record of a newer version", flush_number, Some(next)),
    })
}

fn begins_with_record(bytes: &[u8]) -> bool {
    let whole = || {
        let (lengths, rest) = bytes.split_first_chunk()?;
        let (payload, rest) = rest.split_at_checked(length_of(*lengths)? as usize)?;
        let checksum = u32::from_le_bytes(*rest.first_chunk()?);
        (crc32fast::hash(payload) == checksum && CatalogEntry::read(payload).is_some()).then_some(())
    };
    whole().is_some()
}

/// Returns the length of a record if it matches its complement.
fn length_of(lengths: [u8; 8]) -> Option<u32> {
    let [a, b, c, d, complement @ ..] = lengths;
    let length = u32::from_le_bytes([a, b, c, d]);
    (length == !u32::from_le_bytes(complement)).then_some(length)
}

/// Fills a buffer. Returns false at the end of the file.
fn read_whole(input: &mut impl Read, buffer: &mut [u8]) -> io::Result<bool> {
    match input.read_exact(buffer) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        result => result.map(|()| true),
    }
}
