//! Eviction: resident tiles move to the compact form, and compact tiles are saved to disk in the background.

use super::memory_plan::MemoryPlan;
use super::tile_cache::Eviction;
use super::tile_pager::TilePager;
use crate::error::{Error, Result};
use crate::persistence::Saved;
use crate::scan::ScanUpdates;
use crate::space::TileIndex;
use crate::tile::Tile;

/// Bytes of memory for each tile that a scan creates, in addition to its voxels: scan parts, buffered updates and
/// index.
const BYTES_OF_NEW_TILE: usize = 120;

impl TilePager<'_> {
    /// Checks that the index of tiles takes at most half of the memory limit.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::InvalidArgument`], which names a sufficient limit.
    pub(super) fn check_index(&self, updates: &ScanUpdates) -> Result<()> {
        let is_new = |tile: &&TileIndex| !self.exists(**tile) && !self.contents.buffer.is_staged(**tile);
        let tiles = updates.tiles.iter().map(|(tile, _)| tile).filter(is_new).count();
        let tiles = tiles + self.contents.buffer.staged_tiles().filter(|tile| !self.exists(*tile)).count();
        let plan = self.plan();
        let index = self.disk.index_bytes() + BYTES_OF_NEW_TILE * tiles;
        if !plan.is_enforced || index <= plan.bytes / 2 {
            return Ok(());
        }
        let mib = |bytes: usize| bytes.div_ceil(1 << 20);
        let reason = format!(
            "{} MiB are too few: the index of {} tiles takes {} MiB; use at least {} MiB, or larger tiles",
            mib(plan.bytes),
            self.count_tiles() + tiles,
            mib(index),
            mib(3 * index),
        );
        Err(Error::argument("memory", reason))
    }

    /// Maximum number of tiles that one scan may change.
    pub(in crate::mapper) fn max_tiles_of_scan(&self) -> usize {
        let plan = self.plan();
        match plan.is_enforced {
            true => (plan.bytes / 2).saturating_sub(self.memory().index as usize) / BYTES_OF_NEW_TILE,
            false => usize::MAX,
        }
    }

    pub(super) fn plan(&self) -> &MemoryPlan {
        self.contents.plan()
    }

    fn bytes_of_disk(&self) -> usize {
        self.disk.in_flight_bytes() + self.disk.index_bytes() + self.disk.commit_bytes()
    }

    /// Bytes of memory of tiles that are being read, saved or flushed.
    pub(super) fn in_flight_bytes(&self) -> usize {
        self.disk.in_flight_bytes() + self.contents.pinned_bytes()
    }

    /// Returns whether `tiles` more tiles with `bytes` bytes fit.
    pub(super) fn has_room_for(&self, tiles: usize, bytes: usize) -> bool {
        self.contents.has_room_for(tiles, bytes, self.bytes_of_disk())
    }

    /// Returns whether a tile can be loaded ahead of use without evicting others soon.
    pub(super) fn has_room_to_spare(&self) -> bool {
        self.has_room_for(1, self.plan().spare_bytes)
    }

    /// Evicts tiles until `tile` fits.
    pub(super) fn make_room(&mut self, tile: &Tile) -> Result<()> {
        self.evict_until(tile.bytes(), self.plan().tiles - 1)?;
        self.save_ahead()
    }

    /// Evicts tiles until `bytes` bytes are free. Tiles in use are not evicted; if all are in use, the limit is
    /// exceeded.
    pub(super) fn make_room_for(&mut self, bytes: usize) -> Result<()> {
        self.evict_until(bytes, self.plan().tiles)?;
        self.save_ahead()
    }

    /// If the disk is slower than the mapper, waits for one save per scan, which spreads the waiting over the scans.
    /// Nothing is saved while a background flush is running.
    pub(super) fn keep_pace(&mut self) {
        let is_saving = !self.contents.is_flushing() && !self.disk.can_save();
        if is_saving
            && self.contents.cache.has_compact_tier()
            && self.contents.cache.is_behind()
            && let Some(saved) = self.wait(|disk| disk.stall(|disk| disk.wait_saved()))
        {
            self.note_saved(saved);
        }
    }

    /// Evicts tiles until at most `tiles` are resident and `bytes` bytes are free; saves only the tiles that must be
    /// evicted.
    pub(super) fn evict_until(&mut self, bytes: usize, tiles: usize) -> Result<()> {
        loop {
            let (of_disk, is_flushing) = (self.bytes_of_disk(), self.contents.is_flushing());
            match self.contents.next_eviction(bytes, tiles, of_disk) {
                Some(Eviction::Resident(index)) => self.evict(index)?,
                // The tile is being written, or cannot be saved before the flush has ended.
                Some(Eviction::Compact(index)) if is_flushing && self.contents.cache.is_dirty(index) => {
                    self.wait_for_background_flush();
                }
                Some(Eviction::Compact(index)) => self.evict_compact(index)?,
                None if self.contents.is_over(bytes, tiles, of_disk) => {
                    // All remaining tiles are pinned; if a background flush pins them, it will release them.
                    if !is_flushing {
                        return Ok(());
                    }
                    self.wait_for_background_flush();
                }
                None => return Ok(()),
            }
        }
    }

    /// Evicts a resident tile into the compact form, or to disk if there is no compact tier.
    pub(super) fn evict(&mut self, index: TileIndex) -> Result<()> {
        log::debug!("tile {index}: evicted");
        if self.contents.cache.has_compact_tier() {
            return self.contents.pack(index);
        }
        if self.contents.cache.is_dirty(index) {
            self.write(index)?;
        }
        self.contents.cache.drop_resident(index);
        Ok(())
    }

    /// Drops a tile in the compact form after it was saved.
    fn evict_compact(&mut self, index: TileIndex) -> Result<()> {
        while self.contents.cache.is_dirty(index) {
            self.end_background_flush();
            self.begin_save(index)?;
            if self.contents.cache.is_dirty(index) {
                self.wait_for_save()?;
            }
        }
        self.contents.drop_packed(index);
        Ok(())
    }

    /// Begins to save the tiles that will be evicted soon, as many as can be saved at a time.
    fn save_ahead(&mut self) -> Result<()> {
        // During a background flush, tiles are not saved ahead of their eviction.
        if self.contents.is_flushing()
            || !self.contents.cache.has_compact_tier()
            || self.disk.has_save_error()
        {
            return Ok(());
        }
        while self.disk.can_save()
            && let Some(index) = self.contents.cache.next_to_save()
        {
            self.begin_save(index)?;
        }
        Ok(())
    }

    /// Begins to save a tile in the compact form, if it is dirty and not being saved.
    pub(super) fn begin_save(&mut self, index: TileIndex) -> Result<()> {
        if !self.contents.cache.needs_save(index) {
            return Ok(());
        }
        self.end_background_flush();
        self.upgrade()?;
        while !self.disk.can_save() {
            self.wait_for_save()?;
        }
        let writer = self.wait(|disk| disk.writer())?;
        if let Err(error) = self.apply_before_save(index) {
            log::debug!("tile {index}: its updates stay buffered: {error}");
        }
        if let Some(tile) = self.contents.cache.begin_save(index) {
            let scan_number = self.contents.scan_number;
            self.disk.save(writer, index, tile, scan_number);
        }
        Ok(())
    }

    /// Applies the buffered updates of a tile in the compact form before it is saved. The tile was not used for long,
    /// so nothing else would apply them, and the buffer would fill with a few updates for every tile along the
    /// trajectory.
    fn apply_before_save(&mut self, index: TileIndex) -> Result<()> {
        if !self.contents.has_applicable(index) || self.contents.buffer.is_frozen(index) {
            return Ok(());
        }
        let tile = self.read(index)?;
        self.contents.renew_packed(&tile, &self.disk)
    }

    /// Waits for one save to end.
    ///
    /// # Errors
    ///
    /// Fails with the error of a failed save.
    fn wait_for_save(&mut self) -> Result<()> {
        match self.wait(|disk| disk.stall(|disk| disk.wait_saved())) {
            Some(saved) => self.note_saved(saved),
            // No save is running any more; some may have been lost with their thread.
            None => self.contents.cache.no_save_running(),
        }
        self.disk.take_save_error().map_or(Ok(()), Err)
    }

    fn note_saved(&mut self, saved: Saved) {
        self.contents.note_saved(saved, &mut self.disk);
    }

    /// Records the saves that have ended; returns whether there was one.
    pub(super) fn take_saved(&mut self) -> bool {
        let mut is_any = false;
        while let Some(saved) = self.disk.take_saved() {
            self.note_saved(saved);
            is_any = true;
        }
        is_any
    }

    /// Waits until no version of a tile is being saved, so that an older version never overwrites a newer one.
    pub(super) fn end_saves_of(&mut self, index: TileIndex) {
        while self.disk.is_saving(index) {
            if let Some(saved) = self.wait(|disk| disk.stall(|disk| disk.wait_saved())) {
                self.note_saved(saved);
            }
        }
    }

    /// Waits until all saves have ended.
    ///
    /// # Errors
    ///
    /// Fails with the error of a failed save.
    pub(super) fn end_saves(&mut self) -> Result<()> {
        while let Some(saved) = self.wait(|disk| disk.wait_saved()) {
            self.note_saved(saved);
        }
        self.contents.cache.no_save_running();
        self.disk.take_save_error().map_or(Ok(()), Err)
    }

    /// Waits until no read or save is running.
    pub(super) fn end_io(&mut self) -> Result<()> {
        // A tile whose save failed remains dirty and the flush saves it again, so the error is dropped. The saves end
        // before `end_prefetches`, which may wait for a save to get memory and would return this error.
        let _ = self.end_saves();
        self.end_prefetches()?;
        let _ = self.end_saves();
        Ok(())
    }
}
