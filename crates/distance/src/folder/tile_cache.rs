use crate::observed::Observed;
use crate::options::DistanceOptions;
use crate::tile_voxels::TileVoxels;
use lru::LruCache;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use voxtile::mapper::MapView;
use voxtile::{Error, Result, TileIndex};

/// Voxels of tiles of the map that were read, because neighbouring boxes need them again.
pub(super) struct TileCache<'a, V> {
    map: &'a V,
    options: DistanceOptions,
    tiles: LruCache<TileIndex, Arc<TileVoxels>>,
    bytes: usize,
    max_bytes: usize,
    /// Tiles that are read at the same time.
    together: usize,
    damaged: BTreeMap<TileIndex, String>,
}

impl<'a, V: MapView> TileCache<'a, V> {
    pub(super) fn new(map: &'a V, options: DistanceOptions, max_bytes: usize, together: usize) -> Self {
        let tiles = LruCache::unbounded();
        Self { map, options, tiles, bytes: 0, max_bytes, together, damaged: BTreeMap::new() }
    }

    /// Marks the voxels of tiles in a box. Returns the damaged tiles among them.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read for other reasons than damage.
    pub(super) fn add_to(&mut self, observed: &mut Observed, tiles: &[TileIndex]) -> Result<Vec<TileIndex>> {
        let mut damaged = Vec::new();
        for tiles in tiles.chunks(self.together) {
            let missing: Vec<TileIndex> = tiles
                .iter()
                .copied()
                .filter(|tile| !self.tiles.contains(tile) && !self.damaged.contains_key(tile))
                .collect();
            let read: Vec<Result<TileVoxels>> = missing
                .par_iter()
                .map(|&tile| TileVoxels::read(self.map, tile, self.options.needs_known()))
                .collect();
            let mut voxels: BTreeMap<TileIndex, Arc<TileVoxels>> = BTreeMap::new();
            for (tile, read) in missing.into_iter().zip(read) {
                match read {
                    Ok(read) => {
                        voxels.insert(tile, Arc::new(read));
                    }
                    Err(error) if matches!(error, Error::Damaged { .. }) || error.is_of_medium() => {
                        self.damaged.insert(tile, format!("{error:#}"));
                    }
                    Err(error) => return Err(error),
                }
            }
            for &tile in tiles {
                if self.damaged.contains_key(&tile) {
                    damaged.push(tile);
                } else if let Some(found) = voxels.remove(&tile) {
                    found.add_to(observed);
                    self.put(tile, found);
                } else if let Some(found) = self.tiles.get(&tile) {
                    found.add_to(observed);
                } else {
                    // Evicted by the tiles read with it.
                    TileVoxels::read(self.map, tile, self.options.needs_known())?.add_to(observed);
                }
            }
        }
        Ok(damaged)
    }

    fn put(&mut self, tile: TileIndex, voxels: Arc<TileVoxels>) {
        self.bytes += voxels.bytes();
        self.tiles.put(tile, voxels);
        while self.bytes > self.max_bytes
            && let Some((_, dropped)) = self.tiles.pop_lru()
        {
            self.bytes -= dropped.bytes();
        }
    }

    /// Damaged tiles that were found, each with the problem.
    pub(super) fn into_damaged(self) -> BTreeMap<TileIndex, String> {
        self.damaged
    }
}
