use super::{MapStatistics, TileRef};
use crate::config::MapConfig;
use crate::error::Result;
use crate::scan::{PointBatch, Scan, ScanPoints, ScanReport};
use crate::sensor::Evidence;
use crate::space::{TileBox, TileIndex, TileSelection, VoxelIndex};
use crate::store::TileVersion;
use crate::tile::{Tile, Voxel};

/// A map of tiles. All of [`Queries`](crate::query::Queries) and [`MapQueries`](crate::query::MapQueries) use these
/// few.
///
/// Queries see whole scans, unsaved ones too.
///
/// Other crates may implement it, for maps that wrap another one: to stop it, to count what is asked, to choose between
/// two. Tiles come from the map inside. A method with a default is answered by the others; pass it on where the map
/// inside knows a faster answer.
pub trait MapView: Sync {
    /// How the map is made.
    fn config(&self) -> &MapConfig;

    /// Number of the last scan or batch in the map; 0 for none.
    fn scan_number(&self) -> u64;

    /// The tiles in which something was observed, ordered by x, then y, then z.
    fn tile_indices(&self) -> Vec<TileIndex>;

    /// A box around all tiles in which something was observed, and perhaps some more; `None` for an empty map. Its cost
    /// does not depend on the number of tiles.
    fn tile_bounds(&self) -> Option<TileBox>;

    /// Whether something was observed in a tile. Its cost does not depend on the number of tiles.
    fn has_tile(&self, index: TileIndex) -> bool;

    /// A box of tiles around this one in which nothing was observed, where the map knows one. Its cost does not depend
    /// on the number of tiles.
    fn empty_around(&self, index: TileIndex) -> Option<TileBox> {
        let _ = index;
        None
    }

    /// The tiles held in memory, ordered likewise.
    fn cached_tile_indices(&self) -> Vec<TileIndex>;

    /// A tile; `None` if nothing was observed in it. It stays in memory while the returned value lives, and may
    /// push out others.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read, or one pushed out that cannot be written.
    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>>;

    /// The same for work on the whole map: what is read for it leaves memory with the returned value, and the
    /// tiles in memory stay.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read.
    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>>;

    /// The observed voxels of a tile whose log-odds are at least `from`, in Morton order; what is read for it leaves
    /// memory as with [`MapView::tile_uncached`].
    ///
    /// # Errors
    ///
    /// A tile that cannot be read.
    fn voxels_from(&self, index: TileIndex, from: f64) -> Result<Vec<Voxel>> {
        let tile = self.tile_uncached(index)?;
        Ok(tile.map_or(Vec::new(), |tile| tile.voxels_from(from).collect()))
    }

    /// The evidence of a voxel; `None` if it was never observed.
    ///
    /// # Errors
    ///
    /// As for [`MapView::tile`].
    fn evidence(&self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        let tile = self.tile(self.config().grid.tile_of_voxel(voxel))?;
        Ok(tile.and_then(|tile| tile.evidence(voxel)))
    }

    /// A tile, or an empty one if nothing was observed in it, where all tiles stay in memory: then looking one up is
    /// cheaper than grouping what is asked. `None` where tiles come and go.
    #[inline]
    fn tile_at_hand(&self, index: TileIndex) -> Option<&Tile> {
        let _ = index;
        None
    }

    /// About how many voxels were observed in a tile, where that is known without reading it.
    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64>;

    /// The committed version of a tile, where the map knows it without reading the tile: maps on disk that are open to
    /// be read.
    fn version_of_tile(&self, index: TileIndex) -> Option<TileVersion> {
        let _ = index;
        None
    }

    /// Number of the last scan that the map had taken when a tile was last flushed, where that is known without reading
    /// it.
    fn last_scan_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.version_of_tile(index).map(|version| version.scan_number)
    }

    /// Sizes of the map and of what is in memory.
    fn statistics(&self) -> MapStatistics;

    /// All tiles, in the order of [`MapView::tile_indices`] and in constant memory.
    fn tiles(&self) -> impl Iterator<Item = Result<TileRef<'_>>>
    where
        Self: Sized,
    {
        self.tile_indices().into_iter().filter_map(|index| self.tile_uncached(index).transpose())
    }
}

/// A map that takes scans.
///
/// An accepted call gets the next scan number. After an error the map is as it was before the call, and the number
/// is not used.
pub trait Mapper: MapView + Send {
    /// Adds a scan: rays from its origin to its points, wherever these lie: borrowed
    /// ([`ScanRef`](crate::scan::ScanRef)), in a file (`StoredScan` of `voxtile-formats`), or in a [`Scan`].
    ///
    /// # Errors
    ///
    /// An origin without a voxel, intensities that are missing or not one a point, points that cannot be read, a tile
    /// that cannot be read or written.
    fn insert_points(&mut self, scan: &dyn ScanPoints) -> Result<ScanReport>;

    /// Adds what a scan says about some tiles: these are afterwards as after [`Mapper::insert_points`], to the bit, and
    /// all others as before. Rays are cut before they are walked, so it costs what the tiles cost. The report counts
    /// all points, but only the updates of these tiles.
    ///
    /// # Errors
    ///
    /// As for [`Mapper::insert_points`].
    fn insert_points_in(&mut self, scan: &dyn ScanPoints, tiles: &TileSelection) -> Result<ScanReport>;

    /// Adds scans in order: the map is as after [`Mapper::insert_points`] of one after the other, to the bit. Scans
    /// that are at hand together go to the cores one each, which takes less time than to divide each among all cores.
    /// Each accepted scan adds its report.
    ///
    /// # Errors
    ///
    /// As for [`Mapper::insert_points`]. Scans before the one that failed are in the map, and have their reports.
    fn insert_all(&mut self, scans: &[&dyn ScanPoints], reports: &mut Vec<ScanReport>) -> Result<()> {
        for scan in scans {
            reports.push(self.insert_points(*scan)?);
        }
        Ok(())
    }

    /// [`Mapper::insert_points`] for a [`Scan`].
    ///
    /// # Errors
    ///
    /// As for [`Mapper::insert_points`].
    fn insert_scan(&mut self, scan: &Scan) -> Result<ScanReport> {
        self.insert_points(scan)
    }

    /// Adds observations of single points, without rays, in order.
    ///
    /// # Errors
    ///
    /// Lists of different lengths, missing intensities, a tile that cannot be read or written.
    fn batch_update(&mut self, batch: &PointBatch<'_>) -> Result<ScanReport>;

    /// Makes everything so far durable, as a whole; nothing to do for a map in memory.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read or written. Nothing is lost then: the call can be repeated.
    fn flush(&mut self) -> Result<()>;

    /// Brings the octree of every tile in memory up to date, which queries do not need.
    fn sync_octrees(&mut self);
}
