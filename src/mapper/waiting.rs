//! Updates that wait: when they are applied, and how they go to files where memory is short.

use super::pending::InFile;
use super::residency::Residency;
use crate::error::Result;
use crate::scan::PackedUpdates;
use crate::space::TileIndex;
use crate::tile::Tile;

/// A tile for which more than this waits in its file is brought in: so much is cheaper applied than kept.
const MOST_IN_FILE: u64 = 1 << 20;

impl Residency {
    /// Applies what waits, as far as it is too much.
    pub(super) fn work_off(&mut self, scan_number: u64) -> Result<()> {
        let too_much = self.pending.bytes().saturating_sub(self.plan.pending_bytes);
        let heaviest = if too_much > 0 { self.pending.heaviest(too_much) } else { Vec::new() };
        let in_files = self.pending.longest_files(MOST_IN_FILE);
        for tile in heaviest.into_iter().chain(in_files) {
            if self.pending.contains(tile) && !self.coming.contains_key(&tile) {
                self.bring_in(tile, scan_number)?;
            }
        }
        Ok(())
    }

    /// Applies to a tile what waits for it.
    pub(super) fn apply_waiting(&mut self, tile: &mut Tile) -> Result<()> {
        let (model, index) = (&self.config.sensor_model, tile.index());
        let InFile { file, updates } = self.pending.in_file(index);
        if file.bytes > 0 {
            let (store, stalls) = (&self.store, &mut self.stalls);
            let bytes = stalls.during(|| store.read_waiting(index, file))?;
            self.io.bytes_read += file.bytes;
            PackedUpdates::from_parts(bytes, updates).iter().for_each(|updates| tile.apply(model, &updates));
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

    /// Begins a scan: whatever an earlier one left in files without being accepted does not count.
    pub(super) fn begin_scan(&mut self) {
        self.coming.clear();
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
            let in_memory = self.pending.in_memory(index).filter(|waiting| !waiting.is_empty());
            if let Some(waiting) = in_memory {
                let in_file = self.append(index, self.pending.in_file(index), waiting)?;
                self.io.bytes_written += waiting.as_bytes().len() as u64;
                self.pending.moved_to_file(index, in_file);
            }
            let before = self.coming.get(&index).copied();
            let before = before.unwrap_or_else(|| self.pending.in_file(index));
            let in_file = self.append(index, before, &updates)?;
            self.io.bytes_written += updates.as_bytes().len() as u64;
            self.coming.insert(index, in_file);
        }
        self.make_room_for(0, self.plan.tiles, scan_number)
    }

    fn append(&self, index: TileIndex, before: InFile, updates: &PackedUpdates) -> Result<InFile> {
        let file = self.store.append_waiting(index, before.file, updates.as_bytes())?;
        Ok(InFile { file, updates: before.updates + updates.len() })
    }
}
