use crate::space::{TileIndex, hash_table_bytes};
use rustc_hash::FxHashMap;

/// What a flush beside the mapper holds of the tiles as of its scan, until they are written.
///
/// It shares resident tiles with the cache. A scan that changes one leaves the flush with what was there (copy on
/// write), which then counts on top.
#[derive(Debug, Default)]
pub(super) struct Flight {
    tiles: FxHashMap<TileIndex, FlightTile>,
    /// Bytes of memory of tiles that the flush alone holds.
    own_bytes: usize,
}

/// A tile on its way to disk.
#[derive(Clone, Copy, Debug)]
struct FlightTile {
    bytes: usize,
    is_shared: bool,
}

impl Flight {
    /// A flush of some tiles, each with its bytes of memory.
    pub(super) fn of(tiles: impl Iterator<Item = (TileIndex, usize)>) -> Self {
        let tile = |(index, bytes)| (index, FlightTile { bytes, is_shared: true });
        Self { tiles: tiles.map(tile).collect(), own_bytes: 0 }
    }

    /// Bytes of memory that changing these tiles takes on top.
    pub(super) fn bytes_to_copy(&self, tiles: impl Iterator<Item = TileIndex>) -> usize {
        let shared = tiles.filter_map(|index| self.tiles.get(&index)).filter(|tile| tile.is_shared);
        shared.map(|tile| tile.bytes).sum()
    }

    /// Notes that the cache has another version of a tile, or none, from now on.
    pub(super) fn is_left_alone_with(&mut self, index: TileIndex) {
        if let Some(tile) = self.tiles.get_mut(&index)
            && tile.is_shared
        {
            tile.is_shared = false;
            self.own_bytes += tile.bytes;
        }
    }

    /// Notes that a tile was written, and let go of.
    pub(super) fn note_written(&mut self, index: TileIndex) {
        if let Some(tile) = self.tiles.remove(&index)
            && !tile.is_shared
        {
            self.own_bytes -= tile.bytes;
        }
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        self.own_bytes + hash_table_bytes::<(TileIndex, FlightTile)>(self.tiles.capacity())
    }
}
