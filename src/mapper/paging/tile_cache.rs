use super::compact_tiles::CompactTiles;
use super::memory_plan::MemoryPlan;
use super::pinned_tiles::PinnedTiles;
use super::resident_tiles::ResidentTiles;
use super::tile_threads::TileThreads;
use crate::config::{MapConfig, Storage};
use crate::error::Result;
use crate::mapper::statistics::{IoCounts, MapStatistics, MemoryCounts};
use crate::persistence::CompactTile;
use crate::space::{Grid, TileIndex};
use crate::tile::{OctreeFactory, Table, Tile};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Tiles in memory: resident ones in LRU order, and below them those in the compact form. Also enforces the memory
/// limit.
#[derive(Debug)]
pub(super) struct TileCache {
    plan: MemoryPlan,
    grid: Grid,
    /// Log-odds from which a voxel is occupied, if the map stores tiles in the compact form.
    occupied_from: Option<f64>,
    resident: ResidentTiles,
    /// Declared after the tiles and so dropped after them: the octree worker then skips trees that are being dropped.
    octrees: OctreeFactory,
    compact: CompactTiles,
    threads: TileThreads,
    /// Bytes of memory reserved for inserting scans: the most that a scan has needed so far.
    scan_bytes: usize,
    hits: u64,
    encoded: u64,
    decoded: u64,
}

/// Next step of an eviction.
pub(super) enum Eviction {
    /// Move a resident tile to the compact form, or to disk if there is no compact tier.
    Resident(TileIndex),
    /// Drop a tile in the compact form, after it was saved.
    Compact(TileIndex),
}

pub(super) enum Cached<'a> {
    Resident(&'a Arc<Tile>),
    Compact(&'a CompactTile),
}

impl TileCache {
    pub(super) fn new(config: &MapConfig) -> Self {
        let plan = MemoryPlan::of(config);
        let is_compact = config.storage == Storage::Compact;
        Self {
            plan,
            grid: config.grid,
            occupied_from: is_compact.then(|| config.occupied_log_odds()),
            resident: ResidentTiles::default(),
            octrees: OctreeFactory::new(config.octree),
            compact: CompactTiles::default(),
            threads: TileThreads::default(),
            scan_bytes: plan.min_scan_bytes,
            hits: 0,
            encoded: 0,
            decoded: 0,
        }
    }

    /// Uses dedicated threads to change tiles from now on: other threads may be waiting for the lock on the contents.
    pub(super) fn use_threads(&mut self, threads: TileThreads) {
        self.threads = threads;
    }

    pub(super) fn plan(&self) -> &MemoryPlan {
        &self.plan
    }

    /// Returns whether tiles are kept in the compact form; not if the limit is a number of tiles.
    pub(super) fn has_compact_tier(&self) -> bool {
        self.plan.has_compact_tier()
    }

    /// Returns a resident tile and marks it as the most recently used.
    pub(super) fn get(&mut self, index: TileIndex) -> Option<&Arc<Tile>> {
        let tile = self.resident.get(index);
        self.hits += u64::from(tile.is_some());
        tile
    }

    /// Returns a resident tile without changing the order.
    pub(super) fn peek(&self, index: TileIndex) -> Option<&Arc<Tile>> {
        self.resident.peek(index)
    }

    pub(super) fn note_scan(&mut self) {
        self.resident.note_scan();
    }

    /// Number of scans since the last use of the resident tile to evict next; `None` if none can be evicted.
    pub(super) fn scans_since_oldest(&self, pinned: Option<&PinnedTiles>) -> Option<u64> {
        self.resident.scans_since_oldest(|index| self.releases(pinned, index))
    }

    /// Returns whether a flush that holds a resident tile will accept its compact form instead.
    fn releases(&self, pinned: Option<&PinnedTiles>, index: TileIndex) -> bool {
        self.has_compact_tier() && pinned.is_some_and(|pinned| pinned.may_be_packed(index))
    }

    pub(super) fn is_resident(&self, index: TileIndex) -> bool {
        self.resident.contains(index)
    }

    pub(super) fn resident_indices(&self) -> Vec<TileIndex> {
        let mut indices: Vec<_> = self.resident.iter().map(|tile| tile.index()).collect();
        indices.sort_unstable();
        indices
    }

    /// The resident tiles, the most recently used first.
    pub(super) fn used_last_first(&self) -> impl Iterator<Item = &Arc<Tile>> {
        self.resident.iter()
    }

    /// Builds a tile from a table without caching it.
    pub(super) fn make_tile(&self, index: TileIndex, table: Table) -> Tile {
        Tile::from_table(&self.grid, &self.octrees, index, table)
    }

    /// Builds new tiles in parallel, each with its own argument, and inserts them as the most recently used.
    pub(super) fn put_new<T: Send>(
        &mut self,
        given: Vec<(TileIndex, T)>,
        fill: impl Fn(&mut Tile, T) + Sync,
    ) {
        let made = self.threads.map(given, |(index, given)| {
            let mut tile = Tile::empty(&self.grid, &self.octrees, index);
            fill(&mut tile, given);
            Arc::new(tile)
        });
        made.into_iter().for_each(|tile| self.resident.put(tile));
    }

    /// Inserts a tile as the most recently used and drops its compact form.
    pub(super) fn put(&mut self, tile: Arc<Tile>) {
        self.decoded += u64::from(self.compact.remove(tile.index()));
        self.resident.put(tile);
    }

    /// Changes a resident tile without changing the order.
    pub(super) fn change<T>(&mut self, index: TileIndex, change: impl FnOnce(&mut Tile) -> T) -> Option<T> {
        self.resident.change(index, change)
    }

    /// Changes many resident tiles in parallel, each with its own argument.
    pub(super) fn change_all<T: Send>(
        &mut self,
        given: FxHashMap<TileIndex, T>,
        change: impl Fn(&mut Tile, T) + Sync,
    ) {
        self.resident.change_all(&self.threads, given, change);
    }

    pub(super) fn sync_octrees(&mut self) {
        let stale = self.resident.iter().filter(|tile| !tile.is_octree_synced());
        let stale = stale.map(|tile| (tile.index(), ())).collect();
        self.resident.change_all(&self.threads, stale, |tile, ()| tile.sync_octree());
    }

    pub(super) fn drop_resident(&mut self, index: TileIndex) {
        self.resident.remove(index);
    }

    // Both tiers.

    /// Finds a tile in either tier.
    pub(super) fn find(&self, index: TileIndex) -> Option<Cached<'_>> {
        let resident = self.resident.peek(index).map(Cached::Resident);
        resident.or_else(|| self.compact.get(index).map(Cached::Compact))
    }

    pub(super) fn contains(&self, index: TileIndex) -> bool {
        self.resident.contains(index) || self.compact.contains(index)
    }

    /// The tiles of both tiers, in no particular order.
    pub(super) fn indices(&self) -> impl Iterator<Item = TileIndex> {
        self.resident.iter().map(|tile| tile.index()).chain(self.compact.indices())
    }

    /// Marks a tile as identical to its version on disk.
    pub(super) fn note_on_disk(&mut self, index: TileIndex) {
        self.resident.change(index, Tile::mark_clean);
        self.compact.note_on_disk(index);
    }

    /// Returns whether a tile differs from its version on disk.
    pub(super) fn is_dirty(&self, index: TileIndex) -> bool {
        self.resident.peek(index).is_some_and(|tile| tile.is_dirty()) || self.compact.is_dirty(index)
    }

    /// Drops a tile, dirty or not.
    pub(super) fn discard(&mut self, index: TileIndex) {
        self.resident.remove(index);
        self.compact.remove(index);
    }

    // Tiles in the compact form.

    /// Moves a resident tile into the compact form.
    ///
    /// # Errors
    ///
    /// Fails if memory is exhausted; the tile then remains resident.
    pub(super) fn make_compact(&mut self, index: TileIndex) -> Result<()> {
        if let Some(tile) = self.resident.peek(index) {
            self.compact.encode(tile, self.occupied_from)?;
            self.encoded += 1;
        }
        self.resident.remove(index);
        Ok(())
    }

    /// Replaces the compact form of a tile without changing the order; returns whether the tile has one.
    ///
    /// # Errors
    ///
    /// Fails if memory is exhausted; the compact form is then unchanged.
    pub(super) fn renew_compact(&mut self, tile: &Tile) -> Result<bool> {
        let is_renewed = self.compact.renew(tile, self.occupied_from)?;
        self.encoded += u64::from(is_renewed);
        self.decoded += u64::from(is_renewed);
        Ok(is_renewed)
    }

    pub(super) fn drop_compact(&mut self, index: TileIndex) {
        self.compact.remove(index);
    }

    pub(super) fn compact(&self, index: TileIndex) -> Option<&CompactTile> {
        self.compact.get(index)
    }

    pub(super) fn unsaved_compact(&self) -> Vec<TileIndex> {
        self.compact.unsaved()
    }

    pub(super) fn dirty_compact(&self) -> usize {
        self.compact.dirty()
    }

    /// The dirty tiles in the compact form that are being saved, in no particular order.
    pub(super) fn saving_compact(&self) -> impl Iterator<Item = (TileIndex, CompactTile)> {
        self.compact.saving()
    }

    /// Returns whether a tile in the compact form is dirty and not being saved.
    pub(super) fn needs_save(&self, index: TileIndex) -> bool {
        self.compact.needs_save(index)
    }

    /// If the tier is nearly full, returns the dirty tile in the compact form to save before it must be evicted.
    pub(super) fn next_to_save(&self) -> Option<TileIndex> {
        let is_nearly_full = self.compact.bytes() > self.plan.compact_bytes() / 4 * 3;
        is_nearly_full.then(|| self.compact.next_to_save()).flatten()
    }

    /// Returns whether the compact tier is almost full of dirty tiles.
    pub(super) fn is_behind(&self) -> bool {
        self.compact.bytes() > self.plan.compact_bytes() / 8 * 7 && self.compact.oldest_clean().is_none()
    }

    /// Marks a tile in the compact form as being saved and returns it.
    pub(super) fn begin_save(&mut self, index: TileIndex) -> Option<CompactTile> {
        self.compact.begin_save(index)
    }

    /// Records the end of a save. Returns whether the tile here is still the saved version.
    pub(super) fn save_ended(&mut self, index: TileIndex, saved: &CompactTile, is_on_disk: bool) -> bool {
        self.compact.save_ended(index, saved, is_on_disk)
    }

    pub(super) fn no_save_running(&mut self) {
        self.compact.no_save_running();
    }

    // Memory limit. `outside` is the number of bytes outside of the cache that count towards it.

    pub(super) fn note_index(&mut self, bytes: usize) {
        self.plan.note_index(bytes);
    }

    /// Reserves memory for scans of this size.
    pub(super) fn reserve_for_scan(&mut self, scan_bytes: usize) {
        if self.plan.is_enforced {
            self.scan_bytes = self.scan_bytes.max(scan_bytes);
        }
    }

    /// Returns whether `tiles` more tiles with `bytes` bytes fit.
    pub(super) fn has_room_for(&self, tiles: usize, bytes: usize, outside: usize) -> bool {
        self.resident.len() + tiles <= self.plan.tiles
            && self.limited_bytes(outside).saturating_add(bytes) <= self.plan.bytes
    }

    /// Returns whether more than `tiles` tiles are resident, or fewer than `bytes` bytes are free.
    pub(super) fn is_over(&self, bytes: usize, tiles: usize, outside: usize) -> bool {
        self.resident.len() > tiles || self.is_short(bytes, outside)
    }

    fn is_short(&self, bytes: usize, outside: usize) -> bool {
        self.limited_bytes(outside).saturating_add(bytes) > self.plan.bytes
    }

    /// Returns the next eviction until at most `tiles` tiles are resident and `bytes` bytes are free. Pinned tiles are
    /// not evicted, except those that a flush releases; `None` if all are pinned. During a flush, clean compact tiles
    /// are evicted first.
    pub(super) fn next_eviction(
        &self,
        bytes: usize,
        tiles: usize,
        outside: usize,
        pinned: Option<&PinnedTiles>,
    ) -> Option<Eviction> {
        let is_short = self.is_short(bytes, outside);
        if !self.is_over(bytes, tiles, outside) {
            return None;
        }
        let clean = pinned.and_then(|_| self.compact.oldest_clean());
        let resident = self.resident.least_recently_used(|index| self.releases(pinned, index));
        match (resident, clean.or_else(|| self.compact.oldest())) {
            (_, Some(index)) if is_short && self.compact.bytes() > self.plan.compact_bytes() => {
                Some(Eviction::Compact(index))
            }
            (Some(index), _) => Some(Eviction::Resident(index)),
            (None, Some(index)) if is_short => Some(Eviction::Compact(index)),
            _ => None,
        }
    }

    /// Bytes that count towards the limit. The compact tier counts as full: resident tiles leave small free blocks that
    /// its large blocks cannot use.
    fn limited_bytes(&self, outside: usize) -> usize {
        let compact = self.compact.bytes().max(self.plan.compact_bytes());
        self.resident.bytes() + compact + self.scan_bytes + outside
    }

    pub(super) fn memory(&self) -> MemoryCounts {
        MemoryCounts {
            tiles: self.resident.bytes() as u64,
            compact_tiles: self.compact.bytes() as u64,
            scan: self.scan_bytes as u64,
            ..MemoryCounts::default()
        }
    }

    pub(super) fn count_into(&self, statistics: &mut MapStatistics) {
        statistics.cached_tiles = self.resident.len() as u64;
        statistics.dirty_tiles = self.resident.iter().filter(|tile| tile.is_dirty()).count() as u64;
        statistics.compact_tiles = self.compact.len() as u64;
        statistics.dirty_compact_tiles = self.compact.dirty() as u64;
        statistics.octrees = self.octrees.statistics();
        let IoCounts { encoded, decoded, hits, .. } = &mut statistics.io;
        (*encoded, *decoded, *hits) = (self.encoded, self.decoded, self.hits);
        self.resident.iter().for_each(|tile| statistics.cached += tile.counts());
    }
}
