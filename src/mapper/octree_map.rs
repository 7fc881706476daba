use super::{MapStatistics, MapView, TileRef};
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::octree::{Leaf, Octree, OctreeFile, OctreeFormat};
use crate::sensor::Evidence;
use crate::space::{BRICK_EDGE, BrickCode, MortonCode, TileBox, TileIndex, TileSpace, VoxelBox, VoxelIndex};
use crate::store::{Disk, FsDisk};
use crate::tile::{Table, Tile};
use lru::LruCache;
use std::io::Read;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// OctoMap file (`.bt` or `.ot`) as a map with the usual queries.
///
/// The tree of the file is kept in memory, as in OctoMap. Tiles are built from it on demand. Voxels have the log-odds
/// of the file. A `.bt` file stores no log-odds; its voxels have OctoMap's clamping values. The observation count is 0.
///
/// ```
/// use voxtile::mapper::OctreeMap;
/// use voxtile::octree::{Octree, read, write_bt};
/// use voxtile::space::VoxelKey;
/// use voxtile::Queries;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut tree = Octree::new();
/// tree.set(VoxelKey::from_index([10, 0, 0]).morton(), 3.5);
/// let mut file = Vec::new();
/// write_bt(&tree, 0.1, 0.0, &mut file)?;
/// let map = OctreeMap::of(read(&*file)?)?;
/// assert!(map.occupancy_at([1.05, 0.05, 0.05])?.is_occupied());
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct OctreeMap {
    config: MapConfig,
    tree: Octree,
    format: OctreeFormat,
    id: String,
    tiles: Vec<TileIndex>,
    space: TileSpace,
    cache: Mutex<TileCache>,
}

/// Approximate edge of the tiles into which a file is divided.
const TILE_SIZE_M: f64 = 10.0;
/// Largest tile edge in voxels; a tile of this size takes 150 MB if all voxels are known.
const MAX_TILE_EDGE: f64 = 400.0;
/// Maximum number of tiles in memory.
const CACHE_TILES: NonZeroUsize = NonZeroUsize::new(32).expect("more than none");
/// Maximum size of the cached tiles in bytes; the last tile is always kept.
const CACHE_BYTES: usize = 128 << 20;
/// Maximum number of tiles that a file may cover: a file of twenty bytes can describe 2^48 voxels.
const MAX_TILES: u64 = 1 << 23;
/// Depth of bricks in OctoMap's tree.
const BRICK_DEPTH: u8 = 13;
/// Smallest voxel index in OctoMap's space.
const FIRST_VOXEL: VoxelIndex = [-32768; 3];

impl OctreeMap {
    /// Returns whether a path names an OctoMap file: by its first line, or by its extension for files without a header.
    pub fn is_named_by(path: &Path) -> bool {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        let is_named = || ["bt", "ot"].iter().any(|known| extension.eq_ignore_ascii_case(known));
        path.is_file() && (is_named() || begins_as_octree(path))
    }

    /// Returns the map of a decoded file.
    ///
    /// # Errors
    ///
    /// Fails if the leaves cover too many tiles or the resolution is invalid.
    pub fn of(file: OctreeFile) -> Result<Self> {
        let OctreeFile { tree, resolution_m, id, format, .. } = file;
        let edge = (TILE_SIZE_M / resolution_m).round().clamp(2.0, MAX_TILE_EDGE);
        let config = MapConfig::new(resolution_m, edge * resolution_m)?;
        let tiles = tiles_of(&config, &tree)?;
        let space = tiles.iter().copied().collect();
        Ok(Self { config, tree, format, id, tiles, space, cache: Mutex::default() })
    }

    /// Format of the file.
    pub fn format(&self) -> OctreeFormat {
        self.format
    }

    /// Class name of the tree in OctoMap.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// The tree of the file.
    pub fn tree(&self) -> &Octree {
        &self.tree
    }

    pub(crate) fn table_of(&self, index: TileIndex) -> Table {
        let end = FIRST_VOXEL.map(|first| -first);
        let voxels = self.config.grid.voxels_of_tile(index);
        let voxels = voxels.intersection(&VoxelBox { min: FIRST_VOXEL, end });
        let mut table = Table::default();
        let corners = |k: usize| {
            (voxels.min[k] & !(BRICK_EDGE - 1)..voxels.end[k])
                .step_by(BRICK_EDGE as usize)
                .collect::<Vec<_>>()
        };
        let corners: [Vec<i32>; 3] = std::array::from_fn(corners);
        let mut known = Vec::new();
        for &x in &corners[0] {
            for &y in &corners[1] {
                for &z in &corners[2] {
                    self.collect([x, y, z], &voxels, &mut known);
                    if !known.is_empty() {
                        table.insert(BrickCode::of_voxel([x, y, z]), &known);
                    }
                }
            }
        }
        table
    }

    fn make_tile(&self, index: TileIndex) -> Arc<Tile> {
        Arc::new(Tile::uncached(&self.config.grid, index, self.table_of(index)))
    }

    /// Collects the known voxels of a brick within a box, as Morton position and evidence, in Morton order.
    fn collect(&self, corner: VoxelIndex, within: &VoxelBox, known: &mut Vec<(usize, Evidence)>) {
        known.clear();
        let brick = BrickCode::of_voxel(corner);
        for Leaf { code, depth, value } in self.tree.leaves_under(brick.voxel(0), BRICK_DEPTH) {
            let evidence = Evidence { log_odds: f64::from(value), observation_count: 0 };
            for code in code.0..code.0 + MortonCode::span(depth.max(BRICK_DEPTH)) {
                let code = MortonCode(code);
                if within.contains(code.to_key().to_index_from(FIRST_VOXEL)) {
                    known.push((code.place_in_brick(), evidence));
                }
            }
        }
    }

    fn has(&self, index: TileIndex) -> bool {
        self.tiles.binary_search(&index).is_ok()
    }
}

/// Returns whether a file can be read and begins like an OctoMap file.
fn begins_as_octree(path: &Path) -> bool {
    /// Number of bytes to read: enough for the distinguishing part of the first line.
    const FIRST_BYTES: u64 = 64;
    let mut first = Vec::new();
    let read = FsDisk.open(path).and_then(|file| file.take(FIRST_BYTES).read_to_end(&mut first));
    read.is_ok() && OctreeFormat::of_first_bytes(&first).is_some()
}

/// LRU cache of tiles.
#[derive(Debug)]
struct TileCache {
    tiles: LruCache<TileIndex, Arc<Tile>>,
    bytes: usize,
}

impl Default for TileCache {
    fn default() -> Self {
        Self { tiles: LruCache::new(CACHE_TILES), bytes: 0 }
    }
}

impl TileCache {
    fn put(&mut self, index: TileIndex, tile: &Arc<Tile>) {
        self.bytes += tile.bytes();
        if let Some((_, other)) = self.tiles.push(index, tile.clone()) {
            self.bytes = self.bytes.saturating_sub(other.bytes());
        }
        while self.bytes > CACHE_BYTES
            && self.tiles.len() > 1
            && let Some((_, oldest)) = self.tiles.pop_lru()
        {
            self.bytes = self.bytes.saturating_sub(oldest.bytes());
        }
    }
}

/// Returns the tiles that the leaves of a tree overlap, in order.
fn tiles_of(config: &MapConfig, tree: &Octree) -> Result<Vec<TileIndex>> {
    let grid = &config.grid;
    let mut tiles: Vec<TileIndex> = Vec::new();
    let mut max_before_sorting = 1 << 16;
    for Leaf { code, depth, .. } in tree.leaves() {
        let first = code.to_key().to_index_from(FIRST_VOXEL);
        let last = first.map(|k| k + ((1 << (16 - i32::from(depth))) - 1));
        let covered = TileBox::new(grid.tile_of_voxel(first), grid.tile_of_voxel(last));
        let count = covered.count();
        if tiles.len() as u64 + count > MAX_TILES {
            let hint = "the file contains large pruned cubes; crop it with OctoMap's tools first";
            let what = "number of tiles covered by the file";
            return Err(Error::TooLarge { what, size: count, limit: MAX_TILES, hint });
        }
        if count == 1 && tiles.last() == Some(&covered.min()) {
            continue;
        }
        tiles.extend(covered.tiles());
        if tiles.len() > max_before_sorting {
            tiles.sort_unstable();
            tiles.dedup();
            max_before_sorting = 2 * tiles.len().max(1 << 15);
        }
    }
    tiles.sort_unstable();
    tiles.dedup();
    Ok(tiles)
}

impl MapView for OctreeMap {
    fn config(&self) -> &MapConfig {
        &self.config
    }

    fn scan_number(&self) -> u64 {
        0
    }

    fn tile_indices(&self) -> Vec<TileIndex> {
        self.tiles.clone()
    }

    fn tile_bounds(&self) -> Option<TileBox> {
        self.space.bounds()
    }

    fn empty_around(&self, index: TileIndex) -> Option<TileBox> {
        self.space.empty_around(index)
    }

    fn has_tile(&self, index: TileIndex) -> bool {
        self.has(index)
    }

    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        let cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let mut indices: Vec<_> = cache.tiles.iter().map(|(index, _)| *index).collect();
        indices.sort_unstable();
        indices
    }

    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        if !self.has(index) {
            return Ok(None);
        }
        let cache = || self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(tile) = cache().tiles.get(&index) {
            return Ok(Some(TileRef::shared(tile.clone())));
        }
        // The tile is built without the lock on the cache, so that other threads can use it.
        let tile = self.make_tile(index);
        cache().put(index, &tile);
        Ok(Some(TileRef::shared(tile)))
    }

    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        match self.has(index) {
            true => Ok(Some(TileRef::shared(self.make_tile(index)))),
            false => Ok(None),
        }
    }

    fn voxels_of_tile_hint(&self, _: TileIndex) -> Option<u64> {
        None
    }

    fn statistics(&self) -> MapStatistics {
        MapStatistics { tiles: self.tiles.len() as u64, ..MapStatistics::default() }
    }
}
