use super::finding::Finding;
use super::kept_scans::{count_kept, whole_entries};
use super::rebuild::Index;
use super::repair::{Action, ActionKind, Repairer};
use crate::error::Result;
use crate::store::{Disk, EntryKind, Quarantine, Snapshot, TileStore};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

impl<F: FnMut(&Action), P: FnMut(u64, u64)> Repairer<'_, F, P> {
    /// Lists scans whose points are damaged as scans without points, and those whose records are as unknown ones, so
    /// that the map can be mapped on. What neither the map nor a snapshot needs then goes to quarantine: the next
    /// writer would remove it.
    pub(super) fn repair_kept_scans(&mut self, store: &mut TileStore) -> Result<()> {
        if !store.keeps_scans() {
            return Ok(());
        }
        let folder = self.layout.kept_scans();
        let replaced = match store.catalog_path() {
            Err(error) if Finding::is_of_file(&error) => {
                self.quarantine(&folder, &format!("{error:#}"))?;
                None
            }
            replaced => replaced?,
        };
        let as_of = store.last_commit();
        let found = whole_entries(self.disk, &self.layout, as_of, |_| Ok(()))?;
        if found.damage.is_empty() {
            return Ok(());
        }
        let mut reasons = BTreeMap::new();
        for error in &found.damage {
            if let Some(path) = error.path() {
                reasons.entry(path.to_owned()).or_insert_with(|| format!("{error:#}"));
            }
        }
        let why = |path: &Path| reasons.get(path).map_or("no scan that can be read needs it", String::as_str);
        let mut is_kept = false;
        if let Some(catalog) = &replaced
            && let Some(to) = Quarantine::new(self.disk, &self.layout).keep(catalog)?
        {
            is_kept = true;
            let why = reasons.get(catalog).map_or("another takes its place", String::as_str);
            self.note(ActionKind::Quarantined, catalog, format!("{why}; kept as {}", to.display()));
        }
        store.begin_catalog()?;
        let left = whole_entries(self.disk, &self.layout, as_of, |entry| store.put_entry(entry))?;
        // Where a snapshot cannot be read it may need any, and no writer removes any: they go with the snapshot.
        let snapshots = known_snapshots(store);
        if let Some(snapshots) = &snapshots {
            // Before the commit: as long as the catalog is the damaged one, nobody removes anything, and a repair that
            // begins again finds the same scans.
            for path in store.unneeded_scan_files(snapshots, Some(&left.segments))? {
                self.quarantine(&path, why(&path))?;
            }
        }
        store.commit(store.metadata().clone(), as_of.scan_number)?;
        if let Some(snapshots) = &snapshots {
            for path in store.unneeded_scan_files(snapshots, Some(&left.segments))? {
                if !is_kept || Some(&path) != replaced.as_ref() {
                    self.quarantine(&path, why(&path))?;
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

/// The snapshots of a map; `None` if one cannot be read.
fn known_snapshots(store: &TileStore) -> Option<Vec<Snapshot>> {
    store.snapshot_names().ok()?.iter().map(|name| store.snapshot(name).ok()).collect()
}
