use super::catalog::{CatalogWriter, KeptAsOf, KeptRecords};
use super::catalog_entry::{CatalogEntry, SegmentPlace};
use super::catalog_version::CatalogVersion;
use super::scan_list::read_scans;
use super::segment::{SegmentReader, SegmentWriter};
use crate::error::{Error, Result};
use crate::store::commit::commits::Commits;
use crate::store::disk::Disk;
use crate::store::layout::Layout;
use crate::store::map_files::MapFiles;
use std::collections::BTreeSet;
use std::fmt;
use std::io;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// Kept scans of a map: a catalog, and segments with points.
///
/// A scan is written in blocks, whose content is opaque to the store. It is part of the archive once its entry is noted
/// and committed by [`TileStore::commit`](crate::store::TileStore::commit).
#[derive(Debug)]
pub struct ScanArchive {
    files: MapFiles,
    /// Whether the map keeps its scans.
    is_on: bool,
    /// Whether it has, or once had, scans with the motion of the sensor.
    has_motion: bool,
    /// Kept scans as of the last commit.
    last_commit: KeptAsOf,
    /// Catalog as of the last commit, if there is one; `None` before it was searched for.
    committed: Option<Option<Catalog>>,
    /// Entries of the next commit, to be appended to the replacement if there is one, else to the committed catalog.
    pending: Vec<CatalogEntry>,
    /// Number of pending entries that belong to a commit in progress.
    begun_entries: usize,
    /// New catalog that replaces the committed one.
    replacement: Option<Replacement>,
    segment: Option<SegmentWriter>,
    /// Start of the scan that is being written, or is written and not noted yet.
    scan_start: Option<ScanStart>,
    /// Segments with scans that are not durable.
    unsynced: BTreeSet<u64>,
    /// Segments whose sync failed. A later successful sync of them proves nothing.
    failed_segments: BTreeSet<u64>,
    /// Whether a sync failed while a replacement was written.
    has_replacement_failed: bool,
    has_new_names: bool,
    /// Highest segment in all catalogs read so far. New segments get higher numbers, also if that segment is lost.
    highest_segment: u64,
    /// Generation of a catalog that was created for a commit, which may have failed.
    begun: Option<u64>,
}

/// Valid part of a catalog's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::store) struct Catalog {
    version: CatalogVersion,
    /// Whether the file may be longer.
    has_excess: bool,
}

impl Catalog {
    pub(in crate::store) fn version(self) -> CatalogVersion {
        self.version
    }
}

/// Start of a scan in a segment.
#[derive(Clone, Copy, Debug)]
struct ScanStart {
    segment: u64,
    offset: u64,
}

enum Replacement {
    Open {
        generation: u64,
        out: Mutex<CatalogWriter>,
    },
    /// Synced, but not committed yet.
    Whole(Catalog),
}

impl fmt::Debug for Replacement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Open { .. } => "Open",
            Self::Whole(_) => "Whole",
        })
    }
}

impl fmt::Debug for SegmentWriter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SegmentWriter").field("segment", &self.segment).finish_non_exhaustive()
    }
}

impl ScanArchive {
    pub(in crate::store) fn new(
        files: MapFiles,
        [is_on, has_motion]: [bool; 2],
        last_commit: KeptAsOf,
    ) -> Self {
        Self {
            files,
            is_on,
            has_motion,
            last_commit,
            committed: None,
            pending: Vec::new(),
            begun_entries: 0,
            replacement: None,
            segment: None,
            scan_start: None,
            unsynced: BTreeSet::new(),
            failed_segments: BTreeSet::new(),
            has_replacement_failed: false,
            has_new_names: false,
            highest_segment: 0,
            begun: None,
        }
    }

    /// Returns whether the map keeps its scans.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    pub(in crate::store) fn has_motion(&self) -> bool {
        self.has_motion
    }

    pub(crate) fn last_commit(&self) -> KeptAsOf {
        self.last_commit
    }

    pub(in crate::store) fn set_last_commit(&mut self, commits: &Commits) {
        self.last_commit = KeptAsOf::last_of(commits);
    }

    /// Returns the entries of scans as of the last commit, in order.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub(crate) fn records(&self) -> Result<KeptRecords> {
        KeptRecords::open(&**self.files.disk(), self.files.layout(), self.last_commit)
    }

    /// Returns the generation of the committed catalog. New scans are appended to it. Changes of earlier entries need a
    /// new catalog.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub(crate) fn generation(&self) -> Result<Option<u64>> {
        self.last_commit.generation(&**self.files.disk(), self.files.layout())
    }

    /// Returns the path of the catalog of a flush, if it has one.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub(crate) fn catalog_path(&self, as_of: KeptAsOf) -> Result<Option<PathBuf>> {
        let generation = as_of.generation(&**self.files.disk(), self.files.layout())?;
        Ok(generation.map(|generation| self.files.layout().catalog(generation)))
    }

    /// Starts keeping scans from the next commit on.
    pub fn begin(&mut self) {
        if !self.is_on {
            self.is_on = true;
            // Existing catalogs belong to snapshots.
            self.committed = Some(None);
        }
    }

    /// Returns whether a segment may contain scans that no commit names yet.
    pub(in crate::store) fn is_writing(&self, segment: u64) -> bool {
        // The next commit copies noted scans out of segments whose sync failed.
        self.unsynced.contains(&segment)
            || self.failed_segments.contains(&segment)
            || self.segment.as_ref().is_some_and(|open| open.segment == segment)
    }

    /// Records that a catalog names segments up to this one.
    pub(in crate::store) fn note_segment(&mut self, segment: u64) {
        self.highest_segment = self.highest_segment.max(segment);
    }

    pub(in crate::store) fn has_news(&self) -> bool {
        !self.pending.is_empty() || self.replacement.is_some()
    }

    pub(in crate::store) fn bytes(&self) -> usize {
        let heap: usize = self.pending.iter().map(CatalogEntry::heap_bytes).sum();
        self.pending.capacity() * size_of::<CatalogEntry>() + heap
    }

    // Points.

    /// Begins to write the points of a scan. Discards a scan that was begun and not noted.
    ///
    /// # Errors
    ///
    /// A damaged catalog or an I/O error.
    pub fn begin_scan(&mut self) -> Result<()> {
        let (_, start) = self.open_segment()?;
        self.scan_start = Some(start);
        Ok(())
    }

    /// Returns the segment that new scans are written to, and the start of the next scan.
    fn open_segment(&mut self) -> Result<(&mut SegmentWriter, ScanStart)> {
        // Report a damaged catalog before anything is written.
        if self.replacement.is_none() {
            self.find_committed()?;
        }
        if self.segment.as_ref().is_none_or(SegmentWriter::is_full) {
            self.make_folder()?;
            let (disk, layout) = (&**self.files.disk(), self.files.layout());
            let last = segments_in(disk, layout)?.last().copied().unwrap_or_default();
            let segment = last.max(self.highest_segment) + 1;
            self.highest_segment = segment;
            self.segment = Some(SegmentWriter::create(disk, layout, segment)?);
            self.has_new_names = true;
        }
        let layout = self.files.layout();
        let missing = || Error::io(&layout.kept_scans(), "write", io::Error::other("no segment is open"));
        let segment = self.segment.as_mut().ok_or_else(missing)?;
        let start = ScanStart { segment: segment.segment, offset: segment.bytes() };
        Ok((segment, start))
    }

    /// Adds a block of points to the scan.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn push_block(&mut self, block: &[u8]) -> Result<()> {
        self.segment.as_mut().map_or(Ok(()), |segment| segment.push(block))
    }

    /// Ends the scan. It takes effect when its entry is noted.
    pub fn end_scan(&mut self) -> SegmentPlace {
        let (Some(segment), Some(start)) = (&mut self.segment, self.scan_start) else {
            return SegmentPlace::default();
        };
        self.unsynced.insert(segment.segment);
        segment.place_from(start.offset)
    }

    /// Discards the last begun scan, if it is not noted.
    pub fn give_up_scan(&mut self) {
        if let Some(start) = self.scan_start.take() {
            self.cut(start);
        }
    }

    /// Truncates the segment being written, if it is this one.
    fn cut(&mut self, start: ScanStart) {
        let disk = &**self.files.disk();
        if let Some(segment) = self.segment.as_mut().filter(|segment| segment.segment == start.segment)
            && segment.cut(disk, start.offset).is_err()
        {
            // Noted scans in this segment remain valid. The next scan starts a new segment.
            self.segment = None;
        }
    }

    /// Copies the points of a scan to the segment being written, which no catalog names yet.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub fn copy(&mut self, place: SegmentPlace) -> Result<SegmentPlace> {
        let (disk, layout) = (self.files.disk().clone(), self.files.layout().clone());
        self.copy_from(&*disk, &layout, place)
    }

    /// Like [`ScanArchive::copy`], from another map.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub(crate) fn copy_from(
        &mut self,
        disk: &dyn Disk,
        layout: &Layout,
        place: SegmentPlace,
    ) -> Result<SegmentPlace> {
        let mut scan = SegmentReader::open(disk, layout, place)?;
        let (segment, start) = self.open_segment()?;
        let copied = segment.copy(&mut scan);
        self.unsynced.insert(start.segment);
        match copied {
            // A begun scan before the copy can no longer be discarded by truncation.
            Ok(_) => self.scan_start = self.scan_start.filter(|begun| begun.segment != start.segment),
            // A partial copy must not remain before later scans.
            Err(_) => self.cut(start),
        }
        copied
    }

    // Entries.

    /// Adds an entry to the next commit, if the map keeps its scans.
    pub fn note(&mut self, entry: CatalogEntry) {
        if !self.is_on {
            return;
        }
        if let CatalogEntry::Kept(scan) = &entry {
            self.scan_start = None;
            self.has_motion |= scan.has_motion();
        }
        // Entries of a commit in progress must not change.
        let own = self.pending.get_mut(self.begun_entries..).unwrap_or_default();
        if let (Some(CatalogEntry::Unlisted(_, last)), CatalogEntry::Unlisted(first, new_last)) =
            (own.last_mut(), &entry)
            && *last + 1 == *first
        {
            *last = *new_last;
            return;
        }
        self.pending.push(entry);
    }

    /// Begins a new catalog, which replaces the committed one at the next commit.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn begin_catalog(&mut self) -> Result<()> {
        self.make_folder()?;
        let files = &self.files;
        remove_catalogs_after(files, self.last_commit.flush_number)?;
        let generation = self.last_commit.flush_number + 1;
        let out = CatalogWriter::create(&**files.disk(), files.layout(), generation)
            .map_err(|error| Error::io(&files.layout().catalog(generation), "create", error))?;
        self.has_new_names = true;
        self.has_replacement_failed = false;
        self.replacement = Some(Replacement::Open { generation, out: Mutex::new(out) });
        Ok(())
    }

    /// Adds an entry to the new catalog. Scan numbers must be contiguous.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn put(&mut self, entry: &CatalogEntry) -> Result<()> {
        let Some(Replacement::Open { generation, out }) = &mut self.replacement else { return Ok(()) };
        if let CatalogEntry::Kept(scan) = entry {
            self.has_motion |= scan.has_motion();
        }
        let out = out.get_mut().unwrap_or_else(PoisonError::into_inner);
        out.put(entry, *generation)
            .map_err(|error| Error::io(&self.files.layout().catalog(*generation), "write", error))
    }

    /// Writes and syncs a catalog of the next generation that neither the map nor a snapshot names yet.
    pub(in crate::store) fn write_other(
        &self,
        write: impl FnOnce(&mut dyn FnMut(&CatalogEntry) -> Result<()>) -> Result<()>,
    ) -> Result<CatalogVersion> {
        let generation = self.last_commit.flush_number + 1;
        let (disk, layout) = (&**self.files.disk(), self.files.layout());
        let refused = |error| Error::io(&layout.catalog(generation), "write", error);
        self.make_folder()?;
        let mut out = CatalogWriter::create(disk, layout, generation).map_err(refused)?;
        write(&mut |entry| out.put(entry, generation).map_err(refused))?;
        let catalog = out.finish().map_err(refused)?;
        self.files.sync_folder(&layout.kept_scans())?;
        Ok(catalog)
    }

    /// Resets the kept scans to those of an earlier commit.
    pub(in crate::store) fn rewind(&mut self, past: &Self) -> Result<()> {
        self.is_on = past.is_on;
        self.has_motion |= past.has_motion;
        if !past.is_on {
            return Ok(());
        }
        self.begin_catalog()?;
        let mut records = past.records()?;
        while let Some(entry) = records.next_entry()? {
            self.put(&entry)?;
        }
        Ok(())
    }

    /// Returns whether the scans of the last commit equal those of another state.
    pub(in crate::store) fn has_scans_of(&self, past: &Self) -> Result<bool> {
        let (mut now, mut then) = (self.records()?, past.records()?);
        loop {
            match (now.next_entry()?, then.next_entry()?) {
                (None, None) => return Ok(true),
                (now, then) if now == then => {}
                _ => return Ok(false),
            }
        }
    }

    // Commits.

    /// Begins a commit of the entries noted so far.
    pub(in crate::store) fn begin_commit(&mut self) {
        self.begun_entries = self.pending.len();
    }

    pub(in crate::store) fn unsynced(&self) -> Vec<u64> {
        self.unsynced.iter().copied().collect()
    }

    /// Writes and syncs the scans of the next commit. `has_tiles` states that the map had tiles at the last commit.
    /// Returns the argument for [`ScanArchive::commit`].
    ///
    /// # Errors
    ///
    /// An I/O error. The next call writes them again.
    pub(in crate::store) fn write(&mut self, has_tiles: bool) -> Result<Option<Catalog>> {
        if !self.is_on {
            return Ok(None);
        }
        // If the committed catalog will be replaced, it is not read, because it may be damaged.
        let committed = if self.replacement.is_some() { None } else { self.find_committed()? };
        self.copy_failed_segments()?;
        self.sync_segments()?;
        let written = self.write_catalog(committed, has_tiles)?;
        if self.has_new_names {
            self.files.sync_folder(&self.files.layout().kept_scans())?;
            self.has_new_names = false;
        }
        Ok(written)
    }

    fn write_catalog(&mut self, committed: Option<Catalog>, has_tiles: bool) -> Result<Option<Catalog>> {
        let flush_number = self.last_commit.flush_number + 1;
        let in_place = match self.replacement.take() {
            Some(Replacement::Open { generation, out }) => {
                let out = out.into_inner().unwrap_or_else(PoisonError::into_inner);
                let version = out.finish();
                let version = version
                    .map_err(|error| Error::io(&self.files.layout().catalog(generation), "write", error))?;
                let whole = Catalog { version, has_excess: false };
                self.replacement = Some(Replacement::Whole(whole));
                Some(whole)
            }
            Some(Replacement::Whole(whole)) => {
                // Written for a commit that failed later. The file may end with other entries of that commit.
                self.replacement = Some(Replacement::Whole(whole));
                Some(Catalog { has_excess: true, ..whole })
            }
            None => committed,
        };
        if in_place.is_some_and(|catalog| !catalog.has_excess) && self.begun_entries == 0 {
            return Ok(in_place);
        }
        let earlier = if in_place.is_none() { self.entries_before(has_tiles)? } else { Vec::new() };
        if in_place.is_none() && earlier.is_empty() && self.begun_entries == 0 {
            return Ok(None);
        }
        self.make_folder()?;
        let (disk, layout) = (&**self.files.disk(), self.files.layout());
        if let Some(begun) = self.begun.take().filter(|&begun| begun != flush_number) {
            // The catalog belongs to a failed commit, and another commit has been made since.
            self.files.remove_file(&layout.catalog(begun))?;
        }
        self.begun = in_place.is_none().then_some(flush_number);
        let generation = in_place.map_or(flush_number, |catalog| catalog.version.generation);
        self.has_new_names |= in_place.is_none();
        let write = || -> io::Result<CatalogVersion> {
            let mut out = match in_place {
                Some(catalog) => CatalogWriter::append(disk, layout, catalog.version)?,
                None => CatalogWriter::create(disk, layout, generation)?,
            };
            let begun = self.pending.get(..self.begun_entries).unwrap_or(&self.pending);
            earlier.iter().chain(begun).try_for_each(|entry| out.put(entry, flush_number))?;
            out.finish()
        };
        let version = write().map_err(|error| Error::io(&layout.catalog(generation), "write", error));
        if let (Err(_), Some(Some(committed))) = (&version, &mut self.committed) {
            committed.has_excess = true;
        }
        Ok(Some(Catalog { version: version?, has_excess: false }))
    }

    /// Records that the written catalog is committed.
    pub(in crate::store) fn commit(&mut self, written: Option<Catalog>) {
        if self.is_on {
            self.committed = Some(written);
        }
        self.pending = self.pending.split_off(self.begun_entries.min(self.pending.len()));
        (self.begun_entries, self.replacement, self.begun) = (0, None, None);
    }

    /// Records that the commit failed. Its records may be in the file.
    pub(in crate::store) fn not_committed(&mut self) {
        if let Some(Some(committed)) = &mut self.committed {
            committed.has_excess = true;
        }
    }

    /// Returns the entries for scans before the map kept scans: its list of scans, and unlisted ones.
    fn entries_before(&self, has_tiles: bool) -> Result<Vec<CatalogEntry>> {
        let KeptAsOf { flush_number, scan_number, .. } = self.last_commit;
        let mut entries = Vec::new();
        let mut last = 0;
        for scan in read_scans(&**self.files.disk(), self.files.layout(), flush_number, None)? {
            if scan.number <= last || scan.number > scan_number {
                continue;
            }
            if scan.number > last + 1 {
                entries.push(CatalogEntry::Unlisted(last + 1, scan.number - 1));
            }
            last = scan.number;
            entries.push(CatalogEntry::Listed(scan));
        }
        if last < scan_number {
            entries.push(CatalogEntry::Unlisted(last + 1, scan_number));
        }
        if scan_number == 0 && has_tiles {
            entries.push(CatalogEntry::Operation("content from before scans were kept".to_owned()));
        }
        Ok(entries)
    }

    /// Verifies and returns the catalog as of the last commit. A writer may truncate the records after it. A damaged
    /// catalog is an error, so that it is never truncated.
    pub(in crate::store) fn find_committed(&mut self) -> Result<Option<Catalog>> {
        if let Some(committed) = self.committed {
            return Ok(committed);
        }
        remove_catalogs_after(&self.files, self.last_commit.flush_number)?;
        let (generation, mut records) = (self.generation()?, self.records()?);
        while let Some(scan) = records.next_kept()? {
            let highest = scan.places().map(|place| place.segment).max();
            self.highest_segment = self.highest_segment.max(highest.unwrap_or_default());
        }
        let extent = generation.and_then(|generation| records.extent(generation));
        let found = extent.map(|(version, has_excess)| Catalog { version, has_excess });
        self.committed = Some(found);
        Ok(found)
    }

    /// Records a failed sync: scans that are not durable are copied to another segment before the next commit.
    pub(in crate::store) fn note_failed_sync(&mut self) {
        self.has_replacement_failed |= !self.unsynced.is_empty();
        self.failed_segments.append(&mut self.unsynced);
        self.segment = None;
    }

    fn sync_segments(&mut self) -> Result<()> {
        for &segment in &self.unsynced {
            let path = self.files.layout().segment(segment);
            if let Err(error) = self.files.disk().sync_file(&path) {
                self.note_failed_sync();
                return Err(Error::io(&path, "sync", error));
            }
        }
        self.unsynced.clear();
        Ok(())
    }

    /// Copies scans out of segments whose sync failed. Checksums verify what is read.
    fn copy_failed_segments(&mut self) -> Result<()> {
        if self.replacement.is_some() && self.has_replacement_failed {
            let error = io::Error::other("an earlier sync failed; start the operation again");
            return Err(Error::io(&self.files.layout().kept_scans(), "commit", error));
        }
        let mut pending = std::mem::take(&mut self.pending);
        let mut moved = Ok(());
        for entry in &mut pending {
            let CatalogEntry::Kept(scan) = entry else { continue };
            for place in scan.places_mut() {
                if moved.is_ok() && self.failed_segments.contains(&place.segment) {
                    moved = self.copy(*place).map(|copy| *place = copy);
                }
            }
        }
        self.pending = pending;
        // Keep these segments in the list: scans in them may be noted later.
        moved
    }

    pub(in crate::store) fn make_folder(&self) -> Result<()> {
        let files = &self.files;
        let folder = files.layout().kept_scans();
        if files.kind(&folder)?.is_none() {
            files.disk().create_folder(&folder).map_err(|error| Error::io(&folder, "create", error))?;
            files.sync_map_folder()?;
        }
        Ok(())
    }
}

/// Removes catalogs of uncommitted flushes.
fn remove_catalogs_after(files: &MapFiles, committed_flush: u64) -> Result<()> {
    let folder = files.layout().kept_scans();
    let names = match files.disk().list(&folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        names => names.map_err(|error| Error::io(&folder, "list", error))?,
    };
    for generation in names.iter().filter_map(|name| Layout::generation_of(name)) {
        if generation > committed_flush {
            files.remove_file(&files.layout().catalog(generation))?;
        }
    }
    Ok(())
}

fn segments_in(disk: &dyn Disk, layout: &Layout) -> Result<Vec<u64>> {
    let folder = layout.kept_scans();
    let names = disk.list(&folder).map_err(|error| Error::io(&folder, "list", error))?;
    let mut segments: Vec<u64> = names.iter().filter_map(|name| Layout::segment_of(name)).collect();
    segments.sort_unstable();
    Ok(segments)
}
