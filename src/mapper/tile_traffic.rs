use super::cold_tiles::ColdTile;
use super::side_worker::SideWorker;
use super::tile_files::{self, ReadTable};
use super::tile_saver::{PackedTable, TileSaver};
use crate::config::MapConfig;
use crate::error::Result;
use crate::space::{Grid, TileIndex};
use crate::store::{TileLocation, TileStamp, TileWriter};
use crate::tile::Table;
use crate::tile::format::read_compact;
use rustc_hash::FxHashMap;
use std::collections::VecDeque;

/// Tiles on their way to disk and from there, on a thread for each direction.
#[derive(Debug)]
pub(super) struct TileTraffic {
    saver: SideWorker<Save, Saved>,
    loader: SideWorker<Load, Loaded>,
    /// Bytes of memory that each tile on its way from disk is about to take.
    loading: FxHashMap<TileIndex, usize>,
    loading_bytes: usize,
    /// The tiles on their way to disk, in order. One may be there twice, an older and a newer version.
    saving: VecDeque<TileIndex>,
    saving_bytes: usize,
}

/// Most tiles on their way in a direction. More would only take memory: a disk does one after the other.
const MOST_UNDER_WAY: usize = 4;

/// What is written.
struct Save {
    writer: TileWriter,
    index: TileIndex,
    tile: ColdTile,
    scan_number: u64,
}

/// What was written, or why it was not.
pub(super) struct Saved {
    pub(super) index: TileIndex,
    pub(super) tile: ColdTile,
    pub(super) result: Result<TileStamp>,
}

struct Load {
    location: TileLocation,
}

/// What was read, or why it was not.
pub(super) struct Loaded {
    pub(super) index: TileIndex,
    pub(super) result: Result<ReadTable>,
}

impl TileTraffic {
    pub(super) fn new(config: &MapConfig) -> Self {
        let (saver, grid) = (TileSaver::new(config), config.grid);
        Self {
            saver: SideWorker::new("voxtile-save", move |save: Save| save.run(&grid, &saver)),
            loader: SideWorker::new("voxtile-load", move |load: Load| load.run(&grid)),
            loading: FxHashMap::default(),
            loading_bytes: 0,
            saving: VecDeque::new(),
            saving_bytes: 0,
        }
    }

    /// Bytes of memory of all tiles on their way, beside their compact form.
    pub(super) fn bytes(&self) -> usize {
        self.loading_bytes + self.saving_bytes
    }

    /// Whether another tile may be sent to disk.
    pub(super) fn can_save(&self) -> bool {
        self.saver.under_way() < MOST_UNDER_WAY
    }

    pub(super) fn save(&mut self, writer: TileWriter, index: TileIndex, tile: ColdTile, scan_number: u64) {
        self.saving_bytes += tile.bytes_to_save();
        self.saving.push_back(index);
        self.saver.give(Save { writer, index, tile, scan_number });
    }

    /// Whether some version of a tile is on its way to disk.
    pub(super) fn is_saving(&self, index: TileIndex) -> bool {
        self.saving.contains(&index)
    }

    /// A tile that has arrived on disk, or could not.
    pub(super) fn take_saved(&mut self) -> Option<Saved> {
        let saved = self.saver.take()?;
        self.has_left(&saved);
        Some(saved)
    }

    /// The same, waited for; `None` if there is none on its way.
    pub(super) fn wait_saved(&mut self) -> Option<Saved> {
        match self.saver.wait() {
            Some(saved) => {
                self.has_left(&saved);
                Some(saved)
            }
            None => {
                self.saving.clear();
                self.saving_bytes = 0;
                None
            }
        }
    }

    fn has_left(&mut self, saved: &Saved) {
        self.saving_bytes -= saved.tile.bytes_to_save();
        self.saving.pop_front();
    }

    /// Whether another tile may be sent for.
    pub(super) fn can_load(&self) -> bool {
        self.loader.under_way() < MOST_UNDER_WAY
    }

    pub(super) fn is_loading(&self, index: TileIndex) -> bool {
        self.loading.contains_key(&index)
    }

    /// Sends for a tile that will take about so many bytes of memory.
    pub(super) fn load(&mut self, location: TileLocation, bytes: usize) {
        self.loading.insert(location.tile(), bytes);
        self.loading_bytes += bytes;
        self.loader.give(Load { location });
    }

    /// A tile that has arrived in memory, or could not.
    pub(super) fn take_loaded(&mut self) -> Option<Loaded> {
        let loaded = self.loader.take()?;
        self.has_arrived(loaded.index);
        Some(loaded)
    }

    /// The same, waited for; `None` if there is none on its way.
    pub(super) fn wait_loaded(&mut self) -> Option<Loaded> {
        match self.loader.wait() {
            Some(loaded) => {
                self.has_arrived(loaded.index);
                Some(loaded)
            }
            None => {
                self.loading.clear();
                self.loading_bytes = 0;
                None
            }
        }
    }

    fn has_arrived(&mut self, index: TileIndex) {
        self.loading_bytes -= self.loading.remove(&index).unwrap_or_default();
    }
}

impl Save {
    fn run(self, grid: &Grid, saver: &TileSaver) -> Saved {
        let Self { writer, index, tile, scan_number } = self;
        let result = match tile.occupied {
            Some(occupied) => {
                let packed = PackedTable { compact: &tile.compact, voxels: tile.voxels, occupied };
                saver.write_packed(&writer, index, packed, scan_number)
            }
            None => unpack(grid, index, &tile)
                .and_then(|table| saver.write_seed(&writer, index, &table, scan_number)),
        };
        Saved { index, tile, result }
    }
}

impl Load {
    fn run(self, grid: &Grid) -> Loaded {
        let index = self.location.tile();
        let read = |stored| tile_files::read_stored_table(grid, index, stored);
        Loaded { index, result: self.location.open().and_then(read) }
    }
}

/// The table of a tile in the compact form.
pub(super) fn unpack(grid: &Grid, index: TileIndex, tile: &ColdTile) -> Result<Table> {
    let mut input = &*tile.compact;
    // Nothing but broken memory leads to an error.
    read_compact(&mut input, tile.compact.len() as u64, &grid.voxels_of_tile(index))
        .map_err(|error| error.in_map("memory".as_ref(), Some(index)))
}
