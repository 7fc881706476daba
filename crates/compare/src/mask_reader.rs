use crate::tile_masks::{Thresholds, TileMasks};
use lru::LruCache;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::sync::Arc;
use voxtile::mapper::MapView;
use voxtile::{Result, TileIndex};

/// Masks of tiles that are in memory together.
pub(crate) type TilesOfBatch = FxHashMap<TileIndex, Arc<TileMasks>>;

/// Reader of the masks of a map's tiles, with a cache.
pub(crate) struct MaskReader<'a, V> {
    map: &'a V,
    thresholds: Thresholds,
    cache: LruCache<TileIndex, Arc<TileMasks>>,
    bytes: usize,
    max_bytes: usize,
}

impl<'a, V: MapView> MaskReader<'a, V> {
    pub(crate) fn new(map: &'a V, thresholds: Thresholds, max_bytes: usize) -> Self {
        Self { map, thresholds, cache: LruCache::unbounded(), bytes: 0, max_bytes }
    }

    pub(crate) fn map(&self) -> &'a V {
        self.map
    }

    /// Returns the masks of tiles. Missing ones are read on all cores.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read.
    pub(crate) fn read(&mut self, tiles: &[TileIndex]) -> Result<TilesOfBatch> {
        let mut found = TilesOfBatch::default();
        let mut missing = Vec::new();
        for &tile in tiles {
            match self.cache.get(&tile) {
                Some(masks) => {
                    found.insert(tile, masks.clone());
                }
                None => missing.push(tile),
            }
        }
        let read: Vec<Result<TileMasks>> =
            missing.par_iter().map(|&tile| TileMasks::read(self.map, tile, self.thresholds)).collect();
        for (tile, masks) in missing.into_iter().zip(read) {
            let masks = Arc::new(masks?);
            self.bytes += masks.bytes();
            self.cache.put(tile, masks.clone());
            found.insert(tile, masks);
        }
        while self.bytes > self.max_bytes
            && let Some((_, dropped)) = self.cache.pop_lru()
        {
            self.bytes -= dropped.bytes();
        }
        Ok(found)
    }
}
