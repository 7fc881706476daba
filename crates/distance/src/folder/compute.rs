use super::boxes::boxes_of;
use super::damage::make_unknown;
use super::field_disk::{FieldDisk, FsDisk};
use super::field_folder::FieldFolder;
use super::index::{Index, IndexedTile, chunks_of, distance_of_absent};
use super::tile_cache::TileCache;
use super::tile_file;
use super::tile_key::{TileKey, TileKeys};
use super::wanted::{may_have_obstacles, wanted_tiles};
use crate::cap::Cap;
use crate::extent::Extent;
use crate::line::{LANES, Line};
use crate::observed::Observed;
use crate::options::{DistanceOptions, UnknownRule};
use crate::solve::Solver;
use crate::tiles_of_map::tiles_in;
use crate::voxel_distance::BEYOND;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;
use voxtile::mapper::MapView;
use voxtile::scan::Stop;
use voxtile::space::{TileBox, VoxelBox};
use voxtile::{Aabb, Error, Result, TileIndex};

/// Options of [`compute_field`].
#[derive(Clone, Debug)]
#[non_exhaustive]
#[must_use]
pub struct FieldOptions {
    /// Parameters of the distances.
    pub distances: DistanceOptions,
    /// Box in metres: only tiles that overlap it are computed. Default: all.
    pub region: Option<Aabb>,
    /// Bytes of memory, but at least what one tile needs. Default: 256 MiB.
    pub memory_bytes: usize,
    /// Id of the map, stored in the field.
    pub map_id: Option<String>,
    /// Stops the computation. Tiles that were computed until then are kept for the next call.
    pub stop: Stop,
}

impl Default for FieldOptions {
    fn default() -> Self {
        Self {
            distances: DistanceOptions::default(),
            region: None,
            memory_bytes: 256 << 20,
            map_id: None,
            stop: Stop::default(),
        }
    }
}

impl FieldOptions {
    /// Creates the default options with these parameters of the distances.
    pub fn new(distances: DistanceOptions) -> Self {
        Self { distances, ..Self::default() }
    }

    /// Sets the box in metres whose tiles are computed.
    pub fn with_region(self, region: impl Into<Option<Aabb>>) -> Self {
        Self { region: region.into(), ..self }
    }

    /// Sets the bytes of memory.
    pub fn with_memory(self, memory_bytes: usize) -> Self {
        Self { memory_bytes, ..self }
    }

    /// Sets the id of the map, which is stored in the field.
    pub fn with_map_id(self, map_id: impl Into<Option<String>>) -> Self {
        Self { map_id: map_id.into(), ..self }
    }

    /// Sets what stops the computation.
    pub fn with_stop(self, stop: Stop) -> Self {
        Self { stop, ..self }
    }
}

/// Result of [`compute_field`].
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FieldReport {
    /// Number of tiles of the field.
    pub tiles: u64,
    /// Number of tiles that were computed.
    pub tiles_computed: u64,
    /// Number of tiles that were kept, because nothing within the cap has changed.
    pub tiles_kept: u64,
    /// Number of voxels of the computed tiles.
    pub voxels_computed: u64,
    /// Whether any tile of the map may have obstacles. If not, all distances are beyond the cap or unknown.
    pub has_obstacles: bool,
    /// Damaged tiles of the map, around which distances are unknown, each with the problem.
    pub damaged_map_tiles: Vec<String>,
    /// Damaged tiles of the earlier field, which were computed again, each with the problem.
    pub damaged_field_tiles: Vec<String>,
}

/// Computes the field of a map in a folder, or updates it: only tiles are computed for which the map has changed within
/// the cap. The result does not depend on the memory, the threads, or earlier calls.
///
/// `progress` receives the number of computed tiles, and of those to compute. It is called by several threads.
///
/// The folder remains a complete field at any time: if the call fails or is stopped, it has the earlier one.
///
/// ```
/// use voxtile::{MapOptions, MapReader, Mapper, Scan};
/// use voxtile_distance::{DistanceOptions, FieldOptions, FieldReader, UnknownRule, compute_field};
///
/// # fn main() -> voxtile::Result<()> {
/// # let folder = tempfile::tempdir().unwrap();
/// # let (map_folder, field_folder) = (folder.path().join("map"), folder.path().join("field"));
/// let mut map = MapOptions::new().create_if_missing(true).open(&map_folder)?;
/// map.insert_scan(&Scan { points: vec![[4.05, 0.05, 0.05]], ..Scan::default() })?;
/// map.flush()?;
/// let map = MapReader::open(&map_folder, 64 << 20)?;
/// let options = FieldOptions::new(DistanceOptions::new(1.0).with_unknown(UnknownRule::Free));
/// let report = compute_field(&map, &field_folder, &options, &|_, _| {})?;
/// let field = FieldReader::open(&field_folder, 64 << 20)?;
/// assert_eq!(field.voxel([45, 0, 0])?.squared_voxels(), Some(25));
/// assert_eq!(compute_field(&map, &field_folder, &options, &|_, _| {})?.tiles_kept, report.tiles);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
///
/// Fails if the cap is invalid, the folder has other content or is in a map, another process writes it, a tile of the
/// map cannot be read for other reasons than damage, with an I/O error, or with [`Error::Stopped`].
pub fn compute_field<V: MapView>(
    map: &V,
    folder: &Path,
    options: &FieldOptions,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<FieldReport> {
    compute_field_on(Arc::new(FsDisk), map, folder, options, progress)
}

/// As [`compute_field`], with other operations on files.
pub(super) fn compute_field_on<V: MapView>(
    disk: Arc<dyn FieldDisk>,
    map: &V,
    folder: &Path,
    options: &FieldOptions,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<FieldReport> {
    let grid = map.config().grid;
    let distances = options.distances;
    let cap = Cap::of(distances.max_distance_m, grid.resolution_m())?;
    let region = region_of(map, options)?;
    let (field, _lock) = FieldFolder::open_to_write(disk, folder)?;
    let edge = grid.voxels_per_tile_edge() as usize;
    let tiles = map.tile_indices();
    let wanted = wanted_tiles(map, &tiles, region, cap, &distances);
    let keys = TileKeys::new(map, &tiles, cap, &distances);
    let wanted: Vec<(TileIndex, TileKey)> =
        wanted.par_iter().map(|&tile| (tile, keys.key_of(tile))).collect();
    let mut report = FieldReport {
        tiles: wanted.len() as u64,
        has_obstacles: tiles.iter().any(|&tile| may_have_obstacles(map, tile)),
        ..FieldReport::default()
    };
    drop(tiles);
    let Kept { kept, damaged } = kept_tiles(&field, &wanted, edge);
    report.damaged_field_tiles = damaged;
    report.tiles_kept = kept.len() as u64;
    let missing: Vec<TileIndex> =
        wanted.iter().map(|(tile, _)| *tile).filter(|tile| !kept.contains_key(tile)).collect();
    let keys: FxHashMap<TileIndex, TileKey> = wanted.iter().copied().collect();
    let mut computation = Computation {
        map,
        field: &field,
        cap,
        distances,
        keys: &keys,
        cache: TileCache::new(map, distances, options.memory_bytes / 8, together(edge, options.memory_bytes)),
        memory_bytes: options.memory_bytes,
        computed: Vec::with_capacity(missing.len()),
    };
    let all = missing.len() as u64;
    progress(0, all);
    for tiles in boxes_of(&missing, edge, cap, &distances, options.memory_bytes / 8 * 5) {
        options.stop.check()?;
        computation.compute(&tiles, &options.stop)?;
        progress(computation.computed.len() as u64, all);
    }
    report.tiles_computed = computation.computed.len() as u64;
    report.voxels_computed = report.tiles_computed * (edge as u64).pow(3);
    let mut index = Index::new(&grid, &distances, region);
    index.map_id.clone_from(&options.map_id);
    index.scan_number = map.scan_number();
    index.tiles = kept.into_values().chain(computation.computed).collect();
    index.tiles.sort_unstable_by_key(|tile| tile.tile);
    let damaged_map_tiles = computation.cache.into_damaged();
    index.damaged_map_tiles = damaged_map_tiles.keys().map(|tile| tile.to_array()).collect();
    report.damaged_map_tiles = damaged_map_tiles.into_values().collect();
    options.stop.check()?;
    field.write_index(&index)?;
    let with_file = index.tiles.iter().filter(|tile| tile.uniform.is_none());
    field.remove_others(with_file.map(|tile| (tile.tile.into(), tile.key)))?;
    Ok(report)
}

/// The tiles that overlap the box.
fn region_of(map: &impl MapView, options: &FieldOptions) -> Result<Option<TileBox>> {
    let Some(region) = options.region else { return Ok(None) };
    let grid = map.config().grid;
    match Extent::of(&grid.voxels_in(&region)).tiles(&grid) {
        Some([min, max]) => Ok(Some(TileBox::new(min, max))),
        None => Err(Error::argument("region", format!("{region} contains no center of a voxel"))),
    }
}

/// Number of tiles that are decoded or encoded at the same time in a quarter of the memory.
fn together(edge: usize, memory_bytes: usize) -> usize {
    // Stored distances, their differences and the compressed bytes; a decoded tile of the map takes about as much.
    let tile_bytes = 6 * edge.pow(3);
    (memory_bytes / 4 / tile_bytes.max(1)).clamp(1, 256)
}

/// Tiles of the earlier field that remain.
struct Kept {
    kept: FxHashMap<TileIndex, IndexedTile>,
    /// Problems of damaged tiles.
    damaged: Vec<String>,
}

/// Finds the tiles whose file exists. Files that were left by a killed run count too.
fn kept_tiles(field: &FieldFolder, wanted: &[(TileIndex, TileKey)], edge: usize) -> Kept {
    let mut damaged = Vec::new();
    let listed: FxHashMap<[i32; 3], IndexedTile> = match field.read_index() {
        Ok(index) => index.into_iter().flat_map(|index| index.tiles).map(|tile| (tile.tile, tile)).collect(),
        Err(error) => {
            damaged.push(format!("{error:#}"));
            FxHashMap::default()
        }
    };
    let found: Vec<(Option<IndexedTile>, Option<String>)> = wanted
        .par_iter()
        .map(|&(tile, key)| {
            let listed = listed.get(&tile.to_array()).filter(|listed| listed.key == key);
            if let Some(IndexedTile { uniform: Some(_), .. }) = listed {
                return (listed.cloned(), None);
            }
            match field.read_tile(tile, edge, key) {
                Ok(_) => (Some(IndexedTile { tile: tile.to_array(), key, uniform: None }), None),
                // A tile that was never computed is not damaged.
                Err(error) if listed.is_some() || matches!(error, Error::Malformed { .. }) => {
                    (None, Some(format!("{error:#}")))
                }
                Err(_) => (None, None),
            }
        })
        .collect();
    let mut kept = FxHashMap::default();
    for (tile, problem) in found {
        damaged.extend(problem);
        if let Some(tile) = tile {
            kept.insert(tile.tile.into(), tile);
        }
    }
    Kept { kept, damaged }
}

/// Computation of the tiles that are missing.
struct Computation<'a, V> {
    map: &'a V,
    field: &'a FieldFolder,
    cap: Cap,
    distances: DistanceOptions,
    keys: &'a FxHashMap<TileIndex, TileKey>,
    cache: TileCache<'a, V>,
    memory_bytes: usize,
    computed: Vec<IndexedTile>,
}

impl<V: MapView> Computation<'_, V> {
    /// Computes and writes the tiles of a box.
    fn compute(&mut self, tiles: &[TileIndex], stop: &Stop) -> Result<()> {
        let grid = self.map.config().grid;
        let Some(bounds) = TileBox::of(tiles.iter().copied()) else { return Ok(()) };
        let extent = Extent::of(&grid.voxels_of_tiles(bounds));
        let around = extent.grown(self.cap.reach);
        let mut near = tiles_in(self.map, &around);
        if self.distances.unknown == UnknownRule::Free {
            near.retain(|&tile| may_have_obstacles(self.map, tile));
        }
        let mut observed = Observed::new(around, &self.distances);
        let damaged = self.cache.add_to(&mut observed, &near)?;
        stop.check()?;
        let mut solver = Solver::new(extent, self.cap, self.distances);
        solver.compute(&observed);
        let mut lines = solver.into_distances(&observed);
        drop(observed);
        for &tile in &damaged {
            make_unknown(&mut lines, extent, &grid.voxels_of_tile(tile), self.cap);
        }
        let edge = grid.voxels_per_tile_edge() as usize;
        for tiles in tiles.chunks(together(edge, self.memory_bytes)) {
            let written: Vec<Result<IndexedTile>> =
                tiles.par_iter().map(|&tile| self.write(tile, extent, &lines, &damaged)).collect();
            for tile in written {
                self.computed.push(tile?);
            }
        }
        Ok(())
    }

    fn write(
        &self,
        tile: TileIndex,
        extent: Extent,
        lines: &[Line],
        damaged: &[TileIndex],
    ) -> Result<IndexedTile> {
        let grid = self.map.config().grid;
        let edge = grid.voxels_per_tile_edge() as usize;
        let voxels = grid.voxels_of_tile(tile);
        let near = Extent::of(&voxels).grown(self.cap.reach);
        let is_near = |other: &TileIndex| {
            let VoxelBox { min, end } = near.voxels().intersection(&grid.voxels_of_tile(*other));
            (0..3).all(|k| min[k] < end[k])
        };
        let damaged: Vec<TileIndex> = damaged.iter().copied().filter(is_near).collect();
        let mut key = self.keys.get(&tile).copied().unwrap_or_default();
        if !damaged.is_empty() {
            // The version of a damaged tile does not change when it is repaired.
            key = key.without(&damaged);
        }
        // The last tile of the range of indices may be cut off.
        let absent = distance_of_absent(&self.distances).to_bits();
        let mut distances = vec![absent; edge.pow(3)];
        let from: [usize; 3] = std::array::from_fn(|k| (i64::from(voxels.min[k]) - extent.min[k]) as usize);
        let size: [usize; 3] = Extent::of(&voxels).size;
        let row_lanes = chunks_of(extent.size[0]) * LANES;
        let all = lines.as_flattened();
        for z in 0..size[2] {
            for y in 0..size[1] {
                let row = ((from[1] + y) * extent.size[2] + from[2] + z) * row_lanes + from[0];
                let out = (z * edge + y) * edge;
                distances[out..out + size[0]].copy_from_slice(&all[row..row + size[0]]);
            }
        }
        let first = distances.first().copied().unwrap_or(BEYOND);
        if distances.iter().all(|distance| *distance == first) {
            return Ok(IndexedTile { tile: tile.to_array(), key, uniform: Some(first) });
        }
        let encoded = tile_file::encode(tile, edge, key, &distances);
        let encoded =
            encoded.map_err(|error| Error::io(&self.field.tile_path(tile, key), "compress", error))?;
        self.field.write_tile(tile, key, &encoded)?;
        Ok(IndexedTile { tile: tile.to_array(), key, uniform: None })
    }
}
