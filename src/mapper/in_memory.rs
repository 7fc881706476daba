use super::trace::trace;
use super::{MapStatistics, MapView, Mapper, TileRef};
use crate::config::MapConfig;
use crate::error::Result;
use crate::scan::{PointBatch, Scan, ScanReport, ScanTracer, ScanUpdates, TileUpdates};
use crate::space::TileIndex;
use crate::tile::{OctreeFactory, Tile};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// A map that lives in memory and ends with it. It has tiles too, and gives the answers of an
/// [`OutOfCoreTileMapper`](super::OutOfCoreTileMapper) to the bit.
#[derive(Debug)]
pub struct InMemoryMapper {
    config: MapConfig,
    /// Boxed, so that those a scan touches can be taken out, changed at the same time, and put back.
    tiles: FxHashMap<TileIndex, Box<Tile>>,
    /// After the tiles: what is in flight to octrees goes with these, and need not be written any more.
    octrees: OctreeFactory,
    tracer: ScanTracer,
    scan_number: u64,
}

impl InMemoryMapper {
    /// An empty map.
    ///
    /// # Errors
    ///
    /// The first argument of the configuration that is wrong.
    pub fn new(config: MapConfig) -> Result<Self> {
        let config = config.validated()?;
        let octrees = OctreeFactory::new(config.octree);
        let (tiles, tracer) = Default::default();
        Ok(Self { config, tiles, octrees, tracer, scan_number: 0 })
    }

    fn accept(&mut self, updates: ScanUpdates) -> ScanReport {
        let take_out = |(index, updates): (TileIndex, TileUpdates)| {
            let tile = self.tiles.remove(&index);
            (tile.unwrap_or_else(|| Box::new(Tile::empty(&self.config.grid, &self.octrees, index))), updates)
        };
        let mut touched: Vec<(Box<Tile>, TileUpdates)> = updates.tiles.into_iter().map(take_out).collect();
        let model = &self.config.sensor_model;
        touched.par_iter_mut().for_each(|(tile, updates)| tile.apply(model, updates));
        self.tiles.extend(touched.into_iter().map(|(tile, _)| (tile.index(), tile)));
        self.scan_number += 1;
        updates.report
    }
}

impl MapView for InMemoryMapper {
    fn config(&self) -> &MapConfig {
        &self.config
    }

    fn scan_number(&self) -> u64 {
        self.scan_number
    }

    fn tile_indices(&self) -> Vec<TileIndex> {
        let mut indices: Vec<_> = self.tiles.keys().copied().collect();
        indices.sort_unstable();
        indices
    }

    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        self.tile_indices()
    }

    #[inline]
    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        Ok(self.tiles.get(&index).map(|tile| TileRef::borrowed(tile)))
    }

    fn tile_in_passing(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        self.tile(index)
    }

    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.tiles.get(&index).map(|tile| tile.table().len() as u64)
    }

    fn statistics(&self) -> MapStatistics {
        let tiles = self.tiles.len() as u64;
        let mut statistics = MapStatistics {
            scan_number: self.scan_number,
            tiles,
            cached_tiles: tiles,
            dirty_tiles: tiles,
            octrees: self.octrees.statistics(),
            ..MapStatistics::default()
        };
        self.tiles.values().for_each(|tile| statistics.cached += tile.counts());
        statistics
    }
}

impl Mapper for InMemoryMapper {
    fn insert_scan(&mut self, scan: &Scan) -> Result<ScanReport> {
        let updates = trace(&mut self.tracer, &self.config, scan)?;
        Ok(self.accept(updates))
    }

    fn batch_update(&mut self, batch: &PointBatch<'_>) -> Result<ScanReport> {
        let updates = batch.updates(&self.config.grid, &self.config.sensor_model)?;
        Ok(self.accept(updates))
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }

    fn sync_octrees(&mut self) {
        self.tiles.par_iter_mut().for_each(|(_, tile)| tile.sync_octree());
    }
}
