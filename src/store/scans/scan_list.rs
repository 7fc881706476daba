use super::scan_record::{Entry, RECORD_BYTES, ScanRecord};
use crate::error::{DecodeError, Error, FormatError, Result, is_of_medium};
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::Layout;
use crate::store::map_files::MapFiles;
use crate::store::recovery::quarantine::Quarantine;
use crate::store::tile_store::TileStore;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

const HEADER_BYTES: usize = 16;
/// Magic, version, zeros.
const HEADER: [u8; HEADER_BYTES] = *b"VXTSCANS\x01\0\0\0\0\0\0\0";

/// State of `scans.bin` in a writer.
#[derive(Debug, Default)]
pub(in crate::store) struct ScanList {
    /// Scans and reverts of the next commit.
    pending: Vec<Entry>,
    /// Committed part, empty without a file; `None` before the file was read.
    committed: Option<Extent>,
    /// Whether the file may be longer than the committed part.
    has_excess: bool,
    /// Path of a copy of the file before damage was truncated.
    quarantined: Option<PathBuf>,
}

struct Found {
    committed: Extent,
    has_excess: bool,
    quarantined: Option<PathBuf>,
}

/// Leading part of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::store) struct Extent {
    pub(in crate::store) records: u64,
}

impl Extent {
    /// Length in bytes, including the header.
    fn bytes(self) -> u64 {
        if self.records == 0 { 0 } else { HEADER_BYTES as u64 + self.records * RECORD_BYTES as u64 }
    }
}

impl ScanList {
    pub(in crate::store) fn note_scan(&mut self, scan: ScanRecord) {
        self.pending.push(Entry::Scan(scan));
    }

    pub(in crate::store) fn note_rewind(&mut self, to_flush: u64) {
        self.pending.push(Entry::Rewind(to_flush));
    }

    pub(in crate::store) fn bytes(&self) -> usize {
        self.pending.capacity() * size_of::<Entry>()
    }

    pub(in crate::store) fn pending(&self) -> usize {
        self.pending.len()
    }

    /// Writes and syncs the first `count` entries, which belong to a commit. `committed` is the last flush before it,
    /// and `records` the number of its records, if known. Returns the argument for [`ScanList::commit`]. A damaged list
    /// is copied to quarantine before it is truncated.
    ///
    /// # Errors
    ///
    /// An I/O error. The next call writes them again.
    pub(in crate::store) fn write(
        &mut self,
        files: &MapFiles,
        committed: u64,
        records: Option<u64>,
        count: usize,
    ) -> Result<Extent> {
        let pending = self.pending.get(..count).unwrap_or(&self.pending);
        let path = files.layout().scans();
        let before = match self.committed {
            Some(before) => before,
            None => {
                let found = find_end(&**files.disk(), files.layout(), committed, records)?;
                (self.has_excess, self.quarantined) = (found.has_excess, found.quarantined);
                *self.committed.insert(found.committed)
            }
        };
        if pending.is_empty() && !self.has_excess {
            return Ok(before);
        }
        if pending.is_empty() && before.records == 0 {
            files.remove_file(&path)?;
            self.has_excess = false;
            return Ok(before);
        }
        // The file is longer than its committed part until these entries are committed.
        self.has_excess = true;
        let write = || -> io::Result<()> {
            let mut out = match before.bytes() {
                0 => {
                    let mut out = files.disk().create(&path)?;
                    out.write_all(&HEADER)?;
                    out
                }
                bytes => files.disk().append(&path, bytes)?,
            };
            for records in pending.chunks(1024) {
                let bytes: Vec<u8> = records.iter().flat_map(|entry| entry.to_bytes(committed + 1)).collect();
                out.write_all(&bytes)?;
            }
            out.sync()
        };
        write().map_err(|error| Error::io(&path, "write", error))?;
        if before.records == 0 {
            files.sync_map_folder()?;
        }
        Ok(Extent { records: before.records + pending.len() as u64 })
    }

    /// Removes entries after the committed part before a commit without scans. They have the number of that flush, and
    /// would count as committed by it. The arguments are those of [`ScanList::write`].
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(in crate::store) fn remove_excess(
        &mut self,
        files: &MapFiles,
        committed: u64,
        records: Option<u64>,
    ) -> Result<()> {
        let file_bytes = match files.kind(&files.layout().scans())? {
            Some(EntryKind::File(bytes)) => bytes,
            _ => 0,
        };
        // A file that is too short is damaged, and `repair` or the next scan deals with it.
        if records.is_some_and(|records| file_bytes <= Extent { records }.bytes()) {
            return Ok(());
        }
        self.write(files, committed, records, 0).map(drop)
    }

    /// Replaces the file by its readable leading part and moves the original to quarantine. Returns the extent of the
    /// new list, and the path in quarantine.
    ///
    /// # Errors
    ///
    /// An I/O error.
    fn rewrite(&mut self, files: &MapFiles, committed: u64) -> Result<(Extent, Option<PathBuf>)> {
        let (disk, layout) = (&**files.disk(), files.layout());
        let (path, next, mut found) = (layout.scans(), layout.scans_next(), Extent::default());
        match for_each_record(disk, layout, committed, &mut |_, _| found.records += 1) {
            Err(DecodeError::Io(error))
                if !is_of_medium(&error) && error.kind() != io::ErrorKind::InvalidInput =>
            {
                return Err(Error::io(&path, "read", error));
            }
            _ => {}
        }
        let copy = || {
            let mut out = disk.create(&next)?;
            io::copy(&mut disk.open(&path)?.take(found.bytes()), &mut out)?;
            out.sync()
        };
        let quarantine = Quarantine::new(disk, layout);
        let mut quarantined = None;
        if found.records > 0 {
            copy().map_err(|error| Error::io(&next, "write", error))?;
            files.sync_map_folder()?;
            // With a hard link in quarantine, the original remains in place until it is replaced.
            quarantined = quarantine.link(&path)?;
        }
        if quarantined.is_none() && files.kind(&path)?.is_some() {
            quarantined = Some(quarantine.take(&path)?);
        }
        if found.records > 0 {
            files.rename(&next, &path)?;
        }
        files.sync_map_folder()?;
        (self.committed, self.has_excess) = (Some(found), false);
        Ok((found, quarantined))
    }

    /// Path of a copy of the file before damage was truncated, if it was.
    pub(in crate::store) fn quarantined(&self) -> Option<&Path> {
        self.quarantined.as_deref()
    }

    /// Records that the written entries are committed.
    pub(in crate::store) fn commit(&mut self, written: Extent, count: usize) {
        (self.committed, self.has_excess) = (Some(written), false);
        self.pending = self.pending.split_off(count.min(self.pending.len()));
    }
}

impl TileStore {
    /// Replaces an unreadable list of scans by its readable leading part. Returns the path of the original in
    /// quarantine.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(crate) fn rewrite_scans(&mut self) -> Result<Option<PathBuf>> {
        let (list, quarantined) = self.scans.rewrite(&self.files, self.versions.commits().flush_number)?;
        self.committer.set_scan_records(list.records);
        self.write_metadata()?;
        Ok(quarantined)
    }
}

/// Finds the committed part of the list. A damaged list is copied to quarantine.
fn find_end(disk: &dyn Disk, layout: &Layout, committed: u64, records: Option<u64>) -> Result<Found> {
    let (mut found, path) = (Extent::default(), layout.scans());
    let read = for_each_record(disk, layout, committed, &mut |_, _| found.records += 1);
    let damage = match read {
        Ok(_) if records.is_some_and(|records| found.records < records) => {
            "the end of the file is missing".to_owned()
        }
        Ok(file_bytes) => {
            let has_excess = file_bytes.is_some_and(|bytes| bytes != found.bytes());
            return Ok(Found { committed: found, has_excess, quarantined: None });
        }
        Err(DecodeError::Io(error)) => return Err(Error::io(&path, "read", error)),
        Err(DecodeError::Format(error)) => error.to_string(),
    };
    // The file is not moved if it cannot be copied, because its intact part is needed in place.
    let quarantined = Quarantine::new(disk, layout).copy(&path)?;
    log::warn!(
        "{}: {damage}; the list continues after record {}{}",
        path.display(),
        found.records,
        quarantined.as_ref().map_or(String::new(), |to| format!("; the original is now {}", to.display()))
    );
    Ok(Found { committed: found, has_excess: true, quarantined })
}

/// Returns the scans of a map as of a flush, in order. Empty for a map without a list.
///
/// # Errors
///
/// Damage or an I/O error.
pub(crate) fn read_scans(
    disk: &dyn Disk,
    layout: &Layout,
    flush_number: u64,
    records: Option<u64>,
) -> Result<Vec<ScanRecord>> {
    let mut entries = Vec::new();
    for_each_committed(disk, layout, flush_number, records, &mut |flush, entry| {
        entries.push((flush, entry))
    })?;
    // Read backwards: of the entries before a revert, only those up to the flush to which it reverted count.
    let (mut parts, mut end) = (Vec::new(), entries.len());
    loop {
        let before = &entries[..end];
        let Some(revert) = before.iter().rposition(|(_, entry)| matches!(entry, Entry::Rewind(_))) else {
            parts.push(before);
            break;
        };
        parts.push(&before[revert + 1..]);
        let (_, Entry::Rewind(to_flush)) = before[revert] else { break };
        end = before[..revert].partition_point(|(flush, _)| *flush <= to_flush);
    }
    let scans = parts.into_iter().rev().flatten().filter_map(|(_, entry)| match entry {
        Entry::Scan(scan) => Some(*scan),
        Entry::Rewind(_) => None,
    });
    Ok(scans.collect())
}

/// Checks that the list is complete as of a flush. Like [`read_scans`], but in constant memory.
///
/// # Errors
///
/// Damage or an I/O error.
pub(crate) fn check_scans(
    disk: &dyn Disk,
    layout: &Layout,
    flush_number: u64,
    records: Option<u64>,
) -> Result<()> {
    for_each_committed(disk, layout, flush_number, records, &mut |_, _| ())
}

/// Visits the records up to a flush. `records` is their number, if known.
fn for_each_committed(
    disk: &dyn Disk,
    layout: &Layout,
    flush_number: u64,
    records: Option<u64>,
    visit: &mut dyn FnMut(u64, Entry),
) -> Result<()> {
    let mut found = Extent::default();
    let read = for_each_record(disk, layout, flush_number, &mut |flush, entry| {
        found.records += 1;
        visit(flush, entry);
    });
    let in_map = |error: DecodeError| error.in_map(&layout.scans(), None);
    read.map_err(in_map)?;
    match records {
        Some(records) if records != found.records => {
            let reason = format!("{} records, but metadata.json records {records}", found.records);
            Err(in_map(FormatError::at_offset(found.bytes(), reason).into()))
        }
        _ => Ok(()),
    }
}

/// Visits the records up to a flush. Returns the length of the file, or `None` without a file. Records of later
/// flushes, and incomplete records after a crash, are ignored.
fn for_each_record(
    disk: &dyn Disk,
    layout: &Layout,
    flush_number: u64,
    visit: &mut dyn FnMut(u64, Entry),
) -> std::result::Result<Option<u64>, DecodeError> {
    let input = match disk.open(&layout.scans()) {
        Ok(input) => input,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let file_bytes = input.file_bytes();
    let mut input = BufReader::new(input);
    let mut header = Vec::new();
    input.by_ref().take(HEADER_BYTES as u64).read_to_end(&mut header)?;
    if header.len() < HEADER_BYTES {
        // A crash while the file was created, or damage. The number of records distinguishes them.
        return Ok(Some(file_bytes));
    }
    if header.iter().zip(HEADER).any(|(&byte, wanted)| byte != wanted && byte != 0) {
        let reason = match header.starts_with(&HEADER[..8]) {
            true => "a list of scans of a newer version",
            false => "not a list of scans",
        };
        return Err(FormatError::at_offset(0, reason).into());
    }
    if header != HEADER {
        // A crash may leave an incomplete header. The number of records shows whether records are missing, too.
        return Ok(Some(file_bytes));
    }
    let mut at = HEADER_BYTES as u64;
    let mut record = [0; RECORD_BYTES];
    while at + RECORD_BYTES as u64 <= file_bytes {
        input.read_exact(&mut record)?;
        match Entry::from_bytes(&record) {
            Some((flush, entry)) if flush <= flush_number => visit(flush, entry),
            Some(_) => break,
            None if is_uncommitted(&record, flush_number) && !has_committed(&mut input, flush_number)? => {
                break;
            }
            None => return Err(FormatError::at_offset(at, "the checksum of a record does not match").into()),
        }
        at += RECORD_BYTES as u64;
    }
    Ok(Some(file_bytes))
}

/// Returns whether a damaged record may belong to an uncommitted flush: it has the number of a later flush, or zeros,
/// which never reached the disk.
fn is_uncommitted(record: &[u8; RECORD_BYTES], flush_number: u64) -> bool {
    let flush = <[u8; 8]>::try_from(&record[8..16]).map(u64::from_le_bytes).unwrap_or_default();
    flush == 0 || flush > flush_number
}

/// Returns whether a record of a committed flush follows. Then the records before it were committed too.
fn has_committed(input: &mut impl Read, flush_number: u64) -> io::Result<bool> {
    let mut record = [0; RECORD_BYTES];
    loop {
        match input.read_exact(&mut record) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(false),
            Err(error) => return Err(error),
            Ok(()) if Entry::from_bytes(&record).is_some_and(|(flush, _)| flush <= flush_number) => {
                return Ok(true);
            }
            Ok(()) => {}
        }
    }
}
