use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::persistence::TileSaver;
use crate::persistence::upgrade;
use crate::persistence::{config_from, load, new_metadata};
use crate::space::TileIndex;
use crate::store::{CatalogEntry, Disk, Extension, MAX_NUMBER, ScanArchive, TileStore, TileVersion};
use crate::tile::Table;
use std::path::Path;
use std::sync::Arc;

/// Editor that changes a map in place, tile by tile, with one commit for all changes. Until the commit the map is
/// unchanged.
#[derive(Debug)]
pub(super) struct MapEditor {
    /// Holds the map's lock.
    store: TileStore,
    config: MapConfig,
    saver: TileSaver,
    /// Number of scans that the next commit adds to the map.
    added_scans: u64,
    is_written_to: bool,
}

/// Opens a map for writing and calls `change`. After an error the uncommitted files are removed. After a crash they are
/// removed when the map is next opened for writing.
pub(super) fn edit<T>(
    disk: Arc<dyn Disk>,
    folder: &Path,
    change: impl FnOnce(&mut MapEditor) -> Result<T>,
) -> Result<T> {
    let store = TileStore::open(disk.clone(), folder)?;
    let config = config_from(store.metadata(), &store.layout().metadata())?;
    let saver = TileSaver::new(&config);
    let mut editor = MapEditor { store, config, saver, added_scans: 0, is_written_to: false };
    let outcome = change(&mut editor);
    let leaves_something = editor.is_written_to && outcome.is_err();
    drop(editor);
    if leaves_something && let Err(error) = TileStore::open(disk, folder) {
        log::warn!("{}: the cleanup after an error failed: {error:#}", folder.display());
    }
    outcome
}

impl MapEditor {
    pub(super) fn config(&self) -> &MapConfig {
        &self.config
    }

    /// Number of the last scan in the map, including those that the next commit adds.
    pub(super) fn scan_number(&self) -> u64 {
        self.store.commits().scan_number + self.added_scans
    }

    pub(super) fn flush_number(&self) -> u64 {
        self.store.commits().flush_number
    }

    /// Increases the scan number of the tiles written from now on, and of the next commit.
    pub(super) fn add_scans(&mut self, scans: u64) -> Result<()> {
        let before = self.store.commits().scan_number;
        if before.checked_add(scans).is_none_or(|all| all > MAX_NUMBER) {
            let reason = format!("{scans} scans after scan {before} exceed the maximum scan number");
            return Err(Error::argument("scans", reason));
        }
        self.added_scans = scans;
        Ok(())
    }

    /// Metadata that voxtile adds to the original format; `None` in the original format.
    pub(super) fn ext(&self) -> Option<&Extension> {
        self.store.metadata().ext.as_ref()
    }

    pub(super) fn tiles(&self) -> Vec<TileIndex> {
        let mut tiles: Vec<_> = self.store.tiles().iter().collect();
        tiles.sort_unstable();
        tiles
    }

    pub(super) fn version(&self, tile: TileIndex) -> Option<TileVersion> {
        self.store.tiles().version(tile)
    }

    /// Reads the table of a tile; empty if there is no tile.
    pub(super) fn table(&self, tile: TileIndex) -> Result<Table> {
        let read = load::load_table(&self.store, &self.config.grid, tile)?;
        Ok(read.map(|read| read.table).unwrap_or_default())
    }

    /// Replaces a tile. An empty table removes it.
    pub(super) fn replace(&mut self, tile: TileIndex, table: &Table) -> Result<()> {
        if table.is_empty() {
            return self.remove(tile);
        }
        self.begin_writing()?;
        let version = self.saver.write(&self.store.writer()?, tile, table, self.scan_number())?;
        self.store.tiles_mut().note_next(tile, version);
        Ok(())
    }

    pub(super) fn remove(&mut self, tile: TileIndex) -> Result<()> {
        self.begin_writing()?;
        self.store.remove(tile)
    }

    /// Keeps more scans of a map that keeps its scans: those that `add` copies to the archive. They are committed by
    /// [`MapEditor::commit_scans`].
    pub(super) fn keep_scans(&mut self, add: impl FnOnce(&mut ScanArchive) -> Result<()>) -> Result<()> {
        self.begin_writing()?;
        add(self.store.archive_mut())
    }

    /// Commits all changes, including those that `note` makes to the metadata. `what` is the name of the operation.
    pub(super) fn commit(&mut self, what: &str, note: impl FnOnce(&mut Extension)) -> Result<()> {
        self.begin_writing()?;
        self.store.archive_mut().note(CatalogEntry::Operation(what.to_owned()));
        self.commit_scans(note)
    }

    /// Commits scans and the tiles that they changed: the scans can still be replayed.
    pub(super) fn commit_scans(&mut self, note: impl FnOnce(&mut Extension)) -> Result<()> {
        self.begin_writing()?;
        let mut metadata = self.store.metadata().clone();
        if let Some(ext) = &mut metadata.ext {
            note(ext);
        }
        self.store.commit(metadata, self.scan_number())?;
        self.added_scans = 0;
        Ok(())
    }

    /// Upgrades a map of the original format before its first change.
    fn begin_writing(&mut self) -> Result<()> {
        self.is_written_to = true;
        let Self { saver, config, store, .. } = self;
        upgrade(store, saver, config, |map_id| new_metadata(config, map_id, &[]))
    }
}
