use crate::mapper::paging::Base;
use crate::space::TileIndex;
use crate::tile::Tile;
use lru::LruCache;
use std::sync::Arc;

/// Cache of tiles that readers have built, in the order of their last use. Tiles with buffered updates are not cached.
#[derive(Debug)]
pub(super) struct ReadTiles {
    tiles: LruCache<TileIndex, ReadTile>,
    bytes: usize,
    max_bytes: usize,
}

#[derive(Debug)]
struct ReadTile {
    made_of: Base,
    tile: Arc<Tile>,
    bytes: usize,
}

impl ReadTiles {
    pub(super) fn new(max_bytes: usize) -> Self {
        Self { tiles: LruCache::unbounded(), bytes: 0, max_bytes }
    }

    /// Returns the tile built from this form, if it is cached.
    pub(super) fn get(&mut self, index: TileIndex, base: &Base) -> Option<Arc<Tile>> {
        let read = self.tiles.get(&index).filter(|read| read.made_of.is_same(base))?;
        Some(read.tile.clone())
    }

    pub(super) fn put(&mut self, made_of: Base, tile: Arc<Tile>) {
        let (index, bytes) = (tile.index(), tile.bytes());
        if bytes > self.max_bytes {
            return;
        }
        self.bytes += bytes;
        let replaced = self.tiles.put(index, ReadTile { made_of, tile, bytes });
        self.bytes -= replaced.map_or(0, |replaced| replaced.bytes);
        while self.bytes > self.max_bytes
            && let Some((_, dropped)) = self.tiles.pop_lru()
        {
            self.bytes -= dropped.bytes;
        }
    }
}
