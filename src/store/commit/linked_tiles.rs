use super::checkpoint::{TILES_SYNCED_AT_ONCE, sync_folders};
use super::metadata::Metadata;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::tile_store::TileStore;
use crate::store::tiles::tile_version::TileVersion;
use crate::store::tiles::tile_writer::make_folder;
use std::path::PathBuf;

/// Adds tiles of other maps of the same id and storage to a new map by hard links, in one commit.
///
/// The files get the names of committed versions at once, so no file is renamed and each folder is synced once. This
/// requires a map that no other process sees yet ([`StagedMap`](crate::store::StagedMap)). The other maps must be
/// durable and have no writer; they are unchanged. Without hard links the files are copied, and their checksums are
/// compared with the log. For links only the lengths are compared.
#[derive(Debug)]
pub struct LinkedTiles<'a> {
    store: &'a mut TileStore,
    /// Copied files that are not durable yet.
    copies: Vec<PathBuf>,
}

impl TileStore {
    /// Begins to link tiles of other maps into this map, which has no tiles.
    pub fn link_tiles(&mut self) -> LinkedTiles<'_> {
        LinkedTiles { store: self, copies: Vec::new() }
    }
}

impl LinkedTiles<'_> {
    /// Returns whether the map contains the tile.
    pub fn contains(&self, tile: TileIndex) -> bool {
        self.store.tiles().contains(tile)
    }

    /// Links a tile of another map, and returns its version.
    ///
    /// # Errors
    ///
    /// A file that is missing or of another length, or an I/O error.
    pub fn link(&mut self, other: &TileStore, tile: TileIndex) -> Result<TileVersion> {
        let version = other.version_to_copy(tile)?;
        make_folder(&**self.store.disk(), &self.store.layout().tile_folder(tile))?;
        for &file in self.store.layout().files() {
            other.check_length(tile, file)?;
            let (from, to) = (other.layout().current(tile, file), self.store.layout().current(tile, file));
            if self.store.disk().link(&from, &to).is_err() {
                let writer = self.store.writer()?;
                other.copy_file(&writer, tile, file)?;
                self.store.files.rename(&self.store.layout().next(tile, file), &to)?;
                self.copies.push(to);
            }
        }
        self.store.versions.note_committed(tile, version);
        if self.copies.len() >= TILES_SYNCED_AT_ONCE {
            self.sync_copies()?;
        }
        Ok(version)
    }

    fn sync_copies(&mut self) -> Result<()> {
        let copies = std::mem::take(&mut self.copies);
        let [synced, _] = self.store.disk().sync_all(&copies, &[]);
        copies
            .iter()
            .zip(synced)
            .try_for_each(|(path, synced)| synced.map_err(|error| Error::io(path, "sync", error)))
    }

    /// Makes all tiles durable, then the log and the metadata.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn commit(mut self, metadata: Metadata) -> Result<()> {
        self.sync_copies()?;
        let store = self.store;
        let tiles: Vec<_> = store.tiles().iter().collect();
        for tiles in tiles.chunks(TILES_SYNCED_AT_ONCE) {
            sync_folders(&store.files, tiles, |_| {})?;
        }
        store.files.sync_map_folder()?;
        store.committed_nothing(store.commits().flush_number + 1);
        let numbers = [store.commits().flush_number, store.commits().scan_number];
        store.committer.set_metadata(store.committer.fill_in(
            metadata,
            &store.files,
            &store.versions,
            numbers,
        ));
        store.committer.replace_log(&store.files, store.versions.commits())?;
        store.write_metadata()
    }
}
