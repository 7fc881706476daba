use super::flusher::FlushedTile;
use super::memory_plan::MemoryPlan;
use super::pinned_tiles::{FlushSize, PinnedTiles};
use super::tile_cache::{Cached, Eviction, TileCache};
use super::tile_disk::TileDisk;
use super::tile_state::{Base, StoredTileState, TileState};
use super::views::{ViewId, Views};
use super::write_buffer::WriteBuffer;
use crate::error::{Error, Result};
use crate::mapper::statistics::{MapStatistics, MemoryCounts};
use crate::persistence::{CompactTile, Saved};
use crate::space::{TileBox, TileIndex, TileSpace};
use crate::store::{InputRecord, MAX_INPUTS, TileVersion};
use crate::tile::Tile;
use std::sync::Arc;

/// State of a map after some scan: its tiles in memory and the updates buffered for others.
#[derive(Debug)]
pub(in crate::mapper) struct TileContents {
    pub(super) cache: TileCache,
    pub(super) buffer: WriteBuffer,
    /// Number of scans in the map; recorded in each tile file written.
    pub(super) scan_number: u64,
    /// Box of the tiles that the last scan changed.
    pub(super) last_scan: Option<TileBox>,
    /// Number of tiles that the last scan changed.
    pub(super) last_touched: usize,
    /// Index of the map's tiles. It may contain tiles that were removed.
    pub(super) space: TileSpace,
    /// Inputs that the map was built from, the current one last; stored by the next flush.
    pub(super) inputs: Vec<InputRecord>,
    pub(super) views: Views,
    /// Tiles that a background flush needs, while one is running.
    pub(super) pinned: Option<PinnedTiles>,
    /// Bytes of memory reserved for tiles that only a background flush holds. It is zero before the first background
    /// flush. Later it is 1.25 times the larger of two sizes: the most that a flush has needed, and the tiles that one
    /// scan changes. Without the reserve, the first scan after the beginning of a flush would have to evict that many
    /// bytes.
    pub(super) flush_reserve: usize,
    /// Error of the last background flush, until it is reported.
    pub(super) flush_error: Option<Error>,
}

impl TileContents {
    pub(super) fn plan(&self) -> &MemoryPlan {
        self.cache.plan()
    }

    // Tiles in memory, and updates buffered for others.

    /// Returns whether a tile or updates of it are in memory.
    pub(super) fn holds(&self, index: TileIndex) -> bool {
        self.cache.contains(index) || self.buffer.contains(index)
    }

    /// Returns the tiles that are in memory or have buffered updates, in no particular order; may contain duplicates.
    pub(super) fn held_tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.cache.indices().chain(self.buffer.tiles())
    }

    /// Returns whether a tile has updates that are not on disk.
    pub(super) fn is_dirty(&self, index: TileIndex) -> bool {
        self.buffer.contains(index) || self.cache.is_dirty(index)
    }

    /// Returns whether a tile can be made resident. It cannot while its spill file contains staged updates: those of a
    /// scan that is not accepted yet.
    pub(super) fn can_be_loaded(&self, index: TileIndex) -> bool {
        !self.cache.is_resident(index) && !self.buffer.is_staged(index)
    }

    /// Returns whether a tile has buffered updates that can be applied now.
    pub(super) fn has_applicable(&self, index: TileIndex) -> bool {
        self.buffer.contains(index) && !self.buffer.is_staged(index)
    }

    /// Returns the tiles with the most buffered updates whose removal reduces the buffer to `bytes`.
    pub(super) fn heaviest_beyond(&self, bytes: usize) -> Vec<TileIndex> {
        match self.buffer.bytes().saturating_sub(bytes) {
            0 => Vec::new(),
            excess => self.buffer.heaviest(excess),
        }
    }

    /// Inserts a tile that includes all its updates.
    pub(super) fn put(&mut self, tile: Arc<Tile>, disk: &TileDisk) {
        self.buffer.forget(tile.index(), disk);
        self.leave_to_flush(std::iter::once(tile.index()));
        self.cache.put(tile);
    }

    /// Drops a tile and its updates, saved or not.
    pub(super) fn discard(&mut self, index: TileIndex, disk: &TileDisk) {
        self.keep_for_views(std::iter::once(index));
        self.cache.discard(index);
        self.buffer.forget(index, disk);
    }

    /// Prepares the change of these tiles by an accepted scan.
    pub(super) fn begin_change(&mut self, tiles: &[TileIndex]) {
        self.keep_for_views(tiles.iter().copied());
        self.leave_to_flush(tiles.iter().copied());
        self.space.extend(tiles.iter().copied());
        self.buffer.accept_staged();
    }

    /// Completes an accepted scan that has changed these tiles.
    pub(super) fn end_change(&mut self, tiles: &[TileIndex]) {
        self.scan_number += 1;
        self.cache.note_scan();
        self.note_touched(tiles);
    }

    /// Moves a resident tile into the compact form.
    ///
    /// # Errors
    ///
    /// Fails if memory is exhausted; the tile then remains resident.
    pub(super) fn pack(&mut self, index: TileIndex) -> Result<()> {
        self.cache.make_compact(index)?;
        self.leave_packed_to_flush(index);
        Ok(())
    }

    /// Drops a tile in the compact form that is on disk.
    pub(super) fn drop_packed(&mut self, index: TileIndex) {
        self.leave_to_flush(std::iter::once(index));
        self.cache.drop_compact(index);
    }

    /// Replaces the compact form of a tile by `tile`, which includes all its updates.
    ///
    /// # Errors
    ///
    /// Fails if memory is exhausted; the updates then remain buffered.
    pub(super) fn renew_packed(&mut self, tile: &Tile, disk: &TileDisk) -> Result<()> {
        if self.cache.renew_compact(tile)? {
            self.buffer.forget(tile.index(), disk);
        }
        Ok(())
    }

    /// Returns a resident tile to write it, and marks it dirty until [`Self::end_write`]: a failed write may damage its
    /// version on disk.
    pub(super) fn begin_write(&mut self, index: TileIndex) -> Option<Arc<Tile>> {
        self.cache.change(index, Tile::mark_dirty);
        self.cache.peek(index).cloned()
    }

    pub(super) fn end_write(&mut self, index: TileIndex, version: TileVersion) {
        self.views.note_on_disk(index, version);
        self.cache.change(index, Tile::mark_clean);
    }

    /// Adds an input. It replaces an input without scans; beyond the maximum number the oldest is dropped. Returns the
    /// previous list.
    pub(super) fn add_input(&mut self, input: InputRecord) -> Vec<InputRecord> {
        let before = self.inputs.clone();
        if self.inputs.last().is_some_and(|last| last.first_scan == self.scan_number) {
            self.inputs.pop();
        }
        self.inputs.push(input);
        let excess = self.inputs.len().saturating_sub(MAX_INPUTS);
        self.inputs.drain(..excess);
        before
    }

    // Memory. `of_disk` is the number of bytes that [`TileDisk`] uses.

    /// Bytes outside the cache that count towards the limit.
    fn outside_bytes(&self, of_disk: usize) -> usize {
        of_disk + self.buffer.bytes() + self.views.bytes() + self.flush_bytes()
    }

    /// Returns whether `tiles` more tiles with `bytes` bytes fit.
    pub(super) fn has_room_for(&self, tiles: usize, bytes: usize, of_disk: usize) -> bool {
        self.cache.has_room_for(tiles, bytes, self.outside_bytes(of_disk))
    }

    /// Returns the tile to evict next until at most `tiles` tiles are resident and `bytes` bytes are free; see
    /// [`TileCache::next_eviction`].
    pub(super) fn next_eviction(&self, bytes: usize, tiles: usize, of_disk: usize) -> Option<Eviction> {
        self.cache.next_eviction(bytes, tiles, self.outside_bytes(of_disk), self.pinned.as_ref())
    }

    /// Returns whether more than `tiles` tiles are resident, or fewer than `bytes` bytes are free.
    pub(super) fn is_over(&self, bytes: usize, tiles: usize, of_disk: usize) -> bool {
        self.cache.is_over(bytes, tiles, self.outside_bytes(of_disk))
    }

    /// Number of scans since the last use of the resident tile to evict next; `None` if none can be evicted.
    pub(super) fn scans_since_oldest(&self) -> Option<u64> {
        self.cache.scans_since_oldest(self.pinned.as_ref())
    }

    /// Bytes of memory by purpose, without those that [`TileDisk`] uses.
    pub(super) fn memory(&self) -> MemoryCounts {
        MemoryCounts {
            write_buffer: self.buffer.bytes() as u64,
            readers: self.views.bytes() as u64,
            ..self.cache.memory()
        }
    }

    pub(super) fn count_into(&self, statistics: &mut MapStatistics) {
        statistics.scan_number = self.scan_number;
        self.buffer.count_into(statistics);
        self.cache.count_into(statistics);
    }

    pub(in crate::mapper) fn scan_number(&self) -> u64 {
        self.scan_number
    }

    /// The tiles that contain observations.
    pub(in crate::mapper) fn space(&self) -> &TileSpace {
        &self.space
    }

    /// Returns the current state of a tile.
    fn state_of(&self, index: TileIndex) -> TileState {
        let base = match self.cache.find(index) {
            Some(Cached::Resident(tile)) => return TileState::Resident(tile.clone()),
            Some(Cached::Compact(tile)) => Base::Compact(tile.clone()),
            None => self.views.on_disk(index),
        };
        let (spilled, updates) = self.buffer.of(index);
        let is_nothing = matches!(base, Base::Nothing) && spilled.bytes == 0 && updates.is_none();
        if is_nothing {
            TileState::Nothing
        } else {
            TileState::Stored(StoredTileState { base, spilled, updates })
        }
    }

    /// Keeps the current state of tiles for open views. Must precede every change of these tiles.
    pub(super) fn keep_for_views(&mut self, tiles: impl Iterator<Item = TileIndex>) {
        if self.views.are_open() {
            for tile in tiles {
                if self.views.need(tile) {
                    let state = self.state_of(tile);
                    self.views.keep(tile, state);
                }
            }
            if self.views.past_bytes() > self.plan().view_bytes {
                self.views.expire();
            }
        }
        self.views.content_changes();
    }

    // Background flush.

    pub(super) fn is_flushing(&self) -> bool {
        self.pinned.is_some()
    }

    /// Number of tiles that a flush begun now would write.
    pub(super) fn flush_size(&self) -> FlushSize {
        FlushSize {
            resident: self.cache.used_last_first().filter(|tile| tile.is_dirty()).count(),
            compact: self.cache.dirty_compact(),
            unapplied: self.buffer.tiles().count(),
        }
    }

    pub(super) fn begin_background_flush(&mut self, pinned: PinnedTiles) {
        self.pinned = Some(pinned);
        self.flush_reserve = self.flush_reserve.max(1);
    }

    /// Tiles in the compact form that are being saved and have no buffered updates.
    pub(super) fn saving_as_they_are(&self) -> Vec<(TileIndex, CompactTile)> {
        self.cache.saving_compact().filter(|(index, _)| !self.buffer.is_frozen(*index)).collect()
    }

    /// The tiles with buffered updates, in order.
    pub(super) fn buffered_tiles(&self) -> Vec<TileIndex> {
        let mut buffered: Vec<_> = self.buffer.tiles().collect();
        buffered.sort_unstable();
        buffered
    }

    /// Hands the buffered updates of a tile to the flush. They apply to the compact form of the tile or, without one,
    /// to its version on disk.
    pub(super) fn freeze(&mut self, index: TileIndex, on_disk: Base) -> StoredTileState {
        let (spilled, updates) = self.buffer.freeze(index);
        let base = match self.cache.find(index) {
            Some(Cached::Compact(tile)) => Base::Compact(tile.clone()),
            _ => on_disk,
        };
        StoredTileState { base, spilled, updates }
    }

    /// Bytes of memory of tiles that only the flush holds.
    pub(super) fn pinned_bytes(&self) -> usize {
        self.pinned.as_ref().map_or(0, PinnedTiles::bytes)
    }

    /// Records that the cache is about to change or drop these tiles, so that the flush keeps their current versions.
    pub(super) fn leave_to_flush(&mut self, tiles: impl Iterator<Item = TileIndex>) {
        if let Some(pinned) = &mut self.pinned {
            tiles.for_each(|index| pinned.note_changed(index));
            let bytes = pinned.bytes();
            self.reserve_for_flush(bytes);
        }
    }

    /// Records that a tile was packed into the compact form without a change. The flush then shares the compact form.
    pub(super) fn leave_packed_to_flush(&mut self, index: TileIndex) {
        if let (Some(pinned), Some(packed)) = (&mut self.pinned, self.cache.compact(index)) {
            pinned.note_packed(index, packed);
            let bytes = pinned.bytes();
            self.reserve_for_flush(bytes);
        }
    }

    /// Raises the memory reserve for flushes to at least 1.25 times `bytes`.
    fn reserve_for_flush(&mut self, bytes: usize) {
        self.flush_reserve = self.flush_reserve.max(bytes + bytes / 4);
    }

    /// Raises the memory reserve, if the map uses background flushes, to the size of the tiles that a scan has changed.
    pub(super) fn note_touched(&mut self, tiles: &[TileIndex]) {
        self.last_touched = tiles.len();
        if self.flush_reserve > 0 {
            let resident = tiles.iter().filter_map(|&index| self.cache.peek(index));
            let bytes = resident.map(|tile| tile.bytes()).sum();
            self.reserve_for_flush(bytes);
        }
    }

    /// Bytes of memory beyond the reserve that a change of these tiles needs, because the flush keeps their old
    /// versions.
    pub(super) fn bytes_to_copy(&self, tiles: impl Iterator<Item = TileIndex>) -> usize {
        let Some(pinned) = &self.pinned else { return 0 };
        let with_them = pinned.bytes() + pinned.bytes_to_copy(tiles);
        with_them.saturating_sub(self.flush_bytes())
    }

    /// Bytes of memory that only a flush holds, or the reserve if that is larger.
    pub(super) fn flush_bytes(&self) -> usize {
        self.pinned_bytes().max(self.flush_reserve)
    }

    pub(super) fn note_flushed(&mut self, tile: FlushedTile, version: TileVersion, disk: &TileDisk) {
        let index = tile.index();
        self.views.note_on_disk(index, version);
        let is_same = self.pinned.as_mut().is_some_and(|pinned| pinned.note_written(index));
        match tile {
            FlushedTile::Resident(held) => {
                // Dropped first: changing a tile that has other owners would copy it.
                drop(held);
                if is_same {
                    self.cache.note_on_disk(index);
                }
            }
            FlushedTile::Compact(index, tile) => drop(self.cache.save_ended(index, &tile, true)),
            FlushedTile::Unapplied(_) => {
                if self.buffer.thaw(index, true, disk) {
                    // The version on disk is newer than the compact form.
                    self.cache.drop_compact(index);
                }
            }
        }
    }

    /// Records the end of a background save. If a running flush waits for this save and the save has failed, the flush
    /// writes the tile itself.
    pub(super) fn note_saved(&mut self, saved: Saved, disk: &mut TileDisk) {
        let index = saved.index;
        let is_on_disk = saved.result.is_ok();
        if self.pinned.as_mut().is_some_and(|pinned| pinned.note_saved(index, &saved.tile, is_on_disk)) {
            log::debug!("tile {index}: could not be saved, so that the flush writes it");
            return;
        }
        let is_current = self.cache.save_ended(index, &saved.tile, is_on_disk);
        if let Some(version) = disk.note_saved(saved, is_current) {
            self.views.note_on_disk(index, version);
        }
    }

    pub(super) fn is_shared_with_flush(&self, index: TileIndex) -> bool {
        self.pinned.as_ref().is_some_and(|pinned| pinned.is_shared(index))
    }

    pub(super) fn note_copied(&mut self, index: TileIndex) {
        if let Some(pinned) = &mut self.pinned {
            pinned.note_own(index);
        }
    }

    /// Records that the flush will not write a tile, which therefore remains dirty.
    pub(super) fn note_not_flushed(&mut self, tile: FlushedTile, disk: &TileDisk) {
        match tile {
            FlushedTile::Resident(_) => {}
            FlushedTile::Compact(index, tile) => drop(self.cache.save_ended(index, &tile, false)),
            FlushedTile::Unapplied(tile) => drop(self.buffer.thaw(tile.index, false, disk)),
        }
    }

    pub(super) fn end_background_flush(&mut self, flushed: Result<()>) {
        for (index, tile) in self.pinned.take().map(PinnedTiles::into_unsaved).unwrap_or_default() {
            self.cache.save_ended(index, &tile, false);
        }
        self.flush_error = flushed.err();
    }

    /// Takes the error of a failed background flush, so that it is reported once.
    pub(super) fn take_flush_error(&mut self) -> Option<Error> {
        self.flush_error.take()
    }

    /// Opens a view of the current map.
    pub(in crate::mapper) fn open_view(&mut self) -> ViewId {
        self.views.open()
    }

    /// Returns the state of a tile as a view sees it, and whether the tile has changed since; its files may then be
    /// removed at any time.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::Expired`] if the view was held for too long.
    pub(in crate::mapper) fn state_for(&self, view: ViewId, index: TileIndex) -> Result<(TileState, bool)> {
        if self.views.is_expired(view) {
            return Err(Error::Expired);
        }
        Ok(match self.views.past(view, index) {
            Some(past) => (past.clone(), true),
            None => (self.state_of(index), false),
        })
    }

    /// Returns whether a tile may have content.
    pub(in crate::mapper) fn may_hold(&self, index: TileIndex) -> bool {
        let is_on_disk = || !matches!(self.views.on_disk(index), Base::Nothing);
        self.holds(index) || is_on_disk()
    }

    /// The tiles that may have content, in order.
    pub(in crate::mapper) fn tiles(&self) -> Vec<TileIndex> {
        let mut tiles: Vec<_> = self.held_tiles().chain(self.views.tiles_on_disk()).collect();
        tiles.sort_unstable();
        tiles.dedup();
        tiles
    }

    pub(in crate::mapper) fn resident_tiles(&self) -> Vec<TileIndex> {
        self.cache.resident_indices()
    }
}
