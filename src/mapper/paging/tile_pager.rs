use super::tile_cache::{Cached, TileCache};
use super::tile_disk::TileDisk;
use super::write_buffer::WriteBuffer;
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::mapper::statistics::{MapStatistics, MemoryCounts};
use crate::scan::{PackedUpdates, ScanUpdates, TileUpdates};
use crate::sensor::Evidence;
use crate::space::{TileBox, TileIndex, VoxelIndex};
use crate::store::{InputRecord, SnapshotName, TileStore};
use crate::tile::{Table, Tile};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// The tiles of an out-of-core map: which are in memory, and what is buffered for the others.
///
/// This file accepts scans and answers for tiles. `eviction` makes room, `prefetch` fetches tiles ahead, `flush` makes
/// the map durable.
#[derive(Debug)]
pub(in crate::mapper) struct TilePager {
    pub(super) config: MapConfig,
    pub(super) cache: TileCache,
    pub(super) buffer: WriteBuffer,
    pub(super) disk: TileDisk,
    /// Number of scans in the map. Every tile file that is written records it.
    pub(super) scan_number: u64,
    /// The tiles that the last scan touched.
    pub(super) last_scan: Option<TileBox>,
    /// Around all tiles of the map, and perhaps some that it had.
    bounds: Option<TileBox>,
    /// What the map was built from and, last, is being built from; kept with it at the next flush.
    pub(super) inputs: Vec<InputRecord>,
}

/// Expected growth of a tile or of the write buffer per update, in bytes.
const BYTES_OF_UPDATE: usize = 4;

/// A tile whose spill file is longer than this is brought in: applying so much is cheaper than keeping it.
const MOST_SPILLED_BYTES: u64 = 1 << 20;

/// Below so many bytes of updates a tile is never read only to apply them.
const LEAST_BYTES_TO_LOAD_FOR: u64 = 1 << 14;

/// New tiles are made so many bytes at a time, about: then what they really take is known.
const BYTES_OF_NEW_TILES: usize = 4 << 20;

/// Bytes of memory that a new tile takes once it has these updates, about.
fn bytes_of_new_tile(updates: &TileUpdates) -> usize {
    const TILE: usize = 2 << 10;
    const BRICK: usize = 384;
    TILE + match updates {
        TileUpdates::Masks(bricks) => BRICK * bricks.len(),
        TileUpdates::Runs(bricks) => BRICK * bricks.len(),
        // A brick of few voxels takes some 25 bytes packed, and of many as many as they.
        TileUpdates::Packed(packed) => BRICK / 25 * packed.bytes(),
        TileUpdates::Ordered(updates) => 8 * updates.len(),
    }
}

impl TilePager {
    pub(in crate::mapper) fn new(config: MapConfig, store: TileStore) -> Self {
        let bounds = TileBox::of(store.tiles().chain(store.orphans()));
        let inputs = store.metadata().ext.as_ref().map_or(Vec::new(), |ext| ext.inputs.clone());
        Self {
            cache: TileCache::new(&config),
            buffer: WriteBuffer::default(),
            scan_number: store.commits().scan_number,
            disk: TileDisk::new(&config, store),
            last_scan: None,
            bounds,
            inputs,
            config,
        }
    }

    /// The store, for reading.
    pub(in crate::mapper) fn store(&self) -> &TileStore {
        self.disk.store()
    }

    // Scans.

    /// Number of scans in the map.
    pub(in crate::mapper) fn scan_number(&self) -> u64 {
        self.scan_number
    }

    /// Does all that may fail before the updates can be accepted. The map's content stays as it is.
    ///
    /// `scan_bytes` are the bytes of memory that inserting scans takes, with these updates.
    pub(in crate::mapper) fn prepare(&mut self, updates: &ScanUpdates, scan_bytes: usize) -> Result<()> {
        self.cache.reserve_for_scan(scan_bytes);
        self.check_index(updates)?;
        self.take_finished_io()?;
        self.drain_buffer()?;
        for (tile, _) in &updates.tiles {
            let is_wanted = self.disk.is_unread(*tile) || (self.exists(*tile) && self.has_room_to_spare());
            // The spill file of a staged tile holds buffered updates, then those of this scan. Applying only the former
            // would reorder them.
            if is_wanted && !self.cache.is_resident(*tile) && !self.buffer.is_staged(*tile) {
                self.load(*tile)?;
            }
        }
        let all: usize = updates.tiles.iter().map(|(_, updates)| updates.len()).sum();
        // A tile that is made new by the updates is one tile more than there are.
        self.make_room_for(BYTES_OF_UPDATE * all, self.cache.plan().tiles)
    }

    /// Accepts the updates, staged parts first: resident tiles take theirs at once, those of other tiles are buffered.
    /// Cannot fail.
    pub(in crate::mapper) fn accept(&mut self, updates: ScanUpdates) {
        let touched = updates.tiles.iter().map(|(index, _)| *index).chain(self.buffer.staged_tiles());
        self.bounds = TileBox::of(touched).into_iter().chain(self.bounds).reduce(TileBox::union);
        self.buffer.accept_staged();
        let mut resident = FxHashMap::default();
        let mut others = Vec::new();
        for (index, tile_updates) in updates.tiles {
            // The tile becomes the one used last.
            match self.cache.get(index) {
                Some(_) => drop(resident.insert(index, tile_updates)),
                None => others.push((index, tile_updates)),
            }
        }
        let model = &self.config.sensor_model;
        self.cache.change_all(resident, |tile, updates| tile.apply(model, &updates));
        let (mut new, mut new_bytes) = (Vec::new(), 0);
        for (index, tile_updates) in others {
            let with_it = new_bytes + bytes_of_new_tile(&tile_updates);
            if self.exists(index) || !self.has_room_for(new.len() + 1, with_it) {
                self.buffer.push(index, &tile_updates);
                continue;
            }
            new.push((index, tile_updates));
            new_bytes = with_it;
            if new_bytes > BYTES_OF_NEW_TILES {
                self.make_tiles(std::mem::take(&mut new));
                new_bytes = 0;
            }
        }
        self.make_tiles(new);
        self.scan_number += 1;
    }

    /// Makes tiles of what was observed first in them.
    fn make_tiles(&mut self, new: Vec<(TileIndex, TileUpdates)>) {
        let model = &self.config.sensor_model;
        self.cache.put_new(new, |tile, updates| tile.apply(model, &updates));
    }

    /// Stages a part of a scan in files, until the scan is accepted or given up.
    pub(in crate::mapper) fn stage(&mut self, part: Vec<(TileIndex, PackedUpdates)>) -> Result<()> {
        self.upgrade()?;
        for (index, updates) in part {
            if self.disk.is_unread(index) {
                self.load(index)?;
            }
            // Updates are buffered only for tiles that are not resident.
            if self.cache.is_resident(index) {
                self.evict(index)?;
            }
            self.buffer.stage(index, &updates, &mut self.disk)?;
        }
        self.make_room_for(0, self.cache.plan().tiles)
    }

    /// Takes back what a scan that was not accepted has staged.
    pub(in crate::mapper) fn discard_staged(&mut self) {
        self.buffer.discard_staged(&self.disk);
    }

    /// Shrinks the write buffer to its share of memory: updates are applied, or spilled where that is cheaper.
    fn drain_buffer(&mut self) -> Result<()> {
        let most_bytes = self.cache.plan().buffer_bytes;
        let excess = self.buffer.bytes().saturating_sub(most_bytes);
        let heaviest = if excess > 0 { self.buffer.heaviest(excess) } else { Vec::new() };
        for tile in heaviest {
            if self.buffer.is_staged(tile) {
                continue;
            }
            if self.is_spilling_cheaper(tile) {
                log::debug!("tile {tile}: buffered updates spilled");
                self.upgrade()?;
                self.buffer.spill(tile, &mut self.disk)?;
            } else {
                self.load_buffered(tile)?;
            }
        }
        // Even a short spill file has an entry in memory, so their number is limited.
        let most_files = most_bytes / 2 / WriteBuffer::BYTES_OF_FILE;
        let too_many = self.buffer.spill_files().saturating_sub(most_files);
        for tile in self.buffer.longest_files(MOST_SPILLED_BYTES, too_many) {
            self.load_buffered(tile)?;
        }
        Ok(())
    }

    fn load_buffered(&mut self, tile: TileIndex) -> Result<()> {
        // It may have come in with another.
        if self.buffer.contains(tile) && !self.buffer.is_staged(tile) {
            self.load(tile)?;
        }
        Ok(())
    }

    /// Whether spilling a tile's updates costs less than applying them. Applying reads and writes the tile, so it pays
    /// only once the updates are as large as the tile. Disk traffic then stays proportional to the updates, as in a
    /// log-structured merge tree (O'Neil et al., 1996).
    pub(super) fn is_spilling_cheaper(&self, tile: TileIndex) -> bool {
        let is_near = self.cache.contains(tile) || self.disk.is_prefetching(tile);
        if !self.cache.has_compact_tier() || is_near {
            return false;
        }
        let tile_bytes = self.store().version(tile).map_or(0, |version| version.table.bytes);
        self.buffer.bytes_of(tile) < tile_bytes.max(LEAST_BYTES_TO_LOAD_FOR)
    }

    // Tiles.

    /// Whether anything was observed in a tile.
    pub(in crate::mapper) fn exists(&self, index: TileIndex) -> bool {
        self.store().contains(index) || self.buffer.contains(index) || self.cache.contains(index)
    }

    /// A box around all tiles in which something was observed.
    pub(in crate::mapper) fn bounds(&self) -> Option<TileBox> {
        self.bounds
    }

    /// A tile, brought into memory; `None` if nothing was observed in it.
    pub(in crate::mapper) fn tile(&mut self, index: TileIndex) -> Result<Option<Arc<Tile>>> {
        if let Some(tile) = self.cache.get(index) {
            return Ok(Some(tile.clone()));
        }
        if !self.exists(index) {
            return Ok(None);
        }
        let tile = Arc::new(self.read(index)?);
        // If the disk refuses an eviction, the query is answered from a copy.
        if self.make_room(&tile).is_ok() {
            self.put(tile.clone());
        }
        Ok(Some(tile))
    }

    /// The evidence of a voxel, whose tile is brought into memory.
    pub(in crate::mapper) fn evidence(&mut self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        let index = self.config.grid.tile_of_voxel(voxel);
        if let Some(tile) = self.cache.get(index) {
            return Ok(tile.evidence_of_own(voxel));
        }
        Ok(self.tile(index)?.and_then(|tile| tile.evidence_of_own(voxel)))
    }

    /// A tile as it is now, without bringing it into memory.
    pub(in crate::mapper) fn tile_uncached(&mut self, index: TileIndex) -> Result<Option<Arc<Tile>>> {
        if let Some(tile) = self.cache.peek(index) {
            return Ok(Some(tile.clone()));
        }
        if !self.exists(index) {
            return Ok(None);
        }
        let (table, _) = self.fetch(index)?;
        let mut tile = Tile::uncached(&self.config.grid, index, table);
        self.buffer.apply_to(&mut tile, &self.config.sensor_model, &mut self.disk)?;
        Ok(Some(Arc::new(tile)))
    }

    /// Brings a tile into memory, with its buffered updates.
    pub(super) fn load(&mut self, index: TileIndex) -> Result<()> {
        // Read first: a tile that cannot be read evicts nothing.
        let tile = Arc::new(self.read(index)?);
        log::debug!("tile {index}: loaded");
        if !self.cache.is_resident(index) {
            self.make_room(&tile)?;
            self.put(tile);
        }
        Ok(())
    }

    /// Puts a tile into memory. Its buffered updates are applied already, so they are dropped. The caller has made
    /// room.
    pub(super) fn put(&mut self, tile: Arc<Tile>) {
        self.buffer.forget(tile.index(), &self.disk);
        self.cache.put(tile);
    }

    /// A tile that is not resident, with its buffered updates applied.
    pub(super) fn read(&mut self, index: TileIndex) -> Result<Tile> {
        self.end_prefetch_of(index)?;
        if let Some(tile) = self.cache.peek(index) {
            return Ok(Tile::clone(tile)); // It has just arrived.
        }
        let (table, is_dirty) = self.fetch(index)?;
        let mut tile = self.make_tile(index, table)?;
        if is_dirty {
            tile.mark_dirty();
        }
        Ok(tile)
    }

    /// A tile made of its table, with its buffered updates applied.
    pub(super) fn make_tile(&mut self, index: TileIndex, table: Table) -> Result<Tile> {
        let mut tile = self.cache.make_tile(index, table);
        self.buffer.apply_to(&mut tile, &self.config.sensor_model, &mut self.disk)?;
        Ok(tile)
    }

    /// The table of a tile that is not resident, without its buffered updates, and whether it differs from the one on
    /// disk; an empty one if there is none yet.
    fn fetch(&mut self, index: TileIndex) -> Result<(Table, bool)> {
        if let Some(Cached::Compact(tile)) = self.cache.find(index) {
            return Ok((tile.decode(&self.config.grid, index)?, self.cache.is_dirty(index)));
        }
        Ok((self.disk.read(index)?.unwrap_or_default(), false))
    }

    /// Number of voxels of a tile in memory, or of its latest version on disk; buffered updates are left out.
    pub(in crate::mapper) fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        match self.cache.find(index) {
            Some(Cached::Resident(tile)) => Some(tile.table().len() as u64),
            Some(Cached::Compact(tile)) => Some(tile.voxels()),
            None => self.store().version(index).map(|version| version.voxels),
        }
    }

    /// Every tile in which something was observed, in order.
    pub(in crate::mapper) fn tile_indices(&self) -> Vec<TileIndex> {
        let in_memory = self.cache.indices().chain(self.buffer.tiles());
        let mut indices: Vec<_> = self.store().tiles().chain(in_memory).collect();
        indices.sort_unstable();
        indices.dedup();
        indices
    }

    /// Number of tiles in which something was observed.
    pub(super) fn count_tiles(&self) -> usize {
        let is_new = |index: &TileIndex| !self.store().contains(*index);
        let cached = self.cache.indices().filter(is_new).count();
        let buffered =
            self.buffer.tiles().filter(|index| is_new(index) && !self.cache.contains(*index)).count();
        self.store().count_tiles() + cached + buffered
    }

    /// The resident tiles, in order.
    pub(in crate::mapper) fn cached_tile_indices(&self) -> Vec<TileIndex> {
        self.cache.resident_indices()
    }

    /// Whether a tile has updates that are not on disk.
    pub(in crate::mapper) fn is_dirty(&self, index: TileIndex) -> bool {
        self.buffer.contains(index) || self.cache.is_dirty(index)
    }

    /// Drops a tile from memory and reads it from disk again; tells whether it is there.
    ///
    /// # Errors
    ///
    /// [`Error::UnsavedChanges`] if updates would be lost and `discard_changes` is false; a tile that cannot be read.
    pub(in crate::mapper) fn reload(&mut self, index: TileIndex, discard_changes: bool) -> Result<bool> {
        if self.is_dirty(index) && !discard_changes {
            return Err(Error::UnsavedChanges { tile: index });
        }
        self.end_io()?;
        // All that may fail comes before anything is let go.
        let table = self.disk.read(index)?;
        let tile = table.map(|table| self.cache.make_tile(index, table));
        if let Some(tile) = &tile
            && !self.cache.is_resident(index)
        {
            self.make_room(tile)?;
        }
        self.cache.discard(index);
        self.buffer.forget(index, &self.disk);
        let is_there = tile.is_some();
        if let Some(tile) = tile {
            self.cache.put(Arc::new(tile));
        }
        Ok(is_there)
    }

    /// The tiles written since the last call, in order.
    pub(in crate::mapper) fn take_written(&mut self) -> Vec<TileIndex> {
        self.disk.take_written()
    }

    pub(in crate::mapper) fn sync_octrees(&mut self) {
        self.cache.sync_octrees();
    }

    /// Keeps the last flush under a name.
    ///
    /// # Errors
    ///
    /// A name that is taken, and a disk that refuses.
    pub(in crate::mapper) fn create_snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.disk.create_snapshot(name)
    }

    /// What the map was built from, the latest last.
    pub(in crate::mapper) fn inputs(&self) -> &[InputRecord] {
        &self.inputs
    }

    /// The input that the map is being built from.
    pub(in crate::mapper) fn last_input_mut(&mut self) -> Option<&mut InputRecord> {
        self.inputs.last_mut()
    }

    /// Bytes of memory of all that grows, by what they hold.
    pub(super) fn memory(&self) -> MemoryCounts {
        MemoryCounts {
            pending: self.buffer.bytes() as u64,
            on_the_way: self.disk.in_flight_bytes() as u64,
            index: (self.disk.index_bytes() + self.disk.commit_bytes()) as u64,
            ..self.cache.memory()
        }
    }

    pub(in crate::mapper) fn statistics(&self) -> MapStatistics {
        let mut statistics = MapStatistics {
            scan_number: self.scan_number,
            tiles: self.count_tiles() as u64,
            memory: self.memory(),
            ..MapStatistics::default()
        };
        self.disk.count_into(&mut statistics);
        self.buffer.count_into(&mut statistics);
        self.cache.count_into(&mut statistics);
        statistics
    }
}
