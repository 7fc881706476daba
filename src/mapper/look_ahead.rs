//! Tiles are fetched before they are needed: those for which the most waits, and those that lie in the direction of
//! travel.

use super::residency::{Fetched, Residency};
use super::tile_traffic::Loaded;
use crate::error::Result;
use crate::scan::TileUpdates;
use crate::space::TileIndex;
use std::sync::Arc;

/// Where scans touched the map lately.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LookAhead {
    last: Option<TileSpan>,
}

/// The tiles from one corner to another, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct TileSpan {
    min: [i32; 3],
    max: [i32; 3],
}

/// About how many bytes a voxel of a tile on disk takes in memory.
const BYTES_OF_VOXEL: usize = 6;

/// Most tiles that are looked at for what lies ahead; a scan that spans more is no vehicle's.
const MOST_AHEAD: usize = 4096;

impl Residency {
    /// Sends for tiles that will be needed, as far as there is room for them. `updates` are those of the scan that is
    /// being inserted.
    pub(super) fn look_ahead(&mut self, updates: &[(TileIndex, TileUpdates)]) {
        if self.plan.cold_bytes == 0 {
            return;
        }
        // Soon they will have to come in.
        let soon = self.pending.bytes().saturating_sub(self.plan.pending_bytes / 4 * 3);
        if soon > 0 {
            for tile in self.pending.heaviest(soon) {
                if !self.is_cheaper_in_file(tile) {
                    self.send_for(tile);
                }
            }
        }
        let span = TileSpan::of(updates.iter().map(|(tile, _)| *tile));
        let before = std::mem::replace(&mut self.ahead.last, span);
        if let (Some(before), Some(now)) = (before, span) {
            for tile in now.ahead(&before) {
                if self.is_unread(tile) && self.has_room_to_spare() {
                    self.send_for(tile);
                }
            }
        }
    }

    fn send_for(&mut self, index: TileIndex) {
        if self.is_near(index) || self.traffic.is_loading(index) || !self.traffic.can_load() {
            return;
        }
        if let Some(location) = self.store.location(index) {
            let voxels = self.store.stamp(index).map_or(0, |stamp| stamp.voxels) as usize;
            self.traffic.load(location, BYTES_OF_VOXEL.saturating_mul(voxels));
        }
    }

    /// Takes note of what has arrived on disk and in memory since the last time.
    pub(super) fn take_arrived(&mut self, scan_number: u64) -> Result<()> {
        self.take_saved_tiles();
        while let Some(loaded) = self.traffic.take_loaded() {
            self.note_loaded(loaded, scan_number)?;
        }
        Ok(())
    }

    /// Takes note of what has arrived on disk since the last time.
    pub(super) fn take_saved_tiles(&mut self) {
        while let Some(saved) = self.traffic.take_saved() {
            self.note_saved(saved);
        }
    }

    fn note_loaded(&mut self, loaded: Loaded, scan_number: u64) -> Result<()> {
        let Loaded { index, result } = loaded;
        // What could not be read is read again when it is needed, and reported then.
        let Ok(read) = result else { return Ok(()) };
        self.has_read(index, read.file.bytes);
        self.io.prefetches += 1;
        let is_wanted = self.pending.contains(index) || self.has_room_to_spare();
        if !is_wanted || self.coming.contains(index) || self.is_near(index) {
            return Ok(());
        }
        let fetched = Some(Fetched { table: read.table, is_dirty: false });
        let tile = Arc::new(self.made_of(index, fetched)?);
        self.make_room(&tile, scan_number)?;
        self.has_come_in(tile);
        Ok(())
    }

    fn is_near(&self, index: TileIndex) -> bool {
        self.tiles.contains(index) || self.cold.contains(index)
    }

    /// Waits until a tile that was sent for is there.
    pub(super) fn end_load_of(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        while self.traffic.is_loading(index) {
            let traffic = &mut self.traffic;
            match self.stalls.during(|| traffic.wait_loaded()) {
                Some(loaded) => self.note_loaded(loaded, scan_number)?,
                None => break,
            }
        }
        Ok(())
    }

    /// Waits until no tile is on its way to disk or from there.
    pub(super) fn end_traffic(&mut self, scan_number: u64) -> Result<()> {
        while let Some(loaded) = self.traffic.wait_loaded() {
            self.note_loaded(loaded, scan_number)?;
        }
        while let Some(saved) = self.traffic.wait_saved() {
            self.note_saved(saved);
        }
        self.cold.none_leaves();
        // Whatever it was: its tile is dirty, and will be sent again.
        self.save_error = None;
        Ok(())
    }

    /// Waits until no version of a tile is on its way to disk: an older one must not come after a newer.
    pub(super) fn end_saves_of(&mut self, index: TileIndex) {
        while self.traffic.is_saving(index) {
            let traffic = &mut self.traffic;
            if let Some(saved) = self.stalls.during(|| traffic.wait_saved()) {
                self.note_saved(saved);
            }
        }
    }

    /// Waits until every tile that was sent to disk is there.
    ///
    /// # Errors
    ///
    /// Why one of them is not.
    pub(super) fn end_saves(&mut self) -> Result<()> {
        while let Some(saved) = self.traffic.wait_saved() {
            self.note_saved(saved);
        }
        self.cold.none_leaves();
        self.save_error.take().map_or(Ok(()), Err)
    }
}

impl TileSpan {
    fn of(tiles: impl Iterator<Item = TileIndex>) -> Option<Self> {
        let spans = tiles.map(|tile| Self { min: tile.to_array(), max: tile.to_array() });
        spans.reduce(|a, b| Self {
            min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
            max: std::array::from_fn(|k| a.max[k].max(b.max[k])),
        })
    }

    /// The tiles that this span would gain by going one tile further in the direction in which it came here.
    fn ahead(self, before: &Self) -> Vec<TileIndex> {
        let doubled_center = |span: &Self, k: usize| i64::from(span.min[k]) + i64::from(span.max[k]);
        let mut ahead = Vec::new();
        for axis in 0..3 {
            let gained = match doubled_center(&self, axis).cmp(&doubled_center(before, axis)) {
                std::cmp::Ordering::Greater => self.max[axis].checked_add(1),
                std::cmp::Ordering::Less => self.min[axis].checked_sub(1),
                std::cmp::Ordering::Equal => None,
            };
            let Some(gained) = gained else { continue };
            let (mut min, mut max) = (self.min, self.max);
            (min[axis], max[axis]) = (gained, gained);
            for x in min[0]..=max[0] {
                for y in min[1]..=max[1] {
                    for z in min[2]..=max[2] {
                        if ahead.len() == MOST_AHEAD {
                            return ahead;
                        }
                        ahead.push(TileIndex::new(x, y, z));
                    }
                }
            }
        }
        ahead
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_ahead_is_one_tile_further_in_the_direction_of_travel() {
        let span = |min, max| TileSpan { min, max };
        let before = span([0, 0, 0], [2, 1, 0]);
        assert_eq!(before.ahead(&before), []);
        let east = span([1, 0, 0], [3, 1, 0]);
        assert_eq!(east.ahead(&before), [TileIndex::new(4, 0, 0), TileIndex::new(4, 1, 0)]);
        let down = span([0, 0, -1], [2, 0, 0]);
        let below: Vec<_> = (0..3).map(|x| TileIndex::new(x, 0, -2)).collect();
        // Down, and south as well: the center moved by half a tile.
        let south = (0..3).flat_map(|x| [-1, 0].map(|z| TileIndex::new(x, -1, z)));
        assert_eq!(down.ahead(&before), south.chain(below).collect::<Vec<_>>());
    }

    #[test]
    fn the_end_of_the_world_and_the_widest_scan_are_no_trouble() {
        let far = TileSpan { min: [i32::MAX - 1; 3], max: [i32::MAX; 3] };
        let near = TileSpan { min: [0; 3], max: [1; 3] };
        assert_eq!(far.ahead(&near), []);
        let wide = TileSpan { min: [-500; 3], max: [500; 3] };
        assert_eq!(wide.ahead(&near).len(), MOST_AHEAD);
    }
}
