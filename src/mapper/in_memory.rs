use super::tile_map::TileMap;
use super::trace_rules::trace_rules;
use super::{MapStatistics, MapView, Mapper, TileRef};
use crate::config::MapConfig;
use crate::error::Result;
use crate::scan::{PointBatch, ScanPoints, ScanReport, ScanTracer, ScanUpdates, TileUpdates};
use crate::sensor::Evidence;
use crate::space::{TileBox, TileIndex, TileSelection, VoxelIndex};
use crate::tile::{OctreeFactory, Tile};
use rayon::prelude::*;

/// Map that is kept in memory only. It is divided into tiles. Its answers are bit-identical to those of an
/// [`OutOfCoreTileMapper`](super::OutOfCoreTileMapper).
///
/// ```
/// use voxtile::{InMemoryMapper, MapConfig, Mapper, Queries, Scan};
///
/// # fn main() -> voxtile::Result<()> {
/// let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0)?)?;
/// map.insert_scan(&Scan { origin: [0.0; 3], points: vec![[4.0, 0.0, 0.0]], intensities: None })?;
/// let nearest = map.nearest_occupied([3.0, 0.0, 0.0], 5.0)?;
/// assert_eq!(nearest.map(|hit| hit.voxel), Some([40, 0, 0]));
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct InMemoryMapper {
    config: MapConfig,
    tiles: TileMap,
    /// Declared after `tiles`, so that the tiles are dropped first and discard updates still queued for octrees.
    octrees: OctreeFactory,
    tracer: ScanTracer,
    scan_number: u64,
}

impl InMemoryMapper {
    /// Creates an empty map.
    ///
    /// # Errors
    ///
    /// Fails with the first invalid argument of the configuration.
    pub fn new(config: MapConfig) -> Result<Self> {
        let config = config.validated()?;
        let tiles = TileMap::new(&config.grid);
        let octrees = OctreeFactory::new(config.octree);
        Ok(Self { config, tiles, octrees, tracer: ScanTracer::default(), scan_number: 0 })
    }

    fn accept(&mut self, updates: ScanUpdates) -> ScanReport {
        let mut updates_of: Vec<(usize, TileUpdates)> = Vec::with_capacity(updates.tiles.len());
        for (index, updates) in updates.tiles {
            updates_of.push((self.tiles.number_of(&self.config.grid, &self.octrees, index), updates));
        }
        updates_of.sort_unstable_by_key(|&(number, _)| number);
        let mut updates_of = updates_of.into_iter().peekable();
        let of_tile = |(number, tile)| updates_of.next_if(|next| next.0 == number).map(|(_, u)| (tile, u));
        let touched: Vec<(&mut Tile, TileUpdates)> =
            self.tiles.tiles_mut().iter_mut().enumerate().filter_map(of_tile).collect();
        let model = &self.config.sensor_model;
        touched.into_par_iter().for_each(|(tile, updates)| tile.apply(model, &updates));
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
        let mut indices: Vec<_> = self.tiles.tiles().iter().map(Tile::index).collect();
        indices.sort_unstable();
        indices
    }

    fn tile_bounds(&self) -> Option<TileBox> {
        self.tiles.space().bounds()
    }

    fn empty_around(&self, index: TileIndex) -> Option<TileBox> {
        self.tiles.space().empty_around(index)
    }

    fn has_tile(&self, index: TileIndex) -> bool {
        self.tiles.get(index).is_some()
    }

    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        self.tile_indices()
    }

    #[inline]
    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        Ok(self.tiles.get(index).map(TileRef::borrowed))
    }

    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        self.tile(index)
    }

    #[inline]
    fn evidence(&self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        let index = self.config.grid.tile_of_voxel(voxel);
        Ok(self.tiles.get_or_nothing(index).evidence_of_own(voxel))
    }

    #[inline]
    fn resident_tile(&self, index: TileIndex) -> Option<&Tile> {
        Some(self.tiles.get_or_nothing(index))
    }

    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.tiles.get(index).map(|tile| tile.table().len() as u64)
    }

    fn statistics(&self) -> MapStatistics {
        let tiles = self.tiles.tiles().len() as u64;
        let mut statistics = MapStatistics {
            scan_number: self.scan_number,
            tiles,
            cached_tiles: tiles,
            dirty_tiles: tiles,
            octrees: self.octrees.statistics(),
            ..MapStatistics::default()
        };
        self.tiles.tiles().iter().for_each(|tile| statistics.cached += tile.counts());
        statistics
    }
}

impl Mapper for InMemoryMapper {
    fn insert_points(&mut self, scan: &dyn ScanPoints) -> Result<ScanReport> {
        let updates = self.tracer.trace_points(trace_rules(&self.config, None), scan, None)?;
        Ok(self.accept(updates))
    }

    fn insert_all(&mut self, scans: &[&dyn ScanPoints], reports: &mut Vec<ScanReport>) -> Result<()> {
        for some in scans.chunks(self.tracer.max_concurrent(scans.len())) {
            let traced = self.tracer.trace_concurrently(trace_rules(&self.config, None), some);
            for (scan, updates) in some.iter().zip(traced) {
                reports.push(match updates? {
                    Some(updates) => self.accept(updates),
                    None => self.insert_points(*scan)?,
                });
            }
        }
        Ok(())
    }

    fn insert_points_in(&mut self, scan: &dyn ScanPoints, tiles: &TileSelection) -> Result<ScanReport> {
        let updates = self.tracer.trace_points(trace_rules(&self.config, Some(tiles)), scan, None)?;
        Ok(self.accept(updates))
    }

    fn batch_update(&mut self, batch: &PointBatch<'_>) -> Result<ScanReport> {
        let updates =
            batch.updates_with_layers(&self.config.grid, &self.config.sensor_model, self.config.layers())?;
        Ok(self.accept(updates))
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }

    fn sync_octrees(&mut self) {
        self.tiles.tiles_mut().par_iter_mut().for_each(Tile::sync_octree);
    }
}
