use super::map_id::new_map_id;
use super::memory_plan::MemoryPlan;
use super::pending::Pending;
use super::resident_tiles::ResidentTiles;
use super::statistics::{IoCounts, MapStatistics};
use super::tile_files;
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::scan::{ScanUpdates, TileUpdates};
use crate::sensor::Evidence;
use crate::space::{TileIndex, VoxelIndex};
use crate::store::{Extension, Metadata, TileStore, hex};
use crate::tile::{OctreeFactory, Tile};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Which tiles are in memory: an LRU in front of the store, and the updates that wait for tiles behind it.
///
/// Resident tiles have no pending updates; what waits is applied when its tile comes in.
#[derive(Debug)]
pub(super) struct Residency {
    config: MapConfig,
    store: TileStore,
    plan: MemoryPlan,
    tiles: ResidentTiles,
    /// After the tiles: what is in flight to octrees goes with these, and need not be written any more.
    octrees: OctreeFactory,
    pending: Pending,
    /// Tiles on disk that were read or written since the map was opened, and so are known to be whole. Updates wait
    /// only for these, so that a damaged tile is found before a scan is accepted.
    known_whole: FxHashSet<TileIndex>,
    saved: BTreeSet<TileIndex>,
    /// Bytes of memory that are kept free for inserting scans: what the largest so far took.
    scan_bytes: usize,
    io: IoCounts,
    /// What the map is being built from, kept with it at the next flush.
    input: Option<Input>,
}

/// By how many bytes an update may be expected to make a tile larger, or what waits for it.
const BYTES_OF_UPDATE: usize = 4;

/// About how many bytes a new tile takes once it has these updates.
fn bytes_of_new_tile(updates: &TileUpdates) -> usize {
    const TILE: usize = 2 << 10;
    const BRICK: usize = 384;
    TILE + match updates {
        TileUpdates::Once(bricks) => BRICK * bricks.len(),
        TileUpdates::Runs(bricks) => BRICK * bricks.len(),
        // A brick of few voxels takes some 25 bytes packed, and of many as many as they.
        TileUpdates::Packed(packed) => BRICK / 25 * packed.bytes(),
        TileUpdates::Ordered(updates) => 8 * updates.len(),
    }
}

/// What a tile takes in the set of those that are known to be whole, and in that of those saved.
const KNOWN_BYTES_OF_TILE: usize = 4 * size_of::<TileIndex>();

/// An input that a map is built from, and how many scans the map had taken before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Input {
    pub(super) fingerprint: String,
    pub(super) first_scan: u64,
}

impl Residency {
    pub(super) fn new(config: MapConfig, store: TileStore) -> Self {
        let plan = MemoryPlan::new(config.memory);
        let ext = store.metadata().ext.as_ref();
        let input = ext.and_then(|ext| {
            let first_scan = ext.input_first_scan;
            ext.input_fingerprint.clone().map(|fingerprint| Input { fingerprint, first_scan })
        });
        Self {
            octrees: OctreeFactory::new(config.octree),
            plan,
            config,
            store,
            tiles: ResidentTiles::default(),
            pending: Pending::default(),
            known_whole: FxHashSet::default(),
            saved: BTreeSet::new(),
            scan_bytes: plan.least_scan_bytes,
            io: IoCounts::default(),
            input,
        }
    }

    pub(super) fn store(&self) -> &TileStore {
        &self.store
    }

    /// Does all that may fail before the updates can be accepted. The map's content stays as it is.
    ///
    /// `scan_bytes` are the bytes of memory that inserting scans takes, with these updates.
    pub(super) fn prepare(
        &mut self,
        updates: &ScanUpdates,
        scan_bytes: usize,
        scan_number: u64,
    ) -> Result<()> {
        self.scan_bytes = self.scan_bytes.max(scan_bytes);
        if self.pending.bytes() > self.plan.pending_bytes {
            // Half, so that tiles come in for many updates at a time.
            while self.pending.bytes() > self.plan.pending_bytes / 2
                && let Some(tile) = self.pending.heaviest()
            {
                self.bring_in(tile, scan_number)?;
            }
        }
        for (tile, _) in &updates.tiles {
            let is_unread = self.store.contains(*tile) && !self.known_whole.contains(tile);
            if !self.tiles.contains(*tile) && (is_unread || (self.exists(*tile) && self.has_room_to_spare()))
            {
                self.bring_in(*tile, scan_number)?;
            }
        }
        let all: usize = updates.tiles.iter().map(|(_, updates)| updates.len()).sum();
        // A tile that is made new by the updates is one tile more than there are.
        self.make_room_for(BYTES_OF_UPDATE * all, self.plan.tiles, scan_number)
    }

    /// Takes the updates: into tiles in memory at once, for the others they wait. Cannot fail.
    pub(super) fn accept(&mut self, updates: ScanUpdates) {
        let mut resident = FxHashMap::default();
        // What new tiles take only when the updates are applied to them.
        let mut coming = 0;
        for (index, tile_updates) in updates.tiles {
            let with_it = coming + bytes_of_new_tile(&tile_updates);
            if !self.exists(index) && self.has_room_for(with_it) {
                coming = with_it;
                self.tiles.put(Arc::new(Tile::empty(&self.config.grid, &self.octrees, index)));
            }
            // The tile becomes the one used last.
            match self.tiles.get(index) {
                Some(_) => {
                    self.io.hits += 1;
                    resident.insert(index, tile_updates);
                }
                None => self.pending.push(index, &tile_updates),
            }
        }
        let model = &self.config.sensor_model;
        self.tiles.change_all(resident, |tile, updates| tile.apply(model, &updates));
    }

    /// A tile, brought into memory; `None` if nothing was observed in it.
    pub(super) fn tile(&mut self, index: TileIndex, scan_number: u64) -> Result<Option<Arc<Tile>>> {
        if let Some(tile) = self.tiles.get(index) {
            self.io.hits += 1;
            return Ok(Some(tile.clone()));
        }
        if !self.exists(index) {
            return Ok(None);
        }
        let tile = Arc::new(self.read(index)?);
        // A disk that takes no tile in exchange does not keep a question from being answered.
        if self.make_room(&tile, scan_number).is_ok() {
            self.pending.applied(index);
            self.tiles.put(tile.clone());
        }
        Ok(Some(tile))
    }

    /// The evidence of a voxel, whose tile is brought into memory.
    pub(super) fn evidence(&mut self, voxel: VoxelIndex, scan_number: u64) -> Result<Option<Evidence>> {
        let index = self.config.grid.tile_of_voxel(voxel);
        if let Some(tile) = self.tiles.get(index) {
            self.io.hits += 1;
            return Ok(tile.evidence_of_own(voxel));
        }
        Ok(self.tile(index, scan_number)?.and_then(|tile| tile.evidence_of_own(voxel)))
    }

    /// A tile as it is now, without bringing it into memory.
    pub(super) fn tile_in_passing(&mut self, index: TileIndex) -> Result<Option<Arc<Tile>>> {
        if let Some(tile) = self.tiles.peek(index) {
            return Ok(Some(tile.clone()));
        }
        if !self.exists(index) {
            return Ok(None);
        }
        let loaded = tile_files::load_in_passing(&self.store, &self.config.grid, index)?;
        Ok(Some(Arc::new(self.with_waiting(index, loaded))))
    }

    /// The voxels of a tile in memory, or of its latest version on disk; what waits for it is left out.
    pub(super) fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        let resident = self.tiles.peek(index).map(|tile| tile.table().len() as u64);
        resident.or_else(|| self.store.stamp(index).map(|stamp| stamp.voxels))
    }

    /// Every tile in which something was observed, in order.
    pub(super) fn tile_indices(&self) -> Vec<TileIndex> {
        let resident = self.tiles.iter().map(|tile| tile.index());
        let mut indices: Vec<_> = self.store.tiles().chain(resident).chain(self.pending.tiles()).collect();
        indices.sort_unstable();
        indices.dedup();
        indices
    }

    /// Number of tiles in which something was observed.
    fn count_tiles(&self) -> usize {
        let is_new = |index: &TileIndex| !self.store.contains(*index);
        let resident = self.tiles.iter().filter(|tile| is_new(&tile.index())).count();
        let waiting =
            self.pending.tiles().filter(|index| is_new(index) && !self.tiles.contains(*index)).count();
        self.store.tiles().count() + resident + waiting
    }

    /// The tiles in memory, in order.
    pub(super) fn cached_tile_indices(&self) -> Vec<TileIndex> {
        let mut indices: Vec<_> = self.tiles.iter().map(|tile| tile.index()).collect();
        indices.sort_unstable();
        indices
    }

    /// Whether a tile has updates that are not on disk.
    pub(super) fn is_dirty(&self, index: TileIndex) -> bool {
        self.pending.contains(index) || self.tiles.peek(index).is_some_and(|tile| tile.is_dirty())
    }

    pub(super) fn input(&self) -> Option<&Input> {
        self.input.as_ref()
    }

    /// Flushes, and with the flush what the map is being built from now.
    pub(super) fn begin_input(&mut self, input: Input, scan_number: u64) -> Result<()> {
        let before = self.input.replace(input);
        let flushed = self.flush(scan_number);
        if flushed.is_err() {
            self.input = before;
        }
        flushed
    }

    /// Applies what waits, writes every dirty tile and commits.
    pub(super) fn flush(&mut self, scan_number: u64) -> Result<()> {
        for index in self.store.suspects() {
            // Its file cannot be trusted to be on the medium; what can be read of it is checked as always.
            if !self.tiles.contains(index) {
                self.bring_in(index, scan_number)?;
            }
            self.write(index, scan_number)?;
        }
        let mut waiting: Vec<_> = self.pending.tiles().collect();
        waiting.sort_unstable();
        for index in waiting {
            self.bring_in(index, scan_number)?;
        }
        // The files are made of the tables alone. But what statistics say of octrees is as of the flush, and tables
        // whose bricks are in order are written sooner.
        self.sync_octrees();
        for index in self.cached_tile_indices() {
            self.save(index, scan_number)?;
        }
        self.adopt()?;
        self.store.commit(self.metadata(), scan_number)
    }

    /// Drops a tile from memory, so that the next question reads it from disk.
    pub(super) fn reload(
        &mut self,
        index: TileIndex,
        discard_changes: bool,
        scan_number: u64,
    ) -> Result<bool> {
        if self.is_dirty(index) && !discard_changes {
            return Err(Error::UnsavedChanges { tile: index });
        }
        // All that may fail comes before anything is let go.
        let loaded = tile_files::load(&self.store, &self.config.grid, &self.octrees, index)?;
        if let Some((tile, _)) = &loaded
            && !self.tiles.contains(index)
        {
            self.make_room(tile, scan_number)?;
        }
        self.tiles.remove(index);
        self.pending.applied(index);
        let Some((tile, bytes)) = loaded else { return Ok(false) };
        self.io.loads += 1;
        self.io.bytes_read += bytes;
        self.known_whole.insert(index);
        self.tiles.put(Arc::new(tile));
        Ok(true)
    }

    /// The tiles written since the last call.
    pub(super) fn take_saved(&mut self) -> Vec<TileIndex> {
        std::mem::take(&mut self.saved).into_iter().collect()
    }

    pub(super) fn sync_octrees(&mut self) {
        let stale = self.tiles.iter().filter(|tile| !tile.is_octree_synced());
        let stale = stale.map(|tile| (tile.index(), ())).collect();
        self.tiles.change_all(stale, |tile, ()| tile.sync_octree());
    }

    pub(super) fn statistics(&self, scan_number: u64) -> MapStatistics {
        let mut statistics = MapStatistics {
            scan_number,
            tiles: self.count_tiles() as u64,
            cached_tiles: self.tiles.len() as u64,
            dirty_tiles: self.tiles.iter().filter(|tile| tile.is_dirty()).count() as u64,
            pending_tiles: self.pending.len() as u64,
            pending_updates: self.pending.updates() as u64,
            pending_bytes: self.pending.bytes() as u64,
            disk_bytes: self
                .store
                .tiles()
                .filter_map(|tile| self.store.stamp(tile))
                .map(|stamp| stamp.table.bytes + stamp.octree.bytes)
                .sum(),
            octrees: self.octrees.statistics(),
            io: self.io,
            ..MapStatistics::default()
        };
        self.tiles.iter().for_each(|tile| statistics.cached += tile.counts());
        statistics
    }

    /// Whether anything was observed in a tile.
    fn exists(&self, index: TileIndex) -> bool {
        self.store.contains(index) || self.pending.contains(index) || self.tiles.contains(index)
    }

    /// Puts a tile into memory with what waits for it, pushing out others first.
    fn bring_in(&mut self, index: TileIndex, scan_number: u64) -> Result<Arc<Tile>> {
        // Read first: a tile that cannot be read pushes nothing out.
        let tile = Arc::new(self.read(index)?);
        self.make_room(&tile, scan_number)?;
        self.pending.applied(index);
        self.tiles.put(tile.clone());
        Ok(tile)
    }

    /// The tile as it is on disk, with what waits for it applied.
    fn read(&mut self, index: TileIndex) -> Result<Tile> {
        let loaded = tile_files::load(&self.store, &self.config.grid, &self.octrees, index)?;
        Ok(self.with_waiting(index, loaded))
    }

    /// A tile as it is on disk, given with its bytes if it is there, and what waits for it applied.
    fn with_waiting(&mut self, index: TileIndex, loaded: Option<(Tile, u64)>) -> Tile {
        let mut tile = match loaded {
            Some((tile, bytes)) => {
                self.io.loads += 1;
                self.io.bytes_read += bytes;
                self.known_whole.insert(index);
                tile
            }
            None => Tile::empty(&self.config.grid, &self.octrees, index),
        };
        for updates in self.pending.of(index) {
            tile.apply(&self.config.sensor_model, &updates);
        }
        tile
    }

    /// Bytes of memory of all that grows.
    fn bytes(&self) -> usize {
        let known_bytes = KNOWN_BYTES_OF_TILE * self.known_whole.len();
        self.tiles.bytes() + self.pending.bytes() + self.scan_bytes + self.store.index_bytes() + known_bytes
    }

    /// Whether one more tile fits, and so many bytes with it.
    fn has_room_for(&self, bytes: usize) -> bool {
        self.tiles.len() < self.plan.tiles && self.bytes().saturating_add(bytes) <= self.plan.bytes
    }

    /// Whether a tile may come in before it has to: not when others would soon have to go for it.
    fn has_room_to_spare(&self) -> bool {
        self.has_room_for(self.plan.spare_bytes)
    }

    /// Pushes out the least recently used tiles until this one fits.
    fn make_room(&mut self, tile: &Tile, scan_number: u64) -> Result<()> {
        self.make_room_for(tile.bytes(), self.plan.tiles - 1, scan_number)
    }

    /// Pushes out the least recently used tiles until there are at most so many, and room for so many bytes. Tiles in use
    /// stay; if all are, what is to come comes on top.
    fn make_room_for(&mut self, bytes: usize, tiles: usize, scan_number: u64) -> Result<()> {
        while self.tiles.len() > tiles || self.bytes().saturating_add(bytes) > self.plan.bytes {
            let Some(index) = self.tiles.least_recently_used() else { return Ok(()) };
            self.save(index, scan_number)?;
            self.tiles.remove(index);
        }
        Ok(())
    }

    /// Writes a tile in memory if it is dirty; after an error it is as it was.
    fn save(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        if !self.tiles.peek(index).is_some_and(|tile| tile.is_dirty()) {
            return Ok(());
        }
        self.write(index, scan_number)
    }

    fn write(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        self.adopt()?;
        // Until it is written: what is on disk of it may be cut short by an attempt that fails.
        self.tiles.change(index, Tile::mark_dirty);
        let Some(tile) = self.tiles.peek(index) else { return Ok(()) };
        let stamp = tile_files::save(&mut self.store, &self.config, tile, scan_number)?;
        self.tiles.change(index, Tile::mark_clean);
        self.io.saves += 1;
        self.io.bytes_written += stamp.table.bytes + stamp.octree.bytes;
        self.known_whole.insert(index);
        self.saved.insert(index);
        Ok(())
    }

    /// Gives a map of the seed's format, before its first change, an id, a log and trailers: every tile is written
    /// anew as it is, and committed. Until that is done it stays a map of the seed's format, with the same content.
    fn adopt(&mut self) -> Result<()> {
        if self.store.metadata().ext.is_some() {
            return Ok(());
        }
        log::info!("{}: a map of the seed's format; its tiles get checksums", self.store.folder().display());
        self.store.adopt(new_map_id())?;
        for index in self.store.suspects() {
            // What an earlier attempt wrote of it cannot be trusted: it is written again from the tile's own file.
            self.store.drop_next(index);
        }
        for index in self.store.tiles().collect::<BTreeSet<_>>() {
            if self.store.stamp(index).is_some() {
                continue; // Written by an earlier attempt.
            }
            if let Some((tile, _)) = tile_files::load(&self.store, &self.config.grid, &self.octrees, index)? {
                tile_files::save(&mut self.store, &self.config, &tile, 0)?;
            }
        }
        self.store.commit(self.metadata(), 0)
    }

    fn metadata(&self) -> Metadata {
        new_metadata(&self.config, self.store.map_id().unwrap_or_default(), self.input.as_ref())
    }
}

/// The metadata of a map; bounds and numbers are the store's to fill in.
pub(super) fn new_metadata(config: &MapConfig, map_id: [u8; 16], input: Option<&Input>) -> Metadata {
    let ext = Extension {
        empty: true,
        map_id: hex(&map_id),
        flush_number: 0,
        scan_number: 0,
        sensor_model: config.sensor_model,
        occupancy_threshold: config.occupancy_threshold,
        rays: config.rays,
        input_fingerprint: input.map(|input| input.fingerprint.clone()),
        input_first_scan: input.map_or(0, |input| input.first_scan),
    };
    let (resolution_m, tile_size_m) = (config.grid.resolution_m(), config.grid.tile_size_m());
    Metadata { resolution_m, tile_size_m, bounds: None, ext: Some(ext) }
}
