use super::tile_order::in_order_of_tiles;
use super::updates::{ScanUpdates, TileUpdates};
use super::{PackedUpdates, ScanReport};
use crate::space::{Grid, TileIndex};
use rustc_hash::{FxHashMap, FxHashSet};

/// The updates of one scan, put together from parts of different voxels, packed.
#[derive(Debug, Default)]
pub(super) struct PackedParts {
    tiles: FxHashMap<TileIndex, PackedUpdates>,
    bytes: usize,
    /// Tiles whose updates were taken already.
    taken: FxHashSet<TileIndex>,
    report: Option<ScanReport>,
}

/// What a tile takes beside its updates: its place in the table, which may be half empty.
const SLOT_BYTES: usize = 2 * size_of::<(TileIndex, PackedUpdates)>();

impl PackedParts {
    pub(super) fn add(&mut self, updates: ScanUpdates) {
        for (tile, updates) in &updates.tiles {
            let packed = self.tiles.entry(*tile).or_insert_with(|| {
                self.bytes += SLOT_BYTES;
                PackedUpdates::default()
            });
            let before = packed.bytes();
            packed.push(updates);
            self.bytes += packed.bytes() - before;
        }
        // Every part has seen all points.
        match &mut self.report {
            None => self.report = Some(updates.report),
            Some(report) => {
                report.hits += updates.report.hits;
                report.misses += updates.report.misses;
            }
        }
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The updates so far, of which nothing stays here, in the order of tiles.
    pub(super) fn take(&mut self) -> Vec<(TileIndex, PackedUpdates)> {
        self.bytes = 0;
        let mut tiles: Vec<_> = std::mem::take(&mut self.tiles).into_iter().collect();
        tiles.sort_unstable_by_key(|(tile, _)| *tile);
        self.taken.extend(tiles.iter().map(|(tile, _)| *tile));
        tiles
    }

    pub(super) fn into_updates(self, grid: &Grid) -> ScanUpdates {
        let only_taken = self.taken.iter().filter(|tile| !self.tiles.contains_key(tile)).count() as u64;
        let tiles =
            self.tiles.into_iter().map(|(tile, updates)| (tile, TileUpdates::Packed(updates))).collect();
        let mut updates = in_order_of_tiles(grid, tiles, self.report.unwrap_or_default());
        updates.report.tiles_touched += only_taken;
        updates
    }
}
