use super::{MapStatistics, TileRef};
use crate::config::MapConfig;
use crate::error::Result;
use crate::scan::{PointBatch, Scan, ScanPoints, ScanReport};
use crate::sensor::Evidence;
use crate::space::{TileBox, TileIndex, TileSelection, VoxelIndex};
use crate::store::TileVersion;
use crate::tile::{Tile, Voxel};

/// Read access to a map of tiles, on which [`Queries`](crate::query::Queries) and
/// [`MapQueries`](crate::query::MapQueries) are built.
///
/// Queries see the map as of one scan, including unsaved changes.
///
/// Other crates may implement it for wrappers of a map, for example to stop queries, to count accesses or to choose
/// between two maps. The inner map provides the tiles. Methods with a default use the other methods; forward them if
/// the inner map has a faster implementation.
pub trait MapView: Sync {
    /// Configuration of the map.
    fn config(&self) -> &MapConfig;

    /// Number of the last scan or batch in the map; 0 if there is none.
    fn scan_number(&self) -> u64;

    /// The tiles that contain observations, ordered by x, then y, then z.
    fn tile_indices(&self) -> Vec<TileIndex>;

    /// A box that contains all tiles with observations, and may be larger; `None` for an empty map. The cost does not
    /// depend on the number of tiles.
    fn tile_bounds(&self) -> Option<TileBox>;

    /// Returns whether a tile contains observations. The cost does not depend on the number of tiles.
    fn has_tile(&self, index: TileIndex) -> bool;

    /// A box of tiles that contains this tile and no observations, if the map knows one. The cost does not depend on
    /// the number of tiles.
    fn empty_around(&self, index: TileIndex) -> Option<TileBox> {
        let _ = index;
        None
    }

    /// The tiles that are in memory, in the order of [`MapView::tile_indices`].
    fn cached_tile_indices(&self) -> Vec<TileIndex>;

    /// Returns a tile; `None` if it contains no observations. It remains in memory while the returned value exists, and
    /// may evict others.
    ///
    /// # Errors
    ///
    /// Fails if the tile cannot be read, or an evicted one cannot be written.
    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>>;

    /// Like [`MapView::tile`], for operations on the whole map: the tile is not cached and evicts no others.
    ///
    /// # Errors
    ///
    /// Fails if the tile cannot be read.
    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>>;

    /// Returns the observed voxels of a tile whose log-odds are at least `from`, in Morton order, without caching the
    /// tile.
    ///
    /// # Errors
    ///
    /// Fails if the tile cannot be read.
    fn voxels_from(&self, index: TileIndex, from: f64) -> Result<Vec<Voxel>> {
        let tile = self.tile_uncached(index)?;
        Ok(tile.map_or(Vec::new(), |tile| tile.voxels_from(from).collect()))
    }

    /// Returns the evidence of a voxel; `None` if it was never observed.
    ///
    /// # Errors
    ///
    /// Same errors as [`MapView::tile`].
    fn evidence(&self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        let tile = self.tile(self.config().grid.tile_of_voxel(voxel))?;
        Ok(tile.and_then(|tile| tile.evidence(voxel)))
    }

    /// Returns a tile of a map whose tiles are all permanently in memory, or an empty tile if it contains no
    /// observations. Callers then look up each tile, which is cheaper than grouping queries by tile. `None` for other
    /// maps.
    #[inline]
    fn resident_tile(&self, index: TileIndex) -> Option<&Tile> {
        let _ = index;
        None
    }

    /// Approximate number of observed voxels in a tile, if known without reading it.
    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64>;

    /// Committed version of a tile, known without reading the tile. `None` except for maps on disk that were opened for
    /// reading.
    fn version_of_tile(&self, index: TileIndex) -> Option<TileVersion> {
        let _ = index;
        None
    }

    /// Number of the last scan in the map when a tile was last flushed, if known without reading the tile.
    fn last_scan_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.version_of_tile(index).map(|version| version.scan_number)
    }

    /// Sizes of the map and of its content in memory.
    fn statistics(&self) -> MapStatistics;

    /// Iterates over all tiles in the order of [`MapView::tile_indices`], in constant memory.
    fn tiles(&self) -> impl Iterator<Item = Result<TileRef<'_>>>
    where
        Self: Sized,
    {
        self.tile_indices().into_iter().filter_map(|index| self.tile_uncached(index).transpose())
    }
}

/// Map that scans can be inserted into.
///
/// Each accepted call uses the next scan number. After an error the map is the same as before the call, and the number
/// is not used.
pub trait Mapper: MapView + Send {
    /// Inserts a scan: rays from its origin to its points. The points may be borrowed
    /// ([`ScanRef`](crate::scan::ScanRef)), in a file (`StoredScan` of `voxtile-formats`), or in a [`Scan`].
    ///
    /// # Errors
    ///
    /// Fails if the origin is outside of the map's space, intensities are missing or differ in number from the points,
    /// or points or tiles cannot be read or written.
    fn insert_points(&mut self, scan: &dyn ScanPoints) -> Result<ScanReport>;

    /// Inserts the part of a scan that is within some tiles. These tiles are afterwards bit-identical to those after
    /// [`Mapper::insert_points`]; all others are unchanged. Rays are clipped to the tiles before they are traced, so
    /// the cost depends on the tiles. The report counts all points, but only the updates of these tiles.
    ///
    /// # Errors
    ///
    /// Same errors as [`Mapper::insert_points`].
    fn insert_points_in(&mut self, scan: &dyn ScanPoints, tiles: &TileSelection) -> Result<ScanReport>;

    /// Inserts scans in order. The map is bit-identical to that after inserting them one by one. Scans that are passed
    /// together are traced one per core, which is faster than dividing each scan among all cores. The report of each
    /// accepted scan is appended to `reports`.
    ///
    /// # Errors
    ///
    /// Same errors as [`Mapper::insert_points`]. Scans before the failed one are in the map, and have reports.
    fn insert_all(&mut self, scans: &[&dyn ScanPoints], reports: &mut Vec<ScanReport>) -> Result<()> {
        for scan in scans {
            reports.push(self.insert_points(*scan)?);
        }
        Ok(())
    }

    /// Like [`Mapper::insert_points`], for a [`Scan`].
    ///
    /// # Errors
    ///
    /// Same errors as [`Mapper::insert_points`].
    fn insert_scan(&mut self, scan: &Scan) -> Result<ScanReport> {
        self.insert_points(scan)
    }

    /// Inserts observations of single points, without rays, in order.
    ///
    /// # Errors
    ///
    /// Fails if lists differ in length, intensities are missing, or a tile cannot be read or written.
    fn batch_update(&mut self, batch: &PointBatch<'_>) -> Result<ScanReport>;

    /// Makes all changes so far durable, atomically. Has no effect for a map in memory.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read or written. No data are lost then, and the call can be repeated.
    fn flush(&mut self) -> Result<()>;

    /// Updates the octrees of all tiles in memory. Queries do not need this.
    fn sync_octrees(&mut self);
}
