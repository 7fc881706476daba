//! Moves, copies or links files of tiles as next versions, without decoding them.

use crate::error::{Error, FormatError, Result};
use crate::space::TileIndex;
use crate::store::disk::EntryKind;
use crate::store::layout::TileFile;
use crate::store::tile_store::TileStore;
use crate::store::tiles::file_checksum::{Checksumming, FileChecksum};
use crate::store::tiles::tile_version::TileVersion;
use crate::store::tiles::tile_writer::{TileWriter, make_folder};
use std::io;
use std::path::Path;

impl TileStore {
    /// Moves all tiles of `other` to the next versions of this map. `other` must have the same id, storage and file
    /// system, and its tiles must be committed. Afterwards `other` lacks these files.
    ///
    /// # Errors
    ///
    /// An existing folder that the log does not name, or an I/O error. Some tiles may have been moved by then.
    pub fn swap_in(&mut self, other: &Self) -> Result<()> {
        self.finish_earlier_work()?;
        let mut tiles: Vec<_> = other.tiles().iter().collect();
        tiles.sort_unstable();
        tiles.into_iter().try_for_each(|tile| self.swap_in_tile(other, tile))
    }

    /// Like [`TileStore::swap_in`], but `other` keeps its files: they get hard links, or are copied without these.
    ///
    /// # Errors
    ///
    /// As for [`TileStore::swap_in`], and a file that differs from the log of `other`.
    pub fn link_in(&mut self, other: &Self) -> Result<()> {
        self.finish_earlier_work()?;
        let mut tiles: Vec<_> = other.tiles().iter().collect();
        tiles.sort_unstable();
        for tile in tiles {
            let version = other.version_to_copy(tile)?;
            self.check_is_own(tile)?;
            make_folder(&**self.disk(), &self.layout().tile_folder(tile))?;
            for &file in self.layout().files() {
                other.check_length(tile, file)?;
                let (from, to) = (other.layout().current(tile, file), self.layout().next(tile, file));
                if self.disk().link(&from, &to).is_err() {
                    other.copy_file(&self.writer()?, tile, file)?;
                }
            }
            self.versions.note_next(tile, version);
        }
        Ok(())
    }

    /// Checks that no foreign folder has the name of a tile.
    fn check_is_own(&self, tile: TileIndex) -> Result<()> {
        match self.versions.is_orphan(tile) {
            true => {
                let hint = "it is not part of the map; `voxtile repair` moves it to quarantine";
                Err(Error::AlreadyExists { path: self.layout().tile_folder(tile), hint })
            }
            false => Ok(()),
        }
    }

    fn swap_in_tile(&mut self, other: &Self, tile: TileIndex) -> Result<()> {
        let Some(version) = other.tiles().version(tile) else { return Ok(()) };
        self.check_is_own(tile)?;
        make_folder(&**self.disk(), &self.layout().tile_folder(tile))?;
        for &file in self.layout().files() {
            let (from, to) = (other.layout().current(tile, file), self.layout().next(tile, file));
            self.disk().rename(&from, &to).map_err(|error| Error::io(&from, "rename", error))?;
        }
        self.versions.note_next(tile, version);
        Ok(())
    }

    /// Checks that a tile's file exists and has the length in the log.
    ///
    /// # Errors
    ///
    /// A file that is missing or of another length, or an I/O error.
    pub(in crate::store) fn check_length(&self, tile: TileIndex, file: TileFile) -> Result<()> {
        let path = self.layout().current(tile, file);
        let damaged = |reason: String| Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        let wanted = self.version_to_copy(tile)?.of(file).bytes;
        match self.disk().kind_at(&path)? {
            Some(EntryKind::File(bytes)) if bytes == wanted => Ok(()),
            Some(EntryKind::File(bytes)) => {
                damaged(format!("{bytes} bytes, but commits.log records {wanted}"))
            }
            Some(_) => damaged("not a regular file; links inside a map are not followed".into()),
            None => damaged("the file is missing, but the map contains this tile".into()),
        }
    }

    /// Copies a tile's file with `writer`, as a next version in another map.
    ///
    /// # Errors
    ///
    /// A file that differs from the log, or an I/O error.
    pub fn copy_file(&self, writer: &TileWriter, tile: TileIndex, file: TileFile) -> Result<FileChecksum> {
        let wanted = self.version_to_copy(tile)?.of(file);
        let path = self.layout().current(tile, file);
        let damaged = |reason| Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        let input = match self.disk().open(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return damaged("the file is missing, but the map contains this tile");
            }
            input => input.map_err(|error| Error::io(&path, "open", error))?,
        };
        let mut input = Checksumming::new(input);
        let written = match writer.write_next(tile, file, |out| io::copy(&mut input, out).map(drop)) {
            Err(Error::Io { cause, .. }) if input.has_failed() => Err(Error::io(&path, "read", cause)),
            written => written,
        }?;
        if written == wanted { Ok(written) } else { damaged("the file does not match commits.log") }
    }

    /// Replaces the current table by a kept one, which must be the table that the log names.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn put_kept_in_place(&mut self, tile: TileIndex, table: &Path) -> Result<()> {
        self.link_next(tile, table)?;
        let layout = self.layout();
        let (next, current) = (layout.next(tile, TileFile::Table), layout.current(tile, TileFile::Table));
        self.disk().sync_file(&next).map_err(|error| Error::io(&next, "sync", error))?;
        self.files.rename(&next, &current)?;
        self.files.sync_folder(&layout.tile_folder(tile))
    }

    /// Makes the file `table`, another valid table of the tile, its next version: as a hard link if possible, else as a
    /// copy.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn link_next(&mut self, tile: TileIndex, table: &Path) -> Result<()> {
        self.finish_earlier_work()?;
        if self.disk().link(table, &self.layout().next(tile, TileFile::Table)).is_ok() {
            return Ok(());
        }
        let mut input = self.disk().open(table).map_err(|error| Error::io(table, "open", error))?;
        self.write_next(tile, TileFile::Table, |out| io::copy(&mut input, out).map(drop)).map(drop)
    }

    pub(in crate::store) fn version_to_copy(&self, tile: TileIndex) -> Result<TileVersion> {
        self.tiles().version(tile).ok_or_else(|| {
            let reason = format!("{} has no checksums of {tile}", self.folder().display());
            Error::argument("tile", reason)
        })
    }
}
