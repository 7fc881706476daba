use super::kept_scans::{WholeEntries, count_kept, whole_entries};
use super::rebuild::Index;
use super::repair::{Action, ActionKind, Repairer};
use crate::error::{Error, Result, is_of_medium};
use crate::store::{Disk, EntryKind, KeptAsOf, Quarantine, Snapshot, TileStore, kept_as_of};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl<F: FnMut(&Action), P: FnMut(u64, u64)> Repairer<'_, F, P> {
    /// Lists scans whose points are damaged as scans without points, and those whose records are as unknown ones, so
    /// that the map can be mapped on. What neither the map nor a snapshot needs then goes to quarantine: the next
    /// writer would remove it.
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
        // Where a snapshot cannot be read it may need any, and no writer removes any: they go with the snapshot.
        let snapshots = known_snapshots(store);
        if let Some(snapshots) = &snapshots {
            // Before the commit: as long as the catalog is the damaged one, nobody removes anything, and a repair that
            // begins again finds the same scans.
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
                log::warn!("kept scans that nothing needs remain: {error:#}");
            }
        }
        self.counts.scans_lost += left.scans_lost;
        let reason = match left.scans_lost {
            0 => "a record that is damaged is no longer in its catalog".to_owned(),
            lost => {
                format!("{lost} scans that are damaged are no longer kept; the map cannot be mapped again")
            }
        };
        self.note(ActionKind::Forgotten, &folder, reason);
        Ok(())
    }

    /// Makes way for the folder of kept scans.
    fn repair_folder_of_scans(&mut self, folder: &Path) -> Result<()> {
        if let Some(EntryKind::File(_) | EntryKind::Other) = self.kind(folder)? {
            return self.quarantine(folder, "no folder");
        }
        match self.disk.list(folder) {
            Err(error) if is_of_medium(&error) => self.quarantine(folder, &format!("cannot list: {error}")),
            _ => Ok(()),
        }
    }

    /// Keeps a catalog in quarantine of which another takes the place; whether it is there.
    fn keep_catalog(&mut self, catalog: Option<&Path>, reasons: &Reasons) -> Result<bool> {
        let Some(catalog) = catalog else { return Ok(false) };
        if self.catalogs_kept.contains(catalog) {
            return Ok(true);
        }
        let Some(to) = Quarantine::new(self.disk, &self.layout).keep(catalog)? else { return Ok(false) };
        self.catalogs_kept.insert(catalog.to_owned());
        let why = reasons.0.get(catalog).map_or("another takes its place", String::as_str);
        self.note(ActionKind::Quarantined, catalog, format!("{why}; kept as {}", to.display()));
        Ok(true)
    }

    /// Gives snapshots whose kept scans are damaged other catalogs: as for the map itself, they list a scan with
    /// damaged points as one without points, and one whose record is damaged as an unknown one.
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
            let scans_lost = self.write_other_catalog(store, snapshot, as_of)?;
            replaced.push(Replaced { at, old, is_old_kept, scans_lost });
        }
        if replaced.is_empty() {
            return Ok(());
        }
        // Before the snapshots name the new catalogs: as long as one names a damaged one, no writer removes anything.
        self.quarantine_unneeded(store, snapshots, &reasons, |path| {
            replaced.iter().any(|replaced| replaced.old.as_deref() == Some(path))
        })?;
        for replaced in &replaced {
            self.name_other_catalog(store, &snapshots[replaced.at], replaced.scans_lost)?;
        }
        self.quarantine_unneeded(store, snapshots, &reasons, |path| {
            replaced.iter().any(|replaced| replaced.is_old_kept && replaced.old.as_deref() == Some(path))
        })?;
        store.snapshot_writer().release_unseen()
    }

    /// Moves files of kept scans that neither the map nor these snapshots need to quarantine, except some.
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

    /// Writes another catalog of the scans that a snapshot keeps. Its file does not name it yet. Returns the number of
    /// scans that are not in it because they are damaged.
    fn write_other_catalog(
        &mut self,
        store: &mut TileStore,
        snapshot: &mut Snapshot,
        as_of: KeptAsOf,
    ) -> Result<u64> {
        let mut scans_lost = 0;
        let (disk, layout, points) = (self.disk, &self.layout, &mut self.points);
        let catalog = store.snapshot_writer().write_catalog(|put| {
            scans_lost = whole_entries(disk, layout, as_of, points, put)?.scans_lost;
            Ok(())
        })?;
        snapshot.commits.catalog = Some(catalog);
        Ok(scans_lost)
    }

    fn name_other_catalog(
        &mut self,
        store: &mut TileStore,
        snapshot: &Snapshot,
        scans_lost: u64,
    ) -> Result<()> {
        store.snapshot_writer().replace(snapshot)?;
        self.counts.snapshot_scans_lost += scans_lost;
        let reason = match scans_lost {
            0 => "a record that is damaged is no longer in the catalog of its kept scans".to_owned(),
            lost => {
                format!("{lost} scans that are damaged are no longer kept; it cannot be mapped again")
            }
        };
        self.note(ActionKind::Forgotten, &self.layout.snapshot(&snapshot.name), reason);
        Ok(())
    }

    /// Where nothing tells whether the map keeps its scans, moves those that no snapshot needs to quarantine. The next
    /// writer would remove them; without a log nothing tells which of the catalogs the last flush committed.
    pub(super) fn quarantine_unlisted_scans(&mut self, disk: &Arc<dyn Disk>, index: &Index) -> Result<()> {
        let Index { map_id, metadata, commits, .. } = index;
        let folder = self.layout.folder();
        let store = TileStore::of_commits(disk.clone(), folder, *map_id, metadata.clone(), commits.clone());
        if self.kind(&self.layout.kept_scans())? != Some(EntryKind::Folder) {
            return Ok(());
        }
        let kept = count_kept(self.disk, &self.layout)?;
        self.counts.scans_lost += kept;
        // Where a snapshot cannot be read it may need any, and no writer removes any: they go with the snapshot.
        let Some(snapshots) = known_snapshots(&store) else { return Ok(()) };
        let unneeded = store.unneeded_scan_files(&snapshots, None)?;
        for path in &unneeded {
            self.quarantine(path, "neither metadata.json nor commits.log tells whether the map needs it")?;
        }
        // Segments without a catalog have an unknown number of scans.
        self.counts.scans_lost += u64::from(kept == 0 && !unneeded.is_empty());
        Ok(())
    }

    /// Moves what was kept of scans for snapshots that are no more to quarantine.
    pub(super) fn quarantine_unneeded_scans(
        &mut self,
        store: &TileStore,
        snapshots: &[Snapshot],
    ) -> Result<()> {
        for path in store.unneeded_scan_files(snapshots, None)? {
            self.quarantine(&path, "only a snapshot that cannot be read may need it")?;
        }
        Ok(())
    }
}

/// A snapshot whose damaged catalog of kept scans has been replaced.
struct Replaced {
    /// Its place in the list of snapshots.
    at: usize,
    /// The damaged catalog; `None` if it is missing.
    old: Option<PathBuf>,
    /// Whether quarantine has a copy of that.
    is_old_kept: bool,
    scans_lost: u64,
}

/// What is wrong with files of kept scans.
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
        self.0.get(path).map_or("no scan that can be read needs it", String::as_str)
    }
}

/// The snapshots of a map; `None` if one cannot be read.
fn known_snapshots(store: &TileStore) -> Option<Vec<Snapshot>> {
    store.snapshots().names().ok()?.iter().map(|name| store.snapshots().read(name).ok()).collect()
}
