use super::tile_version::TileVersion;
use crate::space::{TileIndex, TileTable, hash_table_bytes};
use crate::store::commit::commits::Commits;
use crate::store::scans::CatalogVersion;
use rustc_hash::FxHashSet;

/// List of a map's tiles on disk with their latest versions: the last commit, and the changes since.
#[derive(Debug, Default)]
pub struct TileVersions {
    commits: Commits,
    /// Versions written since the last commit.
    next: TileTable<TileVersion>,
    /// Tiles whose sync failed. Their files may have any content, even if a later sync succeeds.
    failed_syncs: FxHashSet<TileIndex>,
    /// Tiles that the next commit removes.
    removed: FxHashSet<TileIndex>,
    /// Tile folders that the log does not name. They are neither read nor overwritten.
    orphans: FxHashSet<TileIndex>,
    /// Tiles of a map of the original format, which has no log.
    foreign: FxHashSet<TileIndex>,
}

/// Memory of a commit in bytes per changed tile, in addition to the index: entries in the last record, the tiles to
/// sync and the tiles to rename.
const COMMIT_BYTES_OF_TILE: usize = 42;

impl TileVersions {
    pub(in crate::store) fn new(commits: Commits) -> Self {
        Self { commits, ..Self::default() }
    }

    pub(in crate::store) fn of_foreign(foreign: FxHashSet<TileIndex>) -> Self {
        Self { foreign, ..Self::default() }
    }

    pub(in crate::store) fn set_orphans(&mut self, orphans: FxHashSet<TileIndex>) {
        self.orphans = orphans;
    }

    pub(in crate::store) fn commits(&self) -> &Commits {
        &self.commits
    }

    /// Latest version of a tile.
    pub fn version(&self, tile: TileIndex) -> Option<TileVersion> {
        let committed = || self.commits.tiles.get(tile).filter(|_| !self.removed.contains(&tile));
        self.next.get(tile).or_else(committed)
    }

    /// Latest versions of all tiles, in no particular order.
    pub fn versions(&self) -> impl Iterator<Item = TileVersion> {
        let is_latest = |tile: TileIndex| !self.removed.contains(&tile) && !self.next.contains(tile);
        let committed = self.commits.tiles.iter().filter(move |(tile, _)| is_latest(*tile));
        self.next.values().chain(committed.map(|(_, version)| version))
    }

    /// Returns whether the tile has a version on disk, committed or not.
    pub fn contains(&self, tile: TileIndex) -> bool {
        self.version(tile).is_some() || self.foreign.contains(&tile) || self.orphans.contains(&tile)
    }

    /// Tiles that have a version on disk, in no particular order.
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

    /// Tile folders that the log does not name, in order.
    pub fn orphans(&self) -> Vec<TileIndex> {
        sorted(&self.orphans)
    }

    pub(in crate::store) fn bytes(&self) -> usize {
        self.commits.tiles.bytes()
            + self.commits.last_changed.bytes()
            + self.next.bytes()
            + hash_table_bytes::<TileIndex>(self.foreign.capacity() + self.orphans.capacity())
    }

    /// Additional memory of the next commit in bytes.
    pub(in crate::store) fn commit_bytes(&self) -> usize {
        self.next.len() * COMMIT_BYTES_OF_TILE
    }

    // Changes since the last commit.

    /// Records that the next version of a tile is written.
    pub fn note_next(&mut self, tile: TileIndex, version: TileVersion) {
        self.failed_syncs.remove(&tile);
        self.removed.remove(&tile);
        self.next.insert(tile, version);
    }

    /// Discards the next version of a tile.
    pub fn drop_next(&mut self, tile: TileIndex) {
        self.failed_syncs.remove(&tile);
        self.next.remove(tile);
    }

    pub(in crate::store) fn remove(&mut self, tile: TileIndex) {
        self.drop_next(tile);
        if self.commits.tiles.contains(tile) {
            self.removed.insert(tile);
        }
    }

    pub(in crate::store) fn next(&self) -> &TileTable<TileVersion> {
        &self.next
    }

    pub(in crate::store) fn removed(&self) -> Vec<TileIndex> {
        sorted(&self.removed)
    }

    /// Records that the sync of a tile's next version failed.
    pub(in crate::store) fn note_failed_sync(&mut self, tile: TileIndex) {
        self.failed_syncs.insert(tile);
    }

    /// Tiles whose next version must be written again before the next commit, in order. Their sync failed, so a later
    /// successful sync proves nothing.
    pub fn failed_syncs(&self) -> Vec<TileIndex> {
        sorted(&self.failed_syncs)
    }

    // Commits.

    /// Records that all changes are committed. Returns the written versions.
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

    /// Records a tile of the next commit whose files have their final names already.
    pub(in crate::store) fn note_committed(&mut self, tile: TileIndex, version: TileVersion) {
        self.commits.tiles.insert(tile, version);
    }

    /// Records a commit that changes no tile.
    pub(in crate::store) fn committed_nothing(&mut self, number: u64) {
        self.commits.flush_number = number;
    }

    /// Sets the catalog of the last commit if the log does not name it.
    pub(in crate::store) fn set_catalog(&mut self, catalog: CatalogVersion) {
        self.commits.catalog = Some(catalog);
    }

    /// Removes tiles from the list, even if the log names them.
    pub(in crate::store) fn forget(&mut self, tiles: &[TileIndex]) {
        for &tile in tiles {
            self.commits.tiles.remove(tile);
            self.foreign.remove(&tile);
        }
    }

    /// Records that the files of tiles removed by the last commit are deleted durably.
    pub(in crate::store) fn removals_are_durable(&mut self) {
        self.commits.last_removed.clear();
    }
}

fn sorted(tiles: &FxHashSet<TileIndex>) -> Vec<TileIndex> {
    let mut tiles: Vec<_> = tiles.iter().copied().collect();
    tiles.sort_unstable();
    tiles
}
