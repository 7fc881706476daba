//! A map that can be asked until somebody wants it to stop.

use voxtile::mapper::{MapStatistics, MapView, TileRef};
use voxtile::sensor::Evidence;
use voxtile::space::TileBox;
use voxtile::{MapConfig, Result, Stop, TileIndex, VoxelIndex};

/// Whatever is asked ends at the next tile once the stop is set.
pub struct Stoppable<'a> {
    pub view: &'a dyn MapView,
    pub stop: &'a Stop,
}

impl MapView for Stoppable<'_> {
    fn config(&self) -> &MapConfig {
        self.view.config()
    }

    fn scan_number(&self) -> u64 {
        self.view.scan_number()
    }

    fn tile_indices(&self) -> Vec<TileIndex> {
        self.view.tile_indices()
    }

    fn tile_bounds(&self) -> Option<TileBox> {
        self.view.tile_bounds()
    }

    fn has_tile(&self, index: TileIndex) -> bool {
        self.view.has_tile(index)
    }

    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        self.view.cached_tile_indices()
    }

    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        self.stop.check()?;
        self.view.tile(index)
    }

    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        self.stop.check()?;
        self.view.tile_uncached(index)
    }

    fn evidence(&self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        self.view.evidence(voxel)
    }

    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.view.voxels_of_tile_hint(index)
    }

    fn last_scan_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.view.last_scan_of_tile_hint(index)
    }

    fn statistics(&self) -> MapStatistics {
        self.view.statistics()
    }
}
