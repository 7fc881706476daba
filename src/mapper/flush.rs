//! How a map becomes durable: what waits is applied, what is dirty is written, and all of it committed.

use super::adoption::adopt;
use super::residency::Residency;
use crate::config::MapConfig;
use crate::error::Result;
use crate::space::TileIndex;
use crate::store::{Extension, InputRecord, MOST_INPUTS, Metadata, hex};
use crate::tile::Tile;
use std::sync::Arc;

impl Residency {
    /// Flushes, and with the flush what the map is being built from now. An input that the map took no scan of is
    /// forgotten for it, and so is the earliest of too many.
    pub(super) fn begin_input(&mut self, input: InputRecord, scan_number: u64) -> Result<()> {
        let before = self.inputs.clone();
        if self.inputs.last().is_some_and(|last| last.first_scan == scan_number) {
            self.inputs.pop();
        }
        self.inputs.push(input);
        let excess = self.inputs.len().saturating_sub(MOST_INPUTS);
        self.inputs.drain(..excess);
        let flushed = self.flush(scan_number);
        if flushed.is_err() {
            self.inputs = before;
        }
        flushed
    }

    /// Applies what waits, writes every dirty tile and commits.
    pub(super) fn flush(&mut self, scan_number: u64) -> Result<()> {
        self.end_traffic(scan_number)?;
        for index in self.store.suspects() {
            // Its file cannot be trusted to be on the medium; what can be read of it is checked as always.
            if !self.tiles.contains(index) {
                self.bring_in(index, scan_number)?;
            }
            self.write(index, scan_number)?;
        }
        let mut waiting: Vec<_> = self.pending.tiles().collect();
        waiting.sort_unstable();
        for index in waiting {
            self.flush_waiting(index, scan_number)?;
        }
        // The files are made of the tables alone. But what statistics say of octrees is as of the flush, and tables
        // whose bricks are in order are written sooner.
        self.sync_octrees();
        let mut cold: Vec<_> = self.cold.dirty_tiles();
        cold.sort_unstable();
        let mut cold = cold.into_iter();
        for index in self.cached_tile_indices() {
            // The other thread writes tiles in the compact form meanwhile.
            while self.traffic.can_save()
                && let Some(index) = cold.next()
            {
                self.send_to_disk(index, scan_number)?;
            }
            self.save(index, scan_number)?;
            self.take_saved_tiles();
        }
        for index in cold {
            self.send_to_disk(index, scan_number)?;
        }
        self.end_saves()?;
        // A commit of many tiles takes memory, too.
        self.make_room_for(0, self.plan.tiles, scan_number)?;
        self.adopt()?;
        self.store.commit(self.metadata(), scan_number)
    }

    /// Applies what waits for a tile. Where there is no room for the tile it is written at once and not kept.
    fn flush_waiting(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        if self.plan.cold_bytes == 0 {
            return self.bring_in(index, scan_number);
        }
        let tile = Arc::new(self.read(index, scan_number)?);
        let fits = self.has_room_for(tile.bytes());
        if !fits {
            // While it is written it comes on top: only then what waits is forgotten, and an error leaves it here.
            self.make_room(&tile, scan_number)?;
        }
        self.has_come_in(tile);
        if !fits {
            self.save(index, scan_number)?;
            self.tiles.remove(index);
        }
        Ok(())
    }

    /// Writes a tile in memory if it is dirty, and tells whether it was; after an error it is as it was.
    pub(super) fn save(&mut self, index: TileIndex, scan_number: u64) -> Result<bool> {
        let is_dirty = self.tiles.peek(index).is_some_and(|tile| tile.is_dirty());
        if is_dirty {
            self.write(index, scan_number)?;
        }
        Ok(is_dirty)
    }

    pub(super) fn write(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        self.adopt()?;
        self.end_saves_of(index);
        // Until it is written: what is on disk of it may be cut short by an attempt that fails.
        self.tiles.change(index, Tile::mark_dirty);
        let Some(tile) = self.tiles.peek(index) else { return Ok(()) };
        let stamp = self.saver.save(&mut self.store, tile, scan_number)?;
        self.tiles.change(index, Tile::mark_clean);
        self.io.saves += 1;
        self.io.bytes_written += stamp.table.bytes + stamp.octree.bytes;
        self.unread.remove(index);
        self.saved.insert(index, ());
        Ok(())
    }

    /// Makes a map of the seed's format, before its first change, one of voxtile's own.
    pub(super) fn adopt(&mut self) -> Result<()> {
        let Self { store, saver, config, inputs, .. } = self;
        adopt(store, saver, config, |map_id| new_metadata(config, map_id, inputs))
    }

    fn metadata(&self) -> Metadata {
        let map_id = self.store.map_id().unwrap_or_default();
        let mut metadata = new_metadata(&self.config, map_id, &self.inputs);
        if let (Some(ext), Some(before)) = (&mut metadata.ext, &self.store.metadata().ext) {
            ext.decayed_scan = before.decayed_scan;
        }
        metadata
    }
}

/// The metadata of a map; bounds and numbers are the store's to fill in.
pub(crate) fn new_metadata(config: &MapConfig, map_id: [u8; 16], inputs: &[InputRecord]) -> Metadata {
    let ext = Extension {
        empty: true,
        map_id: hex(&map_id),
        flush_number: 0,
        scan_number: 0,
        sensor_model: config.sensor_model,
        occupancy_threshold: config.occupancy_threshold,
        rays: config.rays,
        inputs: inputs.to_vec(),
        decayed_scan: 0,
        storage: config.storage,
        snapshots: None,
    };
    let (resolution_m, tile_size_m) = (config.grid.resolution_m(), config.grid.tile_size_m());
    Metadata { resolution_m, tile_size_m, bounds: None, ext: Some(ext) }
}
