use super::compact_tile::CompactTile;
use super::load::{self, ReadTable};
use super::tile_saver::TileSaver;
use super::worker::Worker;
use crate::config::MapConfig;
use crate::error::Result;
use crate::space::{Grid, TileIndex};
use crate::store::{TileLocation, TileVersion, TileWriter};
use rustc_hash::FxHashMap;
use std::collections::VecDeque;

/// The two I/O threads of a mapper: one saves tiles, one loads them ahead of use.
#[derive(Debug)]
pub(crate) struct IoThreads {
    saver: Worker<Save, Saved>,
    loader: Worker<Load, Loaded>,
    /// Bytes of memory that each tile that is being loaded is expected to take.
    loading: FxHashMap<TileIndex, usize>,
    loading_bytes: usize,
    /// The tiles that are being saved, in order. One may be there twice, an older and a newer version.
    saving: VecDeque<TileIndex>,
    saving_bytes: usize,
}

/// Most tiles in flight in each direction. More would only take memory: a disk does one after the other.
const MAX_IN_FLIGHT: usize = 4;

struct Save {
    writer: TileWriter,
    index: TileIndex,
    tile: CompactTile,
    scan_number: u64,
}

/// A save that has ended: the files' checksums, or why it failed.
pub(crate) struct Saved {
    pub(crate) index: TileIndex,
    pub(crate) tile: CompactTile,
    pub(crate) result: Result<TileVersion>,
}

struct Load {
    location: TileLocation,
}

/// A load that has ended: the table, or why it failed.
pub(crate) struct Loaded {
    pub(crate) index: TileIndex,
    pub(crate) result: Result<ReadTable>,
}

impl IoThreads {
    pub(crate) fn new(config: &MapConfig) -> Self {
        let (saver, grid) = (TileSaver::new(config), config.grid);
        Self {
            saver: Worker::new("voxtile-save", move |save: Save| save.run(&grid, &saver)).giving_way(),
            loader: Worker::new("voxtile-load", move |load: Load| load.run(&grid)),
            loading: FxHashMap::default(),
            loading_bytes: 0,
            saving: VecDeque::new(),
            saving_bytes: 0,
        }
    }

    /// Bytes of memory of all tiles in flight, beside their compact form.
    pub(crate) fn bytes(&self) -> usize {
        self.loading_bytes + self.saving_bytes
    }

    /// Whether another tile may be saved.
    pub(crate) fn can_save(&self) -> bool {
        self.saver.in_flight() < MAX_IN_FLIGHT
    }

    /// Begins to save a tile.
    pub(crate) fn save(&mut self, writer: TileWriter, index: TileIndex, tile: CompactTile, scan_number: u64) {
        self.saving_bytes += tile.bytes_to_save();
        self.saving.push_back(index);
        self.saver.give(Save { writer, index, tile, scan_number });
    }

    /// Whether some version of a tile is being saved.
    pub(crate) fn is_saving(&self, index: TileIndex) -> bool {
        self.saving.contains(&index)
    }

    /// A save that has ended, if there is one.
    pub(crate) fn take_saved(&mut self) -> Option<Saved> {
        let saved = self.saver.take()?;
        self.save_ended(&saved);
        Some(saved)
    }

    /// Waits for a save to end; `None` if none is in flight.
    pub(crate) fn wait_saved(&mut self) -> Option<Saved> {
        match self.saver.wait() {
            Some(saved) => {
                self.save_ended(&saved);
                Some(saved)
            }
            None => {
                self.saving.clear();
                self.saving_bytes = 0;
                None
            }
        }
    }

    fn save_ended(&mut self, saved: &Saved) {
        self.saving_bytes -= saved.tile.bytes_to_save();
        self.saving.pop_front();
    }

    /// Whether another tile may be loaded.
    pub(crate) fn can_load(&self) -> bool {
        self.loader.in_flight() < MAX_IN_FLIGHT
    }

    /// Whether a tile is being loaded.
    pub(crate) fn is_loading(&self, index: TileIndex) -> bool {
        self.loading.contains_key(&index)
    }

    /// Begins to load a tile that will take about so many bytes of memory.
    pub(crate) fn load(&mut self, location: TileLocation, bytes: usize) {
        self.loading.insert(location.tile(), bytes);
        self.loading_bytes += bytes;
        self.loader.give(Load { location });
    }

    /// A load that has ended, if there is one.
    pub(crate) fn take_loaded(&mut self) -> Option<Loaded> {
        let loaded = self.loader.take()?;
        self.load_ended(loaded.index);
        Some(loaded)
    }

    /// Waits for a load to end; `None` if none is in flight.
    pub(crate) fn wait_loaded(&mut self) -> Option<Loaded> {
        match self.loader.wait() {
            Some(loaded) => {
                self.load_ended(loaded.index);
                Some(loaded)
            }
            None => {
                self.loading.clear();
                self.loading_bytes = 0;
                None
            }
        }
    }

    fn load_ended(&mut self, index: TileIndex) {
        self.loading_bytes -= self.loading.remove(&index).unwrap_or_default();
    }
}

impl Save {
    fn run(self, grid: &Grid, saver: &TileSaver) -> Saved {
        let Self { writer, index, tile, scan_number } = self;
        let result = saver.write_compact(&writer, grid, index, &tile, scan_number);
        Saved { index, tile, result }
    }
}

impl Load {
    fn run(self, grid: &Grid) -> Loaded {
        let index = self.location.tile();
        let read = |stored| load::read_stored_table(grid, index, stored);
        Loaded { index, result: self.location.open().and_then(read) }
    }
}
