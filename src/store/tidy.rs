//! What comes after the commit: committed versions get their names, removed tiles lose theirs.

use super::disk::EntryKind;
use super::layout::TileFile;
use super::tile_store::TileStore;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use std::io;
use std::path::Path;

impl TileStore {
    pub(super) fn tidy_up(&mut self) -> Result<()> {
        self.put_in_place()?;
        if self.written_flush != Some(self.commits.flush_number) {
            self.write_metadata()?;
        }
        self.readers.release(&*self.disk, &self.layout);
        self.compact_log()
    }

    /// Brings the files of tiles to what the last commit says, durably. Before that nothing may be written under the
    /// names in question, which a crash could bring back. Tables that go are kept while there are readers.
    pub(super) fn put_in_place(&mut self) -> Result<()> {
        // Asked after the commit: who begins to read later sees it.
        let is_idle = self.unrenamed.is_empty() && self.unremoved.is_empty();
        let keep = !is_idle && self.readers.are_there();
        self.finish_renames(keep)?;
        self.finish_removals(keep)
    }

    fn finish_renames(&mut self, keep: bool) -> Result<()> {
        while let Some(&tile) = self.unrenamed.first() {
            // Renamed by an earlier attempt, the table in place is the new one.
            if keep && self.kind(&self.layout.next(tile, TileFile::Table))?.is_some() {
                self.keep_table(tile)?;
            }
            for &file in self.layout.files() {
                self.rename(&self.layout.next(tile, file), &self.layout.current(tile, file))?;
            }
            self.unrenamed.remove(&tile);
            self.renamed.insert(tile);
        }
        self.sync_renamed()
    }

    fn sync_renamed(&mut self) -> Result<()> {
        let tiles: Vec<_> = self.renamed.iter().copied().collect();
        let folders: Vec<_> = tiles.iter().map(|&tile| self.layout.tile_folder(tile)).collect();
        let [_, synced] = self.disk.sync_all(&[], &folders);
        for ((tile, folder), result) in tiles.iter().zip(&folders).zip(synced) {
            result.map_err(|error| Error::io(folder, "sync", error))?;
            self.renamed.remove(tile);
        }
        Ok(())
    }

    /// Removes the files of removed tiles, and their folders where nothing else is in them. The log names these tiles
    /// until that is durable.
    fn finish_removals(&mut self, keep: bool) -> Result<()> {
        if self.unremoved.is_empty() {
            return Ok(());
        }
        for tile in self.unremoved.clone() {
            self.remove_files(tile, keep)?;
        }
        self.sync_folder(self.layout.folder())?;
        self.unremoved.clear();
        self.commits.last_removed.clear();
        Ok(())
    }

    fn remove_files(&mut self, tile: TileIndex, keep: bool) -> Result<()> {
        let folder = self.layout.tile_folder(tile);
        if self.kind(&folder)? != Some(EntryKind::Folder) {
            return Ok(());
        }
        if keep && self.kind(&self.layout.current(tile, TileFile::Table))?.is_some() {
            self.keep_table(tile)?;
        }
        for &file in self.layout.files() {
            for path in [self.layout.current(tile, file), self.layout.next(tile, file)] {
                self.remove_file(&path)?;
            }
        }
        let names = self.disk.list(&folder).map_err(|error| Error::io(&folder, "list", error))?;
        match names.is_empty() {
            true => self.disk.remove_folder(&folder).map_err(|error| Error::io(&folder, "remove", error)),
            false => self.sync_folder(&folder),
        }
    }

    /// Keeps the table in place, which the last commit replaces or removes, for those that see the flush before.
    fn keep_table(&mut self, tile: TileIndex) -> Result<()> {
        let flush_number = self.commits.flush_number.saturating_sub(1);
        self.rename(&self.layout.current(tile, TileFile::Table), &self.layout.kept(tile, flush_number))?;
        self.readers.keep(tile, flush_number);
        Ok(())
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

    fn kind(&self, path: &Path) -> Result<Option<EntryKind>> {
        self.disk.kind(path).map_err(|error| Error::io(path, "look at", error))
    }
}
