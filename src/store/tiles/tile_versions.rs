use super::tile_version::TileVersion;
use crate::space::{TileIndex, TileTable, hash_table_bytes};
use crate::store::commit::commits::Commits;
use crate::store::scans::CatalogVersion;
use rustc_hash::FxHashSet;

/// Which tiles a map has on disk and which version of each is the latest: the last commit, and what was written or
/// removed since.
#[derive(Debug, Default)]
pub struct TileVersions {
    commits: Commits,
    /// Versions written since the last commit.
    next: TileTable<TileVersion>,
    /// Versions of which a sync failed: the medium may hold anything, whatever later syncs say.
    suspect: FxHashSet<TileIndex>,
    /// Tiles that the next commit takes out of the map.
    removed: FxHashSet<TileIndex>,
    /// Tile folders that the log does not know: never read, never overwritten.
    orphans: FxHashSet<TileIndex>,
    /// Tiles of a map of the original format, which has no log.
    foreign: FxHashSet<TileIndex>,
}

/// Bytes that a commit takes for each tile that it changes, beside the index: its place among those that the last
/// record names, among those that are synced and among those that wait for their names.
const COMMIT_BYTES_OF_TILE: usize = 42;

impl TileVersions {
    pub(in crate::store) fn new(commits: Commits) -> Self {
        Self { commits, ..Self::default() }
    }

    /// The tiles of a map of the original format.
    pub(in crate::store) fn of_foreign(foreign: FxHashSet<TileIndex>) -> Self {
        Self { foreign, ..Self::default() }
    }

    pub(in crate::store) fn set_orphans(&mut self, orphans: FxHashSet<TileIndex>) {
        self.orphans = orphans;
    }

    /// The last commit.
    pub(in crate::store) fn commits(&self) -> &Commits {
        &self.commits
    }

    /// What is known of the latest version of a tile.
    pub fn version(&self, tile: TileIndex) -> Option<TileVersion> {
        let committed = || self.commits.tiles.get(tile).filter(|_| !self.removed.contains(&tile));
        self.next.get(tile).or_else(committed)
    }

    /// What is known of the latest version of each tile, in no particular order.
    pub fn versions(&self) -> impl Iterator<Item = TileVersion> {
        let is_latest = |tile: TileIndex| !self.removed.contains(&tile) && !self.next.contains(tile);
        let committed = self.commits.tiles.iter().filter(move |(tile, _)| is_latest(*tile));
        self.next.values().chain(committed.map(|(_, version)| version))
    }

    /// Whether the tile has a version on disk, committed or not.
    pub fn contains(&self, tile: TileIndex) -> bool {
        self.version(tile).is_some() || self.foreign.contains(&tile) || self.orphans.contains(&tile)
    }

    /// The tiles that have a version on disk, in no particular order.
    pub fn iter(&self) -> impl Iterator<Item = TileIndex> {
        let uncommitted = self.next.tiles().filter(|tile| !self.commits.tiles.contains(*tile));
        let committed = self.commits.tiles.tiles().filter(|tile| !self.removed.contains(tile));
        committed.chain(self.foreign.iter().copied()).chain(uncommitted)
    }

    /// Number of tiles that have a version on disk.
    pub fn count(&self) -> usize {
        let uncommitted = self.next.tiles().filter(|tile| !self.commits.tiles.contains(*tile)).count();
        self.commits.tiles.len() - self.removed.len() + self.foreign.len() + uncommitted
    }

    /// Whether the latest version of a tile is not committed.
    pub(in crate::store) fn is_uncommitted(&self, tile: TileIndex) -> bool {
        self.next.contains(tile)
    }

    pub(in crate::store) fn is_foreign(&self, tile: TileIndex) -> bool {
        self.foreign.contains(&tile)
    }

    pub(in crate::store) fn foreign(&self) -> &FxHashSet<TileIndex> {
        &self.foreign
    }

    pub(in crate::store) fn is_orphan(&self, tile: TileIndex) -> bool {
        self.orphans.contains(&tile)
    }

    /// The tile folders that the log does not name, in order.
    pub fn orphans(&self) -> Vec<TileIndex> {
        sorted(&self.orphans)
    }

    /// Bytes of memory.
    pub(in crate::store) fn bytes(&self) -> usize {
        self.commits.tiles.bytes()
            + self.commits.last_changed.bytes()
            + self.next.bytes()
            + hash_table_bytes::<TileIndex>(self.foreign.capacity() + self.orphans.capacity())
    }

    /// Bytes of memory that the next commit takes on top.
    pub(in crate::store) fn commit_bytes(&self) -> usize {
        self.next.len() * COMMIT_BYTES_OF_TILE
    }

    // What was written since the last commit.

    /// Notes that the next version of a tile is written.
    pub fn note_next(&mut self, tile: TileIndex, version: TileVersion) {
        self.suspect.remove(&tile);
        self.removed.remove(&tile);
        self.next.insert(tile, version);
    }

    /// Forgets the next version of a tile, as if it had not been written.
    pub fn drop_next(&mut self, tile: TileIndex) {
        self.suspect.remove(&tile);
        self.next.remove(tile);
    }

    /// Notes that the next commit takes a tile out of the map.
    pub(in crate::store) fn remove(&mut self, tile: TileIndex) {
        self.drop_next(tile);
        if self.commits.tiles.contains(tile) {
            self.removed.insert(tile);
        }
    }

    /// The versions written since the last commit.
    pub(in crate::store) fn next(&self) -> &TileTable<TileVersion> {
        &self.next
    }

    /// The tiles that the next commit takes out of the map, in order.
    pub(in crate::store) fn removed(&self) -> Vec<TileIndex> {
        sorted(&self.removed)
    }

    /// Notes that the next version of a tile could not be synced.
    pub(in crate::store) fn suspect(&mut self, tile: TileIndex) {
        self.suspect.insert(tile);
    }

    /// The tiles whose next version must be written again before the next commit, in order: the disk failed to sync it,
    /// and what it says of these files from then on proves nothing.
    pub fn suspects(&self) -> Vec<TileIndex> {
        sorted(&self.suspect)
    }

    // What is committed.

    /// Notes that all that was written and removed is committed. Returns what was written.
    pub(in crate::store) fn committed(
        &mut self,
        number: u64,
        scan_number: u64,
        catalog: Option<CatalogVersion>,
    ) -> TileTable<TileVersion> {
        let changed = std::mem::take(&mut self.next);
        let removed = self.removed();
        self.removed.clear();
        self.foreign.clear();
        for &tile in &removed {
            self.commits.tiles.remove(tile);
        }
        self.commits.last_removed = removed;
        self.commits.flush_number = number;
        (self.commits.scan_number, self.commits.catalog) = (scan_number, catalog);
        self.commits.tiles.extend(changed.iter());
        self.commits.last_changed = TileTable::default();
        changed
    }

    /// Notes a tile that the next commit names and whose files have their names already.
    pub(in crate::store) fn note_committed(&mut self, tile: TileIndex, version: TileVersion) {
        self.commits.tiles.insert(tile, version);
    }

    /// Notes a commit that changes no tile.
    pub(in crate::store) fn committed_nothing(&mut self, number: u64) {
        self.commits.flush_number = number;
    }

    /// Names the catalog of the last commit, where the log does not.
    pub(in crate::store) fn set_catalog(&mut self, catalog: CatalogVersion) {
        self.commits.catalog = Some(catalog);
    }

    /// Takes tiles out of the map, whatever the log says of them.
    pub(in crate::store) fn forget(&mut self, tiles: &[TileIndex]) {
        for &tile in tiles {
            self.commits.tiles.remove(tile);
            self.foreign.remove(&tile);
        }
    }

    /// Notes that nothing is left of the tiles that the last commit removed.
    pub(in crate::store) fn removals_are_durable(&mut self) {
        self.commits.last_removed.clear();
    }
}

fn sorted(tiles: &FxHashSet<TileIndex>) -> Vec<TileIndex> {
    let mut tiles: Vec<_> = tiles.iter().copied().collect();
    tiles.sort_unstable();
    tiles
}
