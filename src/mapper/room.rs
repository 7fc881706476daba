//! How room is made: resident tiles are brought into the compact form, and these go to disk, beside the mapping.

use super::cold_tiles::ColdTile;
use super::residency::Residency;
use super::statistics::MemoryCounts;
use super::tile_traffic::Saved;
use crate::config::Storage;
use crate::error::{Error, Result};
use crate::scan::ScanUpdates;
use crate::space::TileIndex;
use crate::tile::Tile;
use std::time::Instant;

/// What a tile takes beside its voxels while a scan is inserted that makes it: its part of the scan, what waits for it, and what
/// is known of it until it is flushed.
const BYTES_OF_NEW_TILE: usize = 120;

impl Residency {
    /// Bytes of memory of all that grows.
    pub(super) fn memory(&self) -> MemoryCounts {
        let known_bytes = self.unread.bytes() + self.saved.bytes();
        MemoryCounts {
            tiles: self.tiles.bytes() as u64,
            compact_tiles: self.cold.bytes() as u64,
            pending: self.pending.bytes() as u64,
            scan: self.scan_bytes as u64,
            on_the_way: self.traffic.bytes() as u64,
            index: (self.store.index_bytes() + self.store.commit_bytes() + known_bytes) as u64,
        }
    }

    /// Whether what is known of the map's tiles leaves room to work in.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] with the limit that would do, if it takes more than half of it.
    pub(super) fn check_index(&self, updates: &ScanUpdates) -> Result<()> {
        let is_new = |tile: &&TileIndex| !self.exists(**tile) && !self.coming.contains(**tile);
        let tiles = updates.tiles.iter().map(|(tile, _)| tile).filter(is_new).count();
        let tiles = tiles + self.coming.tiles().filter(|tile| !self.exists(*tile)).count();
        let memory = self.memory();
        let index = memory.index as usize - self.store.commit_bytes() + BYTES_OF_NEW_TILE * tiles;
        if !self.plan.is_kept || index <= self.plan.bytes / 2 {
            return Ok(());
        }
        let mib = |bytes: usize| bytes.div_ceil(1 << 20);
        let reason = format!(
            "{} MiB are too few for a map of {} tiles: to know which there are takes {} MiB; go on with at least {} MiB, or \
             build with larger tiles",
            mib(self.plan.bytes),
            self.count_tiles() + tiles,
            mib(index),
            mib(3 * index),
        );
        Err(Error::argument("memory", reason))
    }

    /// How many tiles one scan may touch.
    pub(super) fn most_tiles_of_scan(&self) -> usize {
        match self.plan.is_kept {
            true => (self.plan.bytes / 2).saturating_sub(self.memory().index as usize) / BYTES_OF_NEW_TILE,
            false => usize::MAX,
        }
    }

    /// Bytes that count towards the limit. The share of packed tiles counts as if it were full: the many small blocks that
    /// tiles in use leave to the allocator do not take the large ones of packed tiles, so that these come on top of all that
    /// tiles in use have ever taken.
    fn bytes(&self) -> usize {
        let memory = self.memory();
        let packed = memory.compact_tiles.max(self.plan.cold_bytes as u64);
        (memory.bytes() - memory.compact_tiles + packed) as usize
    }

    /// Whether one more tile fits, and so many bytes with it.
    pub(super) fn has_room_for(&self, bytes: usize) -> bool {
        self.tiles.len() < self.plan.tiles && self.bytes().saturating_add(bytes) <= self.plan.bytes
    }

    /// Whether a tile may come in before it has to: not when others would soon have to go for it.
    pub(super) fn has_room_to_spare(&self) -> bool {
        self.has_room_for(self.plan.spare_bytes)
    }

    /// Pushes out the least recently used tiles until this one fits.
    pub(super) fn make_room(&mut self, tile: &Tile, scan_number: u64) -> Result<()> {
        self.make_room_for(tile.bytes(), self.plan.tiles - 1, scan_number)
    }

    /// Pushes out the least recently used tiles until there are at most so many, and room for so many bytes. Tiles in use
    /// stay; if all are, what is to come comes on top.
    pub(super) fn make_room_for(&mut self, bytes: usize, tiles: usize, scan_number: u64) -> Result<()> {
        loop {
            let is_short = self.bytes().saturating_add(bytes) > self.plan.bytes;
            if self.tiles.len() <= tiles && !is_short {
                break;
            }
            let resident = self.tiles.least_recently_used();
            match (resident, self.cold.oldest()) {
                (_, Some(cold)) if is_short && self.cold.bytes() > self.plan.cold_bytes => {
                    self.push_out_cold(cold, scan_number)?;
                }
                (Some(index), _) => self.push_out(index, scan_number)?,
                (None, Some(cold)) if is_short => self.push_out_cold(cold, scan_number)?,
                _ => break,
            }
        }
        self.save_ahead(scan_number)
    }

    /// Takes a tile from those in memory: into the compact form, or where there is no room for that, to disk.
    pub(super) fn push_out(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        if self.plan.cold_bytes == 0 {
            let since = Instant::now();
            let is_written = self.save(index, scan_number)?;
            if is_written {
                self.stalls.note(since.elapsed());
            }
        } else if let Some(tile) = self.tiles.peek(index) {
            let is_compact = self.config.storage == Storage::Compact;
            self.cold.pack(tile, is_compact.then(|| self.config.occupied_log_odds()))?;
            self.io.packed += 1;
        }
        self.tiles.remove(index);
        Ok(())
    }

    /// Drops a tile in the compact form, once it is on disk.
    fn push_out_cold(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        while self.cold.get(index).is_some_and(|tile| tile.is_dirty) {
            self.send_to_disk(index, scan_number)?;
            self.wait_for_save()?;
        }
        self.cold.remove(index);
        Ok(())
    }

    /// Sends tiles to disk before they have to go, as many as may be on their way at a time.
    fn save_ahead(&mut self, scan_number: u64) -> Result<()> {
        if self.plan.cold_bytes == 0 || self.save_error.is_some() {
            return Ok(());
        }
        while self.cold.bytes() > self.plan.cold_bytes / 4 * 3
            && self.traffic.can_save()
            && let Some(index) = self.cold.next_to_leave()
        {
            self.send_to_disk(index, scan_number)?;
        }
        Ok(())
    }

    /// Sends a tile in the compact form to disk, if it is not there as it is, nor on its way.
    pub(super) fn send_to_disk(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        let is_to_leave = |tile: &&ColdTile| tile.is_dirty && !tile.is_leaving;
        let Some(tile) = self.cold.get(index).filter(is_to_leave).cloned() else { return Ok(()) };
        self.adopt()?;
        while !self.traffic.can_save() {
            self.wait_for_save()?;
        }
        let writer = self.store.writer()?;
        self.cold.leaves(index);
        self.traffic.save(writer, index, tile, scan_number);
        Ok(())
    }

    /// Waits until one of the tiles on their way to disk is there.
    pub(super) fn wait_for_save(&mut self) -> Result<()> {
        let traffic = &mut self.traffic;
        match self.stalls.during(|| traffic.wait_saved()) {
            Some(saved) => self.note_saved(saved),
            // None is on its way any more, whatever happened to them.
            None => self.cold.none_leaves(),
        }
        self.save_error.take().map_or(Ok(()), Err)
    }

    /// Takes note of a tile that has arrived on disk, or could not.
    pub(super) fn note_saved(&mut self, saved: Saved) {
        let Saved { index, tile, result } = saved;
        let is_here = self.cold.has_left(index, &tile.compact, result.is_ok());
        match result {
            Ok(stamp) => {
                self.store.note_next(index, stamp);
                self.io.saves += 1;
                self.io.bytes_written += stamp.table.bytes + stamp.octree.bytes;
                self.unread.remove(index);
                self.saved.insert(index, ());
            }
            Err(error) if is_here => self.save_error = Some(error),
            // It has changed since, and is written again.
            Err(error) => log::debug!("an older version of tile {index} was not saved: {error}"),
        }
    }
}
