use super::finding::Finding;
use super::rebuild::read_alone;
use super::repair::{Action, ActionKind, Repairer};
use super::snapshots::{WholeTables, lost_tiles};
use crate::config::MapConfig;
use crate::error::Result;
use crate::space::TileIndex;
use crate::store::{Snapshot, SnapshotName, TileStore};
use std::collections::BTreeMap;

impl<F: FnMut(&Action), P: FnMut(u64, u64)> Repairer<'_, F, P> {
    /// Repairs the snapshots: renames misnamed ones, and moves unreadable ones to quarantine. Kept tables that only
    /// lost snapshots used are moved too. Tiles with unreadable tables are removed from the other snapshots.
    pub(super) fn repair_snapshots(&mut self, store: &mut TileStore, config: &MapConfig) -> Result<()> {
        if store.map_id().is_none() {
            return Ok(());
        }
        if let Err(error) = Snapshot::list(self.disk, &self.layout) {
            let finding = Finding::of(error)?;
            self.quarantine(&self.layout.snapshots(), &finding.reason)?;
        }
        self.put_names_right(store)?;
        let (mut snapshots, mut gone) = (Vec::new(), Vec::new());
        for name in store.snapshots().names()? {
            match store.snapshots().read(&name) {
                Ok(snapshot) => snapshots.push(snapshot),
                Err(error) => {
                    let (finding, path) = (Finding::of(error)?, self.layout.snapshot(&name));
                    match self.kind(&path) {
                        Ok(None) => self.note(ActionKind::Forgotten, &path, "the snapshot's file is missing"),
                        _ => self.quarantine(&path, &finding.reason)?,
                    }
                    gone.push(name);
                }
            }
        }
        let mut whole = WholeTables::new();
        for snapshot in &mut snapshots {
            self.repair_snapshot(store, config, snapshot, &mut whole)?;
        }
        // Before the log drops these snapshots: afterwards a writer removes the files that no other snapshot needs.
        self.quarantine_unneeded_scans(store, &snapshots)?;
        if !gone.is_empty() {
            self.counts.snapshots_lost += gone.len() as u64;
            self.quarantine_unseen(store, &snapshots)?;
            store.snapshot_writer().give_up(&gone)?;
        }
        self.repair_scans_of_snapshots(store, &mut snapshots)
    }

    /// Renames snapshots that the log names and that have another file name.
    fn put_names_right(&mut self, store: &mut TileStore) -> Result<()> {
        let (Some(map_id), Some(listed)) = (store.map_id(), store.snapshots().list().cloned()) else {
            return Ok(());
        };
        let mut found = BTreeMap::new();
        let mut misnamed = Vec::new();
        let is_wanted = |snapshot: &Snapshot| {
            let own = snapshot.name_inside().filter(|own| store.snapshots().read(own).is_err())?;
            (listed.flush_of(own) == Some(snapshot.commits.flush_number)).then(|| own.clone())
        };
        for name in Snapshot::list(self.disk, &self.layout)? {
            let path = self.layout.snapshot(&name);
            if let Ok(Some(snapshot)) = Snapshot::read_file(self.disk, &path, &name, map_id)
                && let Some(own) = is_wanted(&snapshot).filter(|own| *own != name)
            {
                self.quarantine_copy(&path, &format!("the file belongs to the snapshot {own}"))?;
                found.insert(own, snapshot);
                misnamed.push(name);
            }
        }
        // Files that an interrupted repair has moved to quarantine.
        let quarantine = self.layout.quarantine();
        for file in self.disk.list(&quarantine).unwrap_or_default() {
            if let Some(name) = file.strip_prefix("snapshots.").and_then(|name| SnapshotName::new(name).ok())
                && let Ok(Some(snapshot)) =
                    Snapshot::read_file(self.disk, &quarantine.join(&file), &name, map_id)
                && let Some(own) = is_wanted(&snapshot)
            {
                found.entry(own).or_insert(snapshot);
            }
        }
        for (own, snapshot) in found {
            let path = self.layout.snapshot(&own);
            let is_there = self.kind(&path)?.is_some();
            if is_there && !misnamed.contains(&own) {
                self.quarantine(&path, "it is unreadable; the snapshot is intact under another name")?;
            }
            misnamed.retain(|name| *name != own);
            store.snapshot_writer().replace(&Snapshot { name: own, ..snapshot })?;
            self.note(ActionKind::Renamed, &path, "the snapshot had another name");
        }
        // These files were copied to quarantine above, and the log does not list their names.
        for name in misnamed.iter().filter(|name| !listed.contains(name)) {
            self.quarantine(&self.layout.snapshot(name), "commits.log does not list this snapshot")?;
        }
        Ok(())
    }

    fn repair_snapshot(
        &mut self,
        store: &mut TileStore,
        config: &MapConfig,
        snapshot: &mut Snapshot,
        whole: &mut WholeTables,
    ) -> Result<()> {
        let lost = lost_tiles(store, config, snapshot, whole)?;
        if lost.is_empty() {
            return Ok(());
        }
        for (tile, _) in &lost {
            snapshot.commits.tiles.remove(*tile);
            let kept = store.tables().kept(*tile)?;
            let Some(&flush_number) = kept.range(snapshot.commits.flush_number..).next() else { continue };
            self.quarantine_if_damaged(store, config, *tile, flush_number)?;
        }
        store.snapshot_writer().replace(snapshot)?;
        let reason = format!("{} tiles whose tables are missing or damaged", lost.len());
        self.note(ActionKind::Forgotten, &self.layout.snapshot(&snapshot.name), reason);
        self.counts.snapshot_tiles_lost += lost.len() as u64;
        Ok(())
    }

    /// Moves a damaged kept table to quarantine. If the snapshot's own table is missing, the table with this flush
    /// number is intact and belongs to other snapshots: it remains.
    fn quarantine_if_damaged(
        &mut self,
        store: &TileStore,
        config: &MapConfig,
        tile: TileIndex,
        flush_number: u64,
    ) -> Result<()> {
        let (path, storage) = (self.layout.kept(tile, flush_number), self.layout.storage());
        let map_id = store.map_id().unwrap_or_default();
        match read_alone(self.disk, &path, storage, &config.grid, map_id, tile)? {
            Some(Err(error)) => {
                let finding = Finding::of(error)?;
                self.quarantine(&path, &finding.reason)
            }
            Some(Ok(_)) | None => Ok(()),
        }
    }

    /// Moves kept tables to quarantine that no readable snapshot uses. An unreadable snapshot may have used them.
    fn quarantine_unseen(&mut self, store: &TileStore, snapshots: &[Snapshot]) -> Result<()> {
        let mut kept: Vec<_> = store.snapshots().kept_tables().collect();
        kept.sort_unstable();
        for (tile, flush_number) in kept {
            let flushes = store.tables().kept(tile)?;
            let is_seen = |snapshot: &Snapshot| {
                let first = flushes.range(snapshot.commits.flush_number..).next();
                snapshot.commits.tiles.contains(tile) && first == Some(&flush_number)
            };
            if flushes.contains(&flush_number) && !snapshots.iter().any(is_seen) {
                let why = "only an unreadable snapshot may use it";
                self.quarantine(&self.layout.kept(tile, flush_number), why)?;
            }
        }
        Ok(())
    }
}
