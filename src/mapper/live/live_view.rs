use super::live_reader::Shared;
use crate::config::MapConfig;
use crate::error::{Error, FormatError, Result};
use crate::mapper::paging::{Base, StoredTileState, TileState, ViewId};
use crate::mapper::{MapStatistics, MapView, TileRef};
use crate::persistence::load::read_stored_table;
use crate::space::{TileBox, TileIndex};
use crate::store::TileVersion;
use crate::tile::{Table, Tile};
use std::sync::Arc;

/// View of a map as of one scan, while its mapper inserts further scans.
///
/// A view waits neither for flushes nor for disk accesses of the mapper. If a tile changes while the view is open, its
/// old state is kept for the view and counts towards the mapper's memory limit. Queries of the view fail with
/// [`Error::Expired`] if the old states exceed an eighth of the limit, or if a tile that did not fit in memory was
/// rewritten. Hold a view for one decision, not for a mission.
#[derive(Debug)]
pub struct LiveView {
    shared: Arc<Shared>,
    id: ViewId,
    scan_number: u64,
    bounds: Option<TileBox>,
}

/// Maximum number of attempts to read a tile: its file may be replaced or renamed during the read.
const ATTEMPTS: usize = 8;

impl LiveView {
    pub(super) fn open(shared: Arc<Shared>) -> Self {
        let mut contents = shared.contents.lock();
        let (id, scan_number, bounds) =
            (contents.open_view(), contents.scan_number(), contents.space().bounds());
        drop(contents);
        Self { shared, id, scan_number, bounds }
    }

    fn read(&self, index: TileIndex) -> Result<Option<Arc<Tile>>> {
        let state = || self.shared.contents.lock().state_for(self.id, index);
        let mut moved = None;
        for _ in 0..ATTEMPTS {
            let (stored, is_past) = match state()? {
                (TileState::Nothing, _) => return Ok(None),
                (TileState::Resident(tile), _) => return Ok(Some(tile)),
                (TileState::Stored(stored), is_past) => (stored, is_past),
            };
            match self.shared.tile_of(index, &stored) {
                Ok(tile) => return Ok(Some(tile)),
                Err(_) if is_past => return Err(Error::Expired),
                // The file was rewritten, renamed or removed during the read, or it is damaged.
                Err(error) => moved = Some(error),
            }
        }
        Err(moved.unwrap_or(Error::Expired))
    }
}

impl Drop for LiveView {
    fn drop(&mut self) {
        self.shared.contents.close_view(self.id);
    }
}

impl Shared {
    /// Builds a tile from its stored form, or returns it from the cache.
    fn tile_of(&self, index: TileIndex, stored: &StoredTileState) -> Result<Arc<Tile>> {
        let StoredTileState { base, spilled, updates } = stored;
        let is_base_alone = spilled.bytes == 0 && updates.is_none();
        if is_base_alone && let Some(tile) = self.read_tiles.lock().get(index, base) {
            return Ok(tile);
        }
        let grid = &self.config.grid;
        let table = match base {
            Base::Nothing => Table::default(),
            Base::Compact(tile) => tile.decode(grid, index)?,
            Base::OnDisk(version) => self.read_version(index, *version)?,
            Base::Orphan => {
                let reason = "commits.log has no entry for this tile";
                return Err(FormatError::at_offset(0, reason).in_map(self.files.folder(), Some(index)));
            }
        };
        let mut tile = Tile::uncached(grid, index, table);
        stored.apply_updates(&mut tile, &self.files, &self.config.sensor_model)?;
        let tile = Arc::new(tile);
        if is_base_alone {
            self.read_tiles.lock().put(base.clone(), tile.clone());
        }
        Ok(tile)
    }

    /// Reads a version of a table: from its final file, or from its `*.next` file before the commit.
    fn read_version(&self, index: TileIndex, version: TileVersion) -> Result<Table> {
        let [next, current] = self.files.places(index, version);
        let read =
            |place: crate::store::TileLocation| read_stored_table(&self.config.grid, index, place.open()?);
        read(current).or_else(|error| read(next).map_err(|_| error)).map(|read| read.table)
    }
}

impl MapView for LiveView {
    fn config(&self) -> &MapConfig {
        &self.shared.config
    }

    fn scan_number(&self) -> u64 {
        self.scan_number
    }

    fn tile_indices(&self) -> Vec<TileIndex> {
        self.shared.contents.lock().tiles()
    }

    fn tile_bounds(&self) -> Option<TileBox> {
        self.bounds
    }

    fn empty_around(&self, index: TileIndex) -> Option<TileBox> {
        // Tiles that were added after the view was opened can only make the box smaller.
        self.shared.contents.lock().space().empty_around(index)
    }

    fn has_tile(&self, index: TileIndex) -> bool {
        self.shared.contents.lock().may_hold(index)
    }

    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        self.shared.contents.lock().resident_tiles()
    }

    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        Ok(self.read(index)?.map(TileRef::shared))
    }

    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        self.tile(index)
    }

    fn voxels_of_tile_hint(&self, _: TileIndex) -> Option<u64> {
        None
    }

    fn statistics(&self) -> MapStatistics {
        let tiles = self.tile_indices().len() as u64;
        MapStatistics { scan_number: self.scan_number, tiles, ..MapStatistics::default() }
    }
}
