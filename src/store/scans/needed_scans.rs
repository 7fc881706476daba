//! Finds the catalogs and segments that a map and its snapshots need.

use super::catalog::{KeptAsOf, KeptRecords, whole_fronts};
use super::catalog_entry::CatalogEntry;
use super::catalog_salvage::{Salvaged, salvage_entries};
use super::catalog_version::CatalogVersion;
use super::scan_archive::Catalog;
use super::scan_list::read_scans;
use crate::error::{Error, FormatError, Result};
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::Layout;
use crate::store::snapshots::snapshot_file::Snapshot;
use crate::store::tile_store::TileStore;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::PathBuf;

impl TileStore {
    /// Removes catalogs and segments that neither the map nor a snapshot needs. After an I/O error they remain until
    /// the map is next opened for writing.
    pub(in crate::store) fn remove_unneeded_scans(&mut self) {
        if let Err(error) = self.release_scans() {
            log::warn!("unneeded kept scans remain: {error:#}");
        }
    }

    /// Durably removes catalogs and segments that neither the map nor a snapshot needs.
    ///
    /// # Errors
    ///
    /// An I/O error, or an unreadable catalog, which may need any segment.
    pub fn release_scans(&mut self) -> Result<()> {
        // An unreadable snapshot may need any catalog or segment.
        let Some(flushes) = self.kept.snapshots().kept_scans_of(self.committer.snapshots()) else {
            return Ok(());
        };
        let is_new = |segment| self.archive.is_writing(segment);
        let (files, highest) = self.unneeded_scans(flushes, is_new)?;
        self.archive.note_segment(highest);
        for path in &files {
            self.files.remove_file(path)?;
            self.leftovers_removed += 1;
        }
        // Even if nothing was removed now: an earlier removal may not be durable, and a power failure would restore the
        // scans.
        match self.is_keeping_scans() || !files.is_empty() {
            true if self.files.kind(&self.layout().kept_scans())?.is_some() => {
                self.files.sync_folder(&self.layout().kept_scans())
            }
            _ => Ok(()),
        }
    }

    /// Returns whether the map keeps its scans as of the last commit. There may be no catalog yet.
    fn is_keeping_scans(&self) -> bool {
        self.metadata().ext.as_ref().is_some_and(|ext| ext.keeps_scans)
    }

    /// Returns the catalogs and segments that the last commit or one of these snapshots needs, in order.
    ///
    /// # Errors
    ///
    /// A damaged or missing catalog, a missing or truncated segment, or an I/O error.
    pub(in crate::store) fn needed_scan_files(&self, snapshots: &[Snapshot]) -> Result<Vec<PathBuf>> {
        let (disk, layout) = (&**self.disk(), self.layout());
        let mut flushes: Vec<_> = snapshots.iter().filter_map(kept_as_of).collect();
        flushes.extend(self.is_keeping_scans().then(|| self.archive.last_commit()));
        let (mut files, mut ends) = (BTreeSet::new(), BTreeMap::new());
        for as_of in with_all_records(disk, layout, &flushes)? {
            files.extend(as_of.generation(disk, layout)?.map(|generation| layout.catalog(generation)));
            let mut records = KeptRecords::open(disk, layout, as_of)?;
            while let Some(scan) = records.next_kept()? {
                for place in scan.places() {
                    let end = ends.entry(place.segment).or_insert(0);
                    *end = place.offset.saturating_add(place.bytes).max(*end);
                }
            }
        }
        for (segment, end) in ends {
            check_segment(disk, layout, segment, end)?;
            files.insert(layout.segment(segment));
        }
        Ok(files.into_iter().collect())
    }

    /// Returns the catalogs and segments that neither the last commit nor one of these flushes needs, and the highest
    /// segment that is needed.
    pub(in crate::store) fn unneeded_scans(
        &self,
        mut flushes: Vec<KeptAsOf>,
        is_new: impl Fn(u64) -> bool,
    ) -> Result<(Vec<PathBuf>, u64)> {
        if self.is_keeping_scans() {
            flushes.push(self.archive.last_commit());
        }
        unneeded(&**self.disk(), self.layout(), &flushes, is_new)
    }

    /// Records the catalog of the last commit for the next log record, if none is named yet, so that no later catalog
    /// is mistaken for it.
    pub(in crate::store) fn try_to_name_own_catalog(&mut self) -> Result<()> {
        if self.is_keeping_scans() && self.commits().catalog.is_none() {
            let own = self.archive.find_committed()?;
            self.versions.set_catalog(own.map_or(CatalogVersion::NONE, Catalog::version));
            self.archive.set_last_commit(self.versions.commits());
        }
        Ok(())
    }

    /// Like [`Self::try_to_name_own_catalog`], but a damaged catalog remains unnamed.
    pub(in crate::store) fn name_own_catalog(&mut self) {
        if let Err(error) = self.try_to_name_own_catalog() {
            log::warn!("the catalog of kept scans is not recorded: {error:#}");
        }
    }

    /// Returns the catalogs and segments that neither the map nor one of its snapshots needs, as far as their catalogs
    /// are readable. `segments` overrides the segments that the map itself needs.
    ///
    /// # Errors
    ///
    /// An I/O error that is not specific to one file.
    pub(crate) fn unneeded_scan_files(
        &self,
        snapshots: &[Snapshot],
        segments: Option<&BTreeSet<u64>>,
    ) -> Result<Vec<PathBuf>> {
        let (disk, layout, last_commit) = (&**self.disk(), self.layout(), self.archive.last_commit());
        let folder = layout.kept_scans();
        if disk.kind_at(&folder)? != Some(EntryKind::Folder) {
            return Ok(Vec::new());
        }
        let mut flushes: Vec<_> = snapshots.iter().filter_map(kept_as_of).collect();
        let mut needed = segments.cloned().unwrap_or_default();
        let mut generations = BTreeSet::new();
        if self.archive.is_on() {
            flushes.extend(segments.is_none().then_some(last_commit));
            generations.extend(last_commit.generation(disk, layout)?);
        }
        for as_of in flushes {
            generations.extend(as_of.generation(disk, layout)?);
            salvage_entries(disk, layout, as_of, &mut |entry| {
                if let Salvaged::Whole(CatalogEntry::Kept(scan)) = entry {
                    needed.extend(scan.places().map(|place| place.segment));
                }
                Ok(())
            })?;
        }
        let mut names = disk.list(&folder).map_err(|error| Error::io(&folder, "list", error))?;
        names.sort_unstable();
        names.retain(|name| match (Layout::generation_of(name), Layout::segment_of(name)) {
            // A catalog that is being written is newer.
            (Some(generation), _) => {
                let is_new = self.archive.is_on() && generation > last_commit.flush_number;
                !is_new && !generations.contains(&generation)
            }
            (_, Some(segment)) => !needed.contains(&segment) && !self.archive.is_writing(segment),
            // A foreign file.
            _ => false,
        });
        Ok(names.iter().map(|name| folder.join(name)).collect())
    }

    /// Returns whether the scans of the last commit equal those of `past`, a state of the map with the same metadata.
    pub(in crate::store) fn has_scans_of(&self, past: &Self) -> Result<bool> {
        if !self.is_keeping_scans() {
            let listed = |store: &Self| {
                let flush_number = store.commits().flush_number;
                read_scans(&**store.disk(), store.layout(), flush_number, store.listed_records())
            };
            return Ok(listed(self)? == listed(past)?);
        }
        self.archive.has_scans_of(&past.archive)
    }
}

/// Returns the kept scans of a snapshot, if it keeps any.
pub(crate) fn kept_as_of(snapshot: &Snapshot) -> Option<KeptAsOf> {
    let keeps_scans = snapshot.metadata.ext.as_ref().is_some_and(|ext| ext.keeps_scans);
    keeps_scans.then(|| KeptAsOf::last_of(&snapshot.commits))
}

/// Returns the catalogs and segments that no flush in `flushes` needs, in order, and the highest segment that is
/// needed. Segments for which `is_new` is true are omitted.
///
/// # Errors
///
/// An unreadable catalog, which may need any segment, or an I/O error.
fn unneeded(
    disk: &dyn Disk,
    layout: &Layout,
    flushes: &[KeptAsOf],
    is_new: impl Fn(u64) -> bool,
) -> Result<(Vec<PathBuf>, u64)> {
    let folder = layout.kept_scans();
    let mut names = match disk.list(&folder) {
        // A missing folder is damage if the map keeps scans.
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
            segments.extend(scan.places().map(|place| place.segment));
        }
    }
    names.retain(|name| match (Layout::generation_of(name), Layout::segment_of(name)) {
        (Some(generation), _) => !generations.contains(&generation),
        (_, Some(segment)) => !segments.contains(&segment) && !is_new(segment),
        // A foreign file.
        _ => false,
    });
    names.sort_unstable();
    let highest = segments.last().copied().unwrap_or_default();
    Ok((names.iter().map(|name| folder.join(name)).collect(), highest))
}

/// Selects the flushes whose catalogs contain the records of all given flushes: of several versions of one catalog, the
/// longest.
///
/// # Errors
///
/// A catalog that is damaged in the part that one of the other flushes needs.
fn with_all_records(disk: &dyn Disk, layout: &Layout, flushes: &[KeptAsOf]) -> Result<Vec<KeptAsOf>> {
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

/// Checks that a segment exists and has at least `end` bytes.
///
/// # Errors
///
/// A missing or truncated segment, or an I/O error.
pub(crate) fn check_segment(disk: &dyn Disk, layout: &Layout, segment: u64, end: u64) -> Result<()> {
    let path = layout.segment(segment);
    let error = match disk.kind_at(&path)? {
        Some(EntryKind::File(bytes)) if bytes >= end => return Ok(()),
        Some(EntryKind::File(bytes)) => FormatError::at_offset(bytes, "the segment ends early"),
        Some(_) => FormatError::at_offset(0, "not a regular file"),
        None => FormatError::at_offset(0, "the segment of kept scans is missing"),
    };
    Err(error.in_map(&path, None))
}
