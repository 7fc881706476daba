use super::kept_scans::KeptScans;
use super::kept_summary::{KeptSummary, keeps_none};
use super::statistics::IoCounts;
use super::{MapStatistics, MapView, TileRef};
use crate::config::{MapConfig, MemoryLimit};
use crate::error::{Error, Result};
use crate::persistence::config_from;
use crate::persistence::load::{self, ReadTable};
use crate::persistence::one_voxel::read_voxel;
use crate::sensor::Evidence;
use crate::space::{Grid, TileBox, TileIndex, TileSpace, VoxelIndex};
use crate::store::{
    CatalogEntry, Disk, KeptRecord, KeptRecords, MapPath, Metadata, ScanRecord, SnapshotName, TileFile,
    TileStore, TileVersion, read_scans,
};
use crate::tile::{OctreeFactory, Tile, Voxel};
use lru::LruCache;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Map on disk, opened for queries. It takes no lock and never writes, and may be used while a writer is active.
///
/// It sees the last flush that was complete when it was opened, even if a writer flushes again: the writer keeps the
/// files that the reader sees. Two cases are exceptions: a file system without locks, and another writer that was
/// started later. A read of a changed tile may then fail with [`Error::Changed`]: open the map again.
#[derive(Debug)]
pub struct MapReader {
    config: MapConfig,
    octrees: OctreeFactory,
    store: TileStore,
    /// Tiles that exist as of this reader's flush.
    space: TileSpace,
    disk: Arc<dyn Disk>,
    /// The tiles in order; built when the disk supports read-ahead.
    order: OnceLock<Vec<TileIndex>>,
    cache: Mutex<ReaderCache>,
}

/// Cache of tiles in memory, in the order of their last use.
#[derive(Debug)]
struct ReaderCache {
    /// Tiles with their sizes in bytes.
    tiles: LruCache<TileIndex, (Arc<Tile>, usize)>,
    bytes: usize,
    max_tiles: usize,
    max_bytes: usize,
    /// Tiles that are not in memory, but of which one voxel was already read from the file.
    read_once: LruCache<TileIndex, ()>,
    io: IoCounts,
}

/// Largest number of tiles in `read_once`.
const MAX_READ_ONCE: NonZeroUsize = NonZeroUsize::new(1024).unwrap();

impl ReaderCache {
    fn new(memory: MemoryLimit, grid: &Grid) -> Self {
        let max_tiles = match memory {
            MemoryLimit::Tiles { tiles, .. } => tiles,
            _ => usize::MAX,
        };
        Self {
            tiles: LruCache::unbounded(),
            bytes: 0,
            max_tiles,
            max_bytes: memory.bytes(grid).unwrap_or(usize::MAX),
            read_once: LruCache::new(MAX_READ_ONCE),
            io: IoCounts::default(),
        }
    }

    fn get(&mut self, index: TileIndex) -> Option<Arc<Tile>> {
        let (tile, _) = self.tiles.get(&index)?;
        self.io.hits += 1;
        Some(tile.clone())
    }

    fn remove(&mut self, index: TileIndex) {
        self.bytes -= self.tiles.pop(&index).map_or(0, |(_, bytes)| bytes);
    }

    /// Inserts a tile and evicts the least recently used ones until all fit. The inserted tile is always kept.
    fn put(&mut self, tile: Arc<Tile>) {
        let (index, bytes) = (tile.index(), tile.bytes());
        self.remove(index);
        self.read_once.pop(&index);
        while (self.tiles.len() >= self.max_tiles || self.bytes.saturating_add(bytes) > self.max_bytes)
            && let Some((_, (_, dropped))) = self.tiles.pop_lru()
        {
            self.bytes -= dropped;
        }
        self.tiles.put(index, (tile, bytes));
        self.bytes += bytes;
    }
}

/// Returns the configuration of a map. Settings that the map does not store, such as the memory limit, have their
/// defaults.
fn config_of_store(store: &TileStore) -> Result<MapConfig> {
    config_from(store.metadata(), &store.layout().metadata())?.validated()
}

impl MapReader {
    /// Opens the map in a folder. Tiles in memory take at most `memory_bytes`, but one tile is always kept.
    ///
    /// # Errors
    ///
    /// Fails if there is no map or its list of tiles is damaged.
    pub fn open(folder: impl Into<MapPath>, memory_bytes: usize) -> Result<Self> {
        Self::open_within(folder.into(), MemoryLimit::Bytes(memory_bytes))
    }

    pub(super) fn open_within(map: MapPath, memory: MemoryLimit) -> Result<Self> {
        let (disk, folder) = map.into_parts();
        Self::of_store(TileStore::open_read_only(disk.clone(), &folder)?, disk, memory)
    }

    /// Opens a snapshot of the map in a folder, with the same memory limit as [`MapReader::open`].
    ///
    /// # Errors
    ///
    /// Fails if there is no map, no such snapshot, or the snapshot is damaged.
    pub fn open_snapshot(
        folder: impl Into<MapPath>,
        name: &SnapshotName,
        memory_bytes: usize,
    ) -> Result<Self> {
        Self::open_snapshot_within(folder.into(), name, MemoryLimit::Bytes(memory_bytes))
    }

    pub(super) fn open_snapshot_within(
        map: MapPath,
        name: &SnapshotName,
        memory: MemoryLimit,
    ) -> Result<Self> {
        let (disk, folder) = map.into_parts();
        Self::of_store(TileStore::open_snapshot(disk.clone(), &folder, name)?, disk, memory)
    }

    fn of_store(store: TileStore, disk: Arc<dyn Disk>, memory: MemoryLimit) -> Result<Self> {
        let config = config_of_store(&store)?;
        let octrees = OctreeFactory::default();
        let space = store.tiles().iter().collect();
        let cache = Mutex::new(ReaderCache::new(memory, &config.grid));
        Ok(Self { config, octrees, store, space, disk, order: OnceLock::new(), cache })
    }

    /// Updates the reader to the last flush and returns whether it is newer than the one seen so far. Unchanged tiles
    /// remain in memory. The writer may then remove the files of the earlier flush. A reader that is open for long and
    /// never refreshed costs disk space: the old version of each tile that was flushed since.
    ///
    /// A reader of a snapshot does not change.
    ///
    /// # Errors
    ///
    /// Same errors as [`MapReader::open`]; also fails with [`Error::Mismatch`] if the folder contains another map now.
    /// After an error the reader still sees its earlier flush.
    pub fn refresh(&mut self) -> Result<bool> {
        if self.snapshot().is_some() {
            return Ok(false);
        }
        let folder = self.store.folder().to_owned();
        let newer = self.disk.newer().map_err(|error| Error::io(&folder, "read", error))?;
        let disk = newer.unwrap_or_else(|| self.disk.clone());
        let store = TileStore::open_read_only(disk.clone(), &folder)?;
        let id = |store: &TileStore| store.metadata().ext.as_ref().map(|ext| ext.map_id.clone());
        let (seen, found) = (id(&self.store), id(&store));
        if seen.is_some() && seen != found {
            let [wanted, found] = [seen, found].map(|id| id.unwrap_or_else(|| "none".into()));
            return Err(Error::Mismatch { path: folder, what: "the id", found, wanted });
        }
        let config = config_of_store(&store)?;
        let is_newer = seen != found || store.commits().flush_number != self.flush_number();
        let cache = self.cache.get_mut().unwrap_or_else(PoisonError::into_inner);
        let tiles: Vec<_> = cache.tiles.iter().map(|(index, _)| *index).collect();
        for index in tiles {
            if store.tiles().version(index).is_none()
                || store.tiles().version(index) != self.store.tiles().version(index)
            {
                cache.remove(index);
            }
        }
        self.space = store.tiles().iter().collect();
        (self.store, self.config, self.disk, self.order) = (store, config, disk, OnceLock::new());
        Ok(is_newer)
    }

    /// Reads the configuration that a map was created with, for example to continue it. Settings that the map does not
    /// store, such as the memory limit, have their defaults.
    ///
    /// # Errors
    ///
    /// Fails if there is no map or its metadata cannot be read.
    pub fn config_of(folder: impl Into<MapPath>) -> Result<MapConfig> {
        let (disk, folder) = folder.into().into_parts();
        config_of_store(&TileStore::open_read_only(disk, &folder)?)
    }

    /// The content of `metadata.json`.
    pub fn metadata(&self) -> &Metadata {
        self.store.metadata()
    }

    /// Returns whether the map has checksums, so that damage can be detected. A map of the original format has none.
    pub fn is_verified(&self) -> bool {
        self.store.map_id().is_some()
    }

    /// The snapshot that this reader sees; `None` if it reads the map itself.
    pub fn snapshot(&self) -> Option<&SnapshotName> {
        self.store.opened_snapshot()
    }

    /// The folder of the map.
    pub fn folder(&self) -> &Path {
        self.store.folder()
    }

    pub(crate) fn store(&self) -> &TileStore {
        &self.store
    }

    /// The id of the map; `None` for a map of the original format.
    pub(crate) fn map_id(&self) -> Option<[u8; 16]> {
        self.store.map_id()
    }

    /// Version of a tile in the commit log; `None` if the map has no such tile.
    pub(crate) fn version(&self, index: TileIndex) -> Option<TileVersion> {
        self.store.tiles().version(index)
    }

    /// Number of the flush that this reader sees.
    pub fn flush_number(&self) -> u64 {
        self.store.commits().flush_number
    }

    /// Numbers of observed and of occupied voxels of the map, from the commit log; `None` for a map of the original
    /// format.
    pub fn voxel_counts(&self) -> Option<(u64, u64)> {
        self.is_verified().then(|| {
            let versions = self.store.commits().tiles.values();
            versions.fold((0, 0), |(voxels, occupied), version| {
                (voxels + version.voxels, occupied + version.occupied)
            })
        })
    }

    /// The scans of the map in order, each with number, time stamp and origin. A batch update has no record. Maps of
    /// earlier versions of voxtile have no records at all.
    ///
    /// # Errors
    ///
    /// Fails if the list is damaged or cannot be read.
    pub fn scans(&self) -> Result<Vec<ScanRecord>> {
        if self.keeps_scans() {
            let (mut records, mut scans) = (self.kept_records()?, Vec::new());
            while let Some(entry) = self.explained(records.next_entry())? {
                match entry {
                    CatalogEntry::Kept(scan) => {
                        scans.push(ScanRecord::new(scan.number, scan.stamp_ns, scan.origin_m()));
                    }
                    CatalogEntry::Listed(scan) => scans.push(scan),
                    _ => {}
                }
            }
            return Ok(scans);
        }
        let records = self.store.listed_records();
        read_scans(&*self.disk, self.store.layout(), self.flush_number(), records)
    }

    /// Returns whether the map keeps its scans.
    pub fn keeps_scans(&self) -> bool {
        self.store.archive().is_on()
    }

    /// The scans that the map keeps, in order.
    ///
    /// # Errors
    ///
    /// Fails if the map keeps no scans, or if their list is damaged or cannot be read.
    pub fn kept_scans(&self) -> Result<KeptScans> {
        if !self.keeps_scans() {
            return Err(keeps_none(self.folder()));
        }
        let flush_number = self.snapshot().is_none().then(|| self.flush_number());
        Ok(KeptScans::new(self.disk.clone(), self.store.layout().clone(), self.kept_records()?, flush_number))
    }

    /// Reads a summary of the kept scans in one pass over their list, without points.
    ///
    /// # Errors
    ///
    /// Fails if the map keeps no scans, or if their list is damaged or cannot be read.
    pub fn kept_summary(&self) -> Result<KeptSummary> {
        self.kept_summary_with(|_| Ok(()))
    }

    /// Like [`Self::kept_summary`]; also passes each record to `each`.
    pub(crate) fn kept_summary_with(
        &self,
        each: impl FnMut(&KeptRecord) -> Result<()>,
    ) -> Result<KeptSummary> {
        KeptSummary::of(self, each)
    }

    pub(crate) fn kept_records(&self) -> Result<KeptRecords> {
        self.explained(self.store.archive().records())
    }

    /// Bytes on disk of all tables and of all octrees; a snapshot has no octrees. `None` for a map of the original
    /// format.
    pub fn disk_bytes(&self) -> Option<(u64, u64)> {
        self.is_verified().then(|| {
            let versions = self.store.commits().tiles.values();
            versions.fold((0, 0), |(table, octree), version| {
                let octree_bytes = if self.snapshot().is_some() { 0 } else { version.octree.bytes };
                (table + version.table.bytes, octree + octree_bytes)
            })
        })
    }

    /// Bytes on disk of a tile's table and octree; a snapshot has no octrees. `None` if the map has no such tile or is
    /// of the original format.
    pub fn tile_bytes(&self, index: TileIndex) -> Option<u64> {
        let version = self.version(index).filter(|_| self.is_verified())?;
        let octree_bytes = if self.snapshot().is_some() { 0 } else { version.octree.bytes };
        Some(version.table.bytes + octree_bytes)
    }

    /// The disk that contains the map.
    #[doc(hidden)]
    pub fn disk(&self) -> Arc<dyn Disk> {
        self.disk.clone()
    }

    /// Reads the table of a tile from its file, without caching it; `None` if the map has no such tile.
    pub(crate) fn read_table(&self, index: TileIndex) -> Result<Option<ReadTable>> {
        self.read_ahead(index);
        self.explained(load::load_table(&self.store, &self.config.grid, index))
    }

    /// Announces the tiles after this one to a disk that reads ahead: uncached reads usually visit all tiles in order.
    fn read_ahead(&self, index: TileIndex) {
        let files = self.disk.files_ahead();
        // For a snapshot, the current file of a tile may not be the one that will be read.
        if files == 0 || self.snapshot().is_some() {
            return;
        }
        let order = self.order.get_or_init(|| self.tile_indices());
        let first = order.partition_point(|tile| *tile <= index);
        for tile in order.iter().skip(first).take(files) {
            self.disk.read_ahead(&self.store.layout().current(*tile, TileFile::Table));
        }
    }

    fn load(&self, index: TileIndex) -> Result<Option<(Tile, u64)>> {
        self.explained(load::load(&self.store, &self.config.grid, &self.octrees, index))
    }

    /// Locks the cache and runs `look` on it.
    fn with_cache<T>(&self, look: impl FnOnce(&mut ReaderCache) -> T) -> T {
        look(&mut self.cache.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Turns damage into [`Error::Changed`] if a writer has flushed since without seeing this reader's lock.
    pub(crate) fn explained<T>(&self, result: Result<T>) -> Result<T> {
        result.map_err(|error| self.explain(error))
    }

    fn explain(&self, error: Error) -> Error {
        if !matches!(error, Error::Damaged { .. }) {
            return error;
        }
        let folder = self.store.folder();
        if let Some(name) = self.snapshot() {
            // The snapshot may have been deleted since.
            return TileStore::open_snapshot(self.disk.clone(), folder, name).err().unwrap_or(error);
        }
        let now =
            TileStore::open_read_only(self.disk.clone(), folder).map(|store| store.commits().flush_number);
        if now.is_ok_and(|flush_number| flush_number != self.flush_number()) {
            return Error::Changed { path: folder.to_owned() };
        }
        error
    }
}

impl MapView for MapReader {
    fn config(&self) -> &MapConfig {
        &self.config
    }

    fn scan_number(&self) -> u64 {
        self.store.commits().scan_number
    }

    fn tile_indices(&self) -> Vec<TileIndex> {
        let mut indices = Vec::with_capacity(self.store.tiles().count());
        self.store.tiles().iter().for_each(|tile| indices.push(tile));
        indices.sort_unstable();
        indices
    }

    fn tile_bounds(&self) -> Option<TileBox> {
        self.space.bounds()
    }

    fn empty_around(&self, index: TileIndex) -> Option<TileBox> {
        self.space.empty_around(index)
    }

    fn has_tile(&self, index: TileIndex) -> bool {
        self.store.tiles().contains(index)
    }

    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        let cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let mut indices: Vec<_> = cache.tiles.iter().map(|(index, _)| *index).collect();
        indices.sort_unstable();
        indices
    }

    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        if let Some(tile) = self.with_cache(|cache| cache.get(index)) {
            return Ok(Some(TileRef::shared(tile)));
        }
        // The tile is loaded without the lock on the cache, so that other threads can use it.
        let Some((tile, bytes)) = self.load(index)? else { return Ok(None) };
        let tile = Arc::new(tile);
        self.with_cache(|cache| {
            cache.io.loads += 1;
            cache.io.bytes_read += bytes;
            cache.put(tile.clone());
        });
        Ok(Some(TileRef::shared(tile)))
    }

    /// The first voxel of a tile that is not in memory is read from a part of its file. The second voxel loads the
    /// tile, because more will likely follow.
    fn evidence(&self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        let index = self.config.grid.tile_of_voxel(voxel);
        let (tile, is_first) = self.with_cache(|cache| {
            let tile = cache.get(index);
            let is_first = tile.is_none() && cache.read_once.put(index, ()).is_none();
            (tile, is_first)
        });
        if let Some(tile) = tile {
            return Ok(tile.evidence(voxel));
        }
        if is_first && let Some(found) = read_voxel(&self.store, &self.config.grid, voxel) {
            self.with_cache(|cache| cache.io.bytes_read += found.bytes);
            return Ok(found.evidence);
        }
        Ok(self.tile(index)?.and_then(|tile| tile.evidence(voxel)))
    }

    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        if let Some((tile, _)) = self.with_cache(|cache| cache.tiles.peek(&index).cloned()) {
            return Ok(Some(TileRef::shared(tile)));
        }
        self.read_ahead(index);
        let loaded = self.explained(load::load_uncached(&self.store, &self.config.grid, index))?;
        Ok(loaded.map(|(tile, _)| TileRef::shared(Arc::new(tile))))
    }

    fn voxels_from(&self, index: TileIndex, from: f64) -> Result<Vec<Voxel>> {
        if let Some((tile, _)) = self.with_cache(|cache| cache.tiles.peek(&index).cloned()) {
            return Ok(tile.voxels_from(from).collect());
        }
        self.read_ahead(index);
        let loaded = load::load_voxels_from(&self.store, &self.config.grid, index, from);
        let min = self.config.grid.voxels_of_tile(index).min;
        let voxels = self.explained(loaded)?.unwrap_or_default().into_iter();
        Ok(voxels
            .map(|(code, evidence)| Voxel { index: code.to_key().to_index_from(min), evidence })
            .collect())
    }

    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.store.tiles().version(index).map(|version| version.voxels)
    }

    fn version_of_tile(&self, index: TileIndex) -> Option<TileVersion> {
        self.store.tiles().version(index)
    }

    fn statistics(&self) -> MapStatistics {
        let cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let disk_bytes = self.disk_bytes().map_or(0, |(table, octree)| table + octree);
        let mut statistics = MapStatistics {
            scan_number: self.scan_number(),
            tiles: self.store.tiles().iter().count() as u64,
            cached_tiles: cache.tiles.len() as u64,
            disk_bytes,
            io: cache.io,
            ..MapStatistics::default()
        };
        cache.tiles.iter().for_each(|(_, (tile, _))| statistics.cached += tile.counts());
        statistics
    }
}
