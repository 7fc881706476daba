use super::compact_tiles::CompactTiles;
use super::flight::Flight;
use super::memory_plan::MemoryPlan;
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

/// The tiles in memory: resident ones in LRU order, and below them those in the compact form; and how much memory all
/// that grows may take.
#[derive(Debug)]
pub(super) struct TileCache {
    plan: MemoryPlan,
    grid: Grid,
    /// Log-odds from which a voxel is occupied, where the map stores tiles in the compact form.
    occupied_from: Option<f64>,
    resident: ResidentTiles,
    /// Declared after the tiles, so dropped after them: the octree worker does not write trees that are going away.
    octrees: OctreeFactory,
    compact: CompactTiles,
    threads: TileThreads,
    /// Bytes of memory that are kept free for inserting scans: what the largest so far took.
    scan_bytes: usize,
    hits: u64,
    encoded: u64,
    decoded: u64,
}

/// What has to go next to make room.
pub(super) enum Eviction {
    /// A resident tile goes one tier down.
    Resident(TileIndex),
    /// A tile in the compact form goes, once it is on disk.
    Compact(TileIndex),
}

/// A tile in one of the tiers.
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
            scan_bytes: plan.least_scan_bytes,
            hits: 0,
            encoded: 0,
            decoded: 0,
        }
    }

    /// Changes tiles in threads that take no other work from now on: other threads wait for the lock on the contents.
    pub(super) fn use_threads(&mut self, threads: TileThreads) {
        self.threads = threads;
    }

    /// How the memory is shared out.
    pub(super) fn plan(&self) -> &MemoryPlan {
        &self.plan
    }

    /// Whether there is a tier of tiles in the compact form. There is none where tiles are counted.
    pub(super) fn has_compact_tier(&self) -> bool {
        self.plan.has_compact_tier()
    }

    // Resident tiles.

    /// A resident tile, which becomes the one used last.
    pub(super) fn get(&mut self, index: TileIndex) -> Option<&Arc<Tile>> {
        let tile = self.resident.get(index);
        self.hits += u64::from(tile.is_some());
        tile
    }

    /// A resident tile, which keeps its place in the order.
    pub(super) fn peek(&self, index: TileIndex) -> Option<&Arc<Tile>> {
        self.resident.peek(index)
    }

    /// Notes that a scan was inserted.
    pub(super) fn note_scan(&mut self) {
        self.resident.note_scan();
    }

    /// For how many scans the resident tile that has to go next has not been used; `None` if none can go.
    pub(super) fn scans_since_oldest(&self, flight: Option<&Flight>) -> Option<u64> {
        self.resident.scans_since_oldest(|index| self.lets_go(flight, index))
    }

    /// Whether a flush that holds a resident tile lets go of it for its compact form.
    fn lets_go(&self, flight: Option<&Flight>, index: TileIndex) -> bool {
        self.has_compact_tier() && flight.is_some_and(|flight| flight.may_be_packed(index))
    }

    pub(super) fn is_resident(&self, index: TileIndex) -> bool {
        self.resident.contains(index)
    }

    /// The resident tiles, in order of their indices.
    pub(super) fn resident_indices(&self) -> Vec<TileIndex> {
        let mut indices: Vec<_> = self.resident.iter().map(|tile| tile.index()).collect();
        indices.sort_unstable();
        indices
    }

    /// The resident tiles, the one used last first.
    pub(super) fn used_last_first(&self) -> impl Iterator<Item = &Arc<Tile>> {
        self.resident.iter()
    }

    /// Makes a tile from a table, without putting it into the cache.
    pub(super) fn make_tile(&self, index: TileIndex, table: Table) -> Tile {
        Tile::from_table(&self.grid, &self.octrees, index, table)
    }

    /// Puts in new tiles, made on all cores of what is given for each; they become the ones used last.
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

    /// Puts a tile in as the one used last, in place of its compact form.
    pub(super) fn put(&mut self, tile: Arc<Tile>) {
        self.decoded += u64::from(self.compact.remove(tile.index()));
        self.resident.put(tile);
    }

    /// Changes a resident tile, which keeps its place in the order.
    pub(super) fn change<T>(&mut self, index: TileIndex, change: impl FnOnce(&mut Tile) -> T) -> Option<T> {
        self.resident.change(index, change)
    }

    /// Changes many resident tiles on all cores, each with what is given for it.
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

    /// Drops a resident tile.
    pub(super) fn drop_resident(&mut self, index: TileIndex) {
        self.resident.remove(index);
    }

    // Both tiers.

    /// A tile in whichever tier it is.
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

    /// Notes that a tile is on disk as it is.
    pub(super) fn note_on_disk(&mut self, index: TileIndex) {
        self.resident.change(index, Tile::mark_clean);
        self.compact.note_on_disk(index);
    }

    /// Whether a tile differs from its version on disk.
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
    /// A lack of memory; the tile stays where it was.
    pub(super) fn make_compact(&mut self, index: TileIndex) -> Result<()> {
        if let Some(tile) = self.resident.peek(index) {
            self.compact.encode(tile, self.occupied_from)?;
            self.encoded += 1;
        }
        self.resident.remove(index);
        Ok(())
    }

    /// Puts a tile's present content in the place of its compact form, which keeps its place in the order; tells whether
    /// it has one.
    ///
    /// # Errors
    ///
    /// A lack of memory; the compact form stays as it was.
    pub(super) fn renew_compact(&mut self, tile: &Tile) -> Result<bool> {
        let is_renewed = self.compact.renew(tile, self.occupied_from)?;
        self.encoded += u64::from(is_renewed);
        self.decoded += u64::from(is_renewed);
        Ok(is_renewed)
    }

    /// Drops a tile in the compact form.
    pub(super) fn drop_compact(&mut self, index: TileIndex) {
        self.compact.remove(index);
    }

    /// A tile in the compact form.
    pub(super) fn compact(&self, index: TileIndex) -> Option<&CompactTile> {
        self.compact.get(index)
    }

    /// The dirty tiles in the compact form that are not being saved, oldest first.
    pub(super) fn unsaved_compact(&self) -> Vec<TileIndex> {
        self.compact.unsaved()
    }

    /// How many tiles in the compact form are dirty.
    pub(super) fn dirty_compact(&self) -> usize {
        self.compact.dirty()
    }

    /// The dirty tiles in the compact form that are being saved, in no particular order.
    pub(super) fn saving_compact(&self) -> impl Iterator<Item = (TileIndex, CompactTile)> {
        self.compact.saving()
    }

    /// Whether a tile in the compact form is dirty and not being saved.
    pub(super) fn needs_save(&self, index: TileIndex) -> bool {
        self.compact.needs_save(index)
    }

    /// The dirty tile in the compact form that should be saved before it has to go, if the tier is nearly full.
    pub(super) fn next_to_save(&self) -> Option<TileIndex> {
        let is_nearly_full = self.compact.bytes() > self.plan.compact_bytes() / 4 * 3;
        is_nearly_full.then(|| self.compact.next_to_save()).flatten()
    }

    /// Whether tiles in the compact form will soon have to go, and none is clean.
    pub(super) fn is_behind(&self) -> bool {
        self.compact.bytes() > self.plan.compact_bytes() / 8 * 7 && self.compact.oldest_clean().is_none()
    }

    /// Notes that a tile in the compact form is being saved, and returns it.
    pub(super) fn begin_save(&mut self, index: TileIndex) -> Option<CompactTile> {
        self.compact.begin_save(index)
    }

    /// Notes that a save has ended. Tells whether the tile here still is the version that was saved.
    pub(super) fn save_ended(&mut self, index: TileIndex, saved: &CompactTile, is_on_disk: bool) -> bool {
        self.compact.save_ended(index, saved, is_on_disk)
    }

    /// Notes that no save is in flight.
    pub(super) fn no_save_in_flight(&mut self) {
        self.compact.no_save_in_flight();
    }

    // The memory limit. `outside` are the bytes that grow outside of the cache.

    /// Notes how much memory the index of tiles takes.
    pub(super) fn note_index(&mut self, bytes: usize) {
        self.plan.note_index(bytes);
    }

    /// Keeps memory free for scans as large as this one.
    pub(super) fn reserve_for_scan(&mut self, scan_bytes: usize) {
        if self.plan.is_enforced {
            self.scan_bytes = self.scan_bytes.max(scan_bytes);
        }
    }

    /// Whether so many more tiles fit, and so many bytes with them.
    pub(super) fn has_room_for(&self, tiles: usize, bytes: usize, outside: usize) -> bool {
        self.resident.len() + tiles <= self.plan.tiles
            && self.limited_bytes(outside).saturating_add(bytes) <= self.plan.bytes
    }

    /// Whether there are more than `tiles` resident tiles, or fewer than `bytes` free bytes.
    pub(super) fn is_over(&self, bytes: usize, tiles: usize, outside: usize) -> bool {
        self.resident.len() > tiles || self.is_short(bytes, outside)
    }

    fn is_short(&self, bytes: usize, outside: usize) -> bool {
        self.limited_bytes(outside).saturating_add(bytes) > self.plan.bytes
    }

    /// What has to go next for at most `tiles` resident tiles and `bytes` free bytes. Tiles that somebody holds stay,
    /// but for those that a flush lets go of; if all are held, nothing goes. While a flush goes on, tiles in the
    /// compact form that need no saving go first.
    pub(super) fn next_eviction(
        &self,
        bytes: usize,
        tiles: usize,
        outside: usize,
        flight: Option<&Flight>,
    ) -> Option<Eviction> {
        let is_short = self.is_short(bytes, outside);
        if !self.is_over(bytes, tiles, outside) {
            return None;
        }
        let clean = flight.and_then(|_| self.compact.oldest_clean());
        let resident = self.resident.least_recently_used(|index| self.lets_go(flight, index));
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
    /// its large ones cannot use.
    fn limited_bytes(&self, outside: usize) -> usize {
        let compact = self.compact.bytes().max(self.plan.compact_bytes());
        self.resident.bytes() + compact + self.scan_bytes + outside
    }

    /// The cache's part of the memory counts.
    pub(super) fn memory(&self) -> MemoryCounts {
        MemoryCounts {
            tiles: self.resident.bytes() as u64,
            compact_tiles: self.compact.bytes() as u64,
            scan: self.scan_bytes as u64,
            ..MemoryCounts::default()
        }
    }

    /// Adds the cache's part of the statistics.
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
