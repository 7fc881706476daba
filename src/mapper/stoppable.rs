use super::{MapStatistics, MapView, TileRef};
use crate::config::MapConfig;
use crate::error::Result;
use crate::scan::Stop;
use crate::sensor::Evidence;
use crate::space::{TileBox, TileIndex, VoxelIndex};
use crate::store::TileVersion;
use crate::tile::{Tile, Voxel};

/// Map whose queries can be stopped. Once the stop flag is raised, each access to a tile fails with
/// [`Error::Stopped`](crate::Error::Stopped), which ends the query.
#[derive(Debug)]
pub struct Stoppable<'a, V: ?Sized> {
    view: &'a V,
    stop: &'a Stop,
}

impl<'a, V: MapView + ?Sized> Stoppable<'a, V> {
    /// Wraps a map.
    pub fn new(view: &'a V, stop: &'a Stop) -> Self {
        Self { view, stop }
    }
}

impl<V: MapView + ?Sized> MapView for Stoppable<'_, V> {
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

    fn empty_around(&self, index: TileIndex) -> Option<TileBox> {
        self.view.empty_around(index)
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

    fn voxels_from(&self, index: TileIndex, from: f64) -> Result<Vec<Voxel>> {
        self.stop.check()?;
        self.view.voxels_from(index, from)
    }

    // The flag is not checked for single points: callers with many points check it between them.
    fn evidence(&self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        self.view.evidence(voxel)
    }

    // The flag is not checked: callers check it between look-ups.
    fn resident_tile(&self, index: TileIndex) -> Option<&Tile> {
        self.view.resident_tile(index)
    }

    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.view.voxels_of_tile_hint(index)
    }

    fn version_of_tile(&self, index: TileIndex) -> Option<TileVersion> {
        self.view.version_of_tile(index)
    }

    fn last_scan_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.view.last_scan_of_tile_hint(index)
    }

    fn statistics(&self) -> MapStatistics {
        self.view.statistics()
    }
}
