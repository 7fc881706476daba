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

/// Reader of tables: of the opened snapshot, otherwise of the latest versions.
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
    /// A file that the log names and that is missing, or a tile folder that the log does not name.
    pub fn open(self, tile: TileIndex) -> Result<Option<StoredTile>> {
        self.open_at(tile, self.path(tile)?)
    }

    /// Returns the location of the table of a tile for partial reads; `None` if no log names it.
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

    /// Returns the path of a snapshot's version of a table. A writer may rename the file at any time.
    fn path_in_snapshot(self, tile: TileIndex) -> Result<PathBuf> {
        let kept = self.kept(tile)?;
        Ok(match seen_by(Some(&kept), self.store.commits().flush_number) {
            Some(flush_number) => self.store.layout().kept(tile, flush_number),
            None => self.store.layout().current(tile, TileFile::Table),
        })
    }

    /// Returns the flushes as of which replaced tables of a tile are kept.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub fn kept(self, tile: TileIndex) -> Result<BTreeSet<u64>> {
        let folder = self.store.layout().tile_folder(tile);
        match self.store.disk().list(&folder) {
            // Opening the table reports this error.
            Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
                Ok(BTreeSet::new())
            }
            Err(error) => Err(Error::io(&folder, "list", error)),
            Ok(names) => {
                Ok(names.iter().filter_map(|name| self.store.layout().flush_of_kept(name)).collect())
            }
        }
    }

    /// Returns alternative paths of the version that a reader uses while a writer is active: the committed `*.next`
    /// file, or the replaced table that was kept. Empty for a writer.
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

    /// Opens the table at one of the paths of [`Tables::other_places`].
    ///
    /// # Errors
    ///
    /// As for [`Tables::open`].
    pub fn open_at(self, tile: TileIndex, path: PathBuf) -> Result<Option<StoredTile>> {
        if self.store.versions.is_orphan(tile) {
            let reason = "commits.log has no entry for this tile";
            return Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        }
        let version = self.store.versions.version(tile);
        if version.is_none() && !self.store.versions.is_foreign(tile) {
            return Ok(None);
        }
        self.location_at(tile, path, version).open().map(Some)
    }

    /// Returns the location of the latest version of a tile's table, so that another thread can open it before the next
    /// commit.
    pub fn location(self, tile: TileIndex) -> Option<TileLocation> {
        let version = self.store.versions.version(tile)?;
        Some(self.location_at(tile, self.latest_path(tile), Some(version)))
    }

    /// Returns a reader of tables for other threads.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] for a map of the original format.
    pub fn reader(self) -> Result<TileReader> {
        match self.store.map_id() {
            Some(map_id) => Ok(TileReader::new(self.store.files.clone(), map_id)),
            None => Err(Error::argument("map", "a map of the original format; its tiles have no checksums")),
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
