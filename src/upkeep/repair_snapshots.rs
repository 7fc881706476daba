use super::finding::Finding;
use super::rebuild::read_alone;
use super::repair::{Action, ActionKind, Repairer};
use super::snapshots::{WholeTables, lost_tiles};
use crate::config::MapConfig;
use crate::error::Result;
use crate::space::TileIndex;
use crate::store::{Snapshot, TileStore};

impl<F: FnMut(&Action), P: FnMut(u64, u64)> Repairer<'_, F, P> {
    /// Snapshots that cannot be read go to quarantine, and with them the kept tables that no other one sees. Of the others,
    /// tiles go whose tables cannot be read.
    pub(super) fn repair_snapshots(&mut self, store: &mut TileStore, config: &MapConfig) -> Result<()> {
        if store.map_id().is_none() {
            return Ok(());
        }
        let names = match store.snapshot_names() {
            Err(error) => {
                let finding = Finding::of(error)?;
                self.quarantine(&self.layout.snapshots(), &finding.reason)?;
                return self.quarantine_unseen(store, &[]);
            }
            Ok(names) => names,
        };
        let (mut snapshots, mut is_one_damaged) = (Vec::new(), false);
        for name in names {
            match store.snapshot(&name) {
                Ok(snapshot) => snapshots.push(snapshot),
                Err(error) => {
                    let finding = Finding::of(error)?;
                    self.quarantine(&self.layout.snapshot(&name), &finding.reason)?;
                    is_one_damaged = true;
                }
            }
        }
        let mut whole = WholeTables::new();
        for snapshot in &mut snapshots {
            self.repair_snapshot(store, config, snapshot, &mut whole)?;
        }
        if is_one_damaged { self.quarantine_unseen(store, &snapshots) } else { Ok(()) }
    }

    fn repair_snapshot(
        &mut self,
        store: &TileStore,
        config: &MapConfig,
        snapshot: &mut Snapshot,
        whole: &mut WholeTables,
    ) -> Result<()> {
        let lost = lost_tiles(store, config, snapshot, whole)?;
        if lost.is_empty() {
            return Ok(());
        }
        for (tile, _) in &lost {
            snapshot.commits.tiles.remove(tile);
            let kept = store.kept_tables(*tile)?;
            let Some(&flush_number) = kept.range(snapshot.commits.flush_number..).next() else { continue };
            self.quarantine_if_damaged(store, config, *tile, flush_number)?;
        }
        store.replace_snapshot(snapshot)?;
        let reason = format!("{} tiles whose tables are missing or damaged", lost.len());
        self.note(ActionKind::Forgotten, &self.layout.snapshot(&snapshot.name), reason);
        self.counts.snapshot_tiles_lost += lost.len() as u64;
        Ok(())
    }

    /// Where the table that a snapshot saw is missing, names lead it to another version, which is whole and others'.
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

    /// Kept tables that none of the snapshots sees: one that cannot be read may have.
    fn quarantine_unseen(&mut self, store: &TileStore, snapshots: &[Snapshot]) -> Result<()> {
        let mut kept: Vec<_> = store.seen_by_snapshots().collect();
        kept.sort_unstable();
        for (tile, flush_number) in kept {
            let flushes = store.kept_tables(tile)?;
            let is_seen = |snapshot: &Snapshot| {
                let first = flushes.range(snapshot.commits.flush_number..).next();
                snapshot.commits.tiles.contains_key(&tile) && first == Some(&flush_number)
            };
            if flushes.contains(&flush_number) && !snapshots.iter().any(is_seen) {
                let why = "only a snapshot that cannot be read may see it";
                self.quarantine(&self.layout.kept(tile, flush_number), why)?;
            }
        }
        Ok(())
    }
}
