use super::catalog_entry::{CatalogEntry, KeptRecord};
use crate::error::{DecodeError, Error, FormatError, Result};
use crate::store::disk::{Disk, DiskRead, DiskWrite};
use crate::store::layout::Layout;
use crate::store::tiles::tile_version::MAX_NUMBER;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::PathBuf;

const HEADER_BYTES: u64 = 16;
/// Magic, version, zeros.
pub(super) const HEADER: [u8; 16] = *b"VXTKEPT\0\x01\0\0\0\0\0\0\0";
/// Length, its complement and checksum of a record.
pub(super) const FRAME_BYTES: u64 = 12;

/// Reads a catalog in order, up to a flush.
#[derive(Debug)]
pub(in crate::store) struct CatalogReader {
    path: PathBuf,
    input: Input,
    flush_number: u64,
    /// Where the next record begins.
    at: u64,
    /// Number of the last scan so far.
    last: u64,
    payload: Vec<u8>,
}

struct Input {
    // A map that is read by several threads is `Sync`.
    file: std::sync::Mutex<BufReader<Box<dyn DiskRead>>>,
    file_bytes: u64,
}

impl CatalogReader {
    /// Opens the catalog of a generation.
    ///
    /// # Errors
    ///
    /// None there, or a disk that refuses.
    pub(in crate::store) fn open(
        disk: &dyn Disk,
        layout: &Layout,
        generation: u64,
        flush_number: u64,
    ) -> Result<Self> {
        let path = layout.catalog(generation);
        let input = disk.open(&path).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => FormatError::at_offset(0, "the file is missing").in_map(&path, None),
            _ => Error::io(&path, "open", error),
        })?;
        let file_bytes = input.file_bytes();
        let file = std::sync::Mutex::new(BufReader::with_capacity(1 << 16, input));
        let input = Input { file, file_bytes };
        let mut reader = Self { path, input, flush_number, at: 0, last: 0, payload: Vec::new() };
        reader.read_header().map_err(|error| reader.wrong(error))?;
        Ok(reader)
    }

    fn read_header(&mut self) -> std::result::Result<(), DecodeError> {
        let mut header = [0; HEADER_BYTES as usize];
        if !self.input.read(&mut header)? || header != HEADER {
            let reason = match header.starts_with(&HEADER[..8]) {
                true => "a catalog of kept scans of a newer version",
                false => "not a catalog of kept scans",
            };
            return Err(FormatError::at_offset(0, reason).into());
        }
        self.at = HEADER_BYTES;
        Ok(())
    }

    /// The next entry; `None` after the last one of the flush.
    ///
    /// # Errors
    ///
    /// Damage, or a disk that refuses.
    pub(in crate::store) fn next(&mut self) -> Result<Option<CatalogEntry>> {
        match self.read_entry() {
            Ok(entry) => Ok(entry),
            Err(error) => Err(self.wrong(error)),
        }
    }

    /// After the last entry: checks that every scan up to this number was there.
    fn check_end(&self, scan_number: u64) -> Result<()> {
        if self.last == scan_number {
            return Ok(());
        }
        let reason = format!("it ends with scan {}, the map with scan {scan_number}", self.last);
        Err(self.wrong(FormatError::at_offset(self.at, reason).into()))
    }

    fn wrong(&self, error: DecodeError) -> Error {
        error.in_map(&self.path, None)
    }

    fn read_entry(&mut self) -> std::result::Result<Option<CatalogEntry>, DecodeError> {
        let left = self.input.file_bytes - self.at;
        if left < FRAME_BYTES {
            return Ok(None);
        }
        let mut lengths = [0; 8];
        self.input.read(&mut lengths)?;
        let [length, complement] = [0, 4]
            .map(|at| u32::from_le_bytes([lengths[at], lengths[at + 1], lengths[at + 2], lengths[at + 3]]));
        self.payload.clear();
        if length != !complement || u64::from(length) > left - FRAME_BYTES {
            // As far as the number of its flush.
            self.payload.resize(size_of::<u64>().min((left - FRAME_BYTES) as usize), 0);
            self.input.read(&mut self.payload)?;
            return self.end_or_damage("a record of no possible length");
        }
        self.payload.resize(length as usize, 0);
        self.input.read(&mut self.payload)?;
        let mut checksum = [0; 4];
        self.input.read(&mut checksum)?;
        if crc32fast::hash(&self.payload) != u32::from_le_bytes(checksum) {
            return self.end_or_damage("the checksum of a record does not match");
        }
        let wrong = |reason: &str| FormatError::at_offset(self.at, reason);
        let (flush, entry) =
            CatalogEntry::read(&self.payload).ok_or_else(|| wrong("a record of a newer version"))?;
        if flush > self.flush_number {
            return Ok(None);
        }
        if let Some((first, last)) = entry.numbers() {
            if first != self.last + 1 || last < first {
                return Err(wrong("its scans are not in order").into());
            }
            self.last = last;
        }
        self.at += FRAME_BYTES + u64::from(length);
        Ok(Some(entry))
    }
}

impl CatalogReader {
    /// What a record is that is not whole, by what is left of it: the end, if a flush that did not come to its commit
    /// has begun to write it (zeros where nothing reached the medium, or the number of a later flush), else damage.
    fn end_or_damage(&self, reason: &str) -> std::result::Result<Option<CatalogEntry>, DecodeError> {
        let number = self.payload.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        if number == 0 || number > self.flush_number {
            return Ok(None);
        }
        Err(FormatError::at_offset(self.at, reason).into())
    }
}

impl Input {
    /// Fills a buffer; false at the end of the file.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<bool> {
        let file = self.file.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
        match file.read_exact(buffer) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
            result => result.map(|()| true),
        }
    }
}

impl std::fmt::Debug for Input {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Input").field("file_bytes", &self.file_bytes).finish_non_exhaustive()
    }
}

/// Writes records to a catalog.
pub(super) struct CatalogWriter {
    out: BufWriter<Box<dyn DiskWrite>>,
    bytes: u64,
    payload: Vec<u8>,
}

impl CatalogWriter {
    /// Begins a catalog.
    pub(super) fn create(disk: &dyn Disk, layout: &Layout, generation: u64) -> io::Result<Self> {
        let mut out = BufWriter::new(disk.create(&layout.catalog(generation))?);
        out.write_all(&HEADER)?;
        Ok(Self { out, bytes: HEADER_BYTES, payload: Vec::new() })
    }

    /// Goes on with a catalog behind its first `bytes` bytes.
    pub(super) fn append(disk: &dyn Disk, layout: &Layout, generation: u64, bytes: u64) -> io::Result<Self> {
        let out = BufWriter::new(disk.append(&layout.catalog(generation), bytes)?);
        Ok(Self { out, bytes, payload: Vec::new() })
    }

    /// Writes the record of an entry, as of a flush.
    pub(super) fn put(&mut self, entry: &CatalogEntry, flush_number: u64) -> io::Result<()> {
        self.payload.clear();
        entry.write(flush_number, &mut self.payload);
        let length = u32::try_from(self.payload.len()).map_err(io::Error::other)?;
        self.out.write_all(&length.to_le_bytes())?;
        self.out.write_all(&(!length).to_le_bytes())?;
        self.out.write_all(&self.payload)?;
        self.out.write_all(&crc32fast::hash(&self.payload).to_le_bytes())?;
        self.bytes += FRAME_BYTES + u64::from(length);
        Ok(())
    }

    /// Makes all of it durable; returns the bytes of the file.
    pub(super) fn finish(self) -> io::Result<u64> {
        let mut out = self.out.into_inner().map_err(io::IntoInnerError::into_error)?;
        out.sync()?;
        Ok(self.bytes)
    }
}

/// The newest generation up to a flush; `None` if there is none.
///
/// # Errors
///
/// A folder that cannot be listed.
pub(in crate::store) fn generation_of(
    disk: &dyn Disk,
    layout: &Layout,
    flush_number: u64,
) -> Result<Option<u64>> {
    let folder = layout.kept_scans();
    match disk.list(&folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(Error::io(&folder, "list", error)),
        Ok(names) => {
            let generations = names.iter().filter_map(|name| Layout::generation_of(name));
            Ok(generations.filter(|&generation| generation <= flush_number).max())
        }
    }
}

/// A flush of a map that keeps its scans.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeptAsOf {
    pub(in crate::store) flush_number: u64,
    /// Number of its last scan.
    pub(crate) scan_number: u64,
}

impl KeptAsOf {
    /// Later than every flush.
    pub(crate) const NEWEST: Self = Self { flush_number: MAX_NUMBER, scan_number: MAX_NUMBER };
}

/// The kept scans of a map as of a flush, in order, without their points.
#[derive(Debug)]
pub(crate) struct KeptRecords(Option<(CatalogReader, u64)>);

impl KeptRecords {
    /// Opens the list as of a flush.
    pub(in crate::store) fn open(disk: &dyn Disk, layout: &Layout, as_of: KeptAsOf) -> Result<Self> {
        let KeptAsOf { flush_number, scan_number } = as_of;
        let Some(generation) = generation_of(disk, layout, flush_number)? else {
            return match scan_number {
                0 => Ok(Self(None)),
                _ => {
                    let reason = "the catalog of its kept scans is missing";
                    Err(FormatError::at_offset(0, reason).in_map(&layout.kept_scans(), None))
                }
            };
        };
        let reader = CatalogReader::open(disk, layout, generation, flush_number)?;
        Ok(Self(Some((reader, scan_number))))
    }

    /// What was read of the catalog so far: its bytes, and whether there is more in the file. `None` if there is none.
    pub(super) fn extent(&self) -> Option<(u64, bool)> {
        self.0.as_ref().map(|(reader, _)| (reader.at, reader.at != reader.input.file_bytes))
    }

    /// The next entry of the catalog, `None` after the last.
    ///
    /// # Errors
    ///
    /// Damage, or a disk that refuses.
    pub(crate) fn next_entry(&mut self) -> Result<Option<CatalogEntry>> {
        let Some((reader, scan_number)) = &mut self.0 else { return Ok(None) };
        let entry = reader.next()?;
        if entry.is_none() {
            reader.check_end(*scan_number)?;
        }
        Ok(entry)
    }

    /// The next kept scan; other entries are passed over.
    ///
    /// # Errors
    ///
    /// Damage, or a disk that refuses.
    pub(crate) fn next_kept(&mut self) -> Result<Option<KeptRecord>> {
        loop {
            match self.next_entry()? {
                Some(CatalogEntry::Kept(scan)) => return Ok(Some(*scan)),
                Some(_) => {}
                None => return Ok(None),
            }
        }
    }
}
