use super::kept_scans::{WholeEntries, count_kept, whole_entries};
use super::rebuild::Index;
use super::repair::{Action, ActionKind, Repairer};
use crate::error::{Error, Result, is_of_medium};
use crate::store::{Disk, EntryKind, KeptAsOf, Quarantine, Snapshot, TileStore, kept_as_of};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl<F: FnMut(&Action), P: FnMut(u64, u64)> Repairer<'_, F, P> {
    /// Repairs the catalog of the map: scans with damaged points become scans without points, and scans with damaged
    /// records become unlisted ones, so that more scans can be added. Files that neither the map nor a snapshot needs
    /// then move to quarantine, because the next writer would remove them.
    pub(super) fn repair_kept_scans(&mut self, store: &mut TileStore) -> Result<()> {
        let (folder, as_of) = (self.layout.kept_scans(), store.archive().last_commit());
        self.repair_folder_of_scans(&folder)?;
        if !store.archive().is_on() {
            return Ok(());
        }
        let found = whole_entries(self.disk, &self.layout, as_of, &mut self.points, |_| Ok(()))?;
        if found.damage.is_empty() {
            return Ok(());
        }
        let reasons = Reasons::of(&found);
        let replaced = store.archive().catalog_path(as_of)?;
        let is_kept = self.keep_catalog(replaced.as_deref(), &reasons)?;
        store.archive_mut().begin_catalog()?;
        let (disk, layout, points) = (self.disk, &self.layout, &mut self.points);
        let left = whole_entries(disk, layout, as_of, points, |entry| store.archive_mut().put(entry))?;
        // An unreadable snapshot may need any file. Writers remove no files then, and the repair of the snapshots moves
        // the unneeded ones.
        let snapshots = known_snapshots(store);
        if let Some(snapshots) = &snapshots {
            // Before the commit: as long as the damaged catalog is current, no writer removes any file, and a repeated
            // repair finds the same scans.
            for path in store.unneeded_scan_files(snapshots, Some(&left.segments))? {
                self.quarantine(&path, reasons.of_file(&path))?;
            }
        }
        store.commit(store.metadata().clone(), as_of.scan_number)?;
        if let Some(snapshots) = &snapshots {
            for path in store.unneeded_scan_files(snapshots, Some(&left.segments))? {
                if !is_kept || Some(&path) != replaced.as_ref() {
                    self.quarantine(&path, reasons.of_file(&path))?;
                }
            }
            if let Err(error) = store.release_scans() {
                log::warn!("unneeded kept scans remain: {error:#}");
            }
        }
        self.counts.scans_lost += left.scans_lost;
        self.counts.marks_lost += left.marks_lost;
        let reason = forgotten(&left, "its catalog", "the map");
        self.note(ActionKind::Forgotten, &folder, reason);
        Ok(())
    }

    /// Moves the folder of kept scans to quarantine if it is not a folder, or cannot be listed.
    fn repair_folder_of_scans(&mut self, folder: &Path) -> Result<()> {
        if let Some(EntryKind::File(_) | EntryKind::Other) = self.kind(folder)? {
            return self.quarantine(folder, "not a folder");
        }
        match self.disk.list(folder) {
            Err(error) if is_of_medium(&error) => self.quarantine(folder, &format!("cannot list: {error}")),
            _ => Ok(()),
        }
    }

    /// Keeps a catalog in quarantine before it is replaced. Returns whether quarantine has it.
    fn keep_catalog(&mut self, catalog: Option<&Path>, reasons: &Reasons) -> Result<bool> {
        let Some(catalog) = catalog else { return Ok(false) };
        if self.catalogs_kept.contains(catalog) {
            return Ok(true);
        }
        let Some(to) = Quarantine::new(self.disk, &self.layout).keep(catalog)? else { return Ok(false) };
        self.catalogs_kept.insert(catalog.to_owned());
        let why = reasons.0.get(catalog).map_or("it is replaced", String::as_str);
        self.note(ActionKind::Quarantined, catalog, format!("{why}; kept as {}", to.display()));
        Ok(true)
    }

    /// Replaces the catalogs of snapshots whose kept scans are damaged. As for the map, scans with damaged points
    /// become scans without points, and scans with damaged records become unlisted ones.
    pub(super) fn repair_scans_of_snapshots(
        &mut self,
        store: &mut TileStore,
        snapshots: &mut [Snapshot],
    ) -> Result<()> {
        let mut reasons = Reasons::default();
        let mut replaced = Vec::new();
        for (at, snapshot) in snapshots.iter_mut().enumerate() {
            let Some(as_of) = kept_as_of(snapshot) else { continue };
            let found = whole_entries(self.disk, &self.layout, as_of, &mut self.points, |_| Ok(()))?;
            if found.damage.is_empty() {
                continue;
            }
            reasons.add(&found);
            let old = store.archive().catalog_path(as_of)?;
            let is_old_kept = self.keep_catalog(old.as_deref(), &reasons)?;
            let left = self.write_other_catalog(store, snapshot, as_of)?;
            replaced.push(Replaced { at, old, is_old_kept, left });
        }
        if replaced.is_empty() {
            return Ok(());
        }
        // Before the snapshots name the new catalogs: as long as one names a damaged catalog, no writer removes any
        // file.
        self.quarantine_unneeded(store, snapshots, &reasons, |path| {
            replaced.iter().any(|replaced| replaced.old.as_deref() == Some(path))
        })?;
        for replaced in &replaced {
            self.name_other_catalog(store, &snapshots[replaced.at], &replaced.left)?;
        }
        self.quarantine_unneeded(store, snapshots, &reasons, |path| {
            replaced.iter().any(|replaced| replaced.is_old_kept && replaced.old.as_deref() == Some(path))
        })?;
        store.snapshot_writer().release_unseen()
    }

    /// Moves files of kept scans to quarantine that neither the map nor these snapshots need, unless `is_excepted`.
    fn quarantine_unneeded(
        &mut self,
        store: &TileStore,
        snapshots: &[Snapshot],
        reasons: &Reasons,
        is_excepted: impl Fn(&Path) -> bool,
    ) -> Result<()> {
        for path in store.unneeded_scan_files(snapshots, None)? {
            if !is_excepted(&path) {
                self.quarantine(&path, reasons.of_file(&path))?;
            }
        }
        Ok(())
    }

    /// Writes a repaired catalog of the scans that a snapshot keeps, and returns its content. The snapshot's file does not
    /// name it yet.
    fn write_other_catalog(
        &mut self,
        store: &mut TileStore,
        snapshot: &mut Snapshot,
        as_of: KeptAsOf,
    ) -> Result<WholeEntries> {
        let mut left = WholeEntries::default();
        let (disk, layout, points) = (self.disk, &self.layout, &mut self.points);
        let catalog = store.snapshot_writer().write_catalog(|put| {
            left = whole_entries(disk, layout, as_of, points, put)?;
            Ok(())
        })?;
        snapshot.commits.catalog = Some(catalog);
        Ok(left)
    }

    fn name_other_catalog(
        &mut self,
        store: &mut TileStore,
        snapshot: &Snapshot,
        left: &WholeEntries,
    ) -> Result<()> {
        store.snapshot_writer().replace(snapshot)?;
        self.counts.snapshot_scans_lost += left.scans_lost;
        self.counts.marks_lost += left.marks_lost;
        let reason = forgotten(left, "the catalog of its kept scans", "the snapshot");
        self.note(ActionKind::Forgotten, &self.layout.snapshot(&snapshot.name), reason);
        Ok(())
    }

    /// Moves scans to quarantine that no snapshot needs, if it is unknown whether the map keeps its scans. The next
    /// writer would remove them, and without a log the last committed catalog is unknown.
    pub(super) fn quarantine_unlisted_scans(&mut self, disk: &Arc<dyn Disk>, index: &Index) -> Result<()> {
        let Index { map_id, metadata, commits, .. } = index;
        let folder = self.layout.folder();
        let store = TileStore::of_commits(disk.clone(), folder, *map_id, metadata.clone(), commits.clone());
        if self.kind(&self.layout.kept_scans())? != Some(EntryKind::Folder) {
            return Ok(());
        }
        let kept = count_kept(self.disk, &self.layout)?;
        self.counts.scans_lost += kept;
        // An unreadable snapshot may need any file. Writers remove no files then, and the repair of the snapshots moves
        // the unneeded ones.
        let Some(snapshots) = known_snapshots(&store) else { return Ok(()) };
        let unneeded = store.unneeded_scan_files(&snapshots, None)?;
        for path in &unneeded {
            self.quarantine(
                path,
                "without metadata.json and commits.log it is unknown whether the map needs it",
            )?;
        }
        // The number of scans in segments without a catalog is unknown. Count one.
        self.counts.scans_lost += u64::from(kept == 0 && !unneeded.is_empty());
        Ok(())
    }

    /// Moves scans to quarantine that were kept for lost snapshots.
    pub(super) fn quarantine_unneeded_scans(
        &mut self,
        store: &TileStore,
        snapshots: &[Snapshot],
    ) -> Result<()> {
        for path in store.unneeded_scan_files(snapshots, None)? {
            self.quarantine(&path, "only an unreadable snapshot may need it")?;
        }
        Ok(())
    }
}

/// Snapshot whose damaged catalog of kept scans was replaced.
struct Replaced {
    /// Index in the list of snapshots.
    at: usize,
    /// Path of the damaged catalog; `None` if it is missing.
    old: Option<PathBuf>,
    /// Whether quarantine has a copy of the damaged catalog.
    is_old_kept: bool,
    /// Content of the new catalog.
    left: WholeEntries,
}

/// Describes what is missing in a new catalog.
fn forgotten(left: &WholeEntries, catalog: &str, whose: &str) -> String {
    match (left.scans_lost, left.marks_lost) {
        (0, 0) => format!("a damaged record was dropped from {catalog}"),
        (0, lost) => {
            let until = "until its moving points are marked again, or all marks are removed";
            format!("the marks of moving points of {lost} scans are lost; {whose} cannot be replayed {until}")
        }
        (lost, _) => format!("{lost} damaged scans are no longer kept; {whose} cannot be replayed"),
    }
}

/// Reasons for damage of files of kept scans.
#[derive(Default)]
struct Reasons(BTreeMap<PathBuf, String>);

impl Reasons {
    fn of(found: &WholeEntries) -> Self {
        let mut reasons = Self::default();
        reasons.add(found);
        reasons
    }

    fn add(&mut self, found: &WholeEntries) {
        for error in &found.damage {
            if let Some(path) = Error::path(error) {
                self.0.entry(path.to_owned()).or_insert_with(|| format!("{error:#}"));
            }
        }
    }

    fn of_file(&self, path: &Path) -> &str {
        self.0.get(path).map_or("no readable scan needs it", String::as_str)
    }
}

/// Returns the snapshots of a map; `None` if one is unreadable.
fn known_snapshots(store: &TileStore) -> Option<Vec<Snapshot>> {
    store.snapshots().names().ok()?.iter().map(|name| store.snapshots().read(name).ok()).collect()
}
