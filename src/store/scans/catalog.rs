use super::catalog_entry::{CatalogEntry, KeptRecord};
use super::catalog_version::CatalogVersion;
use crate::error::{DecodeError, Error, FormatError, Result};
use crate::store::commit::commits::Commits;
use crate::store::disk::{Disk, DiskRead, DiskWrite};
use crate::store::layout::Layout;
use crate::store::tiles::file_checksum::{Checksumming, FileChecksum};
use crate::store::tiles::tile_version::MAX_NUMBER;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

const HEADER_BYTES: u64 = 16;
/// Magic, version, zeros.
pub(super) const HEADER: [u8; 16] = *b"VXTKEPT\0\x01\0\0\0\0\0\0\0";
/// Length, its complement and checksum of a record.
pub(super) const FRAME_BYTES: u64 = 12;

/// Reader of a catalog in order, up to a flush.
#[derive(Debug)]
struct CatalogReader {
    path: PathBuf,
    input: Input,
    flush_number: u64,
    /// Version that the log names, if any.
    named: Option<CatalogVersion>,
    /// Checksum of the bytes before the next record.
    crc: crc32fast::Hasher,
    /// Offset of the next record.
    at: u64,
    /// Number of the last scan so far.
    last: u64,
    payload: Vec<u8>,
}

struct Input {
    // A `Mutex` because maps are `Sync`.
    file: std::sync::Mutex<BufReader<Box<dyn DiskRead>>>,
    file_bytes: u64,
}

impl CatalogReader {
    /// Opens the catalog of a generation. If the log names it, its checksum is verified before the first entry is
    /// returned.
    ///
    /// # Errors
    ///
    /// A missing or damaged catalog, or an I/O error.
    fn open(disk: &dyn Disk, layout: &Layout, generation: u64, as_of: KeptAsOf) -> Result<Self> {
        let mut reader = Self::begin(disk, layout, generation, as_of)?;
        let Some(named) = as_of.catalog else { return Ok(reader) };
        if checksum_of_front(disk, &reader.path, named.bytes)? == named.checksum() {
            return Ok(reader);
        }
        // The error of the first damaged record is more specific than a wrong checksum of the file.
        while reader.next()?.is_some() {}
        let (found, wanted) = (reader.input.file_bytes, named.bytes);
        let error = match found < wanted {
            true => FormatError::at_offset(found, format!("{found} bytes, but commits.log records {wanted}")),
            false => FormatError::at_offset(0, IS_ANOTHER),
        };
        Err(reader.wrong(error.into()))
    }

    fn begin(disk: &dyn Disk, layout: &Layout, generation: u64, as_of: KeptAsOf) -> Result<Self> {
        let path = layout.catalog(generation);
        let input = disk.open(&path).map_err(|error| refusal(&path, error))?;
        let file_bytes = input.file_bytes();
        let file = std::sync::Mutex::new(BufReader::with_capacity(1 << 16, input));
        let (input, payload, crc) = (Input { file, file_bytes }, Vec::new(), crc32fast::Hasher::new());
        let KeptAsOf { flush_number, catalog: named, .. } = as_of;
        let mut reader = Self { path, input, flush_number, named, crc, at: 0, last: 0, payload };
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
        self.crc.update(&HEADER);
        Ok(())
    }

    /// Returns the next entry; `None` after the last entry of the flush.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    fn next(&mut self) -> Result<Option<CatalogEntry>> {
        match self.read_entry() {
            Ok(entry) => Ok(entry),
            Err(error) => Err(self.wrong(error)),
        }
    }

    /// Checks, after the last entry, that the catalog contains every scan up to this number.
    fn check_end(&self, scan_number: u64) -> Result<()> {
        if self.last == scan_number {
            return Ok(());
        }
        let reason = format!("the catalog ends with scan {}, but the map with scan {scan_number}", self.last);
        Err(self.wrong(FormatError::at_offset(self.at, reason).into()))
    }

    fn wrong(&self, error: DecodeError) -> Error {
        error.in_map(&self.path, None)
    }

    fn read_entry(&mut self) -> std::result::Result<Option<CatalogEntry>, DecodeError> {
        let end = self.named.map_or(self.input.file_bytes, |named| named.bytes.min(self.input.file_bytes));
        let left = end.saturating_sub(self.at);
        if left < FRAME_BYTES {
            return Ok(None);
        }
        let mut lengths = [0; 8];
        self.input.read(&mut lengths)?;
        let [length, complement] = [0, 4]
            .map(|at| u32::from_le_bytes([lengths[at], lengths[at + 1], lengths[at + 2], lengths[at + 3]]));
        self.payload.clear();
        if length != !complement || u64::from(length) > left - FRAME_BYTES {
            // The length is invalid, so read only the flush number.
            self.payload.resize(size_of::<u64>().min((left - FRAME_BYTES) as usize), 0);
            self.input.read(&mut self.payload)?;
            return self.end_or_damage("a record with an invalid length");
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
        match self.named {
            Some(named) if !named.has_flush(flush, self.flush_number) => {
                return Err(wrong(IS_OF_ANOTHER).into());
            }
            None if flush > self.flush_number => return Ok(None),
            _ => {}
        }
        if let Some((first, last)) = entry.numbers() {
            if first != self.last + 1 || last < first {
                return Err(wrong("the scan numbers are not in order").into());
            }
            self.last = last;
        }
        self.at += FRAME_BYTES + u64::from(length);
        [&lengths[..], &self.payload, &checksum].iter().for_each(|bytes| self.crc.update(bytes));
        Ok(Some(entry))
    }
}

impl CatalogReader {
    /// Classifies an invalid record. If its flush number is that of a later flush, or 0 because its bytes never reached
    /// the disk, an uncommitted flush may have begun to write it: it is the end of the catalog. Otherwise it is damage,
    /// as is any invalid record in the part that the log names.
    fn end_or_damage(&self, reason: &str) -> std::result::Result<Option<CatalogEntry>, DecodeError> {
        let number = self.payload.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        if self.named.is_none() && (number == 0 || number > self.flush_number) {
            return Ok(None);
        }
        Err(FormatError::at_offset(self.at, reason).into())
    }
}

impl Input {
    /// Fills a buffer. Returns false at the end of the file.
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

pub(super) struct CatalogWriter {
    out: BufWriter<Box<dyn DiskWrite>>,
    generation: u64,
    bytes: u64,
    crc: crc32fast::Hasher,
    payload: Vec<u8>,
}

impl CatalogWriter {
    pub(super) fn create(disk: &dyn Disk, layout: &Layout, generation: u64) -> io::Result<Self> {
        let mut out = BufWriter::new(disk.create(&layout.catalog(generation))?);
        out.write_all(&HEADER)?;
        let mut crc = crc32fast::Hasher::new();
        crc.update(&HEADER);
        Ok(Self { out, generation, bytes: HEADER_BYTES, crc, payload: Vec::new() })
    }

    /// Opens a catalog for appending, and truncates it to this version.
    pub(super) fn append(disk: &dyn Disk, layout: &Layout, catalog: CatalogVersion) -> io::Result<Self> {
        let CatalogVersion { generation, bytes, crc32 } = catalog;
        let out = BufWriter::new(disk.append(&layout.catalog(generation), bytes)?);
        let crc = crc32fast::Hasher::new_with_initial_len(crc32, bytes);
        Ok(Self { out, generation, bytes, crc, payload: Vec::new() })
    }

    /// Writes the record of an entry with the number of its flush.
    pub(super) fn put(&mut self, entry: &CatalogEntry, flush_number: u64) -> io::Result<()> {
        self.payload.clear();
        entry.write(flush_number, &mut self.payload);
        let length = u32::try_from(self.payload.len()).map_err(io::Error::other)?;
        let checksum = crc32fast::hash(&self.payload).to_le_bytes();
        for part in [&length.to_le_bytes()[..], &(!length).to_le_bytes(), &self.payload, &checksum] {
            self.out.write_all(part)?;
            self.crc.update(part);
        }
        self.bytes += FRAME_BYTES + u64::from(length);
        Ok(())
    }

    /// Makes the catalog durable. Returns the version to be named in the log.
    pub(super) fn finish(self) -> io::Result<CatalogVersion> {
        let mut out = self.out.into_inner().map_err(io::IntoInnerError::into_error)?;
        out.sync()?;
        Ok(CatalogVersion { generation: self.generation, bytes: self.bytes, crc32: self.crc.finalize() })
    }
}

/// Returns the error of a catalog that cannot be opened.
fn refusal(path: &Path, error: io::Error) -> Error {
    match error.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => {
            FormatError::at_offset(0, IS_MISSING).in_map(path, None)
        }
        _ => Error::io(path, "open", error),
    }
}

/// Returns length and checksum of the first `bytes` bytes of a file, or of the whole file if it is shorter.
///
/// # Errors
///
/// A missing file, reported as damage because a writer may have removed it, or an I/O error.
pub(super) fn checksum_of_front(disk: &dyn Disk, path: &Path, bytes: u64) -> Result<FileChecksum> {
    let input = disk.open(path).map_err(|error| refusal(path, error))?;
    let mut input = Checksumming::new(input.take(bytes));
    io::copy(&mut input, &mut io::sink()).map_err(|error| Error::io(path, "read", error))?;
    Ok(input.finish().0)
}

/// Returns which of these versions of one catalog are valid. The file is read once.
pub(crate) fn whole_fronts(disk: &dyn Disk, layout: &Layout, fronts: &[CatalogVersion]) -> Vec<bool> {
    let mut are_whole = vec![false; fronts.len()];
    let mut order: Vec<_> = (0..fronts.len()).filter(|&at| fronts[at].is_there()).collect();
    order.sort_unstable_by_key(|&at| fronts[at].bytes);
    let Some(&first) = order.first() else { return are_whole };
    // Errors are ignored: the next opening of the catalog reports them.
    let Ok(input) = disk.open(&layout.catalog(fronts[first].generation)) else { return are_whole };
    let (mut input, mut read, mut crc) = (input, 0, crc32fast::Hasher::new());
    let mut buffer = vec![0; 1 << 16];
    for at in order {
        while read < fronts[at].bytes {
            let length = (fronts[at].bytes - read).min(buffer.len() as u64) as usize;
            match input.read(&mut buffer[..length]) {
                Ok(0) => return are_whole,
                Ok(bytes) => {
                    crc.update(&buffer[..bytes]);
                    read += bytes as u64;
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(_) => return are_whole,
            }
        }
        are_whole[at] = crc.clone().finalize() == fronts[at].crc32;
    }
    are_whole
}

/// Errors of catalogs that the log names.
pub(super) const IS_MISSING: &str = "the file is missing";
pub(super) const IS_ANOTHER: &str = "the file does not match its checksum in commits.log";
pub(super) const IS_OF_ANOTHER: &str = "a record of another catalog";

/// Returns the newest generation up to a flush; `None` if there is none.
fn newest_generation(disk: &dyn Disk, layout: &Layout, flush_number: u64) -> Result<Option<u64>> {
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

/// Lists the generations of the catalogs in a map's folder, in order. Empty if the folder cannot be listed.
pub(crate) fn catalog_generations(disk: &dyn Disk, layout: &Layout) -> Vec<u64> {
    let names = disk.list(&layout.kept_scans()).unwrap_or_default();
    let generations = names.iter().filter_map(|name| Layout::generation_of(name));
    let mut generations: Vec<_> = generations.filter(|&generation| generation < MAX_NUMBER).collect();
    generations.sort_unstable();
    generations
}

/// Kept scans of a map as of a flush.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeptAsOf {
    pub(in crate::store) flush_number: u64,
    /// Number of the last scan of the flush.
    pub(crate) scan_number: u64,
    /// Catalog of the flush; `None` if neither log nor metadata names it.
    pub(crate) catalog: Option<CatalogVersion>,
}

impl KeptAsOf {
    /// A flush later than all others.
    pub(crate) const NEWEST: Self = Self { flush_number: MAX_NUMBER, scan_number: MAX_NUMBER, catalog: None };

    pub(in crate::store) fn last_of(commits: &Commits) -> Self {
        let Commits { flush_number, scan_number, catalog, .. } = *commits;
        Self { flush_number, scan_number, catalog }
    }

    /// Returns the generation of the catalog: the named one, otherwise the newest up to the flush. `None` if there is
    /// none.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub(in crate::store) fn generation(&self, disk: &dyn Disk, layout: &Layout) -> Result<Option<u64>> {
        match self.catalog {
            Some(catalog) => Ok(catalog.is_there().then_some(catalog.generation)),
            None => newest_generation(disk, layout, self.flush_number),
        }
    }

    /// Returns the error of a flush with scans but without a catalog.
    pub(super) fn no_catalog(layout: &Layout) -> Error {
        let reason = "the catalog of its kept scans is missing";
        FormatError::at_offset(0, reason).in_map(&layout.kept_scans(), None)
    }
}

/// Iterator over the kept scans of a map as of a flush, in order, without their points.
#[derive(Debug)]
pub(crate) struct KeptRecords(Option<(CatalogReader, u64)>);

impl KeptRecords {
    pub(crate) fn open(disk: &dyn Disk, layout: &Layout, as_of: KeptAsOf) -> Result<Self> {
        let Some(generation) = as_of.generation(disk, layout)? else {
            return if as_of.scan_number == 0 { Ok(Self(None)) } else { Err(KeptAsOf::no_catalog(layout)) };
        };
        let reader = CatalogReader::open(disk, layout, generation, as_of)?;
        Ok(Self(Some((reader, as_of.scan_number))))
    }

    /// Returns the part of a catalog read so far, and whether the file is longer. `None` if there is no catalog.
    pub(super) fn extent(&self, generation: u64) -> Option<(CatalogVersion, bool)> {
        self.0.as_ref().map(|(reader, _)| {
            let (bytes, crc32) = (reader.at, reader.crc.clone().finalize());
            (CatalogVersion { generation, bytes, crc32 }, bytes != reader.input.file_bytes)
        })
    }

    /// Returns the next entry of the catalog; `None` after the last.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub(crate) fn next_entry(&mut self) -> Result<Option<CatalogEntry>> {
        let Some((reader, scan_number)) = &mut self.0 else { return Ok(None) };
        let entry = reader.next()?;
        if entry.is_none() {
            reader.check_end(*scan_number)?;
        }
        Ok(entry)
    }

    /// Returns the next kept scan, and skips other entries.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
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
