//! Updates that wait: when they are applied, and how they go to files where memory is short.

use super::pending::{InFile, Pending};
use super::residency::Residency;
use crate::error::{Error, Result};
use crate::scan::PackedUpdates;
use crate::space::TileIndex;
use crate::tile::Tile;

/// A tile for which more than this waits in its file is brought in: so much is cheaper applied than kept.
const MOST_IN_FILE: u64 = 1 << 20;

/// Less than this is not worth reading and writing a tile for, however small that is.
const LEAST_BROUGHT_IN_FOR: u64 = 1 << 14;

impl Residency {
    /// Makes what waits in memory less, as far as it is too much: it is applied, or goes to files where that is cheaper.
    pub(super) fn work_off(&mut self, scan_number: u64) -> Result<()> {
        let too_much = self.pending.bytes().saturating_sub(self.plan.pending_bytes);
        let heaviest = if too_much > 0 { self.pending.heaviest(too_much) } else { Vec::new() };
        for tile in heaviest {
            if self.coming.contains(tile) {
                continue;
            }
            if self.is_cheaper_in_file(tile) {
                self.adopt()?;
                self.move_to_file(tile)?;
            } else {
                self.bring_in_waiting(tile, scan_number)?;
            }
        }
        // However little waits for each: what is known of it takes memory.
        let too_many =
            self.pending.files().saturating_sub(self.plan.pending_bytes / 2 / Pending::BYTES_OF_FILE);
        for tile in self.pending.longest_files(MOST_IN_FILE, too_many) {
            self.bring_in_waiting(tile, scan_number)?;
        }
        Ok(())
    }

    fn bring_in_waiting(&mut self, tile: TileIndex, scan_number: u64) -> Result<()> {
        // It may have come in with another.
        if self.pending.contains(tile) && !self.coming.contains(tile) {
            self.bring_in(tile, scan_number)?;
        }
        Ok(())
    }

    /// Whether what waits for a tile is better put into its file than applied. A tile on disk is read and written for its
    /// updates; that these are at least as many bytes as it has keeps the bytes that go either way in proportion to
    /// the updates, as in a log-structured merge tree (O'Neil et al., 1996).
    pub(super) fn is_cheaper_in_file(&self, tile: TileIndex) -> bool {
        let is_in_memory = self.tiles.contains(tile) || self.cold.contains(tile);
        if self.plan.cold_bytes == 0 || is_in_memory || self.traffic.is_loading(tile) {
            return false;
        }
        let tile_bytes = self.store.stamp(tile).map_or(0, |stamp| stamp.table.bytes);
        let in_memory = self.pending.in_memory(tile).map_or(0, |waiting| waiting.as_bytes().len());
        let waiting = self.pending.in_file(tile).file.bytes + in_memory as u64;
        waiting < tile_bytes.max(LEAST_BROUGHT_IN_FOR)
    }

    /// Puts what waits for a tile in memory into its file, behind what is there.
    fn move_to_file(&mut self, index: TileIndex) -> Result<()> {
        let Some(waiting) = self.pending.in_memory(index).filter(|waiting| !waiting.is_empty()) else {
            return Ok(());
        };
        let in_file = self.append(index, self.pending.in_file(index), waiting)?;
        self.io.bytes_written += waiting.as_bytes().len() as u64;
        self.pending.moved_to_file(index, in_file);
        Ok(())
    }

    /// Applies to a tile what waits for it.
    pub(super) fn apply_waiting(&mut self, tile: &mut Tile) -> Result<()> {
        let (model, index) = (&self.config.sensor_model, tile.index());
        let InFile { file, .. } = self.pending.in_file(index);
        if file.bytes > 0 {
            let (store, stalls) = (&self.store, &mut self.stalls);
            let waiting = stalls.during(|| store.open_waiting(index, file))?;
            self.io.bytes_read += file.bytes;
            PackedUpdates::unpack(waiting, |updates| tile.apply(model, &updates))
                .map_err(|error| Error::io(&store.layout().waiting(index), "read", error))?;
        }
        let in_memory = self.pending.in_memory(index).into_iter().flat_map(PackedUpdates::iter);
        in_memory.for_each(|updates| tile.apply(model, &updates));
        Ok(())
    }

    /// Forgets what waited for a tile: it was applied, or is not wanted any more.
    pub(super) fn forget_waiting(&mut self, index: TileIndex) {
        if self.pending.applied(index).file.bytes > 0 {
            self.store.remove_waiting(index);
        }
    }

    /// Takes back what a scan that was not accepted has put into files: it does not count, and its room may be what the
    /// next flush needs.
    pub(super) fn give_up_scan(&mut self) {
        for index in std::mem::take(&mut self.coming).tiles() {
            self.store.cut_waiting(index, self.pending.in_file(index).file);
        }
    }

    /// Puts a part of a scan that has not been accepted yet into files, behind what waits for the same tiles.
    pub(super) fn put_in_files(
        &mut self,
        part: Vec<(TileIndex, PackedUpdates)>,
        scan_number: u64,
    ) -> Result<()> {
        self.adopt()?;
        for (index, updates) in part {
            if self.is_unread(index) {
                self.bring_in(index, scan_number)?;
            }
            // Updates wait only for tiles that are not resident.
            if self.tiles.contains(index) {
                self.push_out(index, scan_number)?;
            }
            self.move_to_file(index)?;
            let before = self.coming.get(index);
            let before = before.unwrap_or_else(|| self.pending.in_file(index));
            let in_file = self.append(index, before, &updates)?;
            self.io.bytes_written += updates.as_bytes().len() as u64;
            self.coming.insert(index, in_file);
        }
        self.make_room_for(0, self.plan.tiles, scan_number)
    }

    fn append(&self, index: TileIndex, before: InFile, updates: &PackedUpdates) -> Result<InFile> {
        let appended = self.store.append_waiting(index, before.file, updates.as_bytes());
        let file = appended.inspect_err(|_| self.store.cut_waiting(index, before.file))?;
        Ok(InFile { file, updates: before.updates + updates.len() as u64 })
    }
}
