use crate::scan::TileUpdates;
use crate::space::TileIndex;
use rustc_hash::FxHashMap;

/// Updates that wait for tiles on disk, in order.
#[derive(Debug, Default)]
pub(super) struct Pending {
    tiles: FxHashMap<TileIndex, Waiting>,
    bytes: usize,
}

#[derive(Debug, Default)]
struct Waiting {
    updates: Vec<TileUpdates>,
    bytes: usize,
}

impl Pending {
    pub(super) fn push(&mut self, tile: TileIndex, updates: TileUpdates) {
        let bytes = updates.bytes();
        let waiting = self.tiles.entry(tile).or_default();
        waiting.updates.push(updates);
        waiting.bytes += bytes;
        self.bytes += bytes;
    }

    /// What waits for a tile, in order.
    pub(super) fn of(&self, tile: TileIndex) -> &[TileUpdates] {
        self.tiles.get(&tile).map_or(&[], |waiting| &waiting.updates)
    }

    /// Forgets what waited for a tile: it has been applied.
    pub(super) fn applied(&mut self, tile: TileIndex) {
        if let Some(waiting) = self.tiles.remove(&tile) {
            self.bytes -= waiting.bytes;
        }
    }

    pub(super) fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.tiles.keys().copied()
    }

    pub(super) fn len(&self) -> usize {
        self.tiles.len()
    }

    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn updates(&self) -> usize {
        self.tiles.values().flat_map(|waiting| &waiting.updates).map(TileUpdates::len).sum()
    }

    /// The tile for which the most bytes wait, the lowest of equals.
    pub(super) fn heaviest(&self) -> Option<TileIndex> {
        let heaviest =
            self.tiles.iter().max_by_key(|(tile, waiting)| (waiting.bytes, std::cmp::Reverse(**tile)));
        heaviest.map(|(tile, _)| *tile)
    }
}
