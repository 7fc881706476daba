use super::{OutOfCoreTileMapper, ShadowMapper};
use crate::config::{MapConfig, RayConfig};
use crate::error::Result;
use crate::scan::{MovingMarks, ScanPoints, Stop};
use crate::space::{TileIndex, TileSelection};
use crate::store::{CatalogEntry, KeptMarks, KeptRecord, SegmentPlace, TileStore};

/// Replays kept scans into some tiles of a map and rewrites the catalog of the scans. All of it is one commit; until
/// then the map is unchanged.
#[derive(Debug)]
pub(crate) struct Remapper {
    mapper: OutOfCoreTileMapper,
    /// Number of scans in the map, which a replay does not change.
    scan_number: u64,
}

impl Remapper {
    /// Opens the map for a replay into `tiles`, which are emptied.
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

    /// Traces a scan within the selected tiles, or all. Returns the number of updates and the tiles that it changed.
    pub(crate) fn map(
        &mut self,
        number: u64,
        scan: &dyn ScanPoints,
        rays: &RayConfig,
        selection: Option<&TileSelection>,
    ) -> Result<(u64, Vec<TileIndex>)> {
        self.mapper.replay_scan(number, scan, rays, selection)
    }

    /// Adds an entry to the new catalog; each scan of the map has one.
    pub(crate) fn put(&mut self, entry: &CatalogEntry) -> Result<()> {
        self.mapper.with_store(|store| store.archive_mut().put(entry))
    }

    /// Copies points or marks of a scan to a segment that is not going to be removed.
    pub(crate) fn copy(&mut self, place: SegmentPlace) -> Result<SegmentPlace> {
        self.mapper.with_store(|store| store.archive_mut().copy(place))
    }

    /// Writes points, and their marks, that replace those of a scan.
    pub(crate) fn write_points(&mut self, scan: &dyn ScanPoints, record: &mut KeptRecord) -> Result<()> {
        (record.place, record.moving) = self.mapper.write_points(scan)?;
        record.points = scan.len() as u64;
        Ok(())
    }

    /// Writes marks of moving points that replace those of a scan.
    pub(crate) fn write_marks(&mut self, marks: &MovingMarks) -> Result<Option<KeptMarks>> {
        self.mapper.write_marks(marks)
    }

    /// Adds the tiles of a shard of this map, which remains.
    pub(crate) fn link_in(&mut self, shard: &TileStore) -> Result<()> {
        self.mapper.with_store(|store| store.link_in(shard))
    }

    /// Swaps in the committed content of a shadow map: its tiles, and its entries as the new catalog.
    pub(crate) fn take_over(&mut self, side: &mut ShadowMapper) -> Result<()> {
        self.mapper.with_store(|store| {
            side.with_store(|side| {
                let mut records = side.archive().records()?;
                while let Some(entry) = records.next_entry()? {
                    store.archive_mut().put(&entry)?;
                }
                // The checkpoint gives the files their final names, which a commit may postpone.
                side.checkpoint()?;
                store.swap_in(side)
            })
        })
    }

    /// Commits; then `release` removes files that are no longer needed, and its result is returned. If
    /// `have_poses_changed`, the poses recorded with the map's inputs are removed, because they are no longer valid.
    pub(crate) fn finish<T>(
        mut self,
        have_poses_changed: bool,
        release: impl FnOnce(&mut TileStore) -> T,
    ) -> Result<T> {
        self.mapper.commit_replay(self.scan_number, have_poses_changed)?;
        Ok(self.mapper.with_store(release))
    }
}
