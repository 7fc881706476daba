//! Prefetch: loads tiles before they are needed, those with the most buffered updates and those in the direction of
//! travel.

use super::tile_cache::Cached;
use super::tile_pager::TilePager;
use crate::error::Result;
use crate::scan::{ScanUpdates, TileUpdates};
use crate::space::{TileBox, TileIndex};
use crate::tile::Table;
use std::sync::Arc;

/// Maximum number of compact tiles made resident per scan: unpacking takes milliseconds.
const MAX_PACKED_AT_ONCE: usize = 2;

impl TilePager<'_> {
    /// Prefetches tiles that will be needed, as far as memory permits. `updates` are those of the scan that is being
    /// inserted.
    pub(in crate::mapper) fn prefetch(&mut self, updates: &[(TileIndex, TileUpdates)]) {
        if !self.contents.cache.has_compact_tier() {
            return;
        }
        // When the buffer is full, the tiles with the most updates must be loaded, so they are prefetched now.
        for tile in self.contents.heaviest_beyond(self.plan().buffer_bytes() / 4 * 3) {
            if !self.is_spilling_cheaper(tile) {
                self.begin_prefetch(tile);
            }
        }
        for (tile, _) in updates {
            if self.is_often_changed(*tile) && self.may_replace_oldest() {
                self.begin_prefetch(*tile);
            }
        }
        let now = TileBox::of(updates.iter().map(|(tile, _)| *tile));
        let before = std::mem::replace(&mut self.contents.last_scan, now);
        if let (Some(before), Some(now)) = (before, now) {
            for tile in now.ahead(&before) {
                if self.disk.is_unread(tile) && self.has_room_to_spare() {
                    self.begin_prefetch(tile);
                }
            }
        }
    }

    /// Makes compact tiles resident that many recent scans have changed.
    pub(super) fn unpack_often_changed(&mut self, updates: &ScanUpdates) -> Result<()> {
        let mut brought_in = 0;
        for &(tile, _) in &updates.tiles {
            let is_wanted = self.is_often_changed(tile)
                && matches!(self.contents.cache.find(tile), Some(Cached::Compact(_)))
                && !self.contents.buffer.is_staged(tile);
            if is_wanted && brought_in < MAX_PACKED_AT_ONCE && self.may_replace_oldest() {
                self.load(tile)?;
                brought_in += 1;
            }
        }
        Ok(())
    }

    /// Returns whether updates of many scans are buffered for a tile.
    fn is_often_changed(&self, tile: TileIndex) -> bool {
        self.contents.buffer.scans_of(tile) >= self.plan().often_scans
    }

    /// Returns whether a tile that many scans change may replace the least recently used one. If all tiles are used
    /// about equally often, it would soon be evicted again, so its updates remain buffered.
    fn may_replace_oldest(&self) -> bool {
        let often_scans = u64::from(self.plan().often_scans);
        self.contents.scans_since_oldest().is_some_and(|scans| scans > 2 * often_scans)
    }

    fn begin_prefetch(&mut self, index: TileIndex) {
        if !self.contents.cache.contains(index)
            && !self.disk.is_prefetching(index)
            && self.disk.can_prefetch()
        {
            self.disk.prefetch(index);
        }
    }

    /// Records the saves and prefetches that have ended.
    pub(super) fn take_finished_io(&mut self) -> Result<()> {
        self.take_saved();
        while let Some((index, table)) = self.disk.take_prefetched() {
            self.put_prefetched(index, table)?;
        }
        Ok(())
    }

    fn put_prefetched(&mut self, index: TileIndex, table: Option<Table>) -> Result<()> {
        let Some(table) = table else { return Ok(()) };
        let is_wanted = self.contents.buffer.contains(index) || self.has_room_to_spare();
        if !is_wanted || self.contents.buffer.is_staged(index) || self.contents.cache.contains(index) {
            return Ok(());
        }
        let tile = Arc::new(self.make_tile(index, table)?);
        self.make_room(&tile)?;
        self.put(tile);
        Ok(())
    }

    /// Waits until the prefetch of a tile has ended.
    pub(super) fn end_prefetch_of(&mut self, index: TileIndex) -> Result<()> {
        while self.disk.is_prefetching(index) {
            match self.wait(|disk| disk.stall(|disk| disk.wait_prefetched())) {
                Some((index, table)) => self.put_prefetched(index, table)?,
                None => break,
            }
        }
        Ok(())
    }

    pub(super) fn end_prefetches(&mut self) -> Result<()> {
        while let Some((index, table)) = self.wait(|disk| disk.wait_prefetched()) {
            self.put_prefetched(index, table)?;
        }
        Ok(())
    }
}
