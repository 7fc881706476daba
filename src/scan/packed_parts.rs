use super::tile_order::in_order_of_tiles;
use super::updates::{ScanUpdates, TileUpdates};
use super::{PackedUpdates, ScanReport};
use crate::space::{Grid, TileIndex};
use rustc_hash::FxHashMap;

/// The updates of one scan, put together from parts of different voxels, packed.
#[derive(Debug, Default)]
pub(super) struct PackedParts {
    tiles: FxHashMap<TileIndex, PackedUpdates>,
    report: Option<ScanReport>,
}

impl PackedParts {
    pub(super) fn add(&mut self, updates: ScanUpdates) {
        for (tile, updates) in &updates.tiles {
            self.tiles.entry(*tile).or_default().push(updates);
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

    pub(super) fn into_updates(self, grid: &Grid) -> ScanUpdates {
        let tiles =
            self.tiles.into_iter().map(|(tile, updates)| (tile, TileUpdates::Packed(updates))).collect();
        in_order_of_tiles(grid, tiles, self.report.unwrap_or_default())
    }
}
