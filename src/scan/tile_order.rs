use super::ScanReport;
use super::updates::{ScanUpdates, TileUpdates};
use crate::space::{Grid, TileIndex, VoxelKey};

/// In Morton order of the tiles' lowest voxels; far apart, where the codes repeat, by index.
pub(super) fn in_order_of_tiles(
    grid: &Grid,
    mut tiles: Vec<(TileIndex, TileUpdates)>,
    mut report: ScanReport,
) -> ScanUpdates {
    tiles.sort_by_cached_key(|(tile, _)| {
        (VoxelKey::from_index(grid.voxels_of_tile(*tile).min).morton(), *tile)
    });
    report.tiles_touched = tiles.len() as u64;
    ScanUpdates { tiles, report }
}
