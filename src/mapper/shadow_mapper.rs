use super::{KeptScan, OutOfCoreTileMapper};
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::scan::Stop;
use crate::space::{TileIndex, TileSelection};
use crate::store::{CatalogEntry, SideFolder, TileStore};

/// Mapper of a shadow map, for an online remap: it replays tiles into a map of the same id in a folder of its own,
/// while the map's own mapper continues. The map then [takes over](super::Remapper::take_over) its tiles and scan
/// entries.
#[derive(Debug)]
pub(crate) struct ShadowMapper {
    mapper: OutOfCoreTileMapper,
    /// Declared after the mapper, so that the folder is removed once its files are closed.
    _folder: SideFolder,
}

impl ShadowMapper {
    /// Begins an empty shadow map in `MAP.remapping` next to the map; the remains of an earlier attempt are removed.
    ///
    /// # Errors
    ///
    /// Fails if another process is remapping the map, the folder has other content, the map is of the original format
    /// or a disk operation fails.
    pub(crate) fn begin(map: &TileStore, config: MapConfig, stop: Stop) -> Result<Self> {
        let map_id = map
            .map_id()
            .ok_or_else(|| Error::argument("map", "is of the original format; convert it first"))?;
        let folder = SideFolder::begin(map.disk().clone(), map.folder())?;
        let store = TileStore::create(map.disk().clone(), folder.path(), map.metadata().clone(), map_id)?;
        let mut mapper = OutOfCoreTileMapper::without_tiles(store, config, [])?;
        mapper.stop_with(stop);
        Ok(Self { mapper, _folder: folder })
    }

    /// Traces a scan within the selected tiles, or all; also returns the tiles that it changed.
    pub(crate) fn map_kept(
        &mut self,
        scan: &KeptScan,
        selection: Option<&TileSelection>,
    ) -> Result<(u64, Vec<TileIndex>)> {
        self.mapper.replay_scan(scan.number(), scan, scan.rays(), selection)
    }

    /// Records the catalog entry of a scan; entries are added in the order of their numbers.
    pub(crate) fn note(&mut self, entry: CatalogEntry) {
        self.mapper.with_store(|store| store.archive_mut().note(entry));
    }

    /// Commits the replayed tiles and entries up to the scan of this number.
    pub(crate) fn commit(&mut self, scan_number: u64) -> Result<()> {
        self.mapper.commit_replay(scan_number, false)
    }

    /// The committed store, for the map to take over.
    pub(crate) fn with_store<T>(&mut self, work: impl FnOnce(&mut TileStore) -> T) -> T {
        self.mapper.with_store(work)
    }
}
