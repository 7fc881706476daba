use super::flight::Flight;
use super::flusher::FlushedTile;
use super::memory_plan::MemoryPlan;
use super::tile_cache::{Cached, TileCache};
use super::tile_disk::TileDisk;
use super::tile_state::{Base, StoredTileState, TileState};
use super::views::{ViewId, Views};
use super::write_buffer::WriteBuffer;
use crate::error::{Error, Result};
use crate::persistence::Saved;
use crate::space::{TileBox, TileIndex, TileSpace};
use crate::store::{InputRecord, TileVersion};

/// What a map holds after some scan: its tiles in memory and what is buffered for the others.
#[derive(Debug)]
pub(in crate::mapper) struct TileContents {
    pub(super) cache: TileCache,
    pub(super) buffer: WriteBuffer,
    /// Number of scans in the map. Every tile file that is written records it.
    pub(super) scan_number: u64,
    /// The tiles that the last scan touched.
    pub(super) last_scan: Option<TileBox>,
    /// How many.
    pub(super) last_touched: usize,
    /// Where the tiles of the map are, and perhaps some that it had.
    pub(super) space: TileSpace,
    /// What the map was built from and, last, is being built from; kept with it at the next flush.
    pub(super) inputs: Vec<InputRecord>,
    pub(super) views: Views,
    /// What a flush beside the mapper holds, while there is one.
    pub(super) flight: Option<Flight>,
    /// Bytes of memory that are kept free for what such flushes hold alone, once there was one: a little more than the
    /// largest so far took, and than the tiles that a scan changes. Otherwise the scan after the beginning of a flush
    /// would have to make room for all of it.
    pub(super) flush_reserve: usize,
    /// Why the last such flush failed, until somebody is told.
    pub(super) flush_error: Option<Error>,
}

impl TileContents {
    pub(super) fn plan(&self) -> &MemoryPlan {
        self.cache.plan()
    }

    /// Number of scans in the map.
    pub(in crate::mapper) fn scan_number(&self) -> u64 {
        self.scan_number
    }

    /// Where something was observed.
    pub(in crate::mapper) fn space(&self) -> &TileSpace {
        &self.space
    }

    /// A tile as it is now.
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

    /// Keeps the tiles as they are for those who look at them. Comes before every change of what they hold.
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

    // A flush beside the mapper.

    /// Bytes of memory that a flush holds alone.
    pub(super) fn flight_bytes(&self) -> usize {
        self.flight.as_ref().map_or(0, Flight::bytes)
    }

    /// Notes that the cache has another version of these tiles, or none, from now on.
    pub(super) fn leave_to_flush(&mut self, tiles: impl Iterator<Item = TileIndex>) {
        if let Some(flight) = &mut self.flight {
            tiles.for_each(|index| flight.note_changed(index));
            let bytes = flight.bytes();
            self.reserve_for_flush(bytes);
        }
    }

    /// Notes that a tile has gone into the compact form as it is.
    pub(super) fn leave_packed_to_flush(&mut self, index: TileIndex) {
        if let (Some(flight), Some(packed)) = (&mut self.flight, self.cache.compact(index)) {
            flight.note_packed(index, packed);
            let bytes = flight.bytes();
            self.reserve_for_flush(bytes);
        }
    }

    /// Keeps memory free for flushes that hold so much alone.
    fn reserve_for_flush(&mut self, bytes: usize) {
        self.flush_reserve = self.flush_reserve.max(bytes + bytes / 4);
    }

    /// Keeps memory free for flushes, if there are any, that begin after a scan has changed these tiles.
    pub(super) fn note_touched(&mut self, tiles: &[TileIndex]) {
        self.last_touched = tiles.len();
        if self.flush_reserve > 0 {
            let resident = tiles.iter().filter_map(|&index| self.cache.peek(index));
            let bytes = resident.map(|tile| tile.bytes()).sum();
            self.reserve_for_flush(bytes);
        }
    }

    /// Bytes of memory that changing these tiles takes beyond what is kept free for it.
    pub(super) fn bytes_to_copy(&self, tiles: impl Iterator<Item = TileIndex>) -> usize {
        let Some(flight) = &self.flight else { return 0 };
        let with_them = flight.bytes() + flight.bytes_to_copy(tiles);
        with_them.saturating_sub(self.flush_bytes())
    }

    /// Bytes of memory that a flush holds alone, or that are kept free for that.
    pub(super) fn flush_bytes(&self) -> usize {
        self.flight_bytes().max(self.flush_reserve)
    }

    /// Notes that a tile was written as of the flush's scan.
    pub(super) fn note_flushed(&mut self, tile: FlushedTile, version: TileVersion, disk: &TileDisk) {
        let index = tile.index();
        self.views.note_on_disk(index, version);
        let is_same = self.flight.as_mut().is_some_and(|flight| flight.note_written(index));
        match tile {
            FlushedTile::Resident(held) => {
                // Let go first: changing a tile that somebody else holds would copy it.
                drop(held);
                if is_same {
                    self.cache.note_on_disk(index);
                }
            }
            FlushedTile::Compact(index, tile) => drop(self.cache.save_ended(index, &tile, true)),
            FlushedTile::Unapplied(_) => {
                if self.buffer.thaw(index, true, disk) {
                    // What is on disk is newer.
                    self.cache.drop_compact(index);
                }
            }
        }
    }

    /// Takes note of a save beside the mapper that has ended. What could not be saved, a flush that waits for it
    /// writes.
    pub(super) fn note_saved(&mut self, saved: Saved, disk: &mut TileDisk) {
        let index = saved.index;
        let is_on_disk = saved.result.is_ok();
        if self.flight.as_mut().is_some_and(|flight| flight.note_saved(index, &saved.tile, is_on_disk)) {
            log::debug!("tile {index}: could not be saved, so that the flush writes it");
            return;
        }
        let is_current = self.cache.save_ended(index, &saved.tile, is_on_disk);
        if let Some(version) = disk.note_saved(saved, is_current) {
            self.views.note_on_disk(index, version);
        }
    }

    /// Which of these tiles the flush shares with the cache.
    pub(super) fn is_shared_with_flush(&self, index: TileIndex) -> bool {
        self.flight.as_ref().is_some_and(|flight| flight.is_shared(index))
    }

    /// Notes that the flush has copied a tile.
    pub(super) fn note_copied(&mut self, index: TileIndex) {
        if let Some(flight) = &mut self.flight {
            flight.note_own(index);
        }
    }

    /// Notes that a tile will not be written: it is as dirty as before.
    pub(super) fn note_not_flushed(&mut self, tile: FlushedTile, disk: &TileDisk) {
        match tile {
            FlushedTile::Resident(_) => {}
            FlushedTile::Compact(index, tile) => drop(self.cache.save_ended(index, &tile, false)),
            FlushedTile::Unapplied(tile) => drop(self.buffer.thaw(tile.index, false, disk)),
        }
    }

    /// Notes that the flush has ended.
    pub(super) fn end_flight(&mut self, flushed: Result<()>) {
        for (index, tile) in self.flight.take().map(Flight::into_unsaved).unwrap_or_default() {
            self.cache.save_ended(index, &tile, false);
        }
        self.flush_error = flushed.err();
    }

    /// Why a flush beside the mapper has failed, told once.
    pub(super) fn take_flush_error(&mut self) -> Option<Error> {
        self.flush_error.take()
    }

    /// Begins to look at the map as it is now.
    pub(in crate::mapper) fn open_view(&mut self) -> ViewId {
        self.views.open()
    }

    /// A tile as a view sees it, and whether it has changed since: then nobody keeps the files that it is made of.
    ///
    /// # Errors
    ///
    /// [`Error::Expired`] if the view was held for too long.
    pub(in crate::mapper) fn state_for(&self, view: ViewId, index: TileIndex) -> Result<(TileState, bool)> {
        if self.views.is_expired(view) {
            return Err(Error::Expired);
        }
        Ok(match self.views.past(view, index) {
            Some(past) => (past.clone(), true),
            None => (self.state_of(index), false),
        })
    }

    /// Whether there may be something in a tile.
    pub(in crate::mapper) fn may_hold(&self, index: TileIndex) -> bool {
        let is_on_disk = || !matches!(self.views.on_disk(index), Base::Nothing);
        self.cache.contains(index) || self.buffer.contains(index) || is_on_disk()
    }

    /// The tiles in which there may be something, in order.
    pub(in crate::mapper) fn tiles(&self) -> Vec<TileIndex> {
        let in_memory = self.cache.indices().chain(self.buffer.tiles());
        let mut tiles: Vec<_> = in_memory.chain(self.views.tiles_on_disk()).collect();
        tiles.sort_unstable();
        tiles.dedup();
        tiles
    }

    /// The resident tiles, in order.
    pub(in crate::mapper) fn resident_tiles(&self) -> Vec<TileIndex> {
        self.cache.resident_indices()
    }
}
