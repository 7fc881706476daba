use super::tile_location::{StoredTile, TileLocation};
use super::tile_reader::TileReader;
use super::tile_version::TileVersion;
use crate::error::{Error, FormatError, Result};
use crate::space::TileIndex;
use crate::store::layout::TileFile;
use crate::store::snapshots::seen_tables::seen_by;
use crate::store::tile_store::TileStore;
use std::collections::BTreeSet;
use std::io;
use std::path::PathBuf;

/// The tables of a map's tiles, to be read: as of the snapshot that the store was opened as, or else the latest.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    store: &'a TileStore,
}

impl<'a> Tables<'a> {
    pub(in crate::store) fn of(store: &'a TileStore) -> Self {
        Self { store }
    }

    /// Opens the latest version of a tile's table; `None` if the tile has none.
    ///
    /// # Errors
    ///
    /// A file that the log names and that is missing, and a tile folder that the log does not name.
    pub fn open(self, tile: TileIndex) -> Result<Option<StoredTile>> {
        self.open_at(tile, self.path(tile)?)
    }

    /// Where a reader finds the table of a tile, to read a part of it; `None` if no log names it.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub fn location_to_read(self, tile: TileIndex) -> Result<Option<TileLocation>> {
        let Some(version) = self.store.versions.version(tile) else { return Ok(None) };
        Ok(Some(self.location_at(tile, self.path(tile)?, Some(version))))
    }

    fn path(self, tile: TileIndex) -> Result<PathBuf> {
        match &self.store.opened_snapshot {
            Some(_) => self.path_in_snapshot(tile),
            None => Ok(self.latest_path(tile)),
        }
    }

    /// Where a snapshot's version of a table is while no writer is at work.
    fn path_in_snapshot(self, tile: TileIndex) -> Result<PathBuf> {
        let kept = self.kept(tile)?;
        Ok(match seen_by(Some(&kept), self.store.commits().flush_number) {
            Some(flush_number) => self.store.layout().kept(tile, flush_number),
            None => self.store.layout().current(tile, TileFile::Table),
        })
    }

    /// The flushes as of which tables of a tile are kept beside the one in place.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub fn kept(self, tile: TileIndex) -> Result<BTreeSet<u64>> {
        let folder = self.store.layout().tile_folder(tile);
        match self.store.disk().list(&folder) {
            // It tells when the table is opened.
            Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
                Ok(BTreeSet::new())
            }
            Err(error) => Err(Error::io(&folder, "list", error)),
            Ok(names) => {
                Ok(names.iter().filter_map(|name| self.store.layout().flush_of_kept(name)).collect())
            }
        }
    }

    /// Other places where a reader beside a writer may find the version of a tile's table that it sees: committed and
    /// waiting for its name, or already replaced and kept for readers. Empty for a writer.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub fn other_places(self, tile: TileIndex) -> Result<Vec<PathBuf>> {
        if self.store.committer.is_writer() {
            return Ok(Vec::new());
        }
        let kept = self.kept(tile)?.split_off(&self.store.commits().flush_number);
        let kept = kept.into_iter().map(|flush_number| self.store.layout().kept(tile, flush_number));
        let places = kept.chain([
            self.store.layout().next(tile, TileFile::Table),
            self.store.layout().current(tile, TileFile::Table),
        ]);
        Ok(places.collect())
    }

    /// Opens one of [`Tables::other_places`].
    ///
    /// # Errors
    ///
    /// As for [`Tables::open`].
    pub fn open_at(self, tile: TileIndex, path: PathBuf) -> Result<Option<StoredTile>> {
        if self.store.versions.is_orphan(tile) {
            let reason = "commits.log does not name this tile";
            return Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        }
        let version = self.store.versions.version(tile);
        if version.is_none() && !self.store.versions.is_foreign(tile) {
            return Ok(None);
        }
        self.location_at(tile, path, version).open().map(Some)
    }

    /// Where the latest version of a tile's table is that is known to be there, for another thread to open it before
    /// the next commit.
    pub fn location(self, tile: TileIndex) -> Option<TileLocation> {
        let version = self.store.versions.version(tile)?;
        Some(self.location_at(tile, self.latest_path(tile), Some(version)))
    }

    /// What finds tables beside this store; for a map with an id.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] for a map of the original format.
    pub fn reader(self) -> Result<TileReader> {
        match self.store.map_id() {
            Some(map_id) => Ok(TileReader::new(self.store.files.clone(), map_id)),
            None => Err(Error::argument("map", "of the original format; its versions have no checksums")),
        }
    }

    fn location_at(self, tile: TileIndex, path: PathBuf, version: Option<TileVersion>) -> TileLocation {
        let map_id = version.and_then(|_| self.store.map_id());
        let folder = self.store.layout().tile_folder(tile);
        TileLocation {
            disk: self.store.disk().clone(),
            tile,
            folder,
            path,
            map_id,
            version,
            storage: self.store.layout().storage(),
        }
    }

    fn latest_path(self, tile: TileIndex) -> PathBuf {
        match self.store.versions.is_uncommitted(tile) || self.store.checkpoint.is_unrenamed(tile) {
            true => self.store.layout().next(tile, TileFile::Table),
            false => self.store.layout().current(tile, TileFile::Table),
        }
    }
}
