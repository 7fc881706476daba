//! What comes after the commit: committed versions get their names, removed tiles lose theirs.

use super::disk::EntryKind;
use super::flush::TILES_SYNCED_AT_ONCE;
use super::layout::TileFile;
use super::quarantine::Quarantine;
use super::tile_store::TileStore;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use std::io;
use std::path::Path;

impl TileStore {
    pub(super) fn tidy_up(&mut self) -> Result<()> {
        // At once: who opens the map in between cannot tell the writer which flush it reads.
        if self.written_flush != Some(self.commits.flush_number) {
            self.write_metadata()?;
        }
        self.put_in_place()?;
        self.readers.release(&*self.disk, &self.layout, &self.snapshots);
        self.compact_log()
    }

    /// Brings the files of tiles to what the last commit says, durably. Before that nothing may be written under the
    /// names in question, which a crash could bring back.
    pub(super) fn put_in_place(&mut self) -> Result<()> {
        self.keep_replaced()?;
        self.finish_renames()?;
        self.finish_removals()?;
        self.finish_snapshots()
    }

    /// Keeps the tables in place that the last commit replaces or removes, where a reader or a snapshot sees them. Those of
    /// snapshots have their new names durably before other tables can take the old ones.
    fn keep_replaced(&mut self) -> Result<()> {
        let tiles: Vec<_> = self.unrenamed.tiles().chain(self.unremoved.iter().copied()).collect();
        // Asked after the commit: who begins to read later sees it.
        if !tiles.is_empty() {
            self.readers.look();
        }
        let flush_number = self.commits.flush_number.saturating_sub(1);
        let mut seen = Vec::new();
        for tile in tiles {
            let is_seen = self.snapshots.sees_present(tile);
            let is_wanted = (is_seen || self.readers.see(tile, flush_number, &self.snapshots))
                && !self.snapshots.sees_kept(tile, flush_number);
            if is_wanted && self.is_replaced_in_place(tile)? {
                let (from, to) =
                    (self.layout.current(tile, TileFile::Table), self.layout.kept(tile, flush_number));
                self.rename(&from, &to)?;
                match is_seen {
                    true => self.snapshots.pin(tile, flush_number),
                    false => self.readers.keep(tile, flush_number),
                }
            }
            // Also what an earlier attempt, or a writer that was killed, renamed and could not sync.
            if self.snapshots.sees_kept(tile, flush_number) {
                seen.push(tile);
            }
        }
        let folders: Vec<_> = seen.iter().map(|&tile| self.layout.tile_folder(tile)).collect();
        let [_, synced] = self.disk.sync_all(&[], &folders);
        for ((tile, folder), result) in seen.iter().zip(&folders).zip(synced) {
            result.map_err(|error| Error::io(folder, "sync", error))?;
            self.snapshots.has_replaced(*tile);
        }
        Ok(())
    }

    /// Whether the table in place is the version before the last commit. An earlier attempt may have kept it already; what
    /// is renamed then is not there, and nothing happens.
    fn is_replaced_in_place(&self, tile: TileIndex) -> Result<bool> {
        let is_there = |path: &Path| Ok(self.kind(path)?.is_some());
        match self.unrenamed.contains(tile) {
            // Otherwise it has been put in place.
            true => is_there(&self.layout.next(tile, TileFile::Table)),
            false => is_there(&self.layout.tile_folder(tile)),
        }
    }

    fn finish_renames(&mut self) -> Result<()> {
        while !self.unrenamed.is_empty() {
            let group: Vec<_> = self.unrenamed.tiles().take(TILES_SYNCED_AT_ONCE).collect();
            for tile in group {
                for &file in self.layout.files() {
                    self.put_in_its_place(&self.layout.next(tile, file), &self.layout.current(tile, file))?;
                }
                self.unrenamed.remove(tile);
                self.renamed.insert(tile, ());
            }
        }
        self.sync_renamed()
    }

    /// Gives a committed file its name. A folder or link that has it, which no map contains, is moved to quarantine.
    fn put_in_its_place(&self, next: &Path, current: &Path) -> Result<()> {
        let renamed = self.rename(next, current);
        if renamed.is_err()
            && !matches!(self.disk.kind(current), Err(_) | Ok(None | Some(EntryKind::File(_))))
        {
            let to = Quarantine::new(&*self.disk, &self.layout).take(current)?;
            log::warn!("{}: no file, and in the way of one; now {}", current.display(), to.display());
            return self.rename(next, current);
        }
        renamed
    }

    fn sync_renamed(&mut self) -> Result<()> {
        while !self.renamed.is_empty() {
            let group: Vec<_> = self.renamed.tiles().take(TILES_SYNCED_AT_ONCE).collect();
            let folders: Vec<_> = group.iter().map(|&tile| self.layout.tile_folder(tile)).collect();
            let [_, synced] = self.disk.sync_all(&[], &folders);
            for ((&tile, folder), result) in group.iter().zip(&folders).zip(synced) {
                result.map_err(|error| Error::io(folder, "sync", error))?;
                self.renamed.remove(tile);
            }
        }
        Ok(())
    }

    /// Removes the files of removed tiles, and their folders where nothing else is in them. The log names these tiles
    /// until that is durable.
    fn finish_removals(&mut self) -> Result<()> {
        if self.unremoved.is_empty() {
            return Ok(());
        }
        for tile in self.unremoved.clone() {
            self.remove_files(tile)?;
        }
        self.sync_folder(self.layout.folder())?;
        self.unremoved.clear();
        self.commits.last_removed.clear();
        Ok(())
    }

    fn remove_files(&mut self, tile: TileIndex) -> Result<()> {
        let folder = self.layout.tile_folder(tile);
        if self.kind(&folder)? != Some(EntryKind::Folder) {
            return Ok(());
        }
        for &file in self.layout.files() {
            for path in [self.layout.current(tile, file), self.layout.next(tile, file)] {
                // What is no file is not voxtile's, and stays.
                if matches!(self.kind(&path)?, Some(EntryKind::File(_))) {
                    self.remove_file(&path)?;
                }
            }
        }
        let names = self.disk.list(&folder).map_err(|error| Error::io(&folder, "list", error))?;
        match names.is_empty() {
            true => self.disk.remove_folder(&folder).map_err(|error| Error::io(&folder, "remove", error)),
            false => self.sync_folder(&folder),
        }
    }

    /// Renames a file; one that is not there was renamed by an earlier attempt, or never was.
    pub(super) fn rename(&self, from: &Path, to: &Path) -> Result<()> {
        match self.disk.rename(from, to) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            result => result.map_err(|error| Error::io(from, "rename", error)),
        }
    }

    fn remove_file(&self, path: &Path) -> Result<()> {
        match self.disk.remove_file(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            result => result.map_err(|error| Error::io(path, "remove", error)),
        }
    }

    pub(super) fn kind(&self, path: &Path) -> Result<Option<EntryKind>> {
        self.disk.kind(path).map_err(|error| Error::io(path, "look at", error))
    }
}
