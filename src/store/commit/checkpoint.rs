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

/// What the last commit left to do on disk: its tables get their names, removed tiles and deleted snapshots lose their
/// files.
///
/// Until that is done and durable, nothing may be written under the names in question, which a crash could bring back.
#[derive(Debug, Default)]
pub(in crate::store) struct Checkpoint {
    /// Committed versions that still have their `*.next` names.
    unrenamed: TileTable<()>,
    /// Tiles whose versions have their names, but perhaps not on the medium.
    renamed: TileTable<()>,
    /// Tiles that a commit took out of the map, with files that are still there or whose absence may not be durable.
    unremoved: BTreeSet<TileIndex>,
    /// A snapshot that is committed and may not have its name yet.
    unnamed_snapshot: Option<SnapshotName>,
    /// A snapshot whose deletion is committed and whose file may be there still.
    deleted_snapshot: Option<SnapshotName>,
}

/// Tiles whose files are synced at once: their paths take several times the memory of what else is known of them.
pub(in crate::store) const TILES_SYNCED_AT_ONCE: usize = 4096;

impl Checkpoint {
    /// What a writer that was killed left to do.
    pub(in crate::store) fn of_leftovers(
        unrenamed: TileTable<()>,
        renamed: TileTable<()>,
        removed: &[TileIndex],
    ) -> Self {
        let unremoved = removed.iter().copied().collect();
        Self { unrenamed, renamed, unremoved, ..Self::default() }
    }

    /// Adds what a commit leaves to do.
    pub(in crate::store) fn add(&mut self, changed: impl Iterator<Item = TileIndex>, removed: &[TileIndex]) {
        self.unrenamed.extend(changed.map(|tile| (tile, ())));
        self.unremoved.extend(removed);
    }

    /// Adds that a committed snapshot gets its name.
    pub(in crate::store) fn name_snapshot(&mut self, name: &SnapshotName) {
        self.unnamed_snapshot = Some(name.clone());
    }

    /// Adds that a deleted snapshot loses its file.
    pub(in crate::store) fn remove_snapshot(&mut self, name: &SnapshotName) {
        self.deleted_snapshot = Some(name.clone());
    }

    /// Whether the committed version of a tile still has its `*.next` name.
    pub(in crate::store) fn is_unrenamed(&self, tile: TileIndex) -> bool {
        self.unrenamed.contains(tile)
    }

    /// Does what is left to do, durably. After an error calling again goes on.
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

    /// Some tiles whose committed versions still have their `*.next` names.
    pub(in crate::store) fn some_unrenamed(&self, most: usize) -> Vec<TileIndex> {
        self.unrenamed.tiles().take(most).collect()
    }

    /// Keeps the tables in place of some tiles that the last commit replaces or removes, where a reader or a snapshot
    /// sees them. Returns the tiles of which those of snapshots must have their new names durably before other tables
    /// take the old ones.
    pub(in crate::store) fn keep_replaced(
        &self,
        files: &MapFiles,
        tiles: &[TileIndex],
        flush_number: u64,
        kept: &mut KeptTables,
    ) -> Result<Vec<TileIndex>> {
        let (layout, flush_number) = (files.layout(), flush_number.saturating_sub(1));
        // Asked after the commit: who begins to read later sees it.
        if !tiles.is_empty() {
            kept.refresh_readers();
        }
        let mut pinned = Vec::new();
        for &tile in tiles {
            if kept.needs(tile, flush_number) && self.is_replaced_in_place(files, tile)? {
                files.rename(&layout.current(tile, TileFile::Table), &layout.kept(tile, flush_number))?;
                kept.keep(tile, flush_number);
            }
            // Also what an earlier attempt, or a writer that was killed, renamed and could not sync.
            if kept.is_pinned(tile, flush_number) {
                pinned.push(tile);
            }
        }
        Ok(pinned)
    }

    /// Whether the table in place is the version before the last commit. An earlier attempt may have kept it already;
    /// what is renamed then is not there, and nothing happens.
    fn is_replaced_in_place(&self, files: &MapFiles, tile: TileIndex) -> Result<bool> {
        let is_there = |path: &Path| Ok(files.kind(path)?.is_some());
        match self.unrenamed.contains(tile) {
            // Otherwise it has been put in place.
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

    /// Gives the versions of some tiles their names, which are not durable yet.
    pub(in crate::store) fn rename(&mut self, files: &MapFiles, tiles: &[TileIndex]) -> Result<()> {
        let layout = files.layout();
        for &tile in tiles {
            // Another may have done it meanwhile.
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

    /// Notes that the names of some tiles' versions are durable.
    pub(in crate::store) fn renames_are_durable(&mut self, tiles: &[TileIndex]) {
        for &tile in tiles {
            self.renamed.remove(tile);
        }
    }

    /// Removes the files of removed tiles, and their folders where nothing else is in them. The log names these tiles
    /// until that is durable.
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

    /// Gives a committed snapshot its name, and removes the file of a deleted one.
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

/// Makes the names in the folders of some tiles durable, and tells of each that is.
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

/// Gives a committed file its name. A folder or link that has it, which no map contains, is moved to quarantine.
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
            // What is no file is not voxtile's, and stays.
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
