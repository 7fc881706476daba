use super::{KeptScan, OutOfCoreTileMapper};
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::scan::{ScanReport, Stop};
use crate::space::{TileIndex, TileSelection};
use crate::store::{CatalogEntry, SideFolder, TileStore};

/// Maps tiles of a map again beside it, while its own mapper goes on: into a map of the same id in a folder of its own,
/// whose tiles and entries of scans the map can [take over](super::Remapper::take_over).
#[derive(Debug)]
pub(crate) struct SideMapper {
    mapper: OutOfCoreTileMapper,
    /// Behind the mapper: it goes once nobody has a file in it.
    _folder: SideFolder,
}

impl SideMapper {
    /// Begins with no tile and no scan, in `MAP.remapped` beside the map; what an earlier attempt left there goes.
    ///
    /// # Errors
    ///
    /// Another process that does the same, something else in that place, a map of the original format, a disk that
    /// refuses.
    pub(crate) fn begin(map: &TileStore, config: MapConfig, stop: Stop) -> Result<Self> {
        let map_id =
            map.map_id().ok_or_else(|| Error::argument("map", "of the original format; convert it first"))?;
        let folder = SideFolder::begin(map.disk().clone(), map.folder())?;
        let store = TileStore::create(map.disk().clone(), folder.path(), map.metadata().clone(), map_id)?;
        let mut mapper = OutOfCoreTileMapper::without_tiles(store, config, [])?;
        mapper.stop_with(stop);
        Ok(Self { mapper, _folder: folder })
    }

    /// Maps what a scan says about a selection of tiles, or about all; returns the tiles that it touched, too.
    pub(crate) fn map_kept(
        &mut self,
        scan: &KeptScan,
        selection: Option<&TileSelection>,
    ) -> Result<(ScanReport, Vec<TileIndex>)> {
        self.mapper.map_again(scan.number(), scan, scan.rays(), selection)
    }

    /// Notes the entry that a scan is to have; the number of each follows that of the one before.
    pub(crate) fn note(&mut self, entry: CatalogEntry) {
        self.mapper.with_store(|store| store.archive_mut().note(entry));
    }

    /// Writes what was mapped and noted, up to the scan of this number.
    pub(crate) fn commit(&mut self, scan_number: u64) -> Result<()> {
        self.mapper.commit_again(scan_number, false)
    }

    /// What was committed, for the map to take over.
    pub(crate) fn with_store<T>(&mut self, work: impl FnOnce(&mut TileStore) -> T) -> T {
        self.mapper.with_store(work)
    }
}
