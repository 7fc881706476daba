//! Tiles of another map of the same id as next versions of those here.

use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::tile_store::TileStore;
use crate::store::tiles::tile_writer::make_folder;

impl TileStore {
    /// Moves all tiles of `other`, a map of the same id, storage and file system that has committed them and loses them
    /// by this, to where the next commit finds them.
    ///
    /// # Errors
    ///
    /// A folder in the way that the log does not name, a disk that refuses; `other` has lost some of its tiles then.
    pub fn take_over(&mut self, other: &Self) -> Result<()> {
        self.finish_earlier_work()?;
        let mut tiles: Vec<_> = other.tiles().collect();
        tiles.sort_unstable();
        tiles.into_iter().try_for_each(|tile| self.take_tile(other, tile))
    }

    fn take_tile(&mut self, other: &Self, tile: TileIndex) -> Result<()> {
        let Some(version) = other.version(tile) else { return Ok(()) };
        let folder = self.layout().tile_folder(tile);
        if self.versions.is_orphan(tile) {
            let hint = "it is no part of the map as it is; `voxtile repair` moves it out of the way";
            return Err(Error::AlreadyExists { path: folder, hint });
        }
        make_folder(&**self.disk(), &folder)?;
        for &file in self.layout().files() {
            let (from, to) = (other.layout().current(tile, file), self.layout().next(tile, file));
            self.disk().rename(&from, &to).map_err(|error| Error::io(&from, "rename", error))?;
        }
        self.note_next(tile, version);
        Ok(())
    }
}
