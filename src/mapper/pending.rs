use crate::scan::{PackedUpdates, TileUpdates};
use crate::space::TileIndex;
use rustc_hash::FxHashMap;

/// Updates that wait for tiles on disk, in order and packed.
#[derive(Debug, Default)]
pub(super) struct Pending {
    tiles: FxHashMap<TileIndex, PackedUpdates>,
    bytes: usize,
}

/// What a tile takes beside its updates: its place in the table, which may be half empty.
const SLOT_BYTES: usize = 2 * size_of::<(TileIndex, PackedUpdates)>();

impl Pending {
    pub(super) fn push(&mut self, tile: TileIndex, updates: &TileUpdates) {
        let mut added = 0;
        let waiting = self.tiles.entry(tile).or_insert_with(|| {
            added += SLOT_BYTES;
            PackedUpdates::default()
        });
        let before = waiting.bytes();
        waiting.push(updates);
        self.bytes += added + waiting.bytes() - before;
    }

    /// Whether something waits for a tile.
    pub(super) fn contains(&self, tile: TileIndex) -> bool {
        self.tiles.contains_key(&tile)
    }

    /// What waits for a tile, in order.
    pub(super) fn of(&self, tile: TileIndex) -> impl Iterator<Item = TileUpdates> {
        self.tiles.get(&tile).into_iter().flat_map(PackedUpdates::iter)
    }

    /// Forgets what waited for a tile: it has been applied.
    pub(super) fn applied(&mut self, tile: TileIndex) {
        if let Some(waiting) = self.tiles.remove(&tile) {
            self.bytes -= SLOT_BYTES + waiting.bytes();
        }
    }

    pub(super) fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.tiles.keys().copied()
    }

    pub(super) fn len(&self) -> usize {
        self.tiles.len()
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Number of updates.
    pub(super) fn updates(&self) -> usize {
        self.tiles.values().map(PackedUpdates::len).sum()
    }

    /// The tile for which the most bytes wait, the lowest of equals.
    pub(super) fn heaviest(&self) -> Option<TileIndex> {
        let heaviest =
            self.tiles.iter().max_by_key(|(tile, waiting)| (waiting.bytes(), std::cmp::Reverse(**tile)));
        heaviest.map(|(tile, _)| *tile)
    }
}
