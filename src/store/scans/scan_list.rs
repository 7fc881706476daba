use super::scan_record::{Entry, RECORD_BYTES, ScanRecord};
use crate::error::{DecodeError, Error, FormatError, Result};
use crate::store::disk::Disk;
use crate::store::layout::Layout;
use crate::store::map_files::MapFiles;
use std::io::{self, BufReader, Read, Write};

const MAGIC: [u8; 8] = *b"VXTSCANS";
const VERSION: u32 = 1;
/// Bytes of the header: magic, version, zeros.
const HEADER_BYTES: usize = 16;

/// What a writer knows of the file.
#[derive(Debug, Default)]
pub(in crate::store) struct ScanList {
    /// Scans and rewinds of the next commit.
    pending: Vec<Entry>,
    /// Bytes of what is committed, 0 if there is no file; `None` before the file was looked at.
    committed_bytes: Option<u64>,
    /// Whether there may be more in the file.
    has_excess: bool,
}

impl ScanList {
    pub(in crate::store) fn note_scan(&mut self, scan: ScanRecord) {
        self.pending.push(Entry::Scan(scan));
    }

    pub(in crate::store) fn note_rewind(&mut self, scan_number: u64) {
        self.pending.push(Entry::Rewind(scan_number));
    }

    /// Bytes of memory.
    pub(in crate::store) fn bytes(&self) -> usize {
        self.pending.capacity() * size_of::<Entry>()
    }

    /// Writes what belongs to a commit, synced; `committed` is the flush before it. Returns the file's new length for
    /// [`ScanList::commit`].
    ///
    /// # Errors
    ///
    /// A disk that refuses: the next call writes it again.
    pub(in crate::store) fn write(&mut self, files: &MapFiles, committed: u64) -> Result<u64> {
        let path = files.layout().scans();
        let before = match self.committed_bytes {
            Some(bytes) => bytes,
            None => {
                let found = find_end(&**files.disk(), files.layout(), committed)?;
                self.has_excess = found.has_excess;
                *self.committed_bytes.insert(found.bytes)
            }
        };
        if self.pending.is_empty() && !self.has_excess {
            return Ok(before);
        }
        if self.pending.is_empty() && before == 0 {
            files.remove_file(&path)?;
            self.has_excess = false;
            return Ok(0);
        }
        // Until this is committed.
        self.has_excess = true;
        let mut length = before;
        let mut write = || -> io::Result<u64> {
            let mut out =
                if before == 0 { files.disk().create(&path)? } else { files.disk().append(&path, before)? };
            if before == 0 {
                let mut header = [0; HEADER_BYTES];
                header[..8].copy_from_slice(&MAGIC);
                header[8..12].copy_from_slice(&VERSION.to_le_bytes());
                out.write_all(&header)?;
                length = HEADER_BYTES as u64;
            }
            for records in self.pending.chunks(1024) {
                let bytes: Vec<u8> = records.iter().flat_map(|entry| entry.to_bytes(committed + 1)).collect();
                out.write_all(&bytes)?;
                length += bytes.len() as u64;
            }
            out.sync()?;
            Ok(length)
        };
        let length = write().map_err(|error| Error::io(&path, "write", error))?;
        if before == 0 {
            files.sync_map_folder()?;
        }
        Ok(length)
    }

    /// Notes that what was written is committed.
    pub(in crate::store) fn commit(&mut self, bytes: u64) {
        (self.committed_bytes, self.has_excess) = (Some(bytes), false);
        self.pending = Vec::new();
    }
}

/// Where the committed part of a file ends.
struct End {
    bytes: u64,
    has_excess: bool,
}

fn find_end(disk: &dyn Disk, layout: &Layout, committed: u64) -> Result<End> {
    let path = layout.scans();
    match for_each_record(disk, layout, committed, &mut |_| ()) {
        Ok(None) => Ok(End { bytes: 0, has_excess: false }),
        Ok(Some(read)) => Ok(End { bytes: read.bytes, has_excess: read.bytes < read.file_bytes }),
        Err(DecodeError::Io(error)) => Err(Error::io(&path, "read", error)),
        Err(DecodeError::Format(error)) => {
            log::warn!("{}: {error}; what follows there is lost", path.display());
            Ok(End { bytes: if error.at < HEADER_BYTES as u64 { 0 } else { error.at }, has_excess: true })
        }
    }
}

/// The scans of a map as of a flush, in order; none for a map that keeps no list.
///
/// # Errors
///
/// A disk that refuses, damage.
pub(crate) fn read_scans(disk: &dyn Disk, layout: &Layout, flush_number: u64) -> Result<Vec<ScanRecord>> {
    let mut scans: Vec<ScanRecord> = Vec::new();
    let read = for_each_record(disk, layout, flush_number, &mut |entry| match entry {
        Entry::Scan(scan) => scans.push(scan),
        Entry::Rewind(number) => {
            let kept = scans.partition_point(|scan| scan.number <= number);
            scans.truncate(kept);
        }
    });
    read.map_err(|error| error.in_map(&layout.scans(), None))?;
    Ok(scans)
}

/// Whether the list is whole as of a flush; as [`read_scans`], in constant memory.
///
/// # Errors
///
/// A disk that refuses, damage.
pub(crate) fn check_scans(disk: &dyn Disk, layout: &Layout, flush_number: u64) -> Result<()> {
    let read = for_each_record(disk, layout, flush_number, &mut |_| ());
    read.map(|_| ()).map_err(|error| error.in_map(&layout.scans(), None))
}

struct ReadTo {
    /// Where the records up to the flush end.
    bytes: u64,
    file_bytes: u64,
}

/// Visits the records up to a flush; `None` without a file. What a later flush has written, or a crash has left half
/// written behind these, is passed over.
fn for_each_record(
    disk: &dyn Disk,
    layout: &Layout,
    flush_number: u64,
    visit: &mut dyn FnMut(Entry),
) -> std::result::Result<Option<ReadTo>, DecodeError> {
    let input = match disk.open(&layout.scans()) {
        Ok(input) => input,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let file_bytes = input.file_bytes();
    let mut input = BufReader::new(input);
    if file_bytes < HEADER_BYTES as u64 {
        // A crash while it was begun, or damage: a map whose first scans are committed has a whole header.
        return Ok(Some(ReadTo { bytes: 0, file_bytes }));
    }
    let mut header = [0; HEADER_BYTES];
    input.read_exact(&mut header)?;
    if header[..8] != MAGIC {
        return Err(FormatError::at_offset(0, "not a list of scans").into());
    }
    if header[8..12] != VERSION.to_le_bytes() {
        return Err(FormatError::at_offset(8, "a list of scans of a newer version").into());
    }
    let mut bytes = HEADER_BYTES as u64;
    let mut has_records = false;
    let mut record = [0; RECORD_BYTES];
    while bytes + RECORD_BYTES as u64 <= file_bytes {
        input.read_exact(&mut record)?;
        match Entry::from_bytes(&record) {
            Some((flush, entry)) if flush <= flush_number => visit(entry),
            Some(_) => break,
            None if is_uncommitted(&record, flush_number) && !has_committed(&mut input, flush_number)? => {
                break;
            }
            None => {
                return Err(FormatError::at_offset(bytes, "the checksum of a record does not match").into());
            }
        }
        has_records = true;
        bytes += RECORD_BYTES as u64;
    }
    let bytes = if has_records { bytes } else { 0 };
    Ok(Some(ReadTo { bytes, file_bytes }))
}

/// Whether a damaged record is of a flush that did not come to its commit, by what is left of it: zeros where nothing
/// reached the medium, or the number of a later flush.
fn is_uncommitted(record: &[u8; RECORD_BYTES], flush_number: u64) -> bool {
    let flush = <[u8; 8]>::try_from(&record[8..16]).map(u64::from_le_bytes).unwrap_or_default();
    flush == 0 || flush > flush_number
}

/// Whether a record of a commit up to a flush follows: then what comes before it was committed, too.
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
