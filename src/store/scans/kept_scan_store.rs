//! The scans that a map keeps, as part of a [`TileStore`].

use super::catalog::{CatalogWriter, KeptAsOf, KeptRecords, whole_fronts};
use super::catalog_entry::{CatalogEntry, SegmentPlace};
use super::catalog_salvage::{Salvaged, salvage_entries};
use super::catalog_version::CatalogVersion;
use super::scan_keeper::{Catalog, check_segment, unneeded, with_all_records};
use super::scan_list::read_scans;
use crate::error::{Error, Result};
use crate::space::Point;
use crate::store::disk::EntryKind;
use crate::store::layout::Layout;
use crate::store::map_files::MapFiles;
use crate::store::snapshots::snapshot_file::Snapshot;
use crate::store::snapshots::snapshot_name::SnapshotName;
use crate::store::tile_store::TileStore;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

impl TileStore {
    /// Whether the map keeps its scans.
    pub fn keeps_scans(&self) -> bool {
        self.keeper.is_on()
    }

    /// From the next commit on the map keeps the scans that it takes.
    pub fn keep_scans(&mut self) {
        self.keeper.begin();
    }

    /// Begins to write the points of a scan, in place of one that was begun before and not noted.
    ///
    /// # Errors
    ///
    /// A catalog that is damaged, a disk that refuses.
    pub fn begin_kept_scan(&mut self) -> Result<()> {
        self.keeper.begin_scan(&self.files, self.last_commit())
    }

    /// Adds points to it; all with intensities or all without.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn push_kept_points(&mut self, points: &[Point], intensities: Option<&[f32]>) -> Result<()> {
        self.keeper.push_points(points, intensities)
    }

    /// Ends the scan. It is kept if it is noted and committed.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn end_kept_scan(&mut self, has_intensities: bool) -> Result<SegmentPlace> {
        self.keeper.end_scan(has_intensities)
    }

    /// Takes back the scan that was written last and was not noted.
    pub fn give_up_kept_scan(&mut self) {
        self.keeper.give_up_scan(&**self.files.disk());
    }

    /// Copies the points of a kept scan to a segment of its own that the map has no other name for.
    ///
    /// # Errors
    ///
    /// Damage, a disk that refuses.
    pub fn copy_kept_points(&mut self, place: SegmentPlace) -> Result<SegmentPlace> {
        self.keeper.copy(&self.files, self.last_commit(), place)
    }

    /// Records an entry of the next commit, if the map keeps its scans.
    pub fn note_entry(&mut self, entry: CatalogEntry) {
        if self.keeper.is_on() {
            self.keeper.note(entry);
        }
    }

    /// Begins a catalog that takes the place of the committed one with the next commit.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn begin_catalog(&mut self) -> Result<()> {
        self.keeper.begin_replacement(&self.files, self.versions.commits().flush_number)
    }

    /// Adds an entry to that catalog; the number of each scan follows that of the one before.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn put_entry(&mut self, entry: &CatalogEntry) -> Result<()> {
        self.keeper.put(&self.files, entry)
    }

    /// The scans that the map keeps as of the last commit, in order.
    ///
    /// # Errors
    ///
    /// Damage, a disk that refuses.
    pub(crate) fn kept_records(&self) -> Result<KeptRecords> {
        KeptRecords::open(&**self.disk(), self.layout(), self.last_commit())
    }

    /// The catalog that they are in. Scans add to it; what changes earlier entries makes another one.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub(crate) fn catalog_generation(&self) -> Result<Option<u64>> {
        self.last_commit().generation(&**self.disk(), self.layout())
    }

    /// Writes what belongs to the next commit, synced.
    pub(in crate::store) fn write_kept(&mut self) -> Result<Option<Catalog>> {
        let last_commit = self.last_commit();
        let has_tiles = !self.versions.commits().tiles.is_empty();
        let files = &self.files;
        let before = || entries_before(files, last_commit, has_tiles);
        self.keeper.write(files, last_commit, before)
    }

    /// The last commit, as far as kept scans go.
    pub(crate) fn last_commit(&self) -> KeptAsOf {
        KeptAsOf::last_of(self.versions.commits())
    }

    /// Removes catalogs and segments that neither the map nor a snapshot needs. What the disk refuses remains until the
    /// map is next opened for writing.
    pub(in crate::store) fn remove_unneeded_scans(&mut self) {
        if let Err(error) = self.release_scans() {
            log::warn!("kept scans that nothing needs remain: {error:#}");
        }
    }

    /// Removes catalogs and segments that neither the map nor a snapshot needs, durably.
    ///
    /// # Errors
    ///
    /// A disk that refuses; a catalog that cannot be read, which may need any.
    pub fn release_scans(&mut self) -> Result<()> {
        // A snapshot that cannot be read may need any.
        let Some(flushes) = self.kept.snapshots().kept_scans_of(self.committer.snapshots()) else {
            return Ok(());
        };
        let is_new = |segment| self.keeper.is_writing(segment);
        let (files, highest) = self.unneeded_scans(flushes, is_new)?;
        self.keeper.note_segment(highest);
        for path in &files {
            self.files.remove_file(path)?;
            self.leftovers_removed += 1;
        }
        // Also what an attempt before could not make durable: a power cut would bring the scans back.
        match self.is_keeping_scans() || !files.is_empty() {
            true if self.files.kind(&self.layout().kept_scans())?.is_some() => {
                self.files.sync_folder(&self.layout().kept_scans())
            }
            _ => Ok(()),
        }
    }

    /// Whether the map keeps its scans as of the last commit; one that begins to has no catalog yet.
    fn is_keeping_scans(&self) -> bool {
        self.metadata().ext.as_ref().is_some_and(|ext| ext.keeps_scans)
    }

    /// The catalogs and segments that neither the last commit nor a snapshot needs, in order: a writer that ended early
    /// did not remove them, or one at work has not committed them yet. `None` where a snapshot cannot be read, which
    /// may need any of them.
    ///
    /// # Errors
    ///
    /// A disk that refuses; a catalog that cannot be read, which may need any.
    pub(crate) fn idle_scan_files(&self) -> Result<Option<Vec<PathBuf>>> {
        match self.read_snapshots() {
            Ok(snapshots) => {
                let flushes = snapshots.iter().filter_map(kept_as_of).collect();
                self.unneeded_scans(flushes, |_| false).map(|(files, _)| Some(files))
            }
            Err(Error::Damaged { .. }) => Ok(None),
            Err(error) if error.is_of_medium() => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The catalogs and segments that the last commit or one of these snapshots needs, in order.
    ///
    /// # Errors
    ///
    /// A catalog that is damaged or missing, a segment that is missing or too short; a disk that refuses.
    pub(in crate::store) fn needed_scan_files(&self, snapshots: &[Snapshot]) -> Result<Vec<PathBuf>> {
        let (disk, layout) = (&**self.disk(), self.layout());
        let mut flushes: Vec<_> = snapshots.iter().filter_map(kept_as_of).collect();
        flushes.extend(self.is_keeping_scans().then(|| self.last_commit()));
        let (mut files, mut ends) = (BTreeSet::new(), BTreeMap::new());
        for as_of in with_all_records(disk, layout, &flushes)? {
            files.extend(as_of.generation(disk, layout)?.map(|generation| layout.catalog(generation)));
            let mut records = KeptRecords::open(disk, layout, as_of)?;
            while let Some(scan) = records.next_kept()? {
                let end = ends.entry(scan.place.segment).or_insert(0);
                *end = scan.place.offset.saturating_add(scan.place.bytes).max(*end);
            }
        }
        for (segment, end) in ends {
            check_segment(disk, layout, segment, end)?;
            files.insert(layout.segment(segment));
        }
        Ok(files.into_iter().collect())
    }

    /// The catalogs and segments that neither the last commit needs nor one of these flushes, and the highest segment
    /// that one needs.
    fn unneeded_scans(
        &self,
        mut flushes: Vec<KeptAsOf>,
        is_new: impl Fn(u64) -> bool,
    ) -> Result<(Vec<PathBuf>, u64)> {
        if self.is_keeping_scans() {
            flushes.push(self.last_commit());
        }
        unneeded(&**self.disk(), self.layout(), &flushes, is_new)
    }

    /// Checks that the catalogs of the snapshots are whole, before points are taken out of the map: if one is not,
    /// nothing tells which files may go. A snapshot whose own file is damaged is passed over, and keeps all.
    ///
    /// # Errors
    ///
    /// A catalog that is damaged or missing, and what to do about it; a disk that refuses.
    pub(crate) fn check_catalogs_of_snapshots(&self) -> Result<()> {
        let (disk, layout) = (&**self.disk(), self.layout());
        let mut needed = Vec::new();
        for name in self.snapshot_names()? {
            match self.snapshot(&name) {
                Ok(snapshot) => needed.extend(kept_as_of(&snapshot).map(|as_of| (name, as_of))),
                Err(Error::Damaged { .. }) => {}
                Err(error) if error.is_of_medium() => {}
                Err(error) => return Err(error),
            }
        }
        // Of those that are the beginning of one catalog, the longest first: of the others the checksum says enough.
        needed.sort_by_key(|(_, as_of)| std::cmp::Reverse(as_of.catalog));
        for of_one in needed.chunk_by(|(_, a), (_, b)| {
            a.catalog.map(|catalog| catalog.generation) == b.catalog.map(|catalog| catalog.generation)
        }) {
            let fronts: Vec<_> = of_one.iter().filter_map(|(_, as_of)| as_of.catalog).collect();
            let (are_whole, mut is_read) = (whole_fronts(disk, layout, &fronts), false);
            for (at, (name, as_of)) in of_one.iter().enumerate() {
                if is_read && are_whole.get(at).copied().unwrap_or(false) {
                    continue;
                }
                let read = || -> Result<()> {
                    let mut records = KeptRecords::open(disk, layout, *as_of)?;
                    while records.next_entry()?.is_some() {}
                    Ok(())
                };
                read().map_err(|error| needed_by(error, name))?;
                is_read = true;
            }
        }
        Ok(())
    }

    /// The file of the catalog of a flush, if it has one.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub(crate) fn catalog_path(&self, as_of: KeptAsOf) -> Result<Option<PathBuf>> {
        let generation = as_of.generation(&**self.disk(), self.layout())?;
        Ok(generation.map(|generation| self.layout().catalog(generation)))
    }

    /// Writes a catalog that a snapshot is to name in place of its own, in a commit of its own; as long as it is not
    /// named, it is a leftover.
    ///
    /// # Errors
    ///
    /// A disk that refuses; a damaged catalog of the map itself, in a map of a version that did not name it.
    pub(crate) fn write_other_catalog(
        &mut self,
        write: impl FnOnce(&mut dyn FnMut(&CatalogEntry) -> Result<()>) -> Result<()>,
    ) -> Result<CatalogVersion> {
        self.finish_earlier_work()?;
        // From here on the newest is no longer the map's own.
        self.try_to_name_own_catalog()?;
        let generation = self.commits().flush_number + 1;
        let path = self.layout().catalog(generation);
        let refused = |error| Error::io(&path, "write", error);
        self.keeper.make_folder(&self.files)?;
        let mut out = CatalogWriter::create(&**self.disk(), self.layout(), generation).map_err(refused)?;
        write(&mut |entry| out.put(entry, generation).map_err(refused))?;
        let catalog = out.finish().map_err(refused)?;
        self.files.sync_folder(&self.layout().kept_scans())?;
        let listed = self.snapshot_list().cloned().unwrap_or_default();
        self.commit_snapshots(listed)?;
        self.tidy_up();
        Ok(catalog)
    }

    /// Notes the catalog of the last commit for the next record, if none is named yet: a later one must not be taken for
    /// it.
    fn try_to_name_own_catalog(&mut self) -> Result<()> {
        if self.is_keeping_scans() && self.commits().catalog.is_none() {
            let own = self.keeper.find_committed(&self.files, KeptAsOf::last_of(self.versions.commits()))?;
            self.versions.set_catalog(own.map_or(CatalogVersion::NONE, Catalog::version));
        }
        Ok(())
    }

    /// The same; a damaged catalog remains unnamed.
    pub(in crate::store) fn name_own_catalog(&mut self) {
        if let Err(error) = self.try_to_name_own_catalog() {
            log::warn!("the catalog of the kept scans is not named: {error:#}");
        }
    }

    /// The segments and catalogs that neither the map nor one of its snapshots needs, as far as their catalogs can be
    /// read; a map that keeps its scans needs these segments, or if none are given, those of its catalog.
    ///
    /// # Errors
    ///
    /// A disk that refuses more than single files.
    pub(crate) fn unneeded_scan_files(
        &self,
        snapshots: &[Snapshot],
        segments: Option<&BTreeSet<u64>>,
    ) -> Result<Vec<PathBuf>> {
        let (disk, layout, last_commit) = (&**self.disk(), self.layout(), self.last_commit());
        let folder = layout.kept_scans();
        if disk.kind_at(&folder)? != Some(EntryKind::Folder) {
            return Ok(Vec::new());
        }
        let mut flushes: Vec<_> = snapshots.iter().filter_map(kept_as_of).collect();
        let mut needed = segments.cloned().unwrap_or_default();
        let mut generations = BTreeSet::new();
        if self.keeps_scans() {
            flushes.extend(segments.is_none().then_some(last_commit));
            generations.extend(last_commit.generation(disk, layout)?);
        }
        for as_of in flushes {
            generations.extend(as_of.generation(disk, layout)?);
            salvage_entries(disk, layout, as_of, &mut |entry| {
                if let Salvaged::Whole(CatalogEntry::Kept(scan)) = entry {
                    needed.insert(scan.place.segment);
                }
                Ok(())
            })?;
        }
        let mut names = disk.list(&folder).map_err(|error| Error::io(&folder, "list", error))?;
        names.sort_unstable();
        names.retain(|name| match (Layout::generation_of(name), Layout::segment_of(name)) {
            // A later one is being written.
            (Some(generation), _) => {
                let is_new = self.keeps_scans() && generation > last_commit.flush_number;
                !is_new && !generations.contains(&generation)
            }
            (_, Some(segment)) => !needed.contains(&segment) && !self.keeper.is_writing(segment),
            // Not voxtile's.
            _ => false,
        });
        Ok(names.iter().map(|name| folder.join(name)).collect())
    }

    /// Whether the scans of the last commit are those of another state of the map with the same metadata.
    pub(in crate::store) fn has_scans_of(&self, past: &Self) -> Result<bool> {
        if !self.is_keeping_scans() {
            let listed = |store: &Self| {
                let flush_number = store.commits().flush_number;
                read_scans(&**store.disk(), store.layout(), flush_number, store.listed_records())
            };
            return Ok(listed(self)? == listed(past)?);
        }
        let (mut now, mut then) = (self.kept_records()?, past.kept_records()?);
        loop {
            match (now.next_entry()?, then.next_entry()?) {
                (None, None) => return Ok(true),
                (now, then) if now == then => {}
                _ => return Ok(false),
            }
        }
    }

    /// Makes the kept scans those of an earlier commit again, which is open as `past`.
    pub(in crate::store) fn rewind_kept(&mut self, past: &Self) -> Result<()> {
        self.keeper.set_on(past.keeps_scans());
        if !past.keeps_scans() {
            return Ok(());
        }
        self.begin_catalog()?;
        let mut records = past.kept_records()?;
        while let Some(entry) = records.next_entry()? {
            self.put_entry(&entry)?;
        }
        Ok(())
    }
}

/// The error of a catalog that a snapshot needs, with what to do.
fn needed_by(error: Error, name: &SnapshotName) -> Error {
    let Error::Damaged { path, tile, mut cause } = error else { return error };
    cause.reason.push_str(&format!(
        "; the snapshot {name} needs it; nothing was changed: repair the map or delete the snapshot, and run this again"
    ));
    Error::Damaged { path, tile, cause }
}

/// The flush of a snapshot, if it keeps its scans.
pub(crate) fn kept_as_of(snapshot: &Snapshot) -> Option<KeptAsOf> {
    let keeps_scans = snapshot.metadata.ext.as_ref().is_some_and(|ext| ext.keeps_scans);
    keeps_scans.then(|| KeptAsOf::last_of(&snapshot.commits))
}

/// What a map had before its scans were kept: its list of scans, and what is not in it.
fn entries_before(
    files: &MapFiles,
    KeptAsOf { flush_number, scan_number, .. }: KeptAsOf,
    has_tiles: bool,
) -> Result<Vec<CatalogEntry>> {
    let mut entries = Vec::new();
    let mut last = 0;
    for scan in read_scans(&**files.disk(), files.layout(), flush_number, None)? {
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
        entries.push(CatalogEntry::Operation("what it had before its scans were kept".to_owned()));
    }
    Ok(entries)
}
