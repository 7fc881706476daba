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

/// The two I/O threads of a mapper: one saves tiles, the other prefetches tiles.
#[derive(Debug)]
pub(crate) struct IoThreads {
    saver: Worker<Save, Saved>,
    loader: Worker<Load, Loaded>,
    /// Expected memory in bytes of each tile that is being loaded.
    loading: FxHashMap<TileIndex, usize>,
    loading_bytes: usize,
    /// Tiles that are being saved, in order. An older and a newer version of a tile can be present.
    saving: VecDeque<TileIndex>,
    saving_bytes: usize,
}

/// Maximum number of tiles in flight in each direction. A disk handles one at a time, so more would only use memory.
const MAX_IN_FLIGHT: usize = 4;

struct Save {
    writer: TileWriter,
    index: TileIndex,
    tile: CompactTile,
    scan_number: u64,
}

/// Result of a save: the checksums of the files, or the error.
pub(crate) struct Saved {
    pub(crate) index: TileIndex,
    pub(crate) tile: CompactTile,
    pub(crate) result: Result<TileVersion>,
}

struct Load {
    location: TileLocation,
}

/// Result of a load: the table, or the error.
pub(crate) struct Loaded {
    pub(crate) index: TileIndex,
    pub(crate) result: Result<ReadTable>,
}

impl IoThreads {
    pub(crate) fn new(config: &MapConfig) -> Self {
        let (saver, grid) = (TileSaver::new(config), config.grid);
        Self {
            saver: Worker::new("voxtile-save", move |save: Save| save.run(&grid, &saver)).with_low_priority(),
            loader: Worker::new("voxtile-load", move |load: Load| load.run(&grid)),
            loading: FxHashMap::default(),
            loading_bytes: 0,
            saving: VecDeque::new(),
            saving_bytes: 0,
        }
    }

    /// Additional memory of all tiles in flight in bytes, without their compact form.
    pub(crate) fn bytes(&self) -> usize {
        self.loading_bytes + self.saving_bytes
    }

    pub(crate) fn can_save(&self) -> bool {
        self.saver.in_flight() < MAX_IN_FLIGHT
    }

    pub(crate) fn save(&mut self, writer: TileWriter, index: TileIndex, tile: CompactTile, scan_number: u64) {
        self.saving_bytes += tile.bytes_to_save();
        self.saving.push_back(index);
        self.saver.give(Save { writer, index, tile, scan_number });
    }

    /// Returns whether a version of the tile is being saved.
    pub(crate) fn is_saving(&self, index: TileIndex) -> bool {
        self.saving.contains(&index)
    }

    pub(crate) fn take_saved(&mut self) -> Option<Saved> {
        let saved = self.saver.take()?;
        self.save_ended(&saved);
        Some(saved)
    }

    /// Waits for a save to finish; `None` if none is in flight.
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

    pub(crate) fn can_load(&self) -> bool {
        self.loader.in_flight() < MAX_IN_FLIGHT
    }

    pub(crate) fn is_loading(&self, index: TileIndex) -> bool {
        self.loading.contains_key(&index)
    }

    /// Starts to load a tile. `bytes` is its expected memory.
    pub(crate) fn load(&mut self, location: TileLocation, bytes: usize) {
        self.loading.insert(location.tile(), bytes);
        self.loading_bytes += bytes;
        self.loader.give(Load { location });
    }

    pub(crate) fn take_loaded(&mut self) -> Option<Loaded> {
        let loaded = self.loader.take()?;
        self.load_ended(loaded.index);
        Some(loaded)
    }

    /// Waits for a load to finish; `None` if none is in flight.
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
