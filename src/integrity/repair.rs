use super::finding::Finding;
use super::kept_points::WholePoints;
use super::rebuild::{self, Index, Replaced};
use super::tile_check::{check_tile, checksum_of, write_octree};
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::persistence::TileSaver;
use crate::persistence::config_from;
use crate::space::TileIndex;
use crate::store::{
    Commits, Disk, EntryKind, Layout, MapPath, Quarantine, Salvage, Snapshot, TileFile, TileStore,
    WriterLock, check_scans, hex,
};
use crate::tile::{OctreeFactory, Tile};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Action of a repair.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Action {
    /// Kind of action.
    pub kind: ActionKind,
    /// Affected file or folder.
    #[serde(serialize_with = "crate::path_text::serialize")]
    pub path: PathBuf,
    /// Reason, and new location if the file was moved.
    pub reason: String,
}

/// Kind of an [`Action`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ActionKind {
    /// Written again from other files of the map.
    Derived,
    /// Moved to `quarantine/`.
    Quarantined,
    /// Renamed to its committed name.
    Renamed,
    /// Removed, because the log proves that it is uncommitted or replaced.
    Removed,
    /// Removed from the log because its files are missing, or from a snapshot because they are missing or damaged. For
    /// `metadata.json`: the inputs were removed.
    Forgotten,
    /// Unchanged, because the medium failed.
    Left,
}

/// Result of a repair.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Repair {
    /// Number of tiles in the map after the repair.
    pub tiles: u64,
    /// Number of tiles lost from snapshots.
    pub snapshot_tiles_lost: u64,
    /// Number of lost snapshots.
    pub snapshots_lost: u64,
    /// Number of kept scans with a damaged record or damaged points. The map can no longer be replayed from them.
    pub scans_lost: u64,
    /// Like `scans_lost`, for the kept scans of snapshots.
    pub snapshot_scans_lost: u64,
    /// Number of kept scans of the map and of snapshots with damaged marks of moving points. The map can be replayed
    /// after its moving points are marked again, or all marks are removed.
    pub marks_lost: u64,
    /// Number of tiles lost from the map. Their space is unknown again.
    pub tiles_lost: u64,
    /// Number of inputs removed from the metadata, because the tiles may lack some of their scans.
    pub inputs_forgotten: u64,
    /// Number of damaged files that remain, because the medium failed.
    pub left: u64,
    /// Number of actions; 0 if the map was intact.
    pub actions: u64,
}

impl Repair {
    /// Returns whether nothing was lost from the map and its snapshots, and no damage remains.
    pub fn is_complete(&self) -> bool {
        let scans_lost = self.scans_lost + self.snapshot_scans_lost + self.marks_lost;
        let lost = self.tiles_lost + scans_lost + self.snapshot_tiles_lost + self.snapshots_lost;
        lost + self.inputs_forgotten + self.left == 0
    }
}

/// Repairs a damaged map: rebuilds the index and octrees, moves damaged tiles to `quarantine/`, and removes the remains
/// of a crash. No data is deleted. An interrupted repair can be repeated.
///
/// `done` receives each action, and `progress` the number of tiles done and in total.
///
/// # Errors
///
/// No map, another writer, too little data to identify the map, or an I/O error.
pub fn repair(
    folder: impl Into<MapPath>,
    done: impl FnMut(&Action),
    progress: impl FnMut(u64, u64),
) -> Result<Repair> {
    let (disk, folder) = folder.into().into_parts();
    let folder = &*folder;
    let layout = Layout::new(folder);
    let mut repairer = Repairer {
        disk: &*disk,
        layout,
        done,
        progress,
        counts: Repair::default(),
        points: WholePoints::default(),
        catalogs_kept: BTreeSet::new(),
    };
    repairer.repair_lock()?;
    let mut store = match TileStore::open(disk.clone(), folder) {
        Err(error) if matches!(error, Error::Damaged { tile: None, .. }) || Finding::is_of_file(&error) => {
            repairer.repair_index(&disk)?;
            TileStore::open(disk.clone(), folder)?
        }
        store => store?,
    };
    let config = config_from(store.metadata(), &store.layout().metadata())?;
    repairer.layout = store.layout().clone();
    repairer.repair_scans(&mut store)?;
    repairer.repair_kept_scans(&mut store)?;
    repairer.repair_tiles(&mut store, &config)?;
    Ok(repairer.counts)
}

pub(super) struct Repairer<'a, F, P> {
    pub(super) disk: &'a dyn Disk,
    pub(super) layout: Layout,
    done: F,
    progress: P,
    pub(super) counts: Repair,
    /// Points of kept scans that were read and are intact.
    pub(super) points: WholePoints,
    /// Catalogs of kept scans that were copied to quarantine.
    pub(super) catalogs_kept: BTreeSet<PathBuf>,
}

impl<F: FnMut(&Action), P: FnMut(u64, u64)> Repairer<'_, F, P> {
    pub(super) fn note(&mut self, kind: ActionKind, path: &Path, reason: impl Into<String>) {
        self.counts.actions += 1;
        (self.done)(&Action { kind, path: path.to_owned(), reason: reason.into() });
    }

    pub(super) fn quarantine(&mut self, path: &Path, why: &str) -> Result<()> {
        let to = Quarantine::new(self.disk, &self.layout).take(path)?;
        self.note(ActionKind::Quarantined, path, format!("{why}; moved to {}", to.display()));
        Ok(())
    }

    /// Moves the files of a tile to quarantine, except for tables that snapshots use.
    fn quarantine_tile(&mut self, tile: TileIndex, why: &str) -> Result<()> {
        let folder = self.layout.tile_folder(tile);
        let names = match self.kind(&folder)? {
            Some(EntryKind::Folder) if self.kind(&self.layout.snapshots())?.is_some() => {
                self.disk.list(&folder).map_err(|error| Error::io(&folder, "list", error))?
            }
            _ => Vec::new(),
        };
        let is_kept = |name: &String| self.layout.flush_of_kept(name).is_some();
        let (kept, others): (Vec<_>, Vec<_>) = names.into_iter().partition(is_kept);
        if kept.is_empty() {
            return self.quarantine(&folder, why);
        }
        others.iter().try_for_each(|name| self.quarantine(&folder.join(name), why))
    }

    pub(super) fn quarantine_copy(&mut self, path: &Path, why: &str) -> Result<()> {
        if let Some(to) = Quarantine::new(self.disk, &self.layout).take_copy(path)? {
            self.note(ActionKind::Quarantined, path, format!("{why}; kept as {}", to.display()));
        }
        Ok(())
    }

    pub(super) fn kind(&self, path: &Path) -> Result<Option<EntryKind>> {
        self.disk.kind_at(path)
    }

    /// Moves the lock file to quarantine if it is not a regular file.
    fn repair_lock(&mut self) -> Result<()> {
        let path = self.layout.lock();
        match self.kind(&path)? {
            Some(EntryKind::Folder | EntryKind::Other) if self.kind(&self.layout.metadata())?.is_some() => {
                self.quarantine(&path, "not a regular file: the map could not be locked")
            }
            _ => Ok(()),
        }
    }

    /// Truncates the list of scans to its intact part.
    fn repair_scans(&mut self, store: &mut TileStore) -> Result<()> {
        let path = self.layout.scans();
        let flush_number = store.commits().flush_number;
        let records = store.listed_records();
        let damage = match check_scans(self.disk, &self.layout, flush_number, records) {
            Ok(()) => return Ok(()),
            Err(error) if matches!(error, Error::Damaged { .. }) || Finding::is_of_file(&error) => error,
            Err(error) => return Err(error),
        };
        let settled = match &damage {
            Error::Damaged { .. } => store.settle_scans(),
            // Truncation would leave an unreadable file.
            _ => store.rewrite_scans(),
        };
        let quarantined = match settled {
            Err(error) if Finding::is_of_file(&error) => store.rewrite_scans()?,
            settled => settled?,
        };
        if let Some(to) = quarantined {
            let reason = match &damage {
                Error::Damaged { cause, .. } => format!("{cause}; kept as {}", to.display()),
                error => format!("{error:#}; kept as {}", to.display()),
            };
            self.note(ActionKind::Quarantined, &path, reason);
        }
        self.note(ActionKind::Derived, &path, "truncated at the start of the damage");
        Ok(())
    }

    /// Replaces `commits.log` and `metadata.json`, from their remains and from the tiles.
    fn repair_index(&mut self, disk: &Arc<dyn Disk>) -> Result<()> {
        let _lock = WriterLock::take(self.disk, &self.layout)?;
        let remains = Salvage::read(self.disk, &self.layout)?;
        self.layout = remains.layout_of_tiles(self.disk, self.layout.folder());
        let index = rebuild::index_of(self.disk, &self.layout, &remains, &mut self.progress)?;
        let Some(index) = index else {
            // A map of the original format has no log, so the unreadable `commits.log` is not part of it.
            if self.kind(&self.layout.kept_scans())?.is_some() {
                self.quarantine(&self.layout.kept_scans(), "metadata.json is of the original format")?;
            }
            return self.quarantine(&self.layout.commit_log(), "metadata.json is of the original format");
        };
        if index.are_scans_unknown {
            self.quarantine_unlisted_scans(disk, &index)?;
        }
        let Index { map_id, metadata, commits, waiting, damaged, is_from_tiles, inputs_forgotten, .. } =
            index;
        for (tile, error) in damaged {
            self.quarantine_tile(tile, &format!("{error:#}"))?;
            self.counts.tiles_lost += 1;
        }
        if is_from_tiles {
            self.settle_waiting(&commits, &waiting)?;
        }
        let paths = [self.layout.commit_log(), self.layout.metadata()];
        if is_from_tiles {
            let why = remains.log_error.as_ref().map(|error| format!("{error:#}"));
            let why = why.unwrap_or("it does not contain the flush in metadata.json".into());
            self.quarantine_copy(&paths[0], &why)?;
        }
        let written_id =
            remains.metadata.as_ref().map(|metadata| metadata.ext.as_ref().map(|ext| &*ext.map_id));
        match written_id {
            Err(error) => self.quarantine_copy(&paths[1], &format!("{error:#}"))?,
            Ok(id) if id != Some(&hex(&map_id)) => {
                self.quarantine_copy(&paths[1], "it belongs to another map")?
            }
            Ok(_) => {}
        }
        remains.write(self.disk, &self.layout, map_id, &commits, &metadata)?;
        let (source, tiles) = match is_from_tiles {
            true => ("the tiles; without the log they may be from different flushes", commits.tiles.len()),
            false => ("commits.log", commits.tiles.len()),
        };
        self.note(
            ActionKind::Derived,
            &paths[1],
            format!("and commits.log, with {tiles} tiles, from {source}"),
        );
        if inputs_forgotten > 0 {
            self.counts.inputs_forgotten += inputs_forgotten;
            let reason =
                format!("{inputs_forgotten} inputs: it is unknown whether all their scans are in the tiles");
            self.note(ActionKind::Forgotten, &paths[1], reason);
        }
        Ok(())
    }

    /// Renames or quarantines `*.next` files. Without a log none of them is known to be uncommitted, so those that are
    /// not part of the rebuilt map are kept in quarantine.
    fn settle_waiting(&mut self, commits: &Commits, waiting: &BTreeMap<TileIndex, Replaced>) -> Result<()> {
        let mut tiles: Vec<_> = commits.tiles.tiles().collect();
        tiles.sort_unstable();
        // The tables that snapshots use are known only after the map is opened again.
        let has_snapshots = Snapshot::list(self.disk, &self.layout).is_ok_and(|names| !names.is_empty());
        for tile in tiles {
            let kept = self.layout.kept(tile, commits.flush_number.saturating_sub(1));
            for &file in self.layout.files() {
                let (next, current) = (self.layout.next(tile, file), self.layout.current(tile, file));
                if self.kind(&next)?.is_none() {
                    continue;
                }
                let Some(replaced) = waiting.get(&tile) else {
                    self.quarantine(&next, "it is unknown whether it was committed")?;
                    continue;
                };
                let why = match replaced {
                    Replaced::Older => "from an earlier flush than the version that was not renamed yet",
                    Replaced::Unusable => "damaged; the version that was not renamed yet is intact",
                };
                let is_seen = has_snapshots && file == TileFile::Table && *replaced == Replaced::Older;
                if is_seen && self.kind(&kept)?.is_none() {
                    // Keep the table for the snapshots, as the flush would have done.
                    self.quarantine_copy(&current, why)?;
                    self.disk
                        .rename(&current, &kept)
                        .map_err(|error| Error::io(&current, "rename", error))?;
                } else if self.kind(&current)?.is_some() {
                    self.quarantine(&current, why)?;
                }
                self.disk.rename(&next, &current).map_err(|error| Error::io(&next, "rename", error))?;
                self.note(ActionKind::Renamed, &next, "intact, and from the last flush or an earlier one");
            }
            let folder = self.layout.tile_folder(tile);
            self.disk.sync_folder(&folder).map_err(|error| Error::io(&folder, "sync", error))?;
        }
        Ok(())
    }

    fn repair_tiles(&mut self, store: &mut TileStore, config: &MapConfig) -> Result<()> {
        if store.leftovers_removed() > 0 {
            let reason = format!("{} files that were uncommitted or replaced", store.leftovers_removed());
            let folder = self.layout.folder().to_owned();
            self.note(ActionKind::Removed, &folder, reason);
        }
        for tile in store.tiles().orphans() {
            self.quarantine_tile(tile, "commits.log has no entry for this tile")?;
        }
        let mut tiles: Vec<_> = store.tiles().iter().collect();
        tiles.sort_unstable();
        let mut lost = Vec::new();
        for (done, &tile) in (1..).zip(&tiles) {
            match self.repair_tile(store, config, tile) {
                Ok(true) => {}
                Ok(false) => lost.push(tile),
                Err(error) if error.is_of_medium() => {
                    self.counts.left += 1;
                    self.note(ActionKind::Left, &self.layout.tile_folder(tile), format!("{error:#}"));
                }
                Err(error) => return Err(error),
            }
            (self.progress)(done, tiles.len() as u64);
        }
        if !lost.is_empty() {
            if store.map_id().is_none() {
                // `metadata.json` may have keys that voxtile does not know.
                self.quarantine_copy(&self.layout.metadata(), "its bounds will change")?;
            }
            store.forget(&lost)?;
        } else if store.commits().torn.is_some()
            || store.is_metadata_behind()
            || store.has_replaced_metadata()
        {
            store.checkpoint()?;
            self.note(
                ActionKind::Derived,
                &self.layout.metadata(),
                "updated to the last flush in commits.log",
            );
        }
        self.repair_snapshots(store, config)?;
        self.counts.tiles = (tiles.len() - lost.len()) as u64;
        self.counts.tiles_lost += lost.len() as u64;
        Ok(())
    }

    /// Repairs a tile of the map. Returns false if the tile must be removed from the map.
    fn repair_tile(&mut self, store: &mut TileStore, config: &MapConfig, tile: TileIndex) -> Result<bool> {
        let mut check = check_tile(self.disk, store, config, tile)?;
        if matches!(&check.table, Err(error) if error.is_of_medium()) {
            // Retry, in case the error is temporary.
            check = check_tile(self.disk, store, config, tile)?;
        }
        if let Err(error) = &check.table
            && self.restore_table(store, tile, &format!("{error:#}"))?
        {
            check = check_tile(self.disk, store, config, tile)?;
        }
        let table = match check.table {
            Ok(table) => table,
            Err(error) => {
                let folder = self.layout.tile_folder(tile);
                let finding = Finding::of(error)?;
                if self.kind(&folder)?.is_none() {
                    self.note(ActionKind::Forgotten, &folder, "the tile's folder is missing");
                } else {
                    self.quarantine_tile(tile, &finding.reason)?;
                }
                return Ok(false);
            }
        };
        let Some(Err(cause)) = check.octree else { return Ok(true) };
        let path = self.layout.current(tile, TileFile::Octree);
        match self.quarantine_copy(&path, &cause.reason) {
            // The octree is replaced even if it cannot be copied.
            Err(error) if error.is_of_medium() => {}
            copied => copied?,
        }
        if !matches!(self.kind(&path)?, None | Some(EntryKind::File(_))) {
            self.quarantine(&path, "not a regular file")?;
        }
        let expected = store.tiles().version(tile).map(|version| version.octree);
        let written = store.write_next(tile, TileFile::Octree, |out| write_octree(config, &table, out))?;
        if Some(written) == expected {
            store.place_octree(tile)?;
        } else {
            // The octree of another writer cannot be reproduced, so the tile is written again with the current one.
            let scan_number = table.trailer.map_or(0, |trailer| trailer.scan_number);
            let tile = Tile::from_table(&config.grid, &OctreeFactory::default(), tile, table.table);
            TileSaver::new(config).save(store, &tile, scan_number)?;
            let (metadata, scan_number) = (store.metadata().clone(), store.commits().scan_number);
            store.commit(metadata, scan_number)?;
        }
        self.note(ActionKind::Derived, &path, "from the tile's table");
        Ok(true)
    }

    /// Replaces a damaged table by a kept table that has the checksum in the log. A revert can leave such a table.
    /// Returns false if there is none.
    fn restore_table(&mut self, store: &mut TileStore, tile: TileIndex, why: &str) -> Result<bool> {
        let Some(version) = store.tiles().version(tile) else { return Ok(false) };
        // Unreadable files are skipped.
        for flush_number in store.tables().kept(tile).unwrap_or_default() {
            let (kept, current) =
                (self.layout.kept(tile, flush_number), self.layout.current(tile, TileFile::Table));
            if !matches!(checksum_of(self.disk, &kept), Ok(Some(found)) if found == version.table) {
                continue;
            }
            if self.kind(&current)?.is_some() {
                self.quarantine(&current, why)?;
            }
            store.put_kept_in_place(tile, &kept)?;
            let reason = format!("from {}, which has the same bytes", kept.display());
            self.note(ActionKind::Derived, &current, reason);
            return Ok(true);
        }
        Ok(false)
    }
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            ActionKind::Derived => "derived",
            ActionKind::Quarantined => "quarantined",
            ActionKind::Renamed => "renamed",
            ActionKind::Removed => "removed",
            ActionKind::Forgotten => "forgotten",
            ActionKind::Left => "left",
        };
        write!(f, "{kind}: {}: {}", self.path.display(), self.reason)
    }
}
