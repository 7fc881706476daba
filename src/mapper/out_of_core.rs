use super::kept_scan::pose_numbers;
use super::paging::{MemoryPlan, PagedTiles, TilePager};
use super::trace_rules::trace_rules;
use super::{LiveReader, MapStatistics, MapView, Mapper, TileRef};
use crate::config::{Clearing, Layers, MapConfig, RayConfig};
use crate::error::{Error, Result};
use crate::persistence::{new_map_id, new_metadata};
use crate::scan::{
    MovingMarks, Overflow, PointBatch, ScanPoints, ScanReport, ScanTracer, ScanUpdates, Stop, updates_of_hits,
};
use crate::sensor::Evidence;
use crate::space::{TileBox, TileIndex, TileSelection, VoxelIndex};
use crate::store::{
    InputContent, InputRecord, KeptFrame, KeptMarks, KeptRecord, MapPath, Metadata, SegmentPlace,
    SnapshotName, TileStore,
};
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Map on disk with its active tiles in memory. Its size is limited by the disk, not by memory.
///
/// Flushed data survive a crash; later changes do not. Dropping a mapper does not flush.
///
/// ```
/// use voxtile::{MapConfig, MapOptions, Mapper, Queries, Scan};
///
/// # fn main() -> voxtile::Result<()> {
/// # let folder = tempfile::tempdir().unwrap();
/// # let city = folder.path().join("city");
/// let options = MapOptions::new().config(MapConfig::new(0.1, 10.0)?).create_if_missing(true);
/// let mut mapper = options.open(&city)?;
/// mapper.insert_scan(&Scan { origin: [0.0; 3], points: vec![[4.0, 0.0, 0.0]], intensities: None })?;
/// mapper.flush()?;
/// drop(mapper);
/// let mapper = options.open(&city)?;
/// assert!(mapper.occupancy_at([4.05, 0.05, 0.05])?.is_occupied());
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct OutOfCoreTileMapper {
    config: MapConfig,
    tiles: PagedTiles,
    /// Shared with other threads; created by the first call of `reader`.
    live: OnceLock<LiveReader>,
    tracer: ScanTracer,
    /// Scans with fewer points are traced concurrently with others.
    min_points_alone: usize,
}

impl OutOfCoreTileMapper {
    /// Creates an empty map in a folder that is empty or does not exist.
    ///
    /// # Errors
    ///
    /// Fails if the configuration is invalid, the folder has other content or a disk operation fails.
    pub fn create(folder: impl Into<MapPath>, config: MapConfig) -> Result<Self> {
        Self::create_as(folder, config, new_map_id())
    }

    /// Creates an empty map with the given id, for a map that will be imported as a shard of another
    /// ([`operations::move_shard`](crate::operations::move_shard())). Do not reuse an id otherwise: two maps with one
    /// id are treated as the same map.
    ///
    /// # Errors
    ///
    /// Same errors as [`OutOfCoreTileMapper::create`].
    pub fn create_as(folder: impl Into<MapPath>, config: MapConfig, map_id: [u8; 16]) -> Result<Self> {
        let (disk, folder) = folder.into().into_parts();
        let folder = &*folder;
        let mut config = config.validated_as_new()?;
        config.rays = config.rays.stored();
        let store = TileStore::create(disk, folder, new_metadata(&config, map_id, &[]), map_id)?;
        Ok(Self::new(config, store))
    }

    /// Opens a map to continue it. Grid, sensor model and occupancy threshold of `config` must equal those of the map,
    /// and so must the rule of clearing and the layers if `config` has them. [`MapReader::config_of`](super::MapReader::config_of)
    /// reads them.
    ///
    /// # Errors
    ///
    /// Fails if there is no map, another writer has it open, parameters differ or its list of tiles is damaged.
    pub fn open(folder: impl Into<MapPath>, config: MapConfig) -> Result<Self> {
        let (disk, folder) = folder.into().into_parts();
        let folder = &*folder;
        let config = config.validated()?;
        let store = TileStore::open(disk, folder)?;
        check_parameters(folder, store.metadata(), &config)?;
        let own = store.metadata().ext.as_ref().and_then(|ext| ext.rays.clearing);
        let layers = store.metadata().ext.as_ref().map_or(Layers::NONE, |ext| ext.layers);
        let config = config
            .with_storage(store.layout().storage())
            .with_clearing(own)
            .with_layers(layers)
            .validated()?;
        Ok(Self::new(config, store))
    }

    fn new(mut config: MapConfig, mut store: TileStore) -> Self {
        // Scans are kept from the next commit on. A map of the original format is upgraded before its first change.
        if config.keeps_scans {
            store.archive_mut().begin();
        }
        config.keeps_scans = store.archive().is_on();
        let scan_bytes = MemoryPlan::of(&config).scan_bytes;
        let tiles = PagedTiles::new(config.clone(), store);
        let tracer = ScanTracer::with_memory_bytes(scan_bytes);
        Self { tiles, live: OnceLock::new(), config, tracer, min_points_alone: usize::MAX }
    }

    /// Begins a new input: the `n`-th scan inserted from now on is the `n`-th scan of this input. Flushes, so that
    /// [`OutOfCoreTileMapper::resume_input`] finds the input later. The map stores the first 255 bytes of the name.
    ///
    /// # Errors
    ///
    /// Same errors as [`Mapper::flush`].
    pub fn begin_input(&mut self, input: impl Into<InputRecord>) -> Result<()> {
        let mut input = InputRecord { first_scan: self.scan_number(), ..input.into() };
        input.cut_name();
        self.pager().begin_input(input)
    }

    /// Resumes the last input of the map and returns how many of its scans the map contains: skip these and insert the
    /// rest. If the map has neither scans nor inputs, this begins the input.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::Mismatch`] if the map was last built from another input, or with other ranges or another
    /// insert mode. Otherwise same errors as [`Mapper::flush`].
    pub fn resume_input(&mut self, name: &str) -> Result<u64> {
        let scan_number = self.scan_number();
        let last = self.pager().inputs().last().cloned();
        let found = match last {
            Some(input) if input.content.is_none() && input.is_named(name) => {
                let done = scan_number - input.first_scan.min(scan_number);
                self.check_rays(&input)?;
                return Ok(done);
            }
            Some(input) if input.is_named(name) => format!("{name}, which is identified by its content"),
            Some(input) => input.name,
            None if scan_number == 0 => {
                self.begin_input(name)?;
                return Ok(0);
            }
            None => "that it does not know".to_owned(),
        };
        let wanted = name.to_owned();
        Err(Error::Mismatch { path: self.folder(), what: "been built from input", found, wanted })
    }

    /// Inputs that the map was built from, oldest first.
    pub fn inputs(&self) -> Vec<InputRecord> {
        self.pager().inputs().to_vec()
    }

    /// Records how much of the current input was read; the next flush stores it. Call this after each scan, so that
    /// each flush stores the matching state.
    pub fn note_input_content(&mut self, content: InputContent) {
        if let Some(input) = self.pager().last_input_mut() {
            input.content = Some(content);
        }
    }

    /// Checks that an input is resumed with the ranges and the insert mode that it was begun with.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::Mismatch`] if the scans were inserted with other settings: those in the record or, if it has
    /// none, those of the last flush.
    pub fn check_rays(&self, input: &InputRecord) -> Result<()> {
        let pager = self.pager();
        let of_flush = pager.store().metadata().ext.as_ref().map(|ext| ext.rays);
        match input.rays.or(of_flush) {
            Some(begun) => check_rays(pager.store().folder(), &begun, &self.config.rays),
            None => Ok(()),
        }
    }

    /// Sets a stop flag: an insertion that sees it raised ends with [`Error::Stopped`].
    pub fn stop_with(&mut self, stop: Stop) {
        self.tracer.stop_with(stop);
    }

    /// Flushes, and creates a snapshot: it keeps this state of the map under a name until it is deleted
    /// ([`operations::delete_snapshot`](crate::operations::delete_snapshot)).
    ///
    /// # Errors
    ///
    /// Fails with [`Error::AlreadyExists`] if there is a snapshot of this name. Otherwise same errors as
    /// [`Mapper::flush`].
    pub fn snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.flush()?;
        self.pager().create_snapshot(name)
    }

    /// Begins a background flush of all changes so far: another thread writes and commits them while the mapper inserts
    /// further scans. [`OutOfCoreTileMapper::flushed_scan_number`] reports when it is durable, and
    /// [`OutOfCoreTileMapper::end_flush`] waits for it. If a background flush is running, this waits for it first.
    ///
    /// A tile that a scan changes before it is written is in memory twice; both copies count towards the limit. Evicted
    /// tiles remain in memory in compressed form until the flush has ended; if they fill their share of the memory, the
    /// mapper waits for the flush. If the map has so many small tiles that the lists of tiles to write would exceed a
    /// sixteenth of the limit, this call flushes before it returns.
    ///
    /// # Errors
    ///
    /// Fails with the error of an earlier background flush. The part that runs before this returns fails as
    /// [`Mapper::flush`].
    pub fn begin_flush(&mut self) -> Result<()> {
        self.tiles.begin_flush()
    }

    /// Returns whether a background flush is running.
    pub fn is_flushing(&self) -> bool {
        self.pager().is_flushing()
    }

    /// Waits for the background flush, if one is running.
    ///
    /// # Errors
    ///
    /// Fails with the error of the flush. The map on disk is then that of an earlier flush, and memory still holds all
    /// changes.
    pub fn end_flush(&mut self) -> Result<()> {
        self.tiles.end_flush()
    }

    /// Returns a handle for queries from other threads while this mapper inserts scans and flushes. See [`LiveReader`].
    ///
    /// # Errors
    ///
    /// A map of the original format is upgraded first; fails if the upgrade fails.
    pub fn reader(&self) -> Result<LiveReader> {
        if let Some(reader) = self.live.get() {
            return Ok(reader.clone());
        }
        let bytes = MemoryPlan::of(&self.config).reader_bytes;
        let files = self.pager().open_to_readers(bytes)?;
        let new = || LiveReader::new(self.config.clone(), self.tiles.contents().clone(), files, bytes);
        Ok(self.live.get_or_init(new).clone())
    }

    /// The folder of the map.
    pub fn folder(&self) -> std::path::PathBuf {
        self.pager().store().folder().to_owned()
    }

    /// The folder of a tile, which may not exist.
    pub fn tile_folder(&self, tile: TileIndex) -> std::path::PathBuf {
        self.pager().store().layout().tile_folder(tile)
    }

    /// Returns whether the map has updates that are not flushed.
    pub fn is_dirty(&self) -> bool {
        let pager = self.pager();
        pager.scan_number() != pager.store().commits().scan_number
    }

    /// Number of the last scan that is flushed, and so survives a crash.
    pub fn flushed_scan_number(&self) -> u64 {
        self.pager().store().commits().scan_number
    }

    /// Returns whether a tile has updates that are not on disk.
    pub fn is_tile_dirty(&self, tile: TileIndex) -> bool {
        self.pager().is_dirty(tile)
    }

    /// Numbers the next scan as if `count` other scans preceded it, because a shard numbers all scans of its build
    /// ([`join`](crate::operations::join())).
    pub fn skip_scans(&mut self, count: u64) {
        self.pager().skip_scans(count);
    }

    /// Returns the tiles that evictions and flushes have written since the last call, in order. Failed writes are
    /// omitted.
    pub fn take_saved_tiles(&mut self) -> Vec<TileIndex> {
        self.pager().take_written()
    }

    /// Loads tiles into memory ahead of use, and skips tiles that do not exist. Returns the number of tiles loaded.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read, or an evicted one cannot be written.
    pub fn preload(&mut self, tiles: impl IntoIterator<Item = TileIndex>) -> Result<usize> {
        let mut count = 0;
        for tile in tiles {
            count += usize::from(self.pager().tile(tile)?.is_some());
        }
        Ok(count)
    }

    /// Reads a tile from disk again and replaces the one in memory. Returns whether the tile exists.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::UnsavedChanges`] if updates would be lost and `discard_changes` is false, or if the tile
    /// cannot be read.
    pub fn reload(&mut self, tile: TileIndex, discard_changes: bool) -> Result<bool> {
        self.pager().reload(tile, discard_changes)
    }

    /// Inserts a scan with the function `map`. If scans are kept, also stores the scan.
    fn insert(
        &mut self,
        scan: &dyn ScanPoints,
        map: impl FnOnce(&mut Self) -> Result<(ScanReport, Vec<TileIndex>)>,
    ) -> Result<ScanReport> {
        let place = if self.pager().keeps_scans() { Some(self.pager().keep(scan)?) } else { None };
        let inserted = map(self);
        let mut pager = self.pager();
        match inserted {
            Ok((report, tiles)) => {
                let kept = place.map(|place| kept_record(scan, &self.config.rays, place, &report, tiles));
                pager.note_scan(scan, kept);
                Ok(report)
            }
            Err(error) => {
                if place.is_some() {
                    pager.discard_kept();
                }
                Err(error)
            }
        }
    }

    /// Inserts scans that are traced concurrently, up to the first that must be traced alone; returns the number of
    /// inserted scans.
    fn insert_concurrently(
        &mut self,
        scans: &[&dyn ScanPoints],
        reports: &mut Vec<ScanReport>,
    ) -> Result<usize> {
        let mut traced = Vec::with_capacity(scans.len());
        for (scan, updates) in
            scans.iter().zip(self.tracer.trace_concurrently(trace_rules(&self.config, None), scans))
        {
            match updates {
                Ok(Some(updates)) => traced.push(updates),
                Ok(None) => {
                    self.min_points_alone = scan.len().min(self.min_points_alone);
                    break;
                }
                // The caller inserts this scan alone, after the earlier ones, and then reports its error.
                Err(_) => break,
            }
        }
        let count = traced.len();
        let mut waiting_bytes: usize = traced.iter().map(ScanUpdates::bytes).sum();
        for (scan, updates) in scans.iter().zip(traced) {
            waiting_bytes -= updates.bytes();
            reports.push(self.insert(*scan, |mapper| mapper.accept(updates, waiting_bytes))?);
        }
        Ok(count)
    }

    /// Traces a scan within the selected tiles, or all if `None`; also returns the tiles that it changed.
    fn map(
        &mut self,
        scan: &dyn ScanPoints,
        selection: Option<&TileSelection>,
    ) -> Result<(ScanReport, Vec<TileIndex>)> {
        self.accept_within_limit(|config, tracer, overflow| {
            tracer.trace_points(trace_rules(config, selection), scan, overflow)
        })
    }

    /// Inserts the points of a scan as hits without rays, as one batch. Points outside of the mapped region are
    /// omitted.
    ///
    /// # Errors
    ///
    /// Same errors as [`Mapper::batch_update`]; also fails if points cannot be read, or with [`Error::Stopped`].
    pub fn insert_hits(&mut self, scan: &dyn ScanPoints) -> Result<ScanReport> {
        let (report, _) = self.accept_within_limit(|config, tracer, overflow| {
            updates_of_hits(config, scan, tracer.stop(), overflow)
        })?;
        self.pager().note_batch();
        Ok(report)
    }

    /// Computes the updates of a scan and applies them. Updates that exceed the memory limit are spilled to files.
    fn accept_within_limit(
        &mut self,
        make: impl FnOnce(&MapConfig, &mut ScanTracer, Option<Overflow<'_>>) -> Result<ScanUpdates>,
    ) -> Result<(ScanReport, Vec<TileIndex>)> {
        let plan = MemoryPlan::of(&self.config);
        let tiles = &self.tiles;
        let (disk, folder, max_tiles) = {
            let pager = tiles.pager();
            (pager.store().disk().clone(), pager.store().folder().to_owned(), pager.max_tiles_of_scan())
        };
        let make_scratch = &|| disk.scratch(&folder);
        let spill = &mut |part| tiles.pager().stage(part);
        let max_bytes = plan.updates_bytes;
        let overflow = Overflow { max_bytes, max_tiles, folder: &folder, make_scratch, spill };
        let overflow = (max_bytes < usize::MAX).then_some(overflow);
        let made = make(&self.config, &mut self.tracer, overflow);
        let made = made.and_then(|updates| self.tracer.stop().check().map(|()| updates));
        let inserted = made.and_then(|updates| self.accept(updates, 0));
        if inserted.is_err() {
            self.pager().discard_staged();
        }
        inserted
    }

    /// Applies updates, while updates of other scans occupy `waiting_bytes` of memory.
    fn accept(&mut self, updates: ScanUpdates, waiting_bytes: usize) -> Result<(ScanReport, Vec<TileIndex>)> {
        let report = updates.report;
        let scan_bytes = self.tracer.bytes() + updates.bytes() + waiting_bytes;
        let mut pager = self.pager();
        pager.prepare(&updates, scan_bytes)?;
        pager.prefetch(&updates.tiles);
        let tiles = pager.accept(updates);
        Ok((report, tiles))
    }

    /// Sets the ray settings from the next scan on, such as those of a kept scan. Region and rule of clearing must be
    /// those of the map.
    ///
    /// # Errors
    ///
    /// Fails if the configuration is invalid.
    pub fn set_rays(&mut self, rays: RayConfig) -> Result<()> {
        self.config = MapConfig { rays, ..self.config.clone() }.validated()?;
        Ok(())
    }

    // Replay of kept scans.

    /// Opens a map with some tiles emptied, to replay its kept scans into them.
    pub(super) fn without_tiles(
        mut store: TileStore,
        config: MapConfig,
        tiles: impl IntoIterator<Item = TileIndex>,
    ) -> Result<Self> {
        for tile in tiles {
            store.remove(tile)?;
        }
        Ok(Self::new(config, store))
    }

    /// Replays a kept scan within the selected tiles, or all. Returns the number of updates and the tiles that it
    /// changed.
    pub(crate) fn replay_scan(
        &mut self,
        number: u64,
        scan: &dyn ScanPoints,
        rays: &RayConfig,
        selection: Option<&TileSelection>,
    ) -> Result<(u64, Vec<TileIndex>)> {
        self.config.rays = *rays;
        self.pager().set_scan_number(number.saturating_sub(1));
        let (report, tiles) = self.map(scan, selection)?;
        Ok((report.hits + report.misses, tiles))
    }

    /// Runs `work` on the store, to write a catalog of kept scans or to complete a commit.
    pub(crate) fn with_store<T>(&mut self, work: impl FnOnce(&mut TileStore) -> T) -> T {
        work(self.pager().store_mut())
    }

    /// Writes the points of a scan, and its marks of moving points, to the archive of kept scans.
    pub(super) fn write_points(&self, scan: &dyn ScanPoints) -> Result<(SegmentPlace, Option<KeptMarks>)> {
        self.pager().keep(scan)
    }

    /// Writes new marks of moving points of a kept scan to the archive of kept scans.
    pub(super) fn write_marks(&self, marks: &MovingMarks) -> Result<Option<KeptMarks>> {
        self.pager().keep_marks(marks)
    }

    /// Commits a replay; the number of scans does not change.
    pub(crate) fn commit_replay(&mut self, scan_number: u64, have_poses_changed: bool) -> Result<()> {
        let mut pager = self.pager();
        if have_poses_changed {
            pager.forget_poses_of_inputs();
        }
        pager.set_scan_number(scan_number);
        pager.flush()
    }

    /// Locks the pager for one call. A lock is needed because queries take `&self` but may load tiles.
    fn pager(&self) -> TilePager<'_> {
        self.tiles.pager()
    }
}

impl MapView for OutOfCoreTileMapper {
    fn config(&self) -> &MapConfig {
        &self.config
    }

    fn scan_number(&self) -> u64 {
        self.pager().scan_number()
    }

    fn tile_indices(&self) -> Vec<TileIndex> {
        self.pager().tile_indices()
    }

    fn tile_bounds(&self) -> Option<TileBox> {
        self.pager().space().bounds()
    }

    fn empty_around(&self, index: TileIndex) -> Option<TileBox> {
        self.pager().space().empty_around(index)
    }

    fn has_tile(&self, index: TileIndex) -> bool {
        self.pager().exists(index)
    }

    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        self.pager().cached_tile_indices()
    }

    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        Ok(self.pager().tile(index)?.map(TileRef::shared))
    }

    fn evidence(&self, voxel: VoxelIndex) -> Result<Option<Evidence>> {
        self.pager().evidence(voxel)
    }

    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        Ok(self.pager().tile_uncached(index)?.map(TileRef::shared))
    }

    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.pager().voxels_of_tile_hint(index)
    }

    fn statistics(&self) -> MapStatistics {
        self.pager().statistics()
    }
}

impl Mapper for OutOfCoreTileMapper {
    fn insert_points(&mut self, scan: &dyn ScanPoints) -> Result<ScanReport> {
        self.insert(scan, |mapper| mapper.map(scan, None))
    }

    fn insert_all(&mut self, scans: &[&dyn ScanPoints], reports: &mut Vec<ScanReport>) -> Result<()> {
        let mut left = scans;
        while !left.is_empty() {
            let most = self.tracer.max_concurrent(left.len());
            let concurrent =
                left[..most].iter().take_while(|scan| scan.len() < self.min_points_alone).count();
            let inserted =
                if concurrent > 1 { self.insert_concurrently(&left[..concurrent], reports)? } else { 0 };
            left = &left[inserted..];
            if inserted < concurrent.max(1)
                && let Some((alone, others)) = left.split_first()
            {
                reports.push(self.insert_points(*alone)?);
                left = others;
            }
        }
        Ok(())
    }

    fn insert_points_in(&mut self, scan: &dyn ScanPoints, tiles: &TileSelection) -> Result<ScanReport> {
        self.insert(scan, |mapper| mapper.map(scan, Some(tiles)))
    }

    fn batch_update(&mut self, batch: &PointBatch<'_>) -> Result<ScanReport> {
        let updates =
            batch.updates_with_layers(&self.config.grid, &self.config.sensor_model, self.config.layers())?;
        let (report, _) = self.accept(updates, 0)?;
        self.pager().note_batch();
        Ok(report)
    }

    fn flush(&mut self) -> Result<()> {
        self.pager().flush()
    }

    fn sync_octrees(&mut self) {
        self.pager().sync_octrees();
    }
}

/// Returns the record of a scan; the number is assigned when it is added to the map.
fn kept_record(
    scan: &dyn ScanPoints,
    rays: &RayConfig,
    (place, moving): (SegmentPlace, Option<KeptMarks>),
    report: &ScanReport,
    tiles: Vec<TileIndex>,
) -> KeptRecord {
    let frame = match scan.world_from_sensor() {
        Some(pose) => KeptFrame::Sensor(pose_numbers(&pose)),
        None => KeptFrame::World(scan.origin()),
    };
    KeptRecord {
        number: 0,
        stamp_ns: scan.stamp_ns(),
        frame,
        rays: *rays,
        points: scan.len() as u64,
        has_intensities: scan.has_intensities(),
        has_colours: scan.attributes().colours,
        has_classes: scan.attributes().classes,
        updates: report.hits + report.misses,
        place,
        moving,
        sweep: scan.sweep().cloned().map(Arc::new),
        body_from_sensor: scan.body_from_sensor(),
        tiles,
    }
}

fn check_rays(folder: &Path, begun: &RayConfig, rays: &RayConfig) -> Result<()> {
    let mismatch = |what, found: String, wanted: String| {
        Err(Error::Mismatch { path: folder.to_owned(), what, found, wanted })
    };
    let range = |rays: &RayConfig| {
        let max = rays.max_range_m.map_or("no limit".to_owned(), |max| format!("{max} m"));
        let nothing =
            rays.no_return_range_m.map_or(String::new(), |range| format!(", {range} m without a return"));
        format!("{} m to {max}{nothing}", rays.min_range_m)
    };
    if range(begun) != range(rays) {
        return mismatch("been built with ranges of", range(begun), range(rays));
    }
    if begun.region != rays.region {
        let region = |rays: &RayConfig| {
            rays.region.map_or("all of space".to_owned(), |tiles| {
                format!("tiles {} to {}", tiles.min(), tiles.max())
            })
        };
        return mismatch("been built of", region(begun), region(rays));
    }
    if begun.insert_mode != rays.insert_mode {
        let mode = |rays: &RayConfig| rays.insert_mode.to_string();
        return mismatch("been built with insert mode", mode(begun), mode(rays));
    }
    Ok(())
}

/// Checks that grid, sensor model, threshold and rule of clearing are those of the map.
fn check_parameters(folder: &Path, metadata: &Metadata, config: &MapConfig) -> Result<()> {
    let mismatch = |what, found: String, wanted: String| Error::Mismatch {
        path: folder.to_owned(),
        what,
        found,
        wanted,
    };
    let (resolution_m, tile_size_m) = (config.grid.resolution_m(), config.grid.tile_size_m());
    if metadata.resolution_m != resolution_m {
        let (found, wanted) = (format!("{} m", metadata.resolution_m), format!("{resolution_m} m"));
        return Err(mismatch("resolution", found, wanted));
    }
    if metadata.tile_size_m != tile_size_m {
        let (found, wanted) = (format!("{} m", metadata.tile_size_m), format!("{tile_size_m} m"));
        return Err(mismatch("tile size", found, wanted));
    }
    let own = metadata.ext.as_ref().map_or(Clearing::Octomap, |ext| ext.rays.clearing());
    if let Some(wanted) = config.rays.clearing
        && wanted != own
    {
        return Err(mismatch("rule of clearing", own.to_string(), wanted.to_string()));
    }
    let own = metadata.ext.as_ref().map_or(Layers::NONE, |ext| ext.layers);
    if let Some(wanted) = config.layers
        && wanted != own
    {
        return Err(mismatch("layers", own.to_string(), wanted.to_string()));
    }
    let Some(ext) = &metadata.ext else { return Ok(()) };
    if ext.sensor_model != config.sensor_model {
        let (found, wanted) = (ext.sensor_model.to_string(), config.sensor_model.to_string());
        return Err(mismatch("sensor model", found, wanted));
    }
    if ext.occupancy_threshold != config.occupancy_threshold {
        let (found, wanted) = (ext.occupancy_threshold.to_string(), config.occupancy_threshold.to_string());
        return Err(mismatch("occupancy threshold", found, wanted));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapper::MapReader;
    use crate::query::MapQueries;
    use crate::scan::Scan;
    use crate::space::TileBox;

    /// Builds a map of one batch of hits between two scans with rays.
    fn map_of(folder: &Path, config: MapConfig, clouds: &[Scan]) -> OutOfCoreTileMapper {
        let mut mapper = OutOfCoreTileMapper::create(folder, config).unwrap();
        mapper.insert_scan(&clouds[0]).unwrap();
        let report = mapper.insert_hits(&clouds[1]).unwrap();
        assert_eq!((report.points, report.skipped.out_of_range), (20_000, 1));
        mapper.insert_scan(&clouds[2]).unwrap();
        mapper.flush().unwrap();
        mapper
    }

    #[test]
    fn new_maps_reject_control_characters_in_the_coordinate_system() {
        let folder = tempfile::tempdir().unwrap();
        let config = |crs: &str| MapConfig { crs: Some(crs.into()), ..MapConfig::new(0.1, 1.6).unwrap() };
        for crs in ["EPSG:25832\0", "a\u{1b}[2Jb", "a\u{9b}b"] {
            let refused = OutOfCoreTileMapper::create(folder.path().join("map"), config(crs)).unwrap_err();
            assert!(refused.to_string().contains("control character"), "{refused}");
            assert!(!folder.path().join("map").exists());
            // An existing map with this text can be opened.
            config(crs).validated().unwrap();
        }
        let wkt = "PROJCS[\"Gauß\",\r\n\tUNIT[\"metre\",1]]";
        drop(OutOfCoreTileMapper::create(folder.path().join("map"), config(wkt)).unwrap());
        assert_eq!(MapReader::config_of(folder.path().join("map")).unwrap().crs.as_deref(), Some(wkt));
    }

    #[test]
    fn hits_in_little_memory_equal_those_of_one_batch() {
        let cloud = |count: i32, shift: f64| {
            let point = |k: i32| [7, 11, 13].map(|step| f64::from(k * step % 97) * 0.05 + shift);
            let mut points: Vec<_> = (0..count).map(point).collect();
            points[5] = [1e12; 3];
            Scan { origin: [0.25; 3], points, intensities: None }
        };
        let clouds = [cloud(100, -1.0), cloud(20_000, -2.0), cloud(100, -1.5)];
        let region = TileBox::of([TileIndex::new(-2, -2, -2), TileIndex::new(0, 1, 0)].into_iter());
        let folder = tempfile::tempdir().unwrap();
        for region in [None, region] {
            let config = MapConfig::new(0.1, 1.6).unwrap().with_region(region);
            let tight = config.clone().with_tight_memory_bytes(100_000);
            let [whole, parts] = ["whole", "parts"].map(|name| folder.path().join(name));
            let expected = map_of(&whole, config, &clouds);
            let found = map_of(&parts, tight, &clouds);
            assert_eq!(found.digest().unwrap(), expected.digest().unwrap());
            assert_eq!((found.scan_number(), expected.scan_number()), (3, 3));
            drop((found, expected));
            let scans = |folder: &Path| MapReader::open(folder, 1 << 20).unwrap().scans().unwrap();
            assert_eq!(scans(&parts), scans(&whole));
            assert_eq!(scans(&parts).iter().map(|scan| scan.number).collect::<Vec<_>>(), [1, 3]);
            [whole, parts].iter().for_each(|folder| std::fs::remove_dir_all(folder).unwrap());
        }
    }
}
