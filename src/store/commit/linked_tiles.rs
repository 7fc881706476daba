use super::checkpoint::{TILES_SYNCED_AT_ONCE, sync_folders};
use super::metadata::Metadata;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::tile_store::TileStore;
use crate::store::tiles::tile_version::TileVersion;
use crate::store::tiles::tile_writer::make_folder;
use std::path::PathBuf;

/// Puts tiles of other maps of the same id and storage into a new one by second names for their files, in one commit.
///
/// The files get the names of committed versions at once, so that no file is renamed and each folder is synced once:
/// it is for a map that nobody sees yet ([`StagedMap`](crate::store::StagedMap)). The other maps are durable and nobody
/// writes to them; they stay whole. Where the file system gives a file one name only, the files are copied, and every
/// byte is compared with the log; of others the length alone is.
#[derive(Debug)]
pub struct LinkedTiles<'a> {
    store: &'a mut TileStore,
    /// Copies, of which the content is not durable yet.
    copies: Vec<PathBuf>,
}

impl TileStore {
    /// Begins to link tiles of other maps into this one, which has no tile of its own.
    pub fn link_tiles(&mut self) -> LinkedTiles<'_> {
        LinkedTiles { store: self, copies: Vec::new() }
    }
}

impl LinkedTiles<'_> {
    /// Whether the tile is here.
    pub fn contains(&self, tile: TileIndex) -> bool {
        self.store.tiles().contains(tile)
    }

    /// Links a tile of another map.
    ///
    /// # Errors
    ///
    /// A file that is missing or of another length, a disk that refuses.
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

    /// Makes all of them durable, and then the log and the metadata that name them.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
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
