//! Flush of a map: applies buffered updates, writes dirty tiles and commits all of it atomically.

use super::flusher::{BegunFlush, FlushedTile};
use super::pinned_tile::PinnedTile;
use super::pinned_tiles::PinnedTiles;
use super::shared_contents::unlocked;
use super::shared_disk;
use super::tile_disk::BYTES_OF_VOXEL;
use super::tile_pager::TilePager;
use super::tile_state::Base;
use super::unapplied_tile::UnappliedTile;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::InputRecord;
use std::sync::Arc;
use std::time::Instant;

impl TilePager<'_> {
    /// Records a new input and flushes, so that the record is durable. It replaces an input without scans; beyond the
    /// maximum number the oldest is dropped.
    pub(in crate::mapper) fn begin_input(&mut self, input: InputRecord) -> Result<()> {
        let before = self.contents.add_input(input);
        let flushed = self.flush();
        if flushed.is_err() {
            self.contents.inputs = before;
        }
        flushed
    }

    /// Applies buffered updates, writes every dirty tile and commits.
    pub(in crate::mapper) fn flush(&mut self) -> Result<()> {
        self.end_background_flush();
        if let Some(error) = self.contents.take_flush_error() {
            log::debug!("an earlier flush failed, and its tiles are written again: {error:#}");
        }
        self.settle()?;
        // Files are written from tables only. The sync updates octree statistics and sorts bricks, which speeds up
        // writing.
        self.contents.cache.sync_octrees();
        let mut compact = self.contents.cache.unsaved_compact().into_iter();
        for index in self.contents.cache.resident_indices() {
            // Meanwhile, the saving thread writes tiles in the compact form.
            while self.disk.can_save()
                && let Some(index) = compact.next()
            {
                self.begin_save(index)?;
            }
            if self.contents.cache.is_dirty(index) {
                self.write(index)?;
            }
            self.take_saved();
        }
        for index in compact {
            self.begin_save(index)?;
        }
        self.end_saves()?;
        // A commit of many tiles needs memory.
        self.make_room_for(0)?;
        self.upgrade()?;
        let (inputs, scan_number) = (self.contents.inputs.clone(), self.contents.scan_number);
        self.wait(|disk| disk.commit(&inputs, scan_number))
    }

    /// Begins a flush of the current map: dirty tiles, which remain shared with the cache; buffered updates; and the
    /// scans that were noted. Waits first for a flush that is running. Returns `None` if the flush is complete: the
    /// lists for a background flush of many small tiles would have been too large.
    pub(super) fn begin_flush(&mut self) -> Result<Option<BegunFlush>> {
        self.end_background_flush();
        self.contents.take_flush_error().map_or(Ok(()), Err)?;
        let list_bytes = self.contents.flush_size().bytes();
        if list_bytes > self.plan().flush_list_bytes {
            self.flush()?;
            return Ok(None);
        }
        self.rewrite_failed_syncs()?;
        self.upgrade()?;
        // A tile whose save failed remains dirty and the flush saves it again, so the error is dropped.
        self.take_saved();
        let _ = self.disk.take_save_error();
        let pinned_bytes = list_bytes + self.bytes_to_make();
        let bytes_beyond = pinned_bytes.saturating_sub(self.contents.flush_reserve);
        self.evict_until(bytes_beyond, self.plan().tiles)?;
        let (inputs, scan_number) = (self.contents.inputs.clone(), self.contents.scan_number);
        let files = self.store().tables().reader()?;
        let (commit, writer) = self.wait(|disk| disk.begin_commit(&inputs, scan_number))?;
        let mut tiles = self.freeze_buffer();
        // Tiles that are being saved are only listed: this call does not wait for their saves.
        let saving = self.contents.saving_as_they_are();
        let dirty = self.contents.cache.used_last_first().filter(|tile| tile.is_dirty());
        tiles.extend(dirty.cloned().map(|tile| FlushedTile::Resident(Arc::new(PinnedTile::new(tile)))));
        let mut compact = Vec::new();
        for index in self.contents.cache.unsaved_compact().into_iter().rev() {
            if !self.contents.buffer.is_frozen(index) {
                let tile = self.contents.cache.begin_save(index);
                let list = if self.disk.is_saving(index) { &mut tiles } else { &mut compact };
                list.extend(tile.map(|tile| FlushedTile::Compact(index, tile)));
            }
        }
        // A tile that has changed since its save began must be written after the save, so these tiles are first in the
        // list, which is written in reverse order.
        tiles.sort_by_key(|tile| !self.disk.is_saving(tile.index()));
        let after_saves = tiles.iter().take_while(|tile| self.disk.is_saving(tile.index())).count();
        // The next scan will likely change the tiles that the last one changed. These are the first resident ones.
        let is_resident = |tile: &FlushedTile| matches!(tile, FlushedTile::Resident(_));
        let residents = tiles.iter().skip(after_saves).position(is_resident);
        let first = residents.map_or(tiles.len(), |first| after_saves + first);
        let soon_changed = first..tiles.len().min(first + self.contents.last_touched);
        self.contents.begin_background_flush(PinnedTiles::of(
            tiles.iter().chain(&compact),
            pinned_bytes,
            saving,
        ));
        Ok(Some(BegunFlush { scan_number, tiles, compact, after_saves, soon_changed, writer, files, commit }))
    }

    /// Hands the buffered updates to a background flush.
    fn freeze_buffer(&mut self) -> Vec<FlushedTile> {
        let unapplied = self.contents.buffered_tiles().into_iter().map(|index| {
            let store = self.disk.store();
            let on_disk = match store.tiles().version(index) {
                Some(version) => Base::OnDisk(version),
                None if store.tiles().contains(index) => Base::Orphan,
                None => Base::Nothing,
            };
            let state = self.contents.freeze(index, on_disk);
            let location =
                matches!(state.base, Base::OnDisk(_)).then(|| store.tables().location(index)).flatten();
            FlushedTile::Unapplied(Box::new(UnappliedTile { index, state, location }))
        });
        unapplied.collect()
    }

    /// Approximate bytes of memory of the largest tile that a flush has to build from buffered updates.
    fn bytes_to_make(&self) -> usize {
        let max_voxels = (self.config.grid.voxels_per_tile_edge() as u64).saturating_pow(3);
        let voxels = self.contents.buffer.tiles().map(|index| {
            let updates = self.contents.buffer.updates_of(index);
            let before = self.voxels_of_tile_hint(index).unwrap_or_default();
            before.saturating_add(updates).min(max_voxels)
        });
        voxels.max().map_or(0, |voxels| BYTES_OF_VOXEL.saturating_mul(voxels as usize))
    }

    /// Waits for a background flush. If it failed, the next flush reports the error or writes the same tiles.
    pub(super) fn end_background_flush(&mut self) {
        if !self.contents.is_flushing() {
            return;
        }
        let since = Instant::now();
        let Self { contents, disk, flusher, .. } = self;
        unlocked(contents, || shared_disk::unlocked(disk, || while flusher.wait() {}));
        self.disk.note_stall(since.elapsed());
        if self.contents.is_flushing() {
            let lost = std::io::Error::other("the flush thread ended unexpectedly");
            let error = Error::io(self.store().folder(), "flush", lost);
            self.contents.end_background_flush(Err(error));
            self.contents.cache.no_save_running();
        }
    }

    /// Waits until a background flush has released some tiles or has ended.
    pub(super) fn wait_for_background_flush(&mut self) {
        // The end of a save that the flush waits for also releases a tile.
        if self.take_saved() {
            return;
        }
        let since = Instant::now();
        let Self { contents, disk, flusher, .. } = self;
        let goes_on = unlocked(contents, || shared_disk::unlocked(disk, || flusher.wait_for_some()));
        self.disk.note_stall(since.elapsed());
        if !goes_on {
            self.end_background_flush();
        }
    }

    /// Completes all reads and saves and applies all buffered updates.
    fn settle(&mut self) -> Result<()> {
        self.end_io()?;
        self.rewrite_failed_syncs()?;
        self.contents.buffered_tiles().into_iter().try_for_each(|index| self.flush_buffered(index))
    }

    /// Rewrites the tiles whose files failed to sync.
    fn rewrite_failed_syncs(&mut self) -> Result<()> {
        for index in self.store().tiles().failed_syncs() {
            // The file may be incomplete on the medium. The tile is loaded from it, which verifies it, and written
            // again.
            if !self.contents.cache.is_resident(index) {
                self.load(index)?;
            }
            self.write(index)?;
        }
        Ok(())
    }

    /// Applies a tile's buffered updates. A tile that does not fit in memory is written at once and not kept.
    fn flush_buffered(&mut self, index: TileIndex) -> Result<()> {
        if !self.contents.cache.has_compact_tier() {
            return self.load(index);
        }
        let tile = Arc::new(self.read(index)?);
        let fits = self.has_room_for(1, tile.bytes());
        if !fits {
            // The limit is exceeded while the tile is written. The tile remains in the cache until then, so that an
            // error loses no data.
            self.make_room(&tile)?;
        }
        self.put(tile);
        if !fits {
            if self.contents.cache.is_dirty(index) {
                self.write(index)?;
            }
            self.contents.cache.drop_resident(index);
        }
        Ok(())
    }

    /// Writes a resident tile; after an error the tile is dirty.
    pub(super) fn write(&mut self, index: TileIndex) -> Result<()> {
        self.end_background_flush();
        self.upgrade()?;
        self.end_saves_of(index);
        let Some(tile) = self.contents.begin_write(index) else { return Ok(()) };
        let scan_number = self.contents.scan_number;
        // The closure owns the tile and drops it: changing a tile that has other owners would copy it.
        let version = self.wait(move |disk| disk.write(&tile, scan_number))?;
        self.contents.end_write(index, version);
        Ok(())
    }

    /// Upgrades a map of the original format before its first change.
    pub(super) fn upgrade(&mut self) -> Result<()> {
        let inputs = self.contents.inputs.clone();
        self.wait(|disk| disk.upgrade(&inputs))
    }
}
