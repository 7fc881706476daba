use super::kept_scan::pose_numbers;
use super::paging::{MemoryPlan, PagedTiles, TilePager};
use super::trace_rules::trace_rules;
use super::{LiveReader, MapStatistics, MapView, Mapper, TileRef};
use crate::config::{MapConfig, RayConfig};
use crate::error::{Error, Result};
use crate::persistence::{new_map_id, new_metadata};
use crate::scan::{
    Overflow, PointBatch, ScanPoints, ScanReport, ScanTracer, ScanUpdates, Stop, updates_of_hits,
};
use crate::sensor::Evidence;
use crate::space::{TileBox, TileIndex, TileSelection, VoxelIndex};
use crate::store::{
    InputContent, InputRecord, KeptFrame, KeptRecord, MapPath, Metadata, SegmentPlace, SnapshotName,
    TileStore,
};
use std::path::Path;
use std::sync::OnceLock;

/// A map on disk with its active tiles in memory: bounded by the disk, never by memory.
///
/// What was flushed survives a crash; what came after the last flush does not. Dropping a mapper does not flush.
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
    /// What is given to other threads, once somebody asked for it.
    live: OnceLock<LiveReader>,
    tracer: ScanTracer,
    /// Scans of fewer points are traced beside others.
    fewest_points_alone: usize,
}

impl OutOfCoreTileMapper {
    /// Makes an empty map in a folder that does not exist yet or is empty.
    ///
    /// # Errors
    ///
    /// A wrong configuration, a folder with other content, a disk that refuses.
    pub fn create(folder: impl Into<MapPath>, config: MapConfig) -> Result<Self> {
        Self::create_as(folder, config, new_map_id())
    }

    /// The same with an id that the caller names: a map that is to be a piece of another
    /// ([`operations::move_shard`](crate::operations::move_shard())). Otherwise two maps of an id are taken for the
    /// same.
    ///
    /// # Errors
    ///
    /// As for [`OutOfCoreTileMapper::create`].
    pub fn create_as(folder: impl Into<MapPath>, config: MapConfig, map_id: [u8; 16]) -> Result<Self> {
        let (disk, folder) = folder.into().into_parts();
        let folder = &*folder;
        let config = config.validated_as_new()?;
        let store = TileStore::create(disk, folder, new_metadata(&config, map_id, &[]), map_id)?;
        Ok(Self::new(config, store))
    }

    /// Opens a map to go on with it. Of `config`, grid, sensor model and occupancy threshold must be the map's own;
    /// [`MapReader::config_of`](super::MapReader::config_of) reads them.
    ///
    /// # Errors
    ///
    /// No map there, another writer, other parameters, damage to what tells which tiles there are.
    pub fn open(folder: impl Into<MapPath>, config: MapConfig) -> Result<Self> {
        let (disk, folder) = folder.into().into_parts();
        let folder = &*folder;
        let config = config.validated()?;
        let store = TileStore::open(disk, folder)?;
        check_parameters(folder, store.metadata(), &config)?;
        let config = config.with_storage(store.layout().storage());
        Ok(Self::new(config, store))
    }

    fn new(mut config: MapConfig, mut store: TileStore) -> Self {
        // A map of the original format gets what this needs with its first change.
        if config.keeps_scans {
            store.archive_mut().begin();
        }
        config.keeps_scans = store.archive().is_on();
        let scan_bytes = MemoryPlan::of(&config).scan_bytes;
        let tiles = PagedTiles::new(config.clone(), store);
        let tracer = ScanTracer::with_memory_bytes(scan_bytes);
        Self { tiles, live: OnceLock::new(), config, tracer, fewest_points_alone: usize::MAX }
    }

    /// Names what the map is built from, from the next scan on: the `n`-th scan of this input becomes the `n`-th scan
    /// from here. Flushes, so that [`OutOfCoreTileMapper::resume_input`] knows it from now on. Of its name a map keeps
    /// 255 bytes.
    ///
    /// # Errors
    ///
    /// As for [`Mapper::flush`].
    pub fn begin_input(&mut self, input: impl Into<InputRecord>) -> Result<()> {
        let mut input = InputRecord { first_scan: self.scan_number(), ..input.into() };
        input.cut_name();
        self.pager().begin_input(input)
    }

    /// Goes on with the input that the map was last built from, and returns how many of its scans are in the map: pass
    /// over these and insert the rest. A map without scans that was built from nothing yet begins with the input.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] with what differs, if the map was built from another input or with other ranges or another
    /// insert mode; and as for [`Mapper::flush`].
    pub fn resume_input(&mut self, name: &str) -> Result<u64> {
        let scan_number = self.scan_number();
        let last = self.pager().inputs().last().cloned();
        let found = match last {
            Some(input) if input.content.is_none() && input.is_named(name) => {
                let done = scan_number - input.first_scan.min(scan_number);
                self.check_rays(&input)?;
                return Ok(done);
            }
            Some(input) if input.is_named(name) => format!("{name}, which is known by its content"),
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

    /// What the map was built from, the latest last.
    pub fn inputs(&self) -> Vec<InputRecord> {
        self.pager().inputs().to_vec()
    }

    /// Says what has been taken of the input that the map is being built from; the next flush keeps it. To be said
    /// after each scan, so that every flush has what belongs to it.
    pub fn note_input_content(&mut self, content: InputContent) {
        if let Some(input) = self.pager().last_input_mut() {
            input.content = Some(content);
        }
    }

    /// An input that was begun with some ranges and insert mode goes on with them.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] if the map took its scans with others: those that the record names or, if it names none, those
    /// of the last flush.
    pub fn check_rays(&self, input: &InputRecord) -> Result<()> {
        let pager = self.pager();
        let of_flush = pager.store().metadata().ext.as_ref().map(|ext| ext.rays);
        match input.rays.or(of_flush) {
            Some(begun) => check_rays(pager.store().folder(), &begun, &self.config.rays),
            None => Ok(()),
        }
    }

    /// Lets a scan that is being inserted be given up: [`Mapper::insert_points`] then ends with [`Error::Stopped`].
    pub fn stop_with(&mut self, stop: Stop) {
        self.tracer.stop_with(stop);
    }

    /// Flushes, and keeps the map as it is then under a name: a snapshot, which stays until it is deleted
    /// ([`operations::delete_snapshot`](crate::operations::delete_snapshot)).
    ///
    /// # Errors
    ///
    /// [`Error::AlreadyExists`] if there is one of this name; as for [`Mapper::flush`].
    pub fn snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.flush()?;
        self.pager().create_snapshot(name)
    }

    /// Begins a flush of all that was accepted until now, beside the mapper: a thread of its own writes and commits it,
    /// and scans go on meanwhile. [`OutOfCoreTileMapper::flushed_scan_number`] tells when it is durable, and
    /// [`OutOfCoreTileMapper::end_flush`] waits for it. One that is under way ends first.
    ///
    /// Tiles that a scan changes before they are written are in memory twice; both count in the limit. A tile that has
    /// to go waits in the compact form; the mapper waits for the flush where these fill their part of the memory. Where
    /// the lists of very many small tiles would take more than a sixteenth of the limit, the map is flushed before this
    /// returns.
    ///
    /// # Errors
    ///
    /// Why an earlier one has failed; and as for [`Mapper::flush`], for what comes before it goes on beside the mapper.
    pub fn begin_flush(&mut self) -> Result<()> {
        self.tiles.begin_flush()
    }

    /// Whether a flush goes on beside the mapper.
    pub fn is_flushing(&self) -> bool {
        self.pager().is_flushing()
    }

    /// Waits for a flush beside the mapper, if there is one.
    ///
    /// # Errors
    ///
    /// Why it has failed: the map on disk is as of an earlier flush, and nothing in memory is lost.
    pub fn end_flush(&mut self) -> Result<()> {
        self.tiles.end_flush()
    }

    /// A handle for other threads: it answers queries while this mapper inserts scans and flushes. See [`LiveReader`].
    ///
    /// # Errors
    ///
    /// A map of the original format is upgraded first, which fails if the disk refuses.
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

    /// The folder of a tile, whether it exists or not.
    pub fn tile_folder(&self, tile: TileIndex) -> std::path::PathBuf {
        self.pager().store().layout().tile_folder(tile)
    }

    /// Whether the map has updates that no flush has made durable.
    pub fn is_dirty(&self) -> bool {
        let pager = self.pager();
        pager.scan_number() != pager.store().commits().scan_number
    }

    /// Number of the last scan in the last flush: what a crash cannot take away.
    pub fn flushed_scan_number(&self) -> u64 {
        self.pager().store().commits().scan_number
    }

    /// Whether a tile has updates that are not on disk.
    pub fn is_tile_dirty(&self, tile: TileIndex) -> bool {
        self.pager().is_dirty(tile)
    }

    /// The tiles written, by eviction or flush, since the last call, in order; successful writes only.
    pub fn take_saved_tiles(&mut self) -> Vec<TileIndex> {
        self.pager().take_written()
    }

    /// Brings tiles into memory ahead of use; those that do not exist are left out. Returns how many came.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read, or one pushed out that cannot be written.
    pub fn preload(&mut self, tiles: impl IntoIterator<Item = TileIndex>) -> Result<usize> {
        let mut count = 0;
        for tile in tiles {
            count += usize::from(self.pager().tile(tile)?.is_some());
        }
        Ok(count)
    }

    /// Reads a tile from disk again, in place of the one in memory. Returns whether it exists.
    ///
    /// # Errors
    ///
    /// [`Error::UnsavedChanges`] if updates would be lost and `discard_changes` is false; a tile that cannot be read.
    pub fn reload(&mut self, tile: TileIndex, discard_changes: bool) -> Result<bool> {
        self.pager().reload(tile, discard_changes)
    }

    /// Inserts a scan by `map`, and keeps it if the map keeps scans.
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
                    pager.give_up_kept();
                }
                Err(error)
            }
        }
    }

    /// Inserts scans that are traced beside each other, up to the first that has to be traced by itself; returns how many
    /// were inserted.
    fn insert_beside(&mut self, scans: &[&dyn ScanPoints], reports: &mut Vec<ScanReport>) -> Result<usize> {
        let mut traced = Vec::with_capacity(scans.len());
        for (scan, updates) in
            scans.iter().zip(self.tracer.trace_beside(trace_rules(&self.config, None), scans))
        {
            match updates {
                Ok(Some(updates)) => traced.push(updates),
                Ok(None) => {
                    self.fewest_points_alone = scan.len().min(self.fewest_points_alone);
                    break;
                }
                // By itself it fails again, once those before it are in the map.
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

    /// Maps what a scan says about a selection of tiles, or about all; returns the tiles that it touched, too.
    fn map(
        &mut self,
        scan: &dyn ScanPoints,
        selection: Option<&TileSelection>,
    ) -> Result<(ScanReport, Vec<TileIndex>)> {
        self.accept_within_limit(|config, tracer, overflow| {
            tracer.trace_points(trace_rules(config, selection), scan, overflow)
        })
    }

    /// Takes the points of a scan as hits alone, as one batch; those outside of the region of the rays are left out.
    ///
    /// # Errors
    ///
    /// As for [`Mapper::batch_update`]; points that cannot be read; [`Error::Stopped`].
    pub fn insert_hits(&mut self, scan: &dyn ScanPoints) -> Result<ScanReport> {
        let (report, _) = self.accept_within_limit(|config, tracer, overflow| {
            updates_of_hits(config, scan, tracer.stop(), overflow)
        })?;
        self.pager().note_batch();
        Ok(report)
    }

    /// Makes the updates of a scan and accepts them. Those that exceed the memory limit go to files meanwhile.
    fn accept_within_limit(
        &mut self,
        make: impl FnOnce(&MapConfig, &mut ScanTracer, Option<Overflow<'_>>) -> Result<ScanUpdates>,
    ) -> Result<(ScanReport, Vec<TileIndex>)> {
        let plan = MemoryPlan::of(&self.config);
        let tiles = &self.tiles;
        let (disk, folder, max_tiles) = {
            let pager = tiles.pager();
            (pager.store().disk().clone(), pager.store().folder().to_owned(), pager.most_tiles_of_scan())
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

    /// Accepts updates, while those of other scans wait and take so many bytes.
    fn accept(&mut self, updates: ScanUpdates, waiting_bytes: usize) -> Result<(ScanReport, Vec<TileIndex>)> {
        let report = updates.report;
        let scan_bytes = self.tracer.bytes() + updates.bytes() + waiting_bytes;
        let mut pager = self.pager();
        pager.prepare(&updates, scan_bytes)?;
        pager.prefetch(&updates.tiles);
        let tiles = pager.accept(updates);
        Ok((report, tiles))
    }

    /// Which part of a ray counts from the next scan on.
    ///
    /// # Errors
    ///
    /// A wrong configuration.
    pub(crate) fn set_rays(&mut self, rays: RayConfig) -> Result<()> {
        self.config = MapConfig { rays, ..self.config.clone() }.validated()?;
        Ok(())
    }

    // Mapping again.

    /// Opens a map of which some tiles are empty, to map them again from scans that it keeps.
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

    /// Maps a kept scan again, in the tiles of a selection or in all; returns the tiles that it touched, too.
    pub(super) fn map_again(
        &mut self,
        number: u64,
        scan: &dyn ScanPoints,
        rays: &RayConfig,
        selection: Option<&TileSelection>,
    ) -> Result<(ScanReport, Vec<TileIndex>)> {
        self.config.rays = *rays;
        self.pager().set_scan_number(number.saturating_sub(1));
        self.map(scan, selection)
    }

    /// The store, to write a catalog of kept scans, or to leave nothing of a commit to the next opening.
    pub(crate) fn with_store<T>(&mut self, work: impl FnOnce(&mut TileStore) -> T) -> T {
        work(self.pager().store_mut())
    }

    /// Writes the points of a scan to where kept scans lie.
    pub(super) fn pager_keep(&self, scan: &dyn ScanPoints) -> Result<SegmentPlace> {
        self.pager().keep(scan)
    }

    /// Commits what was mapped again; the map has as many scans as before.
    pub(super) fn commit_again(&mut self, scan_number: u64, have_poses_changed: bool) -> Result<()> {
        let mut pager = self.pager();
        if have_poses_changed {
            pager.forget_poses_of_inputs();
        }
        pager.set_scan_number(scan_number);
        pager.flush()
    }

    /// The pager, for one call. Queries take `&self` and may load tiles.
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
            let most = self.tracer.count_beside(left.len());
            let beside = left[..most].iter().take_while(|scan| scan.len() < self.fewest_points_alone).count();
            let inserted = if beside > 1 { self.insert_beside(&left[..beside], reports)? } else { 0 };
            left = &left[inserted..];
            if inserted < beside.max(1)
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
        let updates = batch.updates(&self.config.grid, &self.config.sensor_model)?;
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

/// What is kept of a scan; the number comes with its place in the map.
fn kept_record(
    scan: &dyn ScanPoints,
    rays: &RayConfig,
    place: SegmentPlace,
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
        updates: report.hits + report.misses,
        place,
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

/// Grid, sensor model and threshold must be the map's own.
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

    /// A map of one scan of hits between two scans with rays.
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
    fn no_new_map_has_control_characters_in_its_coordinate_system() {
        let folder = tempfile::tempdir().unwrap();
        let config = |crs: &str| MapConfig { crs: Some(crs.into()), ..MapConfig::new(0.1, 1.6).unwrap() };
        for crs in ["EPSG:25832\0", "a\u{1b}[2Jb", "a\u{9b}b"] {
            let refused = OutOfCoreTileMapper::create(folder.path().join("map"), config(crs)).unwrap_err();
            assert!(refused.to_string().contains("control character"), "{refused}");
            assert!(!folder.path().join("map").exists());
            // As of a map that has it.
            config(crs).validated().unwrap();
        }
        let wkt = "PROJCS[\"Gauß\",\r\n\tUNIT[\"metre\",1]]";
        drop(OutOfCoreTileMapper::create(folder.path().join("map"), config(wkt)).unwrap());
        assert_eq!(MapReader::config_of(folder.path().join("map")).unwrap().crs.as_deref(), Some(wkt));
    }

    #[test]
    fn hits_in_little_memory_are_those_of_one_batch() {
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
