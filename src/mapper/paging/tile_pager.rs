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
use crate::scan::{PackedUpdates, ScanPoints, ScanUpdates, TileUpdates};
use crate::sensor::Evidence;
use crate::space::{TileIndex, TileSpace, VoxelIndex};
use crate::store::{
    CatalogEntry, InputRecord, KeptRecord, ScanRecord, SegmentPlace, SnapshotName, TileReader, TileStore,
};
use crate::tile::{Table, Tile};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// The tiles of an out-of-core map: which are in memory, and what is buffered for the others.
///
/// This file accepts scans and answers for tiles. `eviction` makes room, `prefetch` fetches tiles ahead, `flush` makes
/// the map durable.
///
/// It lets go of the contents while it waits for the disk, so that readers in other threads need not wait for it.
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

/// A tile whose spill file is longer than this is brought in: applying so much is cheaper than keeping it.
const MAX_SPILLED_BYTES: u64 = 1 << 20;

/// Below so many bytes of updates a tile is never read only to apply them.
const MIN_BYTES_TO_LOAD_FOR: u64 = 1 << 14;

/// New tiles are made so many bytes at a time, about: then what they really take is known.
const BYTES_OF_NEW_TILES: usize = 4 << 20;

/// Bytes of memory that a new tile takes once it has these updates, about.
fn bytes_of_new_tile(updates: &TileUpdates) -> usize {
    const TILE: usize = 2 << 10;
    const BRICK: usize = 384;
    TILE + match updates {
        TileUpdates::Masks(bricks) => BRICK * bricks.len(),
        TileUpdates::Runs(runs) => BRICK * runs.brick_count(),
        // A brick of few voxels takes some 25 bytes packed, and of many as many as they.
        TileUpdates::Packed(packed) => BRICK / 25 * packed.bytes(),
        TileUpdates::Ordered(updates) => 8 * updates.len(),
    }
}

impl TilePager<'_> {
    /// Waits for the disk without the lock on the contents.
    pub(super) fn wait<T>(&mut self, wait: impl FnOnce(&mut TileDisk) -> T) -> T {
        let Self { contents, disk, .. } = self;
        unlocked(contents, || wait(disk))
    }

    /// The store, for reading.
    pub(in crate::mapper) fn store(&self) -> &TileStore {
        self.disk.store()
    }

    // Scans.

    /// Number of scans in the map.
    pub(in crate::mapper) fn scan_number(&self) -> u64 {
        self.contents.scan_number
    }

    /// Does all that may fail before the updates can be accepted. The map's content stays as it is.
    ///
    /// `scan_bytes` are the bytes of memory that inserting scans takes, with these updates.
    pub(in crate::mapper) fn prepare(&mut self, updates: &ScanUpdates, scan_bytes: usize) -> Result<()> {
        let index_bytes = self.disk.index_bytes() + self.disk.commit_bytes();
        self.contents.cache.note_index(index_bytes);
        self.contents.cache.reserve_for_scan(scan_bytes);
        self.check_index(updates)?;
        self.take_finished_io()?;
        self.drain_buffer()?;
        for (tile, _) in &updates.tiles {
            let is_wanted = self.disk.is_unread(*tile) || (self.exists(*tile) && self.has_room_to_spare());
            if is_wanted && self.contents.can_come_in(*tile) {
                self.load(*tile)?;
            }
        }
        self.bring_in_packed(updates)?;
        let all: usize = updates.tiles.iter().map(|(_, updates)| updates.len()).sum();
        let copied = self.contents.bytes_to_copy(updates.tiles.iter().map(|(tile, _)| *tile));
        // A tile that is made new by the updates is one tile more than there are.
        self.make_room_for(BYTES_OF_UPDATE * all + copied)?;
        self.keep_pace();
        Ok(())
    }

    /// Accepts the updates, staged parts first: resident tiles take theirs at once, those of other tiles are buffered.
    /// Cannot fail. Returns the tiles that were touched, in order.
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
            // The tile becomes the one used last.
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

    /// Whether the map keeps its scans.
    pub(in crate::mapper) fn keeps_scans(&self) -> bool {
        self.store().archive().is_on()
    }

    /// Writes the points of a scan that is to be kept. That it is kept is to be noted, or it is given up.
    pub(in crate::mapper) fn keep(&mut self, scan: &dyn ScanPoints) -> Result<SegmentPlace> {
        self.upgrade()?;
        self.wait(|disk| disk.keep(scan))
    }

    /// Takes back a scan that was written and not noted.
    pub(in crate::mapper) fn give_up_kept(&mut self) {
        self.disk.give_up_kept();
    }

    /// Notes the last scan: where and when it was taken, or what is kept of it.
    pub(in crate::mapper) fn note_scan(&mut self, scan: &dyn ScanPoints, kept: Option<KeptRecord>) {
        let number = self.contents.scan_number;
        self.disk.note(match kept {
            Some(kept) => CatalogEntry::Kept(Box::new(KeptRecord { number, ..kept })),
            None => CatalogEntry::Listed(ScanRecord::new(number, scan.stamp_ns(), scan.origin())),
        });
    }

    /// Notes that the last number is that of a batch.
    pub(in crate::mapper) fn note_batch(&mut self) {
        let number = self.contents.scan_number;
        self.disk.note(CatalogEntry::Unlisted(number, number));
    }

    /// Goes on counting scans behind this number.
    pub(in crate::mapper) fn set_scan_number(&mut self, number: u64) {
        self.contents.scan_number = number;
    }

    /// Notes that the poses of the map's inputs are not known any more.
    pub(in crate::mapper) fn forget_poses_of_inputs(&mut self) {
        let contents = self.contents.inputs.iter_mut().filter_map(|input| input.content.as_mut());
        contents.for_each(|content| content.pose_chain.clear());
    }

    /// The store, to write a catalog.
    pub(in crate::mapper) fn store_mut(&mut self) -> &mut TileStore {
        self.disk.store_mut()
    }

    /// Makes tiles of what was observed first in them.
    fn make_tiles(&mut self, new: Vec<(TileIndex, TileUpdates)>) {
        let model = &self.config.sensor_model;
        self.contents.cache.put_new(new, |tile, updates| tile.apply(model, &updates));
    }

    /// Stages a part of a scan in files, until the scan is accepted or given up.
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

    /// Takes back what a scan that was not accepted has staged.
    pub(in crate::mapper) fn discard_staged(&mut self) {
        self.contents.buffer.discard_staged(&self.disk);
    }

    /// Shrinks the write buffer to its share of memory: updates are applied, or spilled where that is cheaper.
    fn drain_buffer(&mut self) -> Result<()> {
        let most_bytes = self.plan().buffer_bytes();
        for tile in self.contents.heaviest_beyond(most_bytes) {
            // A flush beside the mapper is about to apply what is frozen.
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
        let most_files = most_bytes / 2 / WriteBuffer::BYTES_OF_FILE;
        let too_many = self.contents.buffer.spill_files().saturating_sub(most_files);
        for tile in self.contents.buffer.longest_files(MAX_SPILLED_BYTES, too_many) {
            self.load_buffered(tile)?;
        }
        Ok(())
    }

    /// Moves a tile's buffered updates from memory to the end of its spill file.
    ///
    /// # Errors
    ///
    /// A disk that refuses; the updates stay in memory.
    fn spill(&mut self, index: TileIndex) -> Result<()> {
        if self.contents.buffer.is_frozen(index) {
            self.end_flight();
        }
        let (before, updates) = self.contents.buffer.of(index);
        if let Some(updates) = updates.filter(|updates| !updates.is_empty()) {
            let spilled = self.wait(|disk| disk.spill(index, before, &updates))?;
            self.contents.buffer.note_spilled(index, spilled);
        }
        Ok(())
    }

    fn load_buffered(&mut self, tile: TileIndex) -> Result<()> {
        // It may have come in with another.
        if self.contents.has_applicable(tile) {
            self.load(tile)?;
        }
        Ok(())
    }

    /// Whether spilling a tile's updates costs less than applying them. Applying reads and writes the tile, so it pays
    /// only once the updates are as large as the tile. Disk traffic then stays proportional to the updates, as in a
    /// log-structured merge tree (O'Neil et al., 1996).
    pub(super) fn is_spilling_cheaper(&self, tile: TileIndex) -> bool {
        let is_near = self.contents.cache.contains(tile) || self.disk.is_prefetching(tile);
        if !self.contents.cache.has_compact_tier() || is_near {
            return false;
        }
        let tile_bytes = self.store().tiles().version(tile).map_or(0, |version| version.table.bytes);
        self.contents.buffer.bytes_of(tile) < tile_bytes.max(MIN_BYTES_TO_LOAD_FOR)
    }

    // Tiles.

    /// Whether anything was observed in a tile.
    pub(in crate::mapper) fn exists(&self, index: TileIndex) -> bool {
        self.store().tiles().contains(index) || self.contents.holds(index)
    }

    /// Where something was observed.
    pub(in crate::mapper) fn space(&self) -> &TileSpace {
        self.contents.space()
    }

    /// A tile, brought into memory; `None` if nothing was observed in it.
    pub(in crate::mapper) fn tile(&mut self, index: TileIndex) -> Result<Option<Arc<Tile>>> {
        if let Some(tile) = self.contents.cache.get(index) {
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
        if let Some(tile) = self.contents.cache.get(index) {
            return Ok(tile.evidence_of_own(voxel));
        }
        Ok(self.tile(index)?.and_then(|tile| tile.evidence_of_own(voxel)))
    }

    /// A tile as it is now, without bringing it into memory.
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

    /// Brings a tile into memory, with its buffered updates.
    pub(super) fn load(&mut self, index: TileIndex) -> Result<()> {
        // Read first: a tile that cannot be read evicts nothing.
        let tile = Arc::new(self.read(index)?);
        log::debug!("tile {index}: loaded");
        if !self.contents.cache.is_resident(index) {
            self.make_room(&tile)?;
            self.put(tile);
        }
        Ok(())
    }

    /// Puts a tile into memory. Its buffered updates are applied already, so they are dropped. The caller has made
    /// room.
    pub(super) fn put(&mut self, tile: Arc<Tile>) {
        self.contents.put(tile, &self.disk);
    }

    /// A tile that is not resident, with its buffered updates applied.
    pub(super) fn read(&mut self, index: TileIndex) -> Result<Tile> {
        self.end_prefetch_of(index)?;
        if let Some(tile) = self.contents.cache.peek(index) {
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
        let mut tile = self.contents.cache.make_tile(index, table);
        self.apply_buffered(&mut tile)?;
        Ok(tile)
    }

    /// Applies a tile's buffered updates to it. They stay in the buffer.
    fn apply_buffered(&mut self, tile: &mut Tile) -> Result<()> {
        let (index, model) = (tile.index(), &self.config.sensor_model);
        let (spilled, in_memory) = self.contents.buffer.of(index);
        if spilled.bytes > 0 {
            self.wait(|disk| disk.read_spill(index, spilled, |updates| tile.apply(model, &updates)))?;
        }
        in_memory.iter().flat_map(|updates| updates.iter()).for_each(|updates| tile.apply(model, &updates));
        Ok(())
    }

    /// The table of a tile that is not resident, without its buffered updates, and whether it differs from the one on
    /// disk; an empty one if there is none yet.
    fn fetch(&mut self, index: TileIndex) -> Result<(Table, bool)> {
        if let Some(Cached::Compact(tile)) = self.contents.cache.find(index) {
            return Ok((tile.decode(&self.config.grid, index)?, self.contents.cache.is_dirty(index)));
        }
        let mut read = self.wait(|disk| disk.read(index));
        if read.is_err() && self.contents.buffer.is_frozen(index) {
            // A flush beside the mapper may have written it anew, and not said so yet.
            self.end_flight();
            read = self.wait(|disk| disk.read(index));
        }
        Ok((read?.unwrap_or_default(), false))
    }

    /// Number of voxels of a tile in memory, or of its latest version on disk; buffered updates are left out.
    pub(in crate::mapper) fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        match self.contents.cache.find(index) {
            Some(Cached::Resident(tile)) => Some(tile.table().len() as u64),
            Some(Cached::Compact(tile)) => Some(tile.voxels()),
            None => self.store().tiles().version(index).map(|version| version.voxels),
        }
    }

    /// Every tile in which something was observed, in order.
    pub(in crate::mapper) fn tile_indices(&self) -> Vec<TileIndex> {
        let mut indices: Vec<_> = self.store().tiles().iter().chain(self.contents.held_tiles()).collect();
        indices.sort_unstable();
        indices.dedup();
        indices
    }

    /// Number of tiles in which something was observed.
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

    /// Whether a flush goes on beside the mapper.
    pub(in crate::mapper) fn is_flushing(&self) -> bool {
        self.contents.is_flushing()
    }

    /// Whether a tile has updates that are not on disk.
    pub(in crate::mapper) fn is_dirty(&self, index: TileIndex) -> bool {
        self.contents.is_dirty(index)
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
        self.end_flight();
        self.end_io()?;
        // All that may fail comes before anything is let go.
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

    /// Begins to note what is on disk for readers in other threads. They may take so many bytes of memory for tiles
    /// that they make.
    ///
    /// # Errors
    ///
    /// For a map of the original format, as for [`TilePager::upgrade`]; a system that gives no threads.
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

    /// Keeps the last flush under a name.
    ///
    /// # Errors
    ///
    /// A name that is taken, and a disk that refuses.
    pub(in crate::mapper) fn create_snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.end_flight();
        self.wait(|disk| disk.create_snapshot(name))
    }

    /// What the map was built from, the latest last.
    pub(in crate::mapper) fn inputs(&self) -> &[InputRecord] {
        &self.contents.inputs
    }

    /// The input that the map is being built from.
    pub(in crate::mapper) fn last_input_mut(&mut self) -> Option<&mut InputRecord> {
        self.contents.inputs.last_mut()
    }

    /// Bytes of memory of all that grows, by what they hold.
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
