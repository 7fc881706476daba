use super::cold_tiles::ColdTiles;
use super::look_ahead::LookAhead;
use super::memory_plan::MemoryPlan;
use super::pending::{InFile, Pending};
use super::resident_tiles::ResidentTiles;
use super::stalls::Stalls;
use super::statistics::{IoCounts, MapStatistics};
use super::tile_files;
use super::tile_saver::TileSaver;
use super::tile_traffic::{TileTraffic, unpack};
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::scan::{ScanUpdates, TileUpdates};
use crate::sensor::Evidence;
use crate::space::{TileIndex, TileTable, VoxelIndex};
use crate::store::{InputRecord, TileStore};
use crate::tile::{OctreeFactory, Table, Tile};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Which tiles are in memory, and the updates that wait for the others.
///
/// ```text
/// ResidentTiles   ready for use, an LRU             <- updates, questions
///   ColdTiles     in the compact form               (with a limit in bytes)
///     TileStore   on disk
/// Pending         updates for tiles that are not resident, in memory and, where that is short, in files
/// ```
///
/// A tile is in one of the first two at most. Resident tiles have no pending updates; what waits is applied when its
/// tile comes in. This file takes updates and answers questions; `room` moves tiles down to make room, `waiting` sees to
/// waiting updates, `look_ahead` fetches tiles before they are needed, and `flush` makes the map durable.
#[derive(Debug)]
pub(super) struct Residency {
    pub(super) config: MapConfig,
    pub(super) store: TileStore,
    pub(super) plan: MemoryPlan,
    pub(super) tiles: ResidentTiles,
    /// After the tiles: what is in flight to octrees goes with these, and need not be written any more.
    pub(super) octrees: OctreeFactory,
    pub(super) cold: ColdTiles,
    pub(super) traffic: TileTraffic,
    pub(super) saver: TileSaver,
    pub(super) pending: Pending,
    /// What the scan that is being inserted has in files already; it counts when the scan is accepted.
    pub(super) coming: TileTable<InFile>,
    pub(super) ahead: LookAhead,
    /// Tiles that were on disk when the map was opened and were neither read nor written since, so that nobody knows whether
    /// they are whole. Updates do not wait for these, so that a damaged tile is found before a scan is accepted.
    pub(super) unread: TileTable<()>,
    pub(super) saved: TileTable<()>,
    /// Why a tile could not be saved beside the mapping; it is dirty still.
    pub(super) save_error: Option<Error>,
    /// Bytes of memory that are kept free for inserting scans: what the largest so far took.
    pub(super) scan_bytes: usize,
    pub(super) io: IoCounts,
    pub(super) stalls: Stalls,
    /// What the map was built from and, last, is being built from, kept with it at the next flush.
    pub(super) inputs: Vec<InputRecord>,
}

/// By how many bytes an update may be expected to make a tile larger, or what waits for it.
const BYTES_OF_UPDATE: usize = 4;

/// About how many bytes a new tile takes once it has these updates.
fn bytes_of_new_tile(updates: &TileUpdates) -> usize {
    const TILE: usize = 2 << 10;
    const BRICK: usize = 384;
    TILE + match updates {
        TileUpdates::Masks(bricks) => BRICK * bricks.len(),
        TileUpdates::Runs(bricks) => BRICK * bricks.len(),
        // A brick of few voxels takes some 25 bytes packed, and of many as many as they.
        TileUpdates::Packed(packed) => BRICK / 25 * packed.bytes(),
        TileUpdates::Ordered(updates) => 8 * updates.len(),
    }
}

/// A table from below, and whether it is not on disk as it is.
pub(super) struct Fetched {
    pub(super) table: Table,
    pub(super) is_dirty: bool,
}

impl Residency {
    pub(super) fn new(config: MapConfig, store: TileStore) -> Self {
        let plan = MemoryPlan::new(config.memory);
        let unread = store.tiles().chain(store.strays()).map(|tile| (tile, ())).collect();
        let inputs = store.metadata().ext.as_ref().map_or(Vec::new(), |ext| ext.inputs.clone());
        Self {
            octrees: OctreeFactory::new(config.octree),
            plan,
            store,
            tiles: ResidentTiles::default(),
            cold: ColdTiles::default(),
            traffic: TileTraffic::new(&config),
            saver: TileSaver::new(&config),
            pending: Pending::default(),
            coming: TileTable::default(),
            ahead: LookAhead::default(),
            unread,
            saved: TileTable::default(),
            save_error: None,
            scan_bytes: plan.least_scan_bytes,
            io: IoCounts::default(),
            stalls: Stalls::default(),
            inputs,
            config,
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
        if self.plan.is_kept {
            self.scan_bytes = self.scan_bytes.max(scan_bytes);
        }
        self.check_index(updates)?;
        self.take_arrived(scan_number)?;
        self.work_off(scan_number)?;
        for (tile, _) in &updates.tiles {
            let is_wanted = self.is_unread(*tile) || (self.exists(*tile) && self.has_room_to_spare());
            // What is in its file of this scan must come after what waits, which is there too.
            if is_wanted && !self.tiles.contains(*tile) && !self.coming.contains(*tile) {
                self.bring_in(*tile, scan_number)?;
            }
        }
        let all: usize = updates.tiles.iter().map(|(_, updates)| updates.len()).sum();
        // A tile that is made new by the updates is one tile more than there are.
        self.make_room_for(BYTES_OF_UPDATE * all, self.plan.tiles, scan_number)
    }

    /// Takes the updates, those that are in files already first: into tiles in memory at once, for the others they
    /// wait. Cannot fail.
    pub(super) fn accept(&mut self, updates: ScanUpdates) {
        for (index, in_file) in std::mem::take(&mut self.coming).iter() {
            self.pending.moved_to_file(index, in_file);
        }
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
        let tile = Arc::new(self.read(index, scan_number)?);
        // A disk that takes no tile in exchange does not keep a question from being answered.
        if self.make_room(&tile, scan_number).is_ok() {
            self.has_come_in(tile.clone());
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
        let fetched = self.fetch(index)?;
        let table = fetched.map(|fetched| fetched.table).unwrap_or_default();
        let mut tile = Tile::in_passing(&self.config.grid, index, table);
        self.apply_waiting(&mut tile)?;
        Ok(Some(Arc::new(tile)))
    }

    /// The voxels of a tile in memory, or of its latest version on disk; what waits for it is left out.
    pub(super) fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        let resident = self.tiles.peek(index).map(|tile| tile.table().len() as u64);
        let cold = || self.cold.get(index).map(|tile| tile.voxels);
        resident.or_else(cold).or_else(|| self.store.stamp(index).map(|stamp| stamp.voxels))
    }

    /// Every tile in which something was observed, in order.
    pub(super) fn tile_indices(&self) -> Vec<TileIndex> {
        let resident = self.tiles.iter().map(|tile| tile.index());
        let cold = self.cold.iter().map(|(index, _)| index);
        let mut indices: Vec<_> =
            self.store.tiles().chain(resident).chain(cold).chain(self.pending.tiles()).collect();
        indices.sort_unstable();
        indices.dedup();
        indices
    }

    /// Number of tiles in which something was observed.
    pub(super) fn count_tiles(&self) -> usize {
        let is_new = |index: &TileIndex| !self.store.contains(*index);
        let resident = self.tiles.iter().filter(|tile| is_new(&tile.index())).count();
        let cold = self.cold.iter().filter(|(index, _)| is_new(index)).count();
        let is_in_memory = |index| self.tiles.contains(index) || self.cold.contains(index);
        let waiting = self.pending.tiles().filter(|index| is_new(index) && !is_in_memory(*index)).count();
        self.store.count_tiles() + resident + cold + waiting
    }

    /// The tiles in memory, in order.
    pub(super) fn cached_tile_indices(&self) -> Vec<TileIndex> {
        let mut indices: Vec<_> = self.tiles.iter().map(|tile| tile.index()).collect();
        indices.sort_unstable();
        indices
    }

    /// Whether a tile has updates that are not on disk.
    pub(super) fn is_dirty(&self, index: TileIndex) -> bool {
        self.pending.contains(index)
            || self.tiles.peek(index).is_some_and(|tile| tile.is_dirty())
            || self.cold.get(index).is_some_and(|tile| tile.is_dirty)
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
        self.end_traffic(scan_number)?;
        // All that may fail comes before anything is let go.
        let loaded = tile_files::load(&self.store, &self.config.grid, &self.octrees, index)?;
        if let Some((tile, _)) = &loaded
            && !self.tiles.contains(index)
        {
            self.make_room(tile, scan_number)?;
        }
        self.tiles.remove(index);
        self.cold.remove(index);
        self.forget_waiting(index);
        let Some((tile, bytes)) = loaded else { return Ok(false) };
        self.has_read(index, bytes);
        self.tiles.put(Arc::new(tile));
        Ok(true)
    }

    /// The tiles written since the last call.
    pub(super) fn take_saved(&mut self) -> Vec<TileIndex> {
        std::mem::take(&mut self.saved).tiles().collect()
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
            pending_updates: self.pending.updates(),
            pending_bytes: self.pending.bytes() as u64,
            pending_file_bytes: self.pending.file_bytes(),
            compact_tiles: self.cold.len() as u64,
            dirty_compact_tiles: self.cold.dirty() as u64,
            disk_bytes: self.store.stamps().map(|stamp| stamp.table.bytes + stamp.octree.bytes).sum(),
            octrees: self.octrees.statistics(),
            io: self.io,
            memory: self.memory(),
            stalls: self.stalls.counts(),
            ..MapStatistics::default()
        };
        self.tiles.iter().for_each(|tile| statistics.cached += tile.counts());
        statistics
    }

    /// Whether anything was observed in a tile.
    pub(super) fn exists(&self, index: TileIndex) -> bool {
        self.store.contains(index)
            || self.pending.contains(index)
            || self.tiles.contains(index)
            || self.cold.contains(index)
    }

    /// Whether a tile is on disk and was not looked at yet.
    pub(super) fn is_unread(&self, index: TileIndex) -> bool {
        self.unread.contains(index)
    }

    /// Puts a tile into memory with what waits for it, pushing out others first.
    pub(super) fn bring_in(&mut self, index: TileIndex, scan_number: u64) -> Result<()> {
        // Read first: a tile that cannot be read pushes nothing out.
        let tile = Arc::new(self.read(index, scan_number)?);
        if !self.tiles.contains(index) {
            self.make_room(&tile, scan_number)?;
            self.has_come_in(tile);
        }
        Ok(())
    }

    /// Puts a tile with all that waited for it into memory, where there is room for it.
    pub(super) fn has_come_in(&mut self, tile: Arc<Tile>) {
        let index = tile.index();
        self.forget_waiting(index);
        self.io.unpacked += u64::from(self.cold.remove(index).is_some());
        self.tiles.put(tile);
    }

    /// A tile that is not resident, with what waits for it applied.
    pub(super) fn read(&mut self, index: TileIndex, scan_number: u64) -> Result<Tile> {
        self.end_load_of(index, scan_number)?;
        if let Some(tile) = self.tiles.peek(index) {
            return Ok(Tile::clone(tile)); // It has just arrived.
        }
        let fetched = self.fetch(index)?;
        self.made_of(index, fetched)
    }

    /// A tile made of its table, if it has one, with what waits for it applied.
    pub(super) fn made_of(&mut self, index: TileIndex, fetched: Option<Fetched>) -> Result<Tile> {
        let Fetched { table, is_dirty } =
            fetched.unwrap_or_else(|| Fetched { table: Table::default(), is_dirty: false });
        let mut tile = Tile::from_table(&self.config.grid, &self.octrees, index, table);
        if is_dirty {
            tile.mark_dirty();
        }
        self.apply_waiting(&mut tile)?;
        Ok(tile)
    }

    /// The table of a tile that is not resident, without what waits for it; `None` if it has none yet.
    fn fetch(&mut self, index: TileIndex) -> Result<Option<Fetched>> {
        if let Some(tile) = self.cold.get(index) {
            let table = unpack(&self.config.grid, index, tile)?;
            return Ok(Some(Fetched { table, is_dirty: tile.is_dirty }));
        }
        let (store, grid) = (&self.store, &self.config.grid);
        if !store.contains(index) {
            return Ok(None);
        }
        let read = self.stalls.during(|| tile_files::load_table(store, grid, index))?;
        Ok(read.map(|read| {
            self.has_read(index, read.file.bytes);
            Fetched { table: read.table, is_dirty: false }
        }))
    }

    pub(super) fn has_read(&mut self, index: TileIndex, bytes: u64) {
        self.io.loads += 1;
        self.io.bytes_read += bytes;
        self.unread.remove(index);
    }
}
