use super::flight::{Flight, FlightSize};
use super::flusher::FlushedTile;
use super::memory_plan::MemoryPlan;
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

    // Tiles in memory, and updates that are buffered for others.

    /// Whether something of a tile is in memory: the tile, or updates of it.
    pub(super) fn holds(&self, index: TileIndex) -> bool {
        self.cache.contains(index) || self.buffer.contains(index)
    }

    /// The tiles of which something is in memory, in no particular order, some of them twice.
    pub(super) fn held_tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.cache.indices().chain(self.buffer.tiles())
    }

    /// Whether a tile has updates that are not on disk.
    pub(super) fn is_dirty(&self, index: TileIndex) -> bool {
        self.buffer.contains(index) || self.cache.is_dirty(index)
    }

    /// Whether a tile can be made resident: its spill file must not hold updates of a scan that is not accepted, which
    /// come after those that are buffered.
    pub(super) fn can_come_in(&self, index: TileIndex) -> bool {
        !self.cache.is_resident(index) && !self.buffer.is_staged(index)
    }

    /// Whether updates are buffered for a tile that can be applied now.
    pub(super) fn has_applicable(&self, index: TileIndex) -> bool {
        self.buffer.contains(index) && !self.buffer.is_staged(index)
    }

    /// The tiles with most buffered updates, without which these take so many bytes.
    pub(super) fn heaviest_beyond(&self, bytes: usize) -> Vec<TileIndex> {
        match self.buffer.bytes().saturating_sub(bytes) {
            0 => Vec::new(),
            excess => self.buffer.heaviest(excess),
        }
    }

    /// Puts in a tile with all its updates.
    pub(super) fn put(&mut self, tile: Arc<Tile>, disk: &TileDisk) {
        self.buffer.forget(tile.index(), disk);
        self.leave_to_flush(std::iter::once(tile.index()));
        self.cache.put(tile);
    }

    /// Drops a tile and its updates, whatever they are.
    pub(super) fn discard(&mut self, index: TileIndex, disk: &TileDisk) {
        self.keep_for_views(std::iter::once(index));
        self.cache.discard(index);
        self.buffer.forget(index, disk);
    }

    /// Comes before an accepted scan changes these tiles.
    pub(super) fn begin_change(&mut self, tiles: &[TileIndex]) {
        self.keep_for_views(tiles.iter().copied());
        self.leave_to_flush(tiles.iter().copied());
        self.space.extend(tiles.iter().copied());
        self.buffer.accept_staged();
    }

    /// Ends an accepted scan, which has changed these tiles.
    pub(super) fn end_change(&mut self, tiles: &[TileIndex]) {
        self.scan_number += 1;
        self.cache.note_scan();
        self.note_touched(tiles);
    }

    /// Moves a resident tile into the compact form.
    ///
    /// # Errors
    ///
    /// A lack of memory; the tile stays where it was.
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

    /// Puts a tile with all its updates in the place of its compact form.
    ///
    /// # Errors
    ///
    /// A lack of memory; the updates stay buffered.
    pub(super) fn renew_packed(&mut self, tile: &Tile, disk: &TileDisk) -> Result<()> {
        if self.cache.renew_compact(tile)? {
            self.buffer.forget(tile.index(), disk);
        }
        Ok(())
    }

    /// A resident tile that is about to be written; it is dirty until that is done: a failed attempt may cut short what
    /// is on disk of it.
    pub(super) fn begin_write(&mut self, index: TileIndex) -> Option<Arc<Tile>> {
        self.cache.change(index, Tile::mark_dirty);
        self.cache.peek(index).cloned()
    }

    /// Notes that it is on disk.
    pub(super) fn end_write(&mut self, index: TileIndex, version: TileVersion) {
        self.views.note_on_disk(index, version);
        self.cache.change(index, Tile::mark_clean);
    }

    /// Adds an input. It replaces one without scans; the earliest of too many is dropped. Returns those before.
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

    // Memory. `of_disk` are the bytes that the disk takes.

    /// Bytes that count towards the limit and are not the cache's.
    fn outside_bytes(&self, of_disk: usize) -> usize {
        of_disk + self.buffer.bytes() + self.views.bytes() + self.flush_bytes()
    }

    /// Whether so many more tiles fit, and so many bytes with them.
    pub(super) fn has_room_for(&self, tiles: usize, bytes: usize, of_disk: usize) -> bool {
        self.cache.has_room_for(tiles, bytes, self.outside_bytes(of_disk))
    }

    /// What has to go next for at most `tiles` resident tiles and `bytes` free bytes; see
    /// [`TileCache::next_eviction`].
    pub(super) fn next_eviction(&self, bytes: usize, tiles: usize, of_disk: usize) -> Option<Eviction> {
        self.cache.next_eviction(bytes, tiles, self.outside_bytes(of_disk), self.flight.as_ref())
    }

    /// Whether there are more than `tiles` resident tiles, or fewer than `bytes` free bytes.
    pub(super) fn is_over(&self, bytes: usize, tiles: usize, of_disk: usize) -> bool {
        self.cache.is_over(bytes, tiles, self.outside_bytes(of_disk))
    }

    /// For how many scans the resident tile that has to go next has not been used; `None` if none can go.
    pub(super) fn scans_since_oldest(&self) -> Option<u64> {
        self.cache.scans_since_oldest(self.flight.as_ref())
    }

    /// Bytes by what they hold, without those of the disk.
    pub(super) fn memory(&self) -> MemoryCounts {
        MemoryCounts {
            write_buffer: self.buffer.bytes() as u64,
            readers: self.views.bytes() as u64,
            ..self.cache.memory()
        }
    }

    /// Adds the contents' part of the statistics.
    pub(super) fn count_into(&self, statistics: &mut MapStatistics) {
        statistics.scan_number = self.scan_number;
        self.buffer.count_into(statistics);
        self.cache.count_into(statistics);
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

    /// Whether there is one.
    pub(super) fn is_flushing(&self) -> bool {
        self.flight.is_some()
    }

    /// How many tiles it would have to write.
    pub(super) fn flight_size(&self) -> FlightSize {
        FlightSize {
            resident: self.cache.used_last_first().filter(|tile| tile.is_dirty()).count(),
            compact: self.cache.dirty_compact(),
            unapplied: self.buffer.tiles().count(),
        }
    }

    /// Notes that one has begun.
    pub(super) fn begin_flight(&mut self, flight: Flight) {
        self.flight = Some(flight);
        self.flush_reserve = self.flush_reserve.max(1);
    }

    /// Tiles in the compact form that are being saved as they are, and for which no updates are buffered.
    pub(super) fn saving_as_they_are(&self) -> Vec<(TileIndex, CompactTile)> {
        self.cache.saving_compact().filter(|(index, _)| !self.buffer.is_frozen(*index)).collect()
    }

    /// The tiles for which updates are buffered, in order.
    pub(super) fn buffered_tiles(&self) -> Vec<TileIndex> {
        let mut buffered: Vec<_> = self.buffer.tiles().collect();
        buffered.sort_unstable();
        buffered
    }

    /// Leaves the buffered updates of a tile to the flush: they are applied to the compact form of the tile, or to what
    /// is on disk of it.
    pub(super) fn freeze(&mut self, index: TileIndex, on_disk: Base) -> StoredTileState {
        let (spilled, updates) = self.buffer.freeze(index);
        let base = match self.cache.find(index) {
            Some(Cached::Compact(tile)) => Base::Compact(tile.clone()),
            _ => on_disk,
        };
        StoredTileState { base, spilled, updates }
    }

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
        self.holds(index) || is_on_disk()
    }

    /// The tiles in which there may be something, in order.
    pub(in crate::mapper) fn tiles(&self) -> Vec<TileIndex> {
        let mut tiles: Vec<_> = self.held_tiles().chain(self.views.tiles_on_disk()).collect();
        tiles.sort_unstable();
        tiles.dedup();
        tiles
    }

    /// The resident tiles, in order.
    pub(in crate::mapper) fn resident_tiles(&self) -> Vec<TileIndex> {
        self.cache.resident_indices()
    }
}
