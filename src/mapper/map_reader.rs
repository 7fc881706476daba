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

/// A map on disk, opened to be asked: it takes no lock, beside a writer too, and never writes.
///
/// It sees the last flush before it was opened, whole, however often a writer flushes meanwhile: the writer keeps what
/// this reader sees. Only where the file system has no locks, or when another writer was started meanwhile, tiles that
/// changed are answered with [`Error::Changed`]: open the map again.
#[derive(Debug)]
pub struct MapReader {
    config: MapConfig,
    octrees: OctreeFactory,
    store: TileStore,
    /// Where the tiles are that this reader sees.
    space: TileSpace,
    disk: Arc<dyn Disk>,
    /// The tiles in order, once a disk wants to know which come next.
    order: OnceLock<Vec<TileIndex>>,
    cache: Mutex<ReaderCache>,
}

/// The tiles in memory, in the order of their last use.
#[derive(Debug)]
struct ReaderCache {
    /// With their bytes.
    tiles: LruCache<TileIndex, (Arc<Tile>, usize)>,
    bytes: usize,
    max_tiles: usize,
    max_bytes: usize,
    /// Tiles not in memory of which one voxel was asked.
    asked_once: LruCache<TileIndex, ()>,
    io: IoCounts,
}

/// Most tiles that are remembered for having been asked once.
const MAX_ASKED_ONCE: NonZeroUsize = NonZeroUsize::new(1024).unwrap();

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
            asked_once: LruCache::new(MAX_ASKED_ONCE),
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

    /// Puts a tile in and drops others, those used longest ago first, until all fit. One always does.
    fn put(&mut self, tile: Arc<Tile>) {
        let (index, bytes) = (tile.index(), tile.bytes());
        self.remove(index);
        self.asked_once.pop(&index);
        while (self.tiles.len() >= self.max_tiles || self.bytes.saturating_add(bytes) > self.max_bytes)
            && let Some((_, (_, dropped))) = self.tiles.pop_lru()
        {
            self.bytes -= dropped;
        }
        self.tiles.put(index, (tile, bytes));
        self.bytes += bytes;
    }
}

/// What only concerns a run has its defaults.
fn config_of_store(store: &TileStore) -> Result<MapConfig> {
    config_from(store.metadata(), &store.layout().metadata())?.validated()
}

impl MapReader {
    /// Opens the map in a folder, keeping up to so many bytes of tiles in memory, and one tile in any case.
    ///
    /// # Errors
    ///
    /// No map there, or damage to what tells which tiles there are.
    pub fn open(folder: impl Into<MapPath>, memory_bytes: usize) -> Result<Self> {
        Self::open_within(folder.into(), MemoryLimit::Bytes(memory_bytes))
    }

    pub(super) fn open_within(map: MapPath, memory: MemoryLimit) -> Result<Self> {
        let (disk, folder) = map.into_parts();
        Self::of_store(TileStore::open_read_only(disk.clone(), &folder)?, disk, memory)
    }

    /// Opens a snapshot of the map in a folder: it is read like the map, as of then, and in as much memory.
    ///
    /// # Errors
    ///
    /// No map or no snapshot of this name there; a damaged snapshot.
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

    /// Goes on to the last flush; whether there is a newer one than the one seen so far. Tiles in memory that have not
    /// changed stay there. From then on the writer need not keep what this reader saw before: a reader that lives long
    /// and is never refreshed costs, for each tile that is flushed anew, the bytes of the version that it sees.
    ///
    /// A reader of a snapshot, which does not change, stays where it is.
    ///
    /// # Errors
    ///
    /// As for [`MapReader::open`], and [`Error::Mismatch`] if there is another map in the folder by now. The reader
    /// goes on seeing what it saw then.
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

    /// The configuration that a map was made with, to go on with it. What only concerns a run has its defaults.
    ///
    /// # Errors
    ///
    /// No map there, or metadata that cannot be read.
    pub fn config_of(folder: impl Into<MapPath>) -> Result<MapConfig> {
        let (disk, folder) = folder.into().into_parts();
        config_of_store(&TileStore::open_read_only(disk, &folder)?)
    }

    /// What `metadata.json` says.
    pub fn metadata(&self) -> &Metadata {
        self.store.metadata()
    }

    /// Whether the map has the checksums that let damage be found; a map of the original format has none.
    pub fn is_verified(&self) -> bool {
        self.store.map_id().is_some()
    }

    /// The snapshot that this reader sees; `None` if it sees the map as it was when it was opened.
    pub fn snapshot(&self) -> Option<&SnapshotName> {
        self.store.opened_snapshot()
    }

    /// The folder of the map.
    pub fn folder(&self) -> &Path {
        self.store.folder()
    }

    /// Its files.
    pub(crate) fn store(&self) -> &TileStore {
        &self.store
    }

    /// The map's id; `None` for a map of the original format.
    pub(crate) fn map_id(&self) -> Option<[u8; 16]> {
        self.store.map_id()
    }

    /// What is known of a tile without reading it.
    pub(crate) fn version(&self, index: TileIndex) -> Option<TileVersion> {
        self.store.tiles().version(index)
    }

    /// Number of the flush that this reader sees.
    pub fn flush_number(&self) -> u64 {
        self.store.commits().flush_number
    }

    /// Observed and occupied voxels of the whole map, from the log alone; `None` for a map of the original format.
    pub fn voxel_counts(&self) -> Option<(u64, u64)> {
        self.is_verified().then(|| {
            let versions = self.store.commits().tiles.values();
            versions.fold((0, 0), |(voxels, occupied), version| {
                (voxels + version.voxels, occupied + version.occupied)
            })
        })
    }

    /// The scans of the map in order: number, time stamp and origin of each. Batches have none, and neither have maps
    /// of earlier versions.
    ///
    /// # Errors
    ///
    /// A list that cannot be read or is damaged.
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

    /// Whether the map keeps its scans.
    pub fn keeps_scans(&self) -> bool {
        self.store.archive().is_on()
    }

    /// The scans that the map keeps, in order.
    ///
    /// # Errors
    ///
    /// A map that keeps none, with a hint; a list that cannot be read or is damaged.
    pub fn kept_scans(&self) -> Result<KeptScans> {
        if !self.keeps_scans() {
            return Err(keeps_none(self.folder()));
        }
        let flush_number = self.snapshot().is_none().then(|| self.flush_number());
        Ok(KeptScans::new(self.disk.clone(), self.store.layout().clone(), self.kept_records()?, flush_number))
    }

    /// What is known of these scans without their points, by one pass over their list.
    ///
    /// # Errors
    ///
    /// A list that cannot be read or is damaged. A map that keeps no scans is none.
    pub fn kept_summary(&self) -> Result<KeptSummary> {
        self.kept_summary_with(|_| Ok(()))
    }

    /// The same; `each` sees the records in passing.
    pub(crate) fn kept_summary_with(
        &self,
        each: impl FnMut(&KeptRecord) -> Result<()>,
    ) -> Result<KeptSummary> {
        KeptSummary::of(self, each)
    }

    pub(super) fn kept_records(&self) -> Result<KeptRecords> {
        self.explained(self.store.archive().records())
    }

    /// Bytes on disk in tables and in octrees, of which a snapshot has none; `None` for a map of the original format.
    pub fn disk_bytes(&self) -> Option<(u64, u64)> {
        self.is_verified().then(|| {
            let versions = self.store.commits().tiles.values();
            versions.fold((0, 0), |(table, octree), version| {
                let octree_bytes = if self.snapshot().is_some() { 0 } else { version.octree.bytes };
                (table + version.table.bytes, octree + octree_bytes)
            })
        })
    }

    /// Bytes on disk of a tile: its table and its octree, of which a snapshot has none; `None` if the map has no such
    /// tile or is of the original format.
    pub fn tile_bytes(&self, index: TileIndex) -> Option<u64> {
        let version = self.version(index).filter(|_| self.is_verified())?;
        let octree_bytes = if self.snapshot().is_some() { 0 } else { version.octree.bytes };
        Some(version.table.bytes + octree_bytes)
    }

    /// Where the map is.
    #[doc(hidden)]
    pub fn disk(&self) -> Arc<dyn Disk> {
        self.disk.clone()
    }

    /// The table of a tile as it stands in its file, which is not kept in memory; `None` if the map has no such tile.
    pub(crate) fn read_table(&self, index: TileIndex) -> Result<Option<ReadTable>> {
        self.read_ahead(index);
        self.explained(load::load_table(&self.store, &self.config.grid, index))
    }

    /// Names the tiles behind this one to a disk that wants to know them: who looks at a tile once walks over all.
    fn read_ahead(&self, index: TileIndex) {
        let files = self.disk.files_ahead();
        // A snapshot may see a kept table in place of the present one.
        if files == 0 || self.snapshot().is_some() {
            return;
        }
        let order = self.order.get_or_init(|| self.tile_indices());
        let behind = order.partition_point(|tile| *tile <= index);
        for tile in order.iter().skip(behind).take(files) {
            self.disk.read_ahead(&self.store.layout().current(*tile, TileFile::Table));
        }
    }

    fn load(&self, index: TileIndex) -> Result<Option<(Tile, u64)>> {
        self.explained(load::load(&self.store, &self.config.grid, &self.octrees, index))
    }

    /// Looks into the cache.
    fn found<T>(&self, look: impl FnOnce(&mut ReaderCache) -> T) -> T {
        look(&mut self.cache.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// A tile that does not match the log is damage, unless a writer has flushed since and did not see this reader.
    pub(super) fn explained<T>(&self, result: Result<T>) -> Result<T> {
        result.map_err(|error| self.explain(error))
    }

    fn explain(&self, error: Error) -> Error {
        if !matches!(error, Error::Damaged { .. }) {
            return error;
        }
        let folder = self.store.folder();
        if let Some(name) = self.snapshot() {
            // Deleted meanwhile?
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
        let mut indices: Vec<_> = self.store.tiles().iter().collect();
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
        if let Some(tile) = self.found(|cache| cache.get(index)) {
            return Ok(Some(TileRef::shared(tile)));
        }
        // Other threads find theirs meanwhile.
        let Some((tile, bytes)) = self.load(index)? else { return Ok(None) };
        let tile = Arc::new(tile);
        self.found(|cache| {
            cache.io.loads += 1;
            cache.io.bytes_read += bytes;
            cache.put(tile.clone());
        });
        Ok(Some(TileRef::shared(tile)))
    }

    /// The first voxel asked of a tile that is not in memory is read from a part of its file; with the second one the
    /// tile is loaded: where two were asked, more will be.
    fn evidence(&self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        let index = self.config.grid.tile_of_voxel(voxel);
        let (tile, is_first) = self.found(|cache| {
            let tile = cache.get(index);
            let is_first = tile.is_none() && cache.asked_once.put(index, ()).is_none();
            (tile, is_first)
        });
        if let Some(tile) = tile {
            return Ok(tile.evidence(voxel));
        }
        if is_first && let Some(found) = read_voxel(&self.store, &self.config.grid, voxel) {
            self.found(|cache| cache.io.bytes_read += found.bytes);
            return Ok(found.evidence);
        }
        Ok(self.tile(index)?.and_then(|tile| tile.evidence(voxel)))
    }

    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        if let Some((tile, _)) = self.found(|cache| cache.tiles.peek(&index).cloned()) {
            return Ok(Some(TileRef::shared(tile)));
        }
        self.read_ahead(index);
        let loaded = self.explained(load::load_uncached(&self.store, &self.config.grid, index))?;
        Ok(loaded.map(|(tile, _)| TileRef::shared(Arc::new(tile))))
    }

    fn voxels_from(&self, index: TileIndex, from: f64) -> Result<Vec<Voxel>> {
        if let Some((tile, _)) = self.found(|cache| cache.tiles.peek(&index).cloned()) {
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
