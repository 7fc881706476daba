use super::flight::Flight;
use super::flusher::FlushedTile;
use super::memory_plan::MemoryPlan;
use super::tile_cache::{Cached, TileCache};
use super::tile_state::{Base, StoredTileState, TileState};
use super::views::{ViewId, Views};
use super::write_buffer::WriteBuffer;
use crate::error::{Error, Result};
use crate::space::{TileBox, TileIndex};
use crate::store::{InputRecord, TileVersion};
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
    /// Around all tiles of the map, and perhaps some that it had.
    pub(super) bounds: Option<TileBox>,
    /// What the map was built from and, last, is being built from; kept with it at the next flush.
    pub(super) inputs: Vec<InputRecord>,
    pub(super) views: Views,
    /// What a flush beside the mapper holds, while there is one.
    pub(super) flight: Option<Flight>,
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

    /// A box around all tiles in which something was observed.
    pub(in crate::mapper) fn bounds(&self) -> Option<TileBox> {
        self.bounds
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

    /// Notes that the cache has another version of these tiles, or none, from now on.
    pub(super) fn leave_to_flush(&mut self, tiles: impl Iterator<Item = TileIndex>) {
        if let Some(flight) = &mut self.flight {
            tiles.for_each(|index| flight.is_left_alone_with(index));
        }
    }

    /// Bytes of memory that changing these tiles takes on top.
    pub(super) fn bytes_to_copy(&self, tiles: impl Iterator<Item = TileIndex>) -> usize {
        self.flight.as_ref().map_or(0, |flight| flight.bytes_to_copy(tiles))
    }

    /// Notes that a tile was written as of the flush's scan.
    pub(super) fn note_flushed(&mut self, tile: FlushedTile, version: TileVersion) {
        let index = tile.index();
        self.views.note_on_disk(index, version);
        if let Some(flight) = &mut self.flight {
            flight.note_written(index);
        }
        match tile {
            FlushedTile::Resident(tile) => {
                let is_same = self.cache.peek(index).is_some_and(|own| Arc::ptr_eq(own, &tile));
                // Let go first: changing a tile that somebody else holds would copy it.
                drop(tile);
                if is_same {
                    self.cache.change(index, Tile::mark_clean);
                }
            }
            FlushedTile::Compact(index, tile) => drop(self.cache.save_ended(index, &tile, true)),
        }
    }

    /// Notes that a tile will not be written: it is as dirty as before.
    pub(super) fn note_not_flushed(&mut self, tile: FlushedTile) {
        if let FlushedTile::Compact(index, tile) = tile {
            self.cache.save_ended(index, &tile, false);
        }
    }

    /// Notes that the flush has ended.
    pub(super) fn end_flight(&mut self, flushed: Result<()>) {
        self.flight = None;
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
