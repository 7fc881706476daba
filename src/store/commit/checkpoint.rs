use crate::error::{Error, Result};
use crate::space::{TileIndex, TileTable};
use crate::store::disk::EntryKind;
use crate::store::layout::TileFile;
use crate::store::map_files::MapFiles;
use crate::store::map_folder;
use crate::store::recovery::quarantine::Quarantine;
use crate::store::snapshots::kept_tables::KeptTables;
use crate::store::snapshots::snapshot_name::SnapshotName;
use crate::store::tiles::tile_versions::TileVersions;
use std::collections::BTreeSet;
use std::path::Path;

/// Work that a commit leaves: renames tables to their final names and removes the files of removed tiles and deleted
/// snapshots.
///
/// These files must not be written again before this work is durable: recovery after a crash repeats the renames and
/// removals.
#[derive(Debug, Default)]
pub(in crate::store) struct Checkpoint {
    /// Committed versions that still have their `*.next` names.
    unrenamed: TileTable<()>,
    /// Tiles whose versions are renamed, but perhaps not durably.
    renamed: TileTable<()>,
    /// Removed tiles whose files may exist, or whose removal may not be durable.
    unremoved: BTreeSet<TileIndex>,
    /// Committed snapshot whose file may not be renamed yet.
    unnamed_snapshot: Option<SnapshotName>,
    /// Deleted snapshot whose file may still exist.
    deleted_snapshot: Option<SnapshotName>,
}

/// Number of tiles synced at a time. The limit bounds memory: the paths of a tile take several times the memory of its
/// entry in the index.
pub(in crate::store) const TILES_SYNCED_AT_ONCE: usize = 4096;

impl Checkpoint {
    /// Returns the work that a killed writer left.
    pub(in crate::store) fn of_leftovers(
        unrenamed: TileTable<()>,
        renamed: TileTable<()>,
        removed: &[TileIndex],
    ) -> Self {
        let unremoved = removed.iter().copied().collect();
        Self { unrenamed, renamed, unremoved, ..Self::default() }
    }

    /// Adds the work of a commit.
    pub(in crate::store) fn add(&mut self, changed: impl Iterator<Item = TileIndex>, removed: &[TileIndex]) {
        self.unrenamed.extend(changed.map(|tile| (tile, ())));
        self.unremoved.extend(removed);
    }

    /// Schedules the rename of a committed snapshot's file.
    pub(in crate::store) fn name_snapshot(&mut self, name: &SnapshotName) {
        self.unnamed_snapshot = Some(name.clone());
    }

    /// Schedules the removal of a deleted snapshot's file.
    pub(in crate::store) fn remove_snapshot(&mut self, name: &SnapshotName) {
        self.deleted_snapshot = Some(name.clone());
    }

    /// Returns whether the committed version of a tile still has its `*.next` name.
    pub(in crate::store) fn is_unrenamed(&self, tile: TileIndex) -> bool {
        self.unrenamed.contains(tile)
    }

    /// Does the pending work durably. After an error, the next call resumes.
    pub(in crate::store) fn run(
        &mut self,
        files: &MapFiles,
        versions: &mut TileVersions,
        kept: &mut KeptTables,
    ) -> Result<()> {
        let tiles: Vec<_> = self.unrenamed.tiles().chain(self.unremoved.iter().copied()).collect();
        let pinned = self.keep_replaced(files, &tiles, versions.commits().flush_number, kept)?;
        sync_folders(files, &pinned, |tile| kept.is_durable(tile))?;
        self.finish_renames(files)?;
        self.finish_removals(files, versions)?;
        self.finish_snapshots(files)
    }

    /// Returns up to `max` tiles whose committed versions still have their `*.next` names.
    pub(in crate::store) fn some_unrenamed(&self, max: usize) -> Vec<TileIndex> {
        self.unrenamed.tiles().take(max).collect()
    }

    /// Keeps the current tables of those tiles that the last commit replaces or removes, if a reader or a snapshot uses
    /// them. Returns the tiles whose kept tables belong to snapshots: their new names must be durable before new tables
    /// take the old names.
    pub(in crate::store) fn keep_replaced(
        &self,
        files: &MapFiles,
        tiles: &[TileIndex],
        flush_number: u64,
        kept: &mut KeptTables,
    ) -> Result<Vec<TileIndex>> {
        let (layout, flush_number) = (files.layout(), flush_number.saturating_sub(1));
        // Refresh after the commit: a reader that opens the map from now on uses the new tables.
        if !tiles.is_empty() {
            kept.refresh_readers();
        }
        let mut pinned = Vec::new();
        for &tile in tiles {
            if kept.needs(tile, flush_number) && self.is_replaced_in_place(files, tile)? {
                files.rename(&layout.current(tile, TileFile::Table), &layout.kept(tile, flush_number))?;
                kept.keep(tile, flush_number);
            }
            // Includes tables that an earlier attempt or a killed writer renamed, but did not sync.
            if kept.is_pinned(tile, flush_number) {
                pinned.push(tile);
            }
        }
        Ok(pinned)
    }

    /// Returns whether the current table is the version before the last commit. If an earlier attempt has already
    /// renamed it to its kept name, there is no current table, and the caller's rename has no effect.
    fn is_replaced_in_place(&self, files: &MapFiles, tile: TileIndex) -> Result<bool> {
        let is_there = |path: &Path| Ok(files.kind(path)?.is_some());
        match self.unrenamed.contains(tile) {
            // If there is no `*.next` table, an earlier attempt has renamed it already.
            true => is_there(&files.layout().next(tile, TileFile::Table)),
            false => is_there(&files.layout().tile_folder(tile)),
        }
    }

    fn finish_renames(&mut self, files: &MapFiles) -> Result<()> {
        while !self.unrenamed.is_empty() {
            self.rename(files, &self.some_unrenamed(TILES_SYNCED_AT_ONCE))?;
        }
        while !self.renamed.is_empty() {
            let group: Vec<_> = self.renamed.tiles().take(TILES_SYNCED_AT_ONCE).collect();
            sync_folders(files, &group, |tile| self.renames_are_durable(&[tile]))?;
        }
        Ok(())
    }

    /// Renames the versions of some tiles to their final names, not durably.
    pub(in crate::store) fn rename(&mut self, files: &MapFiles, tiles: &[TileIndex]) -> Result<()> {
        let layout = files.layout();
        for &tile in tiles {
            // Another thread may have renamed it meanwhile.
            if !self.unrenamed.contains(tile) {
                continue;
            }
            for &file in layout.files() {
                put_in_place(files, &layout.next(tile, file), &layout.current(tile, file))?;
            }
            self.unrenamed.remove(tile);
            self.renamed.insert(tile, ());
        }
        Ok(())
    }

    /// Records that the names of some tiles' versions are durable.
    pub(in crate::store) fn renames_are_durable(&mut self, tiles: &[TileIndex]) {
        for &tile in tiles {
            self.renamed.remove(tile);
        }
    }

    /// Removes the files of removed tiles, and their folders if these are empty. Until this is durable, the log lists
    /// the tiles, so that recovery repeats the removal.
    fn finish_removals(&mut self, files: &MapFiles, versions: &mut TileVersions) -> Result<()> {
        if self.unremoved.is_empty() {
            return Ok(());
        }
        for &tile in &self.unremoved {
            remove_tile_files(files, tile)?;
        }
        files.sync_map_folder()?;
        self.unremoved.clear();
        versions.removals_are_durable();
        Ok(())
    }

    /// Renames the file of a committed snapshot, and removes the file of a deleted one.
    fn finish_snapshots(&mut self, files: &MapFiles) -> Result<()> {
        if self.unnamed_snapshot.is_none() && self.deleted_snapshot.is_none() {
            return Ok(());
        }
        let layout = files.layout();
        if let Some(name) = &self.unnamed_snapshot {
            files.rename(&layout.snapshot_next(), &layout.snapshot(name))?;
        }
        if let Some(name) = &self.deleted_snapshot {
            files.remove_file(&layout.snapshot(name))?;
        }
        files.sync_folder(&layout.snapshots())?;
        (self.unnamed_snapshot, self.deleted_snapshot) = (None, None);
        Ok(())
    }
}

/// Syncs the folders of some tiles, and calls `is_durable` for each tile whose folder was synced, up to the first
/// error.
pub(in crate::store) fn sync_folders(
    files: &MapFiles,
    tiles: &[TileIndex],
    mut is_durable: impl FnMut(TileIndex),
) -> Result<()> {
    let folders: Vec<_> = tiles.iter().map(|&tile| files.layout().tile_folder(tile)).collect();
    let [_, synced] = files.disk().sync_all(&[], &folders);
    for ((&tile, folder), result) in tiles.iter().zip(&folders).zip(synced) {
        result.map_err(|error| Error::io(folder, "sync", error))?;
        is_durable(tile);
    }
    Ok(())
}

/// Renames a committed file to its final name. A folder or link with that name is foreign and moved to quarantine.
fn put_in_place(files: &MapFiles, next: &Path, current: &Path) -> Result<()> {
    let disk = &**files.disk();
    let renamed = files.rename(next, current);
    if renamed.is_err() && !matches!(disk.kind(current), Err(_) | Ok(None | Some(EntryKind::File(_)))) {
        let to = Quarantine::new(disk, files.layout()).take(current)?;
        log::warn!("{}: not a regular file; moved to {}", current.display(), to.display());
        return files.rename(next, current);
    }
    renamed
}

fn remove_tile_files(files: &MapFiles, tile: TileIndex) -> Result<()> {
    let layout = files.layout();
    let folder = layout.tile_folder(tile);
    if files.kind(&folder)? != Some(EntryKind::Folder) {
        return Ok(());
    }
    for &file in layout.files() {
        for path in [layout.current(tile, file), layout.next(tile, file)] {
            // Anything but a regular file is foreign and is kept.
            if matches!(files.kind(&path)?, Some(EntryKind::File(_))) {
                files.remove_file(&path)?;
            }
        }
    }
    let disk = files.disk();
    let names = disk.list(&folder).map_err(|error| Error::io(&folder, "list", error))?;
    match names.is_empty() {
        true => map_folder::remove_unless_used(&**disk, &folder)
            .map_err(|error| Error::io(&folder, "remove", error)),
        false => files.sync_folder(&folder),
    }
}
