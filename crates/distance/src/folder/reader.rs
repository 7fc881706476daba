use super::field_folder::FieldFolder;
use super::index::{Index, IndexedTile, chunks_of};
use super::tile_file;
use super::tile_key::TileKey;
use crate::clearance::{self, Clearance};
use crate::distance::{Distance, DistanceAndGradient};
use crate::extent::Extent;
use crate::field::DistanceField;
use crate::interpolation::{Between, Scale};
use crate::line::{LANES, Line};
use crate::options::DistanceOptions;
use crate::voxel_distance::VoxelDistance;
use lru::LruCache;
use parking_lot::Mutex;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxtile::space::TileBox;
use voxtile::{Aabb, Error, Grid, Point, Result, TileIndex, VoxelIndex};

/// Field in a folder, opened for queries. The tiles in use are in memory.
///
/// If the field is updated while it is open, queries of changed tiles fail: open it again.
#[derive(Debug)]
pub struct FieldReader {
    field: FieldFolder,
    folder: PathBuf,
    grid: Grid,
    edge: usize,
    index: Index,
    tiles: FxHashMap<TileIndex, (TileKey, Option<i16>)>,
    scale: Scale,
    cache: Mutex<LruCache<TileIndex, Arc<Vec<i16>>>>,
    max_tiles: usize,
}

/// Distances of a tile.
#[derive(Clone, Debug)]
enum TileOfField {
    Uniform(VoxelDistance),
    Stored(Arc<Vec<i16>>),
}

/// Looks up tiles and keeps the last one.
struct Cursor<'a> {
    reader: &'a FieldReader,
    last: Option<(Extent, TileOfField)>,
}

impl FieldReader {
    /// Opens the field in a folder. Tiles in memory take at most `memory_bytes`, but one tile is always kept.
    ///
    /// # Errors
    ///
    /// Fails if there is no field in the folder, or its `field.json` is malformed.
    pub fn open(folder: impl Into<PathBuf>, memory_bytes: usize) -> Result<Self> {
        let folder = folder.into();
        let field = FieldFolder::new(&folder);
        let Some(mut index) = field.read_index()? else {
            let reason = "no distance field here (field.json is missing); `voxtile distance` computes one";
            return Err(Error::argument(folder.display().to_string(), reason));
        };
        let grid = index.grid()?;
        let edge = grid.voxels_per_tile_edge() as usize;
        let listed = std::mem::take(&mut index.tiles).into_iter();
        let tiles = listed.map(|IndexedTile { tile, key, uniform }| (tile.into(), (key, uniform))).collect();
        let scale = Scale::new(grid.resolution_m(), index.options().max_distance_m);
        let max_tiles = (memory_bytes / (2 * edge.pow(3))).max(1);
        let cache = Mutex::new(LruCache::unbounded());
        Ok(Self { field, folder, grid, edge, index, tiles, scale, cache, max_tiles })
    }

    /// Folder of the field.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Grid of the map.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Parameters of the field.
    pub fn options(&self) -> DistanceOptions {
        self.index.options()
    }

    /// Id of the map that the field was computed from, if it has one.
    pub fn map_id(&self) -> Option<&str> {
        self.index.map_id.as_deref()
    }

    /// Number of the last scan in the map when the field was computed.
    pub fn scan_number(&self) -> u64 {
        self.index.scan_number
    }

    /// The tiles that are stored, in order.
    pub fn tile_indices(&self) -> Vec<TileIndex> {
        let mut tiles: Vec<TileIndex> = self.tiles.keys().copied().collect();
        tiles.sort_unstable();
        tiles
    }

    /// Box around the stored tiles; `None` if there are none.
    pub fn tile_bounds(&self) -> Option<TileBox> {
        TileBox::of(self.tiles.keys().copied())
    }

    /// Damaged tiles of the map around which distances are unknown.
    pub fn damaged_map_tiles(&self) -> Vec<TileIndex> {
        self.index.damaged_map_tiles.iter().map(|&tile| tile.into()).collect()
    }

    fn tile(&self, tile: TileIndex) -> Result<TileOfField> {
        let key = match self.tiles.get(&tile) {
            Some((_, Some(uniform))) => return Ok(TileOfField::Uniform(VoxelDistance(*uniform))),
            Some((key, None)) => *key,
            None => return Ok(TileOfField::Uniform(self.index.distance_of_absent(tile))),
        };
        if let Some(found) = self.cache.lock().get(&tile) {
            return Ok(TileOfField::Stored(found.clone()));
        }
        // Read without the lock, so that other threads can use the cache.
        let bytes = self.field.read_tile(tile, self.edge, key)?;
        let malformed = |error: voxtile::FormatError| error.in_input(&self.field.tile_path(tile, key));
        let distances = Arc::new(tile_file::decode(&bytes, self.edge).map_err(malformed)?);
        let mut cache = self.cache.lock();
        cache.put(tile, distances.clone());
        while cache.len() > self.max_tiles {
            cache.pop_lru();
        }
        Ok(TileOfField::Stored(distances))
    }

    fn cursor(&self) -> Cursor<'_> {
        Cursor { reader: self, last: None }
    }

    /// Exact distance of a voxel.
    ///
    /// # Errors
    ///
    /// Fails if the tile is damaged or cannot be read.
    pub fn voxel(&self, voxel: VoxelIndex) -> Result<VoxelDistance> {
        self.cursor().voxel(voxel)
    }

    /// Returns the distance at a point, as [`DistanceField::distance_at`] does.
    ///
    /// # Errors
    ///
    /// Fails if a tile is damaged or cannot be read.
    pub fn distance_at(&self, point_m: Point) -> Result<Distance> {
        Ok(self.cursor().gradient_at(point_m)?.distance)
    }

    /// Returns the distances at many points and their gradients, in order, on all cores. Nearby points should be next to
    /// each other.
    ///
    /// # Errors
    ///
    /// Fails if a tile is damaged or cannot be read.
    pub fn distance_and_gradient_at(&self, points_m: &[Point]) -> Result<Vec<DistanceAndGradient>> {
        /// Points of a task of a core.
        const TOGETHER: usize = 1024;
        let parts = points_m.par_chunks(TOGETHER).map(|points_m| {
            let mut cursor = self.cursor();
            points_m.iter().map(|&point_m| cursor.gradient_at(point_m)).collect::<Result<Vec<_>>>()
        });
        Ok(parts.collect::<Result<Vec<_>>>()?.concat())
    }

    /// Checks a path, as [`DistanceField::clearance_along`] does.
    ///
    /// # Errors
    ///
    /// As for [`DistanceField::clearance_along`]; also fails if a tile is damaged or cannot be read.
    pub fn clearance_along(&self, path: &[Point], radius_m: f64) -> Result<Clearance> {
        let mut cursor = self.cursor();
        let (resolution_m, max_distance_m) = (self.scale.resolution_m(), self.scale.max_distance_m());
        clearance::along(path, radius_m, resolution_m, max_distance_m, |point_m| {
            Ok(cursor.gradient_at(point_m)?.distance)
        })
    }

    /// Loads the voxels whose center is in a half-open box, for queries in memory.
    ///
    /// # Errors
    ///
    /// Fails if the box has more than 2^31 voxels, or a tile is damaged or cannot be read.
    pub fn load(&self, region: &Aabb) -> Result<DistanceField> {
        let extent = Extent::of(&self.grid.voxels_in(region));
        extent.check_size()?;
        let chunks = chunks_of(extent.size[0]);
        let mut lines: Vec<Line> =
            vec![[VoxelDistance::UNKNOWN.to_bits(); LANES]; chunks * extent.size[1] * extent.size[2]];
        if let Some([min, max]) = extent.tiles(&self.grid) {
            for tile in TileBox::new(min, max).tiles() {
                self.copy_tile(tile, extent, lines.as_flattened_mut())?;
            }
        }
        Ok(DistanceField::of_lines(self.grid, self.options(), extent, lines))
    }

    /// Copies the part of a tile that is in a box.
    fn copy_tile(&self, tile: TileIndex, extent: Extent, out: &mut [i16]) -> Result<()> {
        let of_tile = Extent::of(&self.grid.voxels_of_tile(tile));
        let voxels = self.grid.voxels_of_tile(tile).intersection(&extent.voxels());
        let part = Extent::of(&voxels);
        let distances = self.tile(tile)?;
        let offset = |outer: &Extent, k: usize| (part.min[k] - outer.min[k]) as usize;
        let row_lanes = chunks_of(extent.size[0]) * LANES;
        for z in 0..part.size[2] {
            for y in 0..part.size[1] {
                let row = (offset(&extent, 1) + y) * extent.size[2] + offset(&extent, 2) + z;
                let first = row * row_lanes + offset(&extent, 0);
                let out = &mut out[first..first + part.size[0]];
                match &distances {
                    TileOfField::Uniform(distance) => out.fill(distance.to_bits()),
                    TileOfField::Stored(distances) => {
                        let row = (offset(&of_tile, 2) + z) * self.edge + offset(&of_tile, 1) + y;
                        let first = row * self.edge + offset(&of_tile, 0);
                        out.copy_from_slice(&distances[first..first + part.size[0]]);
                    }
                }
            }
        }
        Ok(())
    }
}

impl Cursor<'_> {
    fn voxel(&mut self, voxel: VoxelIndex) -> Result<VoxelDistance> {
        let edge = self.reader.edge;
        let place = match &self.last {
            Some((extent, _)) => extent.place_of(voxel),
            None => None,
        };
        let place = match place {
            Some(place) => place,
            None => {
                let tile = self.reader.grid.tile_of_voxel(voxel);
                let extent = Extent::of(&self.reader.grid.voxels_of_tile(tile));
                self.last = Some((extent, self.reader.tile(tile)?));
                extent.place_of(voxel).unwrap_or_default()
            }
        };
        Ok(match &self.last {
            Some((_, TileOfField::Uniform(distance))) => *distance,
            Some((_, TileOfField::Stored(distances))) => {
                VoxelDistance(distances[(place[2] * edge + place[1]) * edge + place[0]])
            }
            None => VoxelDistance::UNKNOWN,
        })
    }

    fn gradient_at(&mut self, point_m: Point) -> Result<DistanceAndGradient> {
        let unknown = DistanceAndGradient { distance: Distance::Unknown, gradient: [0.0; 3] };
        let Some(between) = Between::of(&self.reader.grid, point_m) else { return Ok(unknown) };
        let mut corners = [VoxelDistance::UNKNOWN; 8];
        for (number, corner) in corners.iter_mut().enumerate() {
            let step = |k: usize| between.lowest[k].saturating_add((number >> k & 1) as i32);
            *corner = self.voxel([step(0), step(1), step(2)])?;
        }
        Ok(between.interpolate(corners, &self.reader.scale))
    }
}
