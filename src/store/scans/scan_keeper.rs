use super::catalog::{CatalogWriter, KeptAsOf, KeptRecords, whole_fronts};
use super::catalog_entry::{CatalogEntry, KeptRecord, SegmentPlace};
use super::catalog_version::CatalogVersion;
use super::segment::{SegmentScan, SegmentWriter};
use crate::error::{Error, FormatError, Result};
use crate::space::Point;
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::Layout;
use crate::store::map_files::MapFiles;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// What a writer knows of the scans that its map keeps.
#[derive(Debug, Default)]
pub(in crate::store) struct ScanKeeper {
    /// Whether the map keeps its scans.
    is_on: bool,
    /// The catalog as of the last commit, nothing before the first; `None` before it was looked for.
    committed: Option<Option<Catalog>>,
    /// Entries of the next commit, behind the committed ones or, if there is one, the replacement.
    pending: Vec<CatalogEntry>,
    /// How many of these belong to a commit that has begun.
    begun_entries: usize,
    /// The catalog that takes the place of the committed one.
    replacement: Option<Replacement>,
    segment: Option<SegmentWriter>,
    /// Where the scan begins that is being written, or was written and is not noted yet.
    scan_start: Option<ScanStart>,
    /// Segments with scans that are not durable.
    unsynced: BTreeSet<u64>,
    /// What the disk says of these proves nothing any more: it failed to sync them.
    suspects: BTreeSet<u64>,
    /// Whether that came while a replacement was made.
    is_replacement_suspect: bool,
    has_new_names: bool,
    /// The highest segment that a catalog names, as far as catalogs were read: one that is lost gets no other's scans.
    highest_segment: u64,
    /// A catalog that was begun for a commit, which may not have come.
    begun: Option<u64>,
}

/// A catalog's file, up to where it counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::store) struct Catalog {
    version: CatalogVersion,
    /// Whether the file may go on behind that.
    has_excess: bool,
}

impl Catalog {
    /// What the log names.
    pub(in crate::store) fn version(self) -> CatalogVersion {
        self.version
    }
}

/// Where a scan begins among the segments.
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
    /// Synced, and not committed yet.
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

impl ScanKeeper {
    /// Whether the map keeps its scans.
    pub(in crate::store) fn is_on(&self) -> bool {
        self.is_on
    }

    /// Of a map that is opened, or is another state's again.
    pub(in crate::store) fn set_on(&mut self, is_on: bool) {
        self.is_on = is_on;
    }

    /// Begins to keep scans.
    pub(in crate::store) fn begin(&mut self) {
        if !self.is_on {
            self.is_on = true;
            // Catalogs that are there belong to snapshots.
            self.committed = Some(None);
        }
    }

    /// Whether a segment may have scans that no commit names yet.
    pub(in crate::store) fn is_writing(&self, segment: u64) -> bool {
        // Of suspects what is noted is copied by the next commit.
        self.unsynced.contains(&segment)
            || self.suspects.contains(&segment)
            || self.segment.as_ref().is_some_and(|open| open.segment == segment)
    }

    /// Notes that a catalog names segments up to this one.
    pub(in crate::store) fn note_segment(&mut self, segment: u64) {
        self.highest_segment = self.highest_segment.max(segment);
    }

    /// Whether there is something for the next commit.
    pub(in crate::store) fn has_news(&self) -> bool {
        !self.pending.is_empty() || self.replacement.is_some()
    }

    /// Bytes of memory.
    pub(in crate::store) fn bytes(&self) -> usize {
        let heap: usize = self.pending.iter().map(CatalogEntry::heap_bytes).sum();
        self.pending.capacity() * size_of::<CatalogEntry>() + heap
    }

    // Points.

    /// Begins a scan.
    pub(in crate::store) fn begin_scan(&mut self, files: &MapFiles, last_commit: KeptAsOf) -> Result<()> {
        let (_, start) = self.open_segment(files, last_commit)?;
        self.scan_start = Some(start);
        Ok(())
    }

    /// The segment that scans are written to, and where the next one begins.
    fn open_segment(
        &mut self,
        files: &MapFiles,
        last_commit: KeptAsOf,
    ) -> Result<(&mut SegmentWriter, ScanStart)> {
        // A catalog that is damaged is told before anything is written.
        if self.replacement.is_none() {
            self.find_committed(files, last_commit)?;
        }
        let (disk, layout) = (&**files.disk(), files.layout());
        if self.segment.as_ref().is_none_or(SegmentWriter::is_full) {
            self.make_folder(files)?;
            let last = segments_in(disk, layout)?.last().copied().unwrap_or_default();
            let segment = last.max(self.highest_segment) + 1;
            self.highest_segment = segment;
            self.segment = Some(SegmentWriter::create(disk, layout, segment)?);
            self.has_new_names = true;
        }
        let missing = || Error::io(&layout.kept_scans(), "write", io::Error::other("no segment is open"));
        let segment = self.segment.as_mut().ok_or_else(missing)?;
        let start = ScanStart { segment: segment.segment, offset: segment.bytes() };
        Ok((segment, start))
    }

    /// Adds points to the scan.
    pub(in crate::store) fn push_points(
        &mut self,
        points: &[Point],
        intensities: Option<&[f32]>,
    ) -> Result<()> {
        self.segment.as_mut().map_or(Ok(()), |segment| segment.push(points, intensities))
    }

    /// Ends the scan. It is nothing until it is noted.
    pub(in crate::store) fn end_scan(&mut self, has_intensities: bool) -> Result<SegmentPlace> {
        let (Some(segment), Some(start)) = (&mut self.segment, self.scan_start) else {
            return Ok(SegmentPlace::default());
        };
        self.unsynced.insert(segment.segment);
        segment.end(start.offset, has_intensities)
    }

    /// Takes back the scan that was begun last and is not noted.
    pub(in crate::store) fn give_up_scan(&mut self, disk: &dyn Disk) {
        if let Some(start) = self.scan_start.take() {
            self.cut(disk, start);
        }
    }

    /// Cuts the open segment, if it is this one.
    fn cut(&mut self, disk: &dyn Disk, start: ScanStart) {
        if let Some(segment) = self.segment.as_mut().filter(|segment| segment.segment == start.segment)
            && segment.cut(disk, start.offset).is_err()
        {
            // What lies in it and is noted stays; the next scan goes to another.
            self.segment = None;
        }
    }

    /// Copies the points of a scan to the segment that is being written.
    pub(in crate::store) fn copy(
        &mut self,
        files: &MapFiles,
        last_commit: KeptAsOf,
        place: SegmentPlace,
    ) -> Result<SegmentPlace> {
        let disk = &**files.disk();
        let mut scan = SegmentScan::open(disk, files.layout(), place)?;
        let (segment, start) = self.open_segment(files, last_commit)?;
        let copied = segment.copy(&mut scan);
        self.unsynced.insert(start.segment);
        match copied {
            // What a scan's owner may still give up lies before it now, and stays.
            Ok(_) => self.scan_start = self.scan_start.filter(|begun| begun.segment != start.segment),
            // Half a scan must not move those that follow.
            Err(_) => self.cut(disk, start),
        }
        copied
    }

    // Entries.

    /// Records an entry of the next commit.
    pub(in crate::store) fn note(&mut self, entry: CatalogEntry) {
        if matches!(entry, CatalogEntry::Kept(_)) {
            self.scan_start = None;
        }
        // What a commit has begun to take along stays as it is.
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

    /// Begins a catalog that takes the place of the committed one with the next commit.
    pub(in crate::store) fn begin_replacement(
        &mut self,
        files: &MapFiles,
        committed_flush: u64,
    ) -> Result<()> {
        self.make_folder(files)?;
        remove_catalogs_after(files, committed_flush)?;
        let generation = committed_flush + 1;
        let out = CatalogWriter::create(&**files.disk(), files.layout(), generation)
            .map_err(|error| Error::io(&files.layout().catalog(generation), "create", error))?;
        self.has_new_names = true;
        self.is_replacement_suspect = false;
        self.replacement = Some(Replacement::Open { generation, out: Mutex::new(out) });
        Ok(())
    }

    /// Adds an entry to the catalog that takes the place of the committed one.
    pub(in crate::store) fn put(&mut self, files: &MapFiles, entry: &CatalogEntry) -> Result<()> {
        let Some(Replacement::Open { generation, out }) = &mut self.replacement else { return Ok(()) };
        let out = out.get_mut().unwrap_or_else(PoisonError::into_inner);
        out.put(entry, *generation)
            .map_err(|error| Error::io(&files.layout().catalog(*generation), "write", error))
    }

    // Commits.

    /// Begins a commit: it takes along the entries that there are now.
    pub(in crate::store) fn begin_commit(&mut self) {
        self.begun_entries = self.pending.len();
    }

    /// The segments with scans that are not durable.
    pub(in crate::store) fn unsynced(&self) -> Vec<u64> {
        self.unsynced.iter().copied().collect()
    }

    /// Writes what belongs to the commit after `last_commit`, synced. `before` are the entries of
    /// what the map had before its scans were kept, for the first catalog. Returns what [`ScanKeeper::commit`] is to be
    /// told.
    ///
    /// # Errors
    ///
    /// A disk that refuses: the next call writes it again.
    pub(in crate::store) fn write(
        &mut self,
        files: &MapFiles,
        last_commit: KeptAsOf,
        before: impl FnOnce() -> Result<Vec<CatalogEntry>>,
    ) -> Result<Option<Catalog>> {
        if !self.is_on {
            return Ok(None);
        }
        // Where another takes its place, the committed one may be damaged.
        let committed =
            if self.replacement.is_some() { None } else { self.find_committed(files, last_commit)? };
        self.move_suspects(files, last_commit)?;
        self.sync_segments(files)?;
        let written = self.write_catalog(files, last_commit.flush_number, committed, before)?;
        if self.has_new_names {
            files.sync_folder(&files.layout().kept_scans())?;
            self.has_new_names = false;
        }
        Ok(written)
    }

    fn write_catalog(
        &mut self,
        files: &MapFiles,
        committed_flush: u64,
        committed: Option<Catalog>,
        before: impl FnOnce() -> Result<Vec<CatalogEntry>>,
    ) -> Result<Option<Catalog>> {
        let (disk, layout, flush_number) = (&**files.disk(), files.layout(), committed_flush + 1);
        let in_place = match self.replacement.take() {
            Some(Replacement::Open { generation, out }) => {
                let out = out.into_inner().unwrap_or_else(PoisonError::into_inner);
                let version = out.finish();
                let version =
                    version.map_err(|error| Error::io(&layout.catalog(generation), "write", error))?;
                let whole = Catalog { version, has_excess: false };
                self.replacement = Some(Replacement::Whole(whole));
                Some(whole)
            }
            Some(Replacement::Whole(whole)) => {
                // Of a commit that failed behind it, perhaps with more entries.
                self.replacement = Some(Replacement::Whole(whole));
                Some(Catalog { has_excess: true, ..whole })
            }
            None => committed,
        };
        if in_place.is_some_and(|catalog| !catalog.has_excess) && self.begun_entries == 0 {
            return Ok(in_place);
        }
        let earlier = if in_place.is_none() { before()? } else { Vec::new() };
        if in_place.is_none() && earlier.is_empty() && self.begun_entries == 0 {
            return Ok(None);
        }
        self.make_folder(files)?;
        if let Some(begun) = self.begun.take().filter(|&begun| begun != flush_number) {
            // Another commit came in between.
            files.remove_file(&layout.catalog(begun))?;
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

    /// Notes that what was written is committed.
    pub(in crate::store) fn commit(&mut self, written: Option<Catalog>) {
        if self.is_on {
            self.committed = Some(written);
        }
        self.pending = self.pending.split_off(self.begun_entries.min(self.pending.len()));
        (self.begun_entries, self.replacement, self.begun) = (0, None, None);
    }

    /// Notes that what was written is not committed: its records may be in the file.
    pub(in crate::store) fn not_committed(&mut self) {
        if let Some(Some(committed)) = &mut self.committed {
            committed.has_excess = true;
        }
    }

    /// The catalog as of the last commit. What is behind it in the file may be cut off; what is damaged may not.
    pub(super) fn find_committed(
        &mut self,
        files: &MapFiles,
        last_commit: KeptAsOf,
    ) -> Result<Option<Catalog>> {
        if let Some(committed) = self.committed {
            return Ok(committed);
        }
        let (disk, layout) = (&**files.disk(), files.layout());
        remove_catalogs_after(files, last_commit.flush_number)?;
        let generation = last_commit.generation(disk, layout)?;
        let mut records = KeptRecords::open(disk, layout, last_commit)?;
        while let Some(scan) = records.next_kept()? {
            self.highest_segment = self.highest_segment.max(scan.place.segment);
        }
        let extent = generation.and_then(|generation| records.extent(generation));
        let found = extent.map(|(version, has_excess)| Catalog { version, has_excess });
        self.committed = Some(found);
        Ok(found)
    }

    /// Notes that a sync has failed: what is not durable is copied before a commit names it.
    pub(in crate::store) fn suspect_unsynced(&mut self) {
        self.is_replacement_suspect |= !self.unsynced.is_empty();
        self.suspects.append(&mut self.unsynced);
        self.segment = None;
    }

    fn sync_segments(&mut self, files: &MapFiles) -> Result<()> {
        for &segment in &self.unsynced {
            let path = files.layout().segment(segment);
            if let Err(error) = files.disk().sync_file(&path) {
                self.suspect_unsynced();
                return Err(Error::io(&path, "sync", error));
            }
        }
        self.unsynced.clear();
        Ok(())
    }

    /// Copies scans of segments that could not be synced to another: what can still be read of them is checked.
    fn move_suspects(&mut self, files: &MapFiles, last_commit: KeptAsOf) -> Result<()> {
        if self.replacement.is_some() && self.is_replacement_suspect {
            let error = io::Error::other("an earlier sync failed; begin again");
            return Err(Error::io(&files.layout().kept_scans(), "trust", error));
        }
        let mut pending = std::mem::take(&mut self.pending);
        let mut moved = Ok(());
        for entry in &mut pending {
            if let CatalogEntry::Kept(scan) = entry
                && self.suspects.contains(&scan.place.segment)
            {
                moved = self.copy(files, last_commit, scan.place).map(|place| scan.place = place);
                if moved.is_err() {
                    break;
                }
            }
        }
        self.pending = pending;
        // They stay suspects: a scan may be noted yet that was written before.
        moved
    }

    pub(super) fn make_folder(&mut self, files: &MapFiles) -> Result<()> {
        let folder = files.layout().kept_scans();
        if files.kind(&folder)?.is_none() {
            files.disk().create_folder(&folder).map_err(|error| Error::io(&folder, "create", error))?;
            files.sync_map_folder()?;
        }
        Ok(())
    }
}

/// The catalogs and segments that no flush in `flushes` needs, in order; new segments are left out. Also returns the
/// highest segment that one needs.
///
/// # Errors
///
/// A catalog that cannot be read to its end: it may need any segment. A disk that refuses.
pub(in crate::store) fn unneeded(
    disk: &dyn Disk,
    layout: &Layout,
    flushes: &[KeptAsOf],
    is_new: impl Fn(u64) -> bool,
) -> Result<(Vec<PathBuf>, u64)> {
    let folder = layout.kept_scans();
    let mut names = match disk.list(&folder) {
        // A map that keeps scans and lacks the folder is damaged.
        Err(error) if error.kind() == io::ErrorKind::NotFound && flushes.is_empty() => {
            return Ok((Vec::new(), 0));
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        names => names.map_err(|error| Error::io(&folder, "list", error))?,
    };
    let (mut generations, mut segments) = (BTreeSet::new(), BTreeSet::new());
    for as_of in with_all_records(disk, layout, flushes)? {
        generations.extend(as_of.generation(disk, layout)?);
        let mut records = KeptRecords::open(disk, layout, as_of)?;
        while let Some(scan) = records.next_kept()? {
            segments.insert(scan.place.segment);
        }
    }
    names.retain(|name| match (Layout::generation_of(name), Layout::segment_of(name)) {
        (Some(generation), _) => !generations.contains(&generation),
        (_, Some(segment)) => !segments.contains(&segment) && !is_new(segment),
        // Not voxtile's.
        _ => false,
    });
    names.sort_unstable();
    let highest = segments.last().copied().unwrap_or_default();
    Ok((names.iter().map(|name| folder.join(name)).collect(), highest))
}

/// Those of some flushes whose catalogs have the records of all: where several see the beginning of one, the last.
///
/// # Errors
///
/// A catalog that is not whole as of one of the others.
pub(super) fn with_all_records(
    disk: &dyn Disk,
    layout: &Layout,
    flushes: &[KeptAsOf],
) -> Result<Vec<KeptAsOf>> {
    let (mut left, mut named) = (Vec::new(), BTreeMap::<u64, Vec<(CatalogVersion, KeptAsOf)>>::new());
    for &as_of in flushes {
        match as_of.catalog {
            Some(catalog) => named.entry(catalog.generation).or_default().push((catalog, as_of)),
            None => left.push(as_of),
        }
    }
    for mut of_one in named.into_values() {
        of_one.sort_by_key(|(catalog, _)| catalog.bytes);
        left.extend(of_one.pop().map(|(_, longest)| longest));
        let fronts: Vec<_> = of_one.iter().map(|(catalog, _)| *catalog).collect();
        let are_whole = whole_fronts(disk, layout, &fronts);
        for ((_, as_of), _) in of_one.iter().zip(are_whole).filter(|(_, is_whole)| !is_whole) {
            KeptRecords::open(disk, layout, *as_of)?;
        }
    }
    Ok(left)
}

/// Removes catalogs of commits that never happened.
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

/// The segments of a map, in order.
fn segments_in(disk: &dyn Disk, layout: &Layout) -> Result<Vec<u64>> {
    let folder = layout.kept_scans();
    let names = disk.list(&folder).map_err(|error| Error::io(&folder, "list", error))?;
    let mut segments: Vec<u64> = names.iter().filter_map(|name| Layout::segment_of(name)).collect();
    segments.sort_unstable();
    Ok(segments)
}

/// Checks that a segment is there and as long as the scans in it need.
///
/// # Errors
///
/// If it is not; a disk that refuses.
pub(crate) fn check_segment(disk: &dyn Disk, layout: &Layout, segment: u64, end: u64) -> Result<()> {
    let path = layout.segment(segment);
    let error = match disk.kind_at(&path)? {
        Some(EntryKind::File(bytes)) if bytes >= end => return Ok(()),
        Some(EntryKind::File(bytes)) => FormatError::at_offset(bytes, "the segment ends early"),
        Some(_) => FormatError::at_offset(0, "not a regular file"),
        None => FormatError::at_offset(0, "the segment is missing"),
    };
    Err(error.in_map(&path, None))
}

/// Checks that the points of a kept scan are whole.
pub(crate) fn check_points(disk: &dyn Disk, layout: &Layout, scan: &KeptRecord) -> Result<()> {
    let mut input = SegmentScan::open(disk, layout, scan.place)?;
    let (mut points, mut intensities, mut count) = (Vec::new(), Vec::new(), 0);
    while input.next(&mut points, &mut intensities)? {
        count += points.len() as u64;
    }
    input.check_count(count, scan)
}
