//! How a map becomes durable: buffered updates are applied, dirty tiles written, and all of it committed at once.

use super::tile_pager::TilePager;
use crate::error::Result;
use crate::space::TileIndex;
use crate::store::{InputRecord, MOST_INPUTS};
use crate::tile::Tile;
use std::sync::Arc;

impl TilePager {
    /// Flushes, and with the flush what the map is being built from now. An input without a scan in the map is forgotten
    /// for it, and so is the earliest of too many.
    pub(in crate::mapper) fn begin_input(&mut self, input: InputRecord, scan_number: u64) -> Result<()> {
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

    /// Applies buffered updates, writes every dirty tile and commits.
    pub(in crate::mapper) fn flush(&mut self, scan_number: u64) -> Result<()> {
        self.end_io(scan_number)?;
        for index in self.store().suspects() {
            // Its file may not be on the medium; what can be read of it is checked as always.
            if !self.cache.is_resident(index) {
                self.load(index, scan_number)?;
            }
            self.write(index, scan_number)?;
        }
        let mut buffered: Vec<_> = self.buffer.tiles().collect();
        buffered.sort_unstable();
        for index in buffered {
            self.flush_buffered(index, scan_number)?;
        }
        // The files are made of the tables alone. But statistics of octrees are as of the flush, and tables whose bricks are in
        // order are written sooner.
        self.cache.sync_octrees();
        let mut compact = self.cache.dirty_compact().into_iter();
        for index in self.cache.resident_indices() {
            // The saving thread writes tiles in the compact form meanwhile.
            while self.disk.can_save()
                && let Some(index) = compact.next()
            {
                self.begin_save(index, scan_number)?;
            }
            if self.cache.is_dirty(index) {
                self.write(index, scan_number)?;
            }
            self.take_saved();
        }
        for index in compact {
            self.begin_save(index, scan_number)?;
        }
        self.end_saves()?;
        // A commit of many tiles takes memory, too.
        self.make_room_for(0, self.cache.plan().tiles, scan_number)?;
        self.upgrade()?;
        self.disk.commit(&self.inputs, scan_number)
    }

    /// Applies a tile's buffered updates. Where there is no room for the tile it is written at once and not kept.
    fn flush_buffered(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        if !self.cache.has_compact_tier() {
            return self.load(index, scan_number);
        }
        let tile = Arc::new(self.read(index, scan_number)?);
        let fits = self.has_room_for(tile.bytes());
        if !fits {
            // While it is written it comes on top: its updates are forgotten only then, and an error leaves it here.
            self.make_room(&tile, scan_number)?;
        }
        self.put(tile);
        if !fits {
            if self.cache.is_dirty(index) {
                self.write(index, scan_number)?;
            }
            self.cache.drop_resident(index);
        }
        Ok(())
    }

    /// Writes a resident tile; after an error it is dirty.
    pub(super) fn write(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        self.upgrade()?;
        self.end_saves_of(index);
        // Dirty until it is written: a failed attempt may cut short what is on disk of it.
        self.cache.change(index, Tile::mark_dirty);
        let Some(tile) = self.cache.peek(index) else { return Ok(()) };
        self.disk.write(tile, scan_number)?;
        self.cache.change(index, Tile::mark_clean);
        Ok(())
    }

    /// Makes a map of the seed's format, before its first change, one of voxtile's own.
    pub(super) fn upgrade(&mut self) -> Result<()> {
        self.disk.upgrade(&self.inputs)
    }
}
