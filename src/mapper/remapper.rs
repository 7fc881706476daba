use super::{OutOfCoreTileMapper, SideMapper};
use crate::config::{MapConfig, RayConfig};
use crate::error::Result;
use crate::scan::{ScanPoints, ScanReport, Stop};
use crate::space::{TileIndex, TileSelection};
use crate::store::{CatalogEntry, SegmentPlace, TileStore};

/// Maps some tiles of a map again, from scans that it keeps, and writes the catalog of these scans anew: one commit,
/// until which the map is as it was.
#[derive(Debug)]
pub(crate) struct Remapper {
    mapper: OutOfCoreTileMapper,
    /// Of the map, before and after.
    scan_number: u64,
}

impl Remapper {
    /// Begins with `tiles` as if nothing had been observed in them.
    pub(crate) fn begin(
        mut store: TileStore,
        config: MapConfig,
        tiles: impl IntoIterator<Item = TileIndex>,
        stop: Stop,
    ) -> Result<Self> {
        let scan_number = store.commits().scan_number;
        store.archive_mut().begin_catalog()?;
        let mut mapper = OutOfCoreTileMapper::without_tiles(store, config, tiles)?;
        mapper.stop_with(stop);
        Ok(Self { mapper, scan_number })
    }

    /// Maps what a scan says about a selection of tiles, or about all; returns the tiles that it touched, too.
    pub(crate) fn map(
        &mut self,
        number: u64,
        scan: &dyn ScanPoints,
        rays: &RayConfig,
        selection: Option<&TileSelection>,
    ) -> Result<(ScanReport, Vec<TileIndex>)> {
        self.mapper.map_again(number, scan, rays, selection)
    }

    /// Adds an entry to the new catalog; every scan of the map has its own.
    pub(crate) fn put(&mut self, entry: &CatalogEntry) -> Result<()> {
        self.mapper.with_store(|store| store.archive_mut().put(entry))
    }

    /// Copies the points of a scan to where nothing lies that is to go.
    pub(crate) fn copy_points(&mut self, place: SegmentPlace) -> Result<SegmentPlace> {
        self.mapper.with_store(|store| store.archive_mut().copy(place))
    }

    /// Writes points in place of those that a scan has.
    pub(crate) fn write_points(&mut self, scan: &dyn ScanPoints) -> Result<SegmentPlace> {
        self.mapper.pager_keep(scan)
    }

    /// Takes over what was mapped beside the map and committed there: its tiles, and its entries as the new catalog.
    pub(crate) fn take_over(&mut self, side: &mut SideMapper) -> Result<()> {
        self.mapper.with_store(|store| {
            side.with_store(|side| {
                let mut records = side.archive().records()?;
                while let Some(entry) = records.next_entry()? {
                    store.archive_mut().put(&entry)?;
                }
                // What a commit may leave to the next opening is not left here: the files need their names.
                side.checkpoint()?;
                store.swap_in(side)
            })
        })
    }

    /// Commits, with a note where the poses are no longer those of the map's inputs; then `release` removes what
    /// nothing needs any more. Returns its result.
    pub(crate) fn finish<T>(
        mut self,
        have_poses_changed: bool,
        release: impl FnOnce(&mut TileStore) -> T,
    ) -> Result<T> {
        self.mapper.commit_again(self.scan_number, have_poses_changed)?;
        Ok(self.mapper.with_store(release))
    }
}
