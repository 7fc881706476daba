use super::flusher::FlushedTile;
use super::held_tile::HeldTile;
use super::unapplied_tile::UnappliedTile;
use crate::persistence::CompactTile;
use crate::space::{TileIndex, hash_table_bytes};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// What a flush beside the mapper holds of the tiles as of its scan, until they are written.
///
/// It shares resident tiles with the cache. A scan that changes one leaves the flush with what was there (copy on
/// write), which then counts on top. So that the next scan needs not wait for that, the flush itself copies the tiles
/// that it will change. One that has to leave memory meanwhile leaves the flush with its compact form.
#[derive(Debug, Default)]
pub(super) struct Flight {
    tiles: FxHashMap<TileIndex, FlightTile>,
    /// Bytes of memory of tiles that the flush alone holds.
    own_bytes: usize,
    /// Bytes of memory of its lists, and for one tile that it makes.
    other_bytes: usize,
    /// Tiles that were being saved as they are when it began: it waits for that, and does not write them.
    saving: Vec<(TileIndex, CompactTile)>,
    /// Those of them that could not be saved: it writes them after all.
    unsaved: Vec<(TileIndex, CompactTile)>,
}

/// How many tiles a flush is to write, by what it keeps of each.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FlightSize {
    pub(super) resident: usize,
    pub(super) compact: usize,
    pub(super) unapplied: usize,
}

impl FlightSize {
    /// Bytes of memory of the lists, beside the tiles: of small tiles, these take more than the tiles do.
    pub(super) fn bytes(self) -> usize {
        /// What the allocator adds to a block.
        const BLOCK: usize = 16;
        /// The counts of an `Arc`.
        const COUNTS: usize = 16;
        let all = self.resident + self.compact + self.unapplied;
        // A list or a table that has just grown is half empty.
        let slots = 2 * (size_of::<FlushedTile>() + hash_table_bytes::<(TileIndex, FlightTile)>(1));
        all * slots
            + self.resident * (size_of::<HeldTile>() + COUNTS + BLOCK)
            + self.unapplied * (UnappliedTile::OWN_BYTES + BLOCK)
    }
}

/// A tile on its way to disk.
#[derive(Debug)]
struct FlightTile {
    bytes: usize,
    is_shared: bool,
    /// What the flush will write, where that was resident when it began.
    held: Option<Arc<HeldTile>>,
    /// Whether the cache may hold something else by now.
    has_changed: bool,
}

impl Flight {
    /// A flush of some tiles, and of others that are being saved. `other_bytes` are those of its lists and of a tile
    /// that it makes.
    pub(super) fn of<'a>(
        tiles: impl Iterator<Item = &'a FlushedTile>,
        other_bytes: usize,
        saving: Vec<(TileIndex, CompactTile)>,
    ) -> Self {
        let tiles = tiles.map(|tile| (tile.index(), FlightTile::of(tile))).collect();
        Self { tiles, other_bytes, saving, ..Self::default() }
    }

    /// Notes that a save has ended; tells whether it failed, and it is up to the flush to write the tile.
    pub(super) fn note_saved(&mut self, index: TileIndex, tile: &CompactTile, is_on_disk: bool) -> bool {
        // An older version of the tile may be on its way, too.
        let is_it =
            |(saving, as_it_is): &(TileIndex, CompactTile)| *saving == index && as_it_is.is_same(tile);
        let Some(place) = self.saving.iter().position(is_it) else { return false };
        self.saving.swap_remove(place);
        if !is_on_disk {
            self.unsaved.push((index, tile.clone()));
        }
        !is_on_disk
    }

    /// Whether it waits for saves.
    pub(super) fn waits_for_saves(&self) -> bool {
        !self.saving.is_empty()
    }

    /// The tiles that it has to write because they could not be saved.
    pub(super) fn take_unsaved(&mut self) -> Vec<(TileIndex, CompactTile)> {
        std::mem::take(&mut self.unsaved)
    }

    /// Those that it will not write.
    pub(super) fn into_unsaved(self) -> Vec<(TileIndex, CompactTile)> {
        self.unsaved
    }

    /// Bytes of memory that changing these tiles takes on top.
    pub(super) fn bytes_to_copy(&self, tiles: impl Iterator<Item = TileIndex>) -> usize {
        let shared = tiles.filter_map(|index| self.tiles.get(&index)).filter(|tile| tile.is_shared);
        shared.map(|tile| tile.bytes).sum()
    }

    /// Whether a tile is shared with the cache.
    pub(super) fn is_shared(&self, index: TileIndex) -> bool {
        self.tiles.get(&index).is_some_and(|tile| tile.is_shared)
    }

    /// Whether a tile of the cache, which nobody else holds, may leave memory in the compact form.
    pub(super) fn may_be_packed(&self, index: TileIndex) -> bool {
        let tile = self.tiles.get(&index).filter(|tile| tile.is_shared);
        tile.and_then(|tile| tile.held.as_ref()).is_some_and(|held| held.may_be_packed())
    }

    /// Notes that a tile of the cache goes into the compact form as it is. The flush lets go of the tile itself, unless
    /// it is about to be written or the flush holds an earlier one.
    pub(super) fn note_packed(&mut self, index: TileIndex, packed: &CompactTile) {
        if let Some(tile) = self.tiles.get_mut(&index)
            && tile.is_shared
            && let Some(held) = &tile.held
            && held.hold_packed(packed.clone())
        {
            tile.bytes = held.bytes();
            return;
        }
        self.note_own(index);
    }

    /// Notes that the flush has a tile of its own from now on, be it a copy.
    pub(super) fn note_own(&mut self, index: TileIndex) {
        if let Some(tile) = self.tiles.get_mut(&index)
            && tile.is_shared
        {
            tile.is_shared = false;
            self.own_bytes += tile.bytes;
        }
    }

    /// Notes that the cache has another version of a tile, or none, from now on. One that only went into the compact
    /// form is the same ([`Flight::note_packed`]).
    pub(super) fn note_changed(&mut self, index: TileIndex) {
        self.note_own(index);
        if let Some(tile) = self.tiles.get_mut(&index) {
            tile.has_changed = true;
        }
    }

    /// Notes that a tile was written, and let go of. Tells whether it is what the cache holds.
    pub(super) fn note_written(&mut self, index: TileIndex) -> bool {
        let Some(tile) = self.tiles.remove(&index) else { return false };
        self.own_bytes -= if tile.is_shared { 0 } else { tile.bytes };
        !tile.has_changed
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        self.own_bytes + self.other_bytes
    }
}

impl FlightTile {
    fn of(tile: &FlushedTile) -> Self {
        let held = match tile {
            FlushedTile::Resident(held) => Some(held.clone()),
            FlushedTile::Compact(..) | FlushedTile::Unapplied(_) => None,
        };
        Self { bytes: tile.bytes(), is_shared: true, held, has_changed: false }
    }
}
