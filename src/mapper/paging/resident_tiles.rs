use super::tile_threads::TileThreads;
use crate::space::TileIndex;
use crate::tile::Tile;
use lru::LruCache;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Resident tiles in the order of their last use, and their total size.
#[derive(Debug)]
pub(super) struct ResidentTiles {
    tiles: LruCache<TileIndex, Resident>,
    bytes: usize,
    scans: u64,
}

#[derive(Debug)]
struct Resident {
    tile: Arc<Tile>,
    /// Size when it was last counted: a tree that another thread writes may have grown since.
    bytes: usize,
    /// Value of `scans` at the last use.
    used: u64,
}

/// Bytes of memory per tile for its slots in the table and in the LRU order.
const SLOT_BYTES: usize = size_of::<(TileIndex, Resident)>() + 64;

impl Default for ResidentTiles {
    fn default() -> Self {
        Self { tiles: LruCache::unbounded(), bytes: 0, scans: 0 }
    }
}

impl ResidentTiles {
    pub(super) fn len(&self) -> usize {
        self.tiles.len()
    }

    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn contains(&self, index: TileIndex) -> bool {
        self.tiles.contains(&index)
    }

    /// Returns a tile and marks it as the most recently used.
    pub(super) fn get(&mut self, index: TileIndex) -> Option<&Arc<Tile>> {
        let resident = self.tiles.get_mut(&index)?;
        resident.used = self.scans;
        Some(&resident.tile)
    }

    pub(super) fn note_scan(&mut self) {
        self.scans += 1;
    }

    /// Returns a tile without changing the order.
    pub(super) fn peek(&self, index: TileIndex) -> Option<&Arc<Tile>> {
        self.tiles.peek(&index).map(|resident| &resident.tile)
    }

    /// The tiles, the most recently used first.
    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = &Arc<Tile>> {
        self.tiles.iter().map(|(_, resident)| &resident.tile)
    }

    /// Inserts a tile as the most recently used.
    pub(super) fn put(&mut self, tile: Arc<Tile>) {
        let (index, bytes) = (tile.index(), bytes_of(&tile));
        self.bytes += bytes;
        if let Some(replaced) = self.tiles.put(index, Resident { tile, bytes, used: self.scans }) {
            self.bytes -= replaced.bytes;
        }
    }

    pub(super) fn remove(&mut self, index: TileIndex) {
        if let Some(removed) = self.tiles.pop(&index) {
            self.bytes -= removed.bytes;
        }
    }

    /// The least recently used tile that may be evicted: it has no other owner, or it has one and `releases` is true.
    pub(super) fn least_recently_used(&self, releases: impl Fn(TileIndex) -> bool) -> Option<TileIndex> {
        self.oldest(releases).map(|resident| resident.tile.index())
    }

    /// Number of scans since the last use of the tile that [`Self::least_recently_used`] returns.
    pub(super) fn scans_since_oldest(&self, releases: impl Fn(TileIndex) -> bool) -> Option<u64> {
        self.oldest(releases).map(|resident| self.scans - resident.used)
    }

    fn oldest(&self, releases: impl Fn(TileIndex) -> bool) -> Option<&Resident> {
        let mut oldest_first = self.tiles.iter().rev().map(|(_, resident)| resident);
        oldest_first.find(|resident| match Arc::strong_count(&resident.tile) {
            1 => true,
            2 => releases(resident.tile.index()),
            _ => false,
        })
    }

    /// Changes a tile without changing the order.
    pub(super) fn change<T>(&mut self, index: TileIndex, change: impl FnOnce(&mut Tile) -> T) -> Option<T> {
        let resident = self.tiles.peek_mut(&index)?;
        self.bytes -= resident.bytes;
        let answer = resident.change(change);
        self.bytes += resident.bytes;
        Some(answer)
    }

    /// Changes many tiles in parallel, each with its own argument.
    pub(super) fn change_all<T: Send>(
        &mut self,
        threads: &TileThreads,
        mut given: FxHashMap<TileIndex, T>,
        change: impl Fn(&mut Tile, T) + Sync,
    ) {
        let changed =
            self.tiles.iter_mut().filter_map(|(index, resident)| Some((resident, given.remove(index)?)));
        let changed: Vec<(&mut Resident, T)> = changed.collect();
        self.bytes -= changed.iter().map(|(resident, _)| resident.bytes).sum::<usize>();
        let bytes = threads.map(changed, |(resident, given)| {
            resident.change(|tile| change(tile, given));
            resident.bytes
        });
        self.bytes += bytes.into_iter().sum::<usize>();
    }
}

impl Resident {
    fn change<T>(&mut self, change: impl FnOnce(&mut Tile) -> T) -> T {
        let answer = change(Arc::make_mut(&mut self.tile));
        self.bytes = bytes_of(&self.tile);
        answer
    }
}

fn bytes_of(tile: &Tile) -> usize {
    SLOT_BYTES + tile.bytes()
}
