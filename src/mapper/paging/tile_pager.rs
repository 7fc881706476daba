use super::flusher::Flusher;
use super::shared_contents::{ContentsGuard, SharedContents, unlocked};
use super::shared_disk::DiskGuard;
use super::tile_cache::Cached;
use super::tile_disk::TileDisk;
use super::tile_threads::TileThreads;
use super::write_buffer::WriteBuffer;
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::mapper::statistics::{MapStatistics, MemoryCounts};
use crate::scan::{MovingMarks, PackedUpdates, ScanPoints, ScanUpdates, TileUpdates};
use crate::sensor::Evidence;
use crate::space::{TileIndex, TileSpace, VoxelIndex};
use crate::store::{
    CatalogEntry, InputRecord, KeptMarks, KeptRecord, ScanRecord, SegmentPlace, SnapshotName, TileReader,
    TileStore,
};
use crate::tile::{Table, Tile};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Pager of an out-of-core map: decides which tiles are in memory and buffers updates of the others.
///
/// This file accepts scans and provides tiles. `eviction` frees memory, `prefetch` loads tiles ahead of use, `flush`
/// makes the map durable.
///
/// The pager releases the lock on the contents while it waits for the disk, so that readers in other threads can
/// continue.
#[derive(Debug)]
pub(in crate::mapper) struct TilePager<'a> {
    pub(super) config: &'a MapConfig,
    pub(super) shared: &'a SharedContents,
    pub(super) contents: ContentsGuard<'a>,
    pub(super) disk: DiskGuard<'a>,
    pub(super) flusher: &'a Flusher,
}

/// Expected growth of a tile or of the write buffer per update, in bytes.
const BYTES_OF_UPDATE: usize = 4;

/// Length of a spill file from which a tile is loaded: applying so many updates is cheaper than keeping them.
const MAX_SPILLED_BYTES: u64 = 1 << 20;

/// A tile with fewer bytes of updates is never read only to apply them.
const MIN_BYTES_TO_LOAD_FOR: u64 = 1 << 14;

/// Approximate bytes of a group of new tiles. The actual size of a group is measured before the next one is created.
const BYTES_OF_NEW_TILES: usize = 4 << 20;

/// Approximate bytes of memory of a new tile with these updates.
fn bytes_of_new_tile(updates: &TileUpdates) -> usize {
    const TILE: usize = 2 << 10;
    const BRICK: usize = 384;
    const BYTES_OF_HIT: usize = 16;
    TILE + match updates {
        TileUpdates::Masks(bricks) => BRICK * bricks.len(),
        TileUpdates::Runs(runs) => BRICK * runs.brick_count(),
        // A packed brick with few voxels takes about 25 bytes. Bricks with many voxels take more, in proportion to
        // their voxels.
        TileUpdates::Packed(packed) => BRICK / 25 * packed.bytes(),
        TileUpdates::Ordered(updates) => 8 * updates.len(),
        TileUpdates::Layers(hits) => BYTES_OF_HIT * hits.len(),
        TileUpdates::WithLayers(updates, hits) => bytes_of_new_tile(updates) + BYTES_OF_HIT * hits.len(),
    }
}

impl TilePager<'_> {
    /// Waits for the disk without the lock on the contents.
    pub(super) fn wait<T>(&mut self, wait: impl FnOnce(&mut TileDisk) -> T) -> T {
        let Self { contents, disk, .. } = self;
        unlocked(contents, || wait(disk))
    }

    pub(in crate::mapper) fn store(&self) -> &TileStore {
        self.disk.store()
    }

    // Scans.

    pub(in crate::mapper) fn scan_number(&self) -> u64 {
        self.contents.scan_number
    }

    /// Does everything that may fail before the updates are accepted, without changing the content of the map.
    ///
    /// `scan_bytes` is the memory for inserting scans, including these updates.
    pub(in crate::mapper) fn prepare(&mut self, updates: &ScanUpdates, scan_bytes: usize) -> Result<()> {
        let index_bytes = self.disk.index_bytes() + self.disk.commit_bytes();
        self.contents.cache.note_index(index_bytes);
        self.contents.cache.reserve_for_scan(scan_bytes);
        self.check_index(updates)?;
        self.take_finished_io()?;
        self.drain_buffer()?;
        for (tile, _) in &updates.tiles {
            let is_wanted = self.disk.is_unread(*tile) || (self.exists(*tile) && self.has_room_to_spare());
            if is_wanted && self.contents.can_be_loaded(*tile) {
                self.load(*tile)?;
            }
        }
        self.unpack_often_changed(updates)?;
        let all: usize = updates.tiles.iter().map(|(_, updates)| updates.len()).sum();
        let copied = self.contents.bytes_to_copy(updates.tiles.iter().map(|(tile, _)| *tile));
        // No memory is freed for new tiles: if one does not fit, `accept` buffers its updates.
        self.make_room_for(BYTES_OF_UPDATE * all + copied)?;
        self.keep_pace();
        Ok(())
    }

    /// Accepts the updates, staged parts first: applies those of resident tiles and buffers the others. Cannot fail.
    /// Returns the changed tiles, in order.
    pub(in crate::mapper) fn accept(&mut self, updates: ScanUpdates) -> Vec<TileIndex> {
        let touched =
            updates.tiles.iter().map(|(index, _)| *index).chain(self.contents.buffer.staged_tiles());
        let mut touched: Vec<_> = touched.collect();
        touched.sort_unstable();
        touched.dedup();
        self.shared.wait_for_views(&mut self.contents);
        self.contents.begin_change(&touched);
        let mut resident = FxHashMap::default();
        let mut others = Vec::new();
        for (index, tile_updates) in updates.tiles {
            // `get` marks the tile as the most recently used.
            match self.contents.cache.get(index) {
                Some(_) => drop(resident.insert(index, tile_updates)),
                None => others.push((index, tile_updates)),
            }
        }
        let model = &self.config.sensor_model;
        self.contents.cache.change_all(resident, |tile, updates| tile.apply(model, &updates));
        let (mut new, mut new_bytes) = (Vec::new(), 0);
        for (index, tile_updates) in others {
            let with_it = new_bytes + bytes_of_new_tile(&tile_updates);
            if self.exists(index) || !self.has_room_for(new.len() + 1, with_it) {
                self.contents.buffer.push(index, &tile_updates);
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
        self.contents.end_change(&touched);
        touched
    }

    pub(in crate::mapper) fn keeps_scans(&self) -> bool {
        self.store().archive().is_on()
    }

    /// Writes the points of a scan to be kept. The caller then records the scan or calls [`Self::discard_kept`].
    pub(in crate::mapper) fn keep(
        &mut self,
        scan: &dyn ScanPoints,
    ) -> Result<(SegmentPlace, Option<KeptMarks>)> {
        self.upgrade()?;
        self.wait(|disk| disk.keep(scan))
    }

    /// Writes new marks of moving points of a kept scan.
    pub(in crate::mapper) fn keep_marks(&mut self, marks: &MovingMarks) -> Result<Option<KeptMarks>> {
        self.wait(|disk| disk.keep_marks(marks))
    }

    /// Discards the points of a scan that were written but not recorded.
    pub(in crate::mapper) fn discard_kept(&mut self) {
        self.disk.discard_kept();
    }

    /// Records the last scan: origin and time stamp, or the record of the kept scan.
    pub(in crate::mapper) fn note_scan(&mut self, scan: &dyn ScanPoints, kept: Option<KeptRecord>) {
        let number = self.contents.scan_number;
        self.disk.note(match kept {
            Some(kept) => CatalogEntry::Kept(Box::new(KeptRecord { number, ..kept })),
            None => CatalogEntry::Listed(ScanRecord::new(number, scan.stamp_ns(), scan.origin())),
        });
    }

    /// Records that the last scan number belongs to a batch of points, not to a scan.
    pub(in crate::mapper) fn note_batch(&mut self) {
        let number = self.contents.scan_number;
        self.disk.note(CatalogEntry::Unlisted(number, number));
    }

    /// Numbers the next scan as if so many others preceded it, which are in other parts of the map's build.
    pub(in crate::mapper) fn skip_scans(&mut self, count: u64) {
        let before = self.contents.scan_number;
        if count > 0 {
            self.contents.scan_number = before + count;
            self.disk.note(CatalogEntry::Unlisted(before + 1, before + count));
        }
    }

    /// Sets the number of the last scan; the next scan gets the following number.
    pub(in crate::mapper) fn set_scan_number(&mut self, number: u64) {
        self.contents.scan_number = number;
    }

    /// Removes the poses from the records of the map's inputs, because they are no longer valid.
    pub(in crate::mapper) fn forget_poses_of_inputs(&mut self) {
        let contents = self.contents.inputs.iter_mut().filter_map(|input| input.content.as_mut());
        contents.for_each(|content| content.pose_chain.clear());
    }

    /// The store, for writing a catalog.
    pub(in crate::mapper) fn store_mut(&mut self) -> &mut TileStore {
        self.disk.store_mut()
    }

    /// Creates tiles from their first updates.
    fn make_tiles(&mut self, new: Vec<(TileIndex, TileUpdates)>) {
        let model = &self.config.sensor_model;
        self.contents.cache.put_new(new, |tile, updates| tile.apply(model, &updates));
    }

    /// Stages a part of a scan in files, until the scan is accepted or discarded.
    pub(in crate::mapper) fn stage(&mut self, part: Vec<(TileIndex, PackedUpdates)>) -> Result<()> {
        self.upgrade()?;
        for (index, updates) in part {
            if self.disk.is_unread(index) {
                self.load(index)?;
            }
            // Updates are buffered only for tiles that are not resident.
            if self.contents.cache.is_resident(index) {
                self.evict(index)?;
            }
            self.spill(index)?;
            let before = self.contents.buffer.staged_file(index);
            let spilled = self.wait(|disk| disk.spill(index, before, &updates))?;
            self.contents.buffer.stage(index, spilled, updates.len());
        }
        self.make_room_for(0)
    }

    /// Discards the staged parts of a scan that was not accepted.
    pub(in crate::mapper) fn discard_staged(&mut self) {
        self.contents.buffer.discard_staged(&self.disk);
    }

    /// Shrinks the write buffer to its share of the memory: updates are applied, or spilled if that is cheaper.
    fn drain_buffer(&mut self) -> Result<()> {
        let max_bytes = self.plan().buffer_bytes();
        for tile in self.contents.heaviest_beyond(max_bytes) {
            // A background flush is about to apply the frozen updates.
            if self.contents.buffer.is_staged(tile) || self.contents.buffer.is_frozen(tile) {
                continue;
            }
            if self.is_spilling_cheaper(tile) {
                log::debug!("tile {tile}: buffered updates spilled");
                self.upgrade()?;
                self.spill(tile)?;
            } else {
                self.load_buffered(tile)?;
            }
        }
        // Even a short spill file has an entry in memory, so their number is limited.
        let max_files = max_bytes / 2 / WriteBuffer::BYTES_OF_FILE;
        let too_many = self.contents.buffer.spill_files().saturating_sub(max_files);
        for tile in self.contents.buffer.longest_files(MAX_SPILLED_BYTES, too_many) {
            self.load_buffered(tile)?;
        }
        Ok(())
    }

    /// Moves a tile's buffered updates from memory to the end of its spill file.
    ///
    /// # Errors
    ///
    /// Fails if the write fails; the updates then remain in memory.
    fn spill(&mut self, index: TileIndex) -> Result<()> {
        if self.contents.buffer.is_frozen(index) {
            self.end_background_flush();
        }
        let (before, updates) = self.contents.buffer.of(index);
        if let Some(updates) = updates.filter(|updates| !updates.is_empty()) {
            let spilled = self.wait(|disk| disk.spill(index, before, &updates))?;
            self.contents.buffer.note_spilled(index, spilled);
        }
        Ok(())
    }

    fn load_buffered(&mut self, tile: TileIndex) -> Result<()> {
        // An earlier iteration may have loaded the tile.
        if self.contents.has_applicable(tile) {
            self.load(tile)?;
        }
        Ok(())
    }

    /// Returns whether spilling a tile's updates costs less than applying them. To apply them, the tile is read and
    /// written, which pays off only once the updates are as large as the tile. Disk traffic thus remains proportional
    /// to the updates, as in a log-structured merge tree (O'Neil et al., 1996).
    pub(super) fn is_spilling_cheaper(&self, tile: TileIndex) -> bool {
        let is_near = self.contents.cache.contains(tile) || self.disk.is_prefetching(tile);
        if !self.contents.cache.has_compact_tier() || is_near {
            return false;
        }
        let tile_bytes = self.store().tiles().version(tile).map_or(0, |version| version.table.bytes);
        self.contents.buffer.bytes_of(tile) < tile_bytes.max(MIN_BYTES_TO_LOAD_FOR)
    }

    // Tiles.

    /// Returns whether a tile contains observations.
    pub(in crate::mapper) fn exists(&self, index: TileIndex) -> bool {
        self.store().tiles().contains(index) || self.contents.holds(index)
    }

    /// The tiles that contain observations.
    pub(in crate::mapper) fn space(&self) -> &TileSpace {
        self.contents.space()
    }

    /// Returns a tile and loads it into memory; `None` if it contains no observations.
    pub(in crate::mapper) fn tile(&mut self, index: TileIndex) -> Result<Option<Arc<Tile>>> {
        if let Some(tile) = self.contents.cache.get(index) {
            return Ok(Some(tile.clone()));
        }
        if !self.exists(index) {
            return Ok(None);
        }
        let tile = Arc::new(self.read(index)?);
        // If an eviction fails, the query uses a copy that is not cached.
        if self.make_room(&tile).is_ok() {
            self.put(tile.clone());
        }
        Ok(Some(tile))
    }

    /// Returns the evidence of a voxel and loads its tile into memory.
    pub(in crate::mapper) fn evidence(&mut self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        let index = self.config.grid.tile_of_voxel(voxel);
        if let Some(tile) = self.contents.cache.get(index) {
            return Ok(tile.evidence_of_own(voxel));
        }
        Ok(self.tile(index)?.and_then(|tile| tile.evidence_of_own(voxel)))
    }

    /// Returns the current state of a tile without caching it.
    pub(in crate::mapper) fn tile_uncached(&mut self, index: TileIndex) -> Result<Option<Arc<Tile>>> {
        if let Some(tile) = self.contents.cache.peek(index) {
            return Ok(Some(tile.clone()));
        }
        if !self.exists(index) {
            return Ok(None);
        }
        let (table, _) = self.fetch(index)?;
        let mut tile = Tile::uncached(&self.config.grid, index, table);
        self.apply_buffered(&mut tile)?;
        Ok(Some(Arc::new(tile)))
    }

    /// Loads a tile into memory, with its buffered updates applied.
    pub(super) fn load(&mut self, index: TileIndex) -> Result<()> {
        // Read first, so that a tile that cannot be read evicts none.
        let tile = Arc::new(self.read(index)?);
        log::debug!("tile {index}: loaded");
        if !self.contents.cache.is_resident(index) {
            self.make_room(&tile)?;
            self.put(tile);
        }
        Ok(())
    }

    /// Puts a tile into memory and drops its buffered updates, which it already includes. The caller has freed the
    /// memory.
    pub(super) fn put(&mut self, tile: Arc<Tile>) {
        self.contents.put(tile, &self.disk);
    }

    /// Reads a tile that is not resident and applies its buffered updates.
    pub(super) fn read(&mut self, index: TileIndex) -> Result<Tile> {
        self.end_prefetch_of(index)?;
        if let Some(tile) = self.contents.cache.peek(index) {
            return Ok(Tile::clone(tile)); // Its prefetch has just ended.
        }
        let (table, is_dirty) = self.fetch(index)?;
        let mut tile = self.make_tile(index, table)?;
        if is_dirty {
            tile.mark_dirty();
        }
        Ok(tile)
    }

    /// Builds a tile from its table and applies its buffered updates.
    pub(super) fn make_tile(&mut self, index: TileIndex, table: Table) -> Result<Tile> {
        let mut tile = self.contents.cache.make_tile(index, table);
        self.apply_buffered(&mut tile)?;
        Ok(tile)
    }

    /// Applies buffered updates to a tile; they also remain in the buffer.
    fn apply_buffered(&mut self, tile: &mut Tile) -> Result<()> {
        let (index, model) = (tile.index(), &self.config.sensor_model);
        let (spilled, in_memory) = self.contents.buffer.of(index);
        if spilled.bytes > 0 {
            self.wait(|disk| disk.read_spill(index, spilled, |updates| tile.apply(model, &updates)))?;
        }
        in_memory.iter().flat_map(|updates| updates.iter()).for_each(|updates| tile.apply(model, &updates));
        Ok(())
    }

    /// Returns the table of a tile that is not resident, without its buffered updates, and whether it differs from the
    /// version on disk. The table is empty if the tile does not exist yet.
    fn fetch(&mut self, index: TileIndex) -> Result<(Table, bool)> {
        if let Some(Cached::Compact(tile)) = self.contents.cache.find(index) {
            return Ok((tile.decode(&self.config.grid, index)?, self.contents.cache.is_dirty(index)));
        }
        let mut read = self.wait(|disk| disk.read(index));
        if read.is_err() && self.contents.buffer.is_frozen(index) {
            // A background flush may have rewritten the tile without having recorded it yet.
            self.end_background_flush();
            read = self.wait(|disk| disk.read(index));
        }
        Ok((read?.unwrap_or_default(), false))
    }

    /// Number of voxels of a tile in memory, or of its latest version on disk, without buffered updates.
    pub(in crate::mapper) fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        match self.contents.cache.find(index) {
            Some(Cached::Resident(tile)) => Some(tile.table().len() as u64),
            Some(Cached::Compact(tile)) => Some(tile.voxels()),
            None => self.store().tiles().version(index).map(|version| version.voxels),
        }
    }

    /// All tiles that contain observations, in order.
    pub(in crate::mapper) fn tile_indices(&self) -> Vec<TileIndex> {
        let mut indices: Vec<_> = self.store().tiles().iter().chain(self.contents.held_tiles()).collect();
        indices.sort_unstable();
        indices.dedup();
        indices
    }

    /// Number of tiles that contain observations.
    pub(super) fn count_tiles(&self) -> usize {
        let is_new = |index: &TileIndex| !self.store().tiles().contains(*index);
        let cached = self.contents.cache.indices().filter(is_new).count();
        let buffered = self
            .contents
            .buffer
            .tiles()
            .filter(|index| is_new(index) && !self.contents.cache.contains(*index))
            .count();
        self.store().tiles().count() + cached + buffered
    }

    /// The resident tiles, in order.
    pub(in crate::mapper) fn cached_tile_indices(&self) -> Vec<TileIndex> {
        self.contents.cache.resident_indices()
    }

    pub(in crate::mapper) fn is_flushing(&self) -> bool {
        self.contents.is_flushing()
    }

    /// Returns whether a tile has updates that are not on disk.
    pub(in crate::mapper) fn is_dirty(&self, index: TileIndex) -> bool {
        self.contents.is_dirty(index)
    }

    /// Drops a tile from memory and reads it from disk again; returns whether it exists.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::UnsavedChanges`] if updates would be lost and `discard_changes` is false, or if the tile
    /// cannot be read.
    pub(in crate::mapper) fn reload(&mut self, index: TileIndex, discard_changes: bool) -> Result<bool> {
        if self.is_dirty(index) && !discard_changes {
            return Err(Error::UnsavedChanges { tile: index });
        }
        self.end_background_flush();
        self.end_io()?;
        // Steps that may fail precede the removal.
        let table = self.wait(|disk| disk.read(index))?;
        let tile = table.map(|table| self.contents.cache.make_tile(index, table));
        if let Some(tile) = &tile
            && !self.contents.cache.is_resident(index)
        {
            self.make_room(tile)?;
        }
        self.contents.discard(index, &self.disk);
        let is_there = tile.is_some();
        if let Some(tile) = tile {
            self.contents.cache.put(Arc::new(tile));
        }
        Ok(is_there)
    }

    /// The tiles written since the last call, in order.
    pub(in crate::mapper) fn take_written(&mut self) -> Vec<TileIndex> {
        self.disk.take_written()
    }

    /// Begins to track the tiles on disk for readers in other threads. Readers may cache `bytes` bytes of tiles.
    ///
    /// # Errors
    ///
    /// Same errors as [`TilePager::upgrade`] for a map of the original format; also fails if threads cannot be started.
    pub(in crate::mapper) fn open_to_readers(&mut self, bytes: usize) -> Result<TileReader> {
        self.upgrade()?;
        let threads = TileThreads::own(self.store().folder())?;
        self.contents.cache.use_threads(threads);
        let store = self.disk.store();
        let versions = store.tiles().iter().filter_map(|tile| Some((tile, store.tiles().version(tile)?)));
        self.contents.views.watch_disk(bytes, versions, store.tiles().orphans().into_iter());
        store.tables().reader()
    }

    pub(in crate::mapper) fn sync_octrees(&mut self) {
        self.contents.cache.sync_octrees();
    }

    /// Creates a snapshot of the last flush.
    ///
    /// # Errors
    ///
    /// Fails if the name is in use or a disk operation fails.
    pub(in crate::mapper) fn create_snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.end_background_flush();
        self.wait(|disk| disk.create_snapshot(name))
    }

    /// Inputs that the map was built from, oldest first.
    pub(in crate::mapper) fn inputs(&self) -> &[InputRecord] {
        &self.contents.inputs
    }

    /// The current input.
    pub(in crate::mapper) fn last_input_mut(&mut self) -> Option<&mut InputRecord> {
        self.contents.inputs.last_mut()
    }

    /// Bytes of memory that count towards the limit, by purpose.
    pub(super) fn memory(&self) -> MemoryCounts {
        MemoryCounts {
            in_flight: self.in_flight_bytes() as u64,
            index: (self.disk.index_bytes() + self.disk.commit_bytes()) as u64,
            ..self.contents.memory()
        }
    }

    pub(in crate::mapper) fn statistics(&self) -> MapStatistics {
        let mut statistics = MapStatistics {
            tiles: self.count_tiles() as u64,
            memory: self.memory(),
            ..MapStatistics::default()
        };
        self.disk.count_into(&mut statistics);
        self.contents.count_into(&mut statistics);
        statistics
    }
}
