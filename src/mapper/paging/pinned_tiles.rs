use super::flusher::FlushedTile;
use super::pinned_tile::PinnedTile;
use super::unapplied_tile::UnappliedTile;
use crate::persistence::CompactTile;
use crate::space::{TileIndex, hash_table_bytes};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Tiles that a background flush holds, in the state of the scan at which it began, until they are written.
///
/// The flush shares resident tiles with the cache. A scan that changes such a tile copies it, and the flush keeps the
/// old tile (copy on write), which then counts as additional memory. The copies would delay the next scan. Therefore
/// the flush copies in advance the tiles that this scan will likely change. If a tile is evicted meanwhile, the flush
/// keeps its compact form.
#[derive(Debug, Default)]
pub(super) struct PinnedTiles {
    tiles: FxHashMap<TileIndex, PinnedEntry>,
    /// Bytes of memory of tiles that only the flush holds.
    own_bytes: usize,
    /// Bytes of memory of the flush's lists and of one tile that it builds.
    other_bytes: usize,
    /// Tiles that were being saved unchanged when the flush began; it waits for these saves and does not write the
    /// tiles.
    saving: Vec<(TileIndex, CompactTile)>,
    /// Tiles of `saving` whose save failed; the flush writes them.
    unsaved: Vec<(TileIndex, CompactTile)>,
}

/// Number of tiles that a flush writes, by the form in which it holds them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FlushSize {
    pub(super) resident: usize,
    pub(super) compact: usize,
    pub(super) unapplied: usize,
}

impl FlushSize {
    /// Bytes of memory of the lists, without the tiles. Lists of small tiles take more memory than the tiles.
    pub(super) fn bytes(self) -> usize {
        /// Overhead of the allocator per block.
        const BLOCK: usize = 16;
        /// Reference counts of an `Arc`.
        const COUNTS: usize = 16;
        let all = self.resident + self.compact + self.unapplied;
        // A list or table that has just grown is half empty.
        let slots = 2 * (size_of::<FlushedTile>() + hash_table_bytes::<(TileIndex, PinnedEntry)>(1));
        all * slots
            + self.resident * (size_of::<PinnedTile>() + COUNTS + BLOCK)
            + self.unapplied * (UnappliedTile::OWN_BYTES + BLOCK)
    }
}

#[derive(Debug)]
struct PinnedEntry {
    bytes: usize,
    is_shared: bool,
    /// The tile to write, if it was resident when the flush began.
    held: Option<Arc<PinnedTile>>,
    /// Whether the cache may hold another version by now.
    has_changed: bool,
}

impl PinnedTiles {
    /// Creates the record of a flush of `tiles`, and of others that are being saved. `other_bytes` is the memory of its
    /// lists and of one tile that it builds.
    pub(super) fn of<'a>(
        tiles: impl Iterator<Item = &'a FlushedTile>,
        other_bytes: usize,
        saving: Vec<(TileIndex, CompactTile)>,
    ) -> Self {
        let tiles = tiles.map(|tile| (tile.index(), PinnedEntry::of(tile))).collect();
        Self { tiles, other_bytes, saving, ..Self::default() }
    }

    /// Records the end of a save; returns whether it failed and the flush has to write the tile.
    pub(super) fn note_saved(&mut self, index: TileIndex, tile: &CompactTile, is_on_disk: bool) -> bool {
        // An older version of the tile may also be in the process of being saved.
        let is_it =
            |(saving, as_it_is): &(TileIndex, CompactTile)| *saving == index && as_it_is.is_same(tile);
        let Some(place) = self.saving.iter().position(is_it) else { return false };
        self.saving.swap_remove(place);
        if !is_on_disk {
            self.unsaved.push((index, tile.clone()));
        }
        !is_on_disk
    }

    pub(super) fn waits_for_saves(&self) -> bool {
        !self.saving.is_empty()
    }

    /// Takes the tiles that the flush has to write because their saves failed.
    pub(super) fn take_unsaved(&mut self) -> Vec<(TileIndex, CompactTile)> {
        std::mem::take(&mut self.unsaved)
    }

    /// Tiles whose saves failed and that the flush will not write.
    pub(super) fn into_unsaved(self) -> Vec<(TileIndex, CompactTile)> {
        self.unsaved
    }

    /// Additional bytes of memory after a change of these tiles: those shared with the cache are copied.
    pub(super) fn bytes_to_copy(&self, tiles: impl Iterator<Item = TileIndex>) -> usize {
        let shared = tiles.filter_map(|index| self.tiles.get(&index)).filter(|tile| tile.is_shared);
        shared.map(|tile| tile.bytes).sum()
    }

    pub(super) fn is_shared(&self, index: TileIndex) -> bool {
        self.tiles.get(&index).is_some_and(|tile| tile.is_shared)
    }

    /// Returns whether a tile of the cache that only the flush pins may be packed into the compact form.
    pub(super) fn may_be_packed(&self, index: TileIndex) -> bool {
        let tile = self.tiles.get(&index).filter(|tile| tile.is_shared);
        tile.and_then(|tile| tile.held.as_ref()).is_some_and(|held| held.may_be_packed())
    }

    /// Records that a tile of the cache is packed into the compact form unchanged. The flush then holds the compact
    /// form instead of the tile, unless it is writing the tile or holds an earlier version.
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

    /// Records that the flush now holds its own version of a tile, possibly a copy.
    pub(super) fn note_own(&mut self, index: TileIndex) {
        if let Some(tile) = self.tiles.get_mut(&index)
            && tile.is_shared
        {
            tile.is_shared = false;
            self.own_bytes += tile.bytes;
        }
    }

    /// Records that the cache has changed or dropped a tile. A tile that was only packed into the compact form has not
    /// changed ([`PinnedTiles::note_packed`]).
    pub(super) fn note_changed(&mut self, index: TileIndex) {
        self.note_own(index);
        if let Some(tile) = self.tiles.get_mut(&index) {
            tile.has_changed = true;
        }
    }

    /// Records that a tile was written and released. Returns whether the cache still holds this version.
    pub(super) fn note_written(&mut self, index: TileIndex) -> bool {
        let Some(tile) = self.tiles.remove(&index) else { return false };
        self.own_bytes -= if tile.is_shared { 0 } else { tile.bytes };
        !tile.has_changed
    }

    pub(super) fn bytes(&self) -> usize {
        self.own_bytes + self.other_bytes
    }
}

impl PinnedEntry {
    fn of(tile: &FlushedTile) -> Self {
        let held = match tile {
            FlushedTile::Resident(held) => Some(held.clone()),
            FlushedTile::Compact(..) | FlushedTile::Unapplied(_) => None,
        };
        Self { bytes: tile.bytes(), is_shared: true, held, has_changed: false }
    }
}
