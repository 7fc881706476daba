use crate::args::Args;
use crate::cloud::Cloud;
use crate::cloud_poses::CloudPoses;
use crate::cloud_reader::{CloudReader, attributes_of};
use crate::first_map;
use crate::health::Health;
use crate::inbox::Inbox;
use crate::latencies::Latencies;
use crate::layer_list::LayerList;
use crate::live_map::LiveMap;
use crate::local_mapping::LocalMapping;
use crate::refusal::Refusal;
use crate::remapping::{self, Remapping};
use crate::repeated::{Repeated, counted};
use crate::services::{Order, PlacedOrder};
use anyhow::ensure;
use bytesize::ByteSize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant, SystemTime};
use voxtile::operations::{self, OnlineRemap, Part};
use voxtile::{
    Aabb, Clearing, Error, MapConfig, MapReader, MapView, Mapper, MemoryLimit, OutOfCoreTileMapper, Point,
    Stop,
};
use voxtile_formats::ros::messages::StampedPose;

/// Mapping thread: maps clouds from the inbox and flushes at an interval.
pub struct Mapping {
    inbox: Arc<Inbox>,
    mapper: OutOfCoreTileMapper,
    live: Arc<LiveMap>,
    local: LocalMapping,
    latencies: Latencies,
    reader: CloudReader,
    orders: Receiver<PlacedOrder>,
    /// Save requests, each with the scan that must become durable.
    saves: Vec<(u64, PlacedOrder)>,
    /// Corrected path, with the number of the last scan before its arrival. That scan must be durable before remapping
    /// begins.
    path: Option<(u64, Vec<StampedPose>)>,
    remapping: Option<Remapping>,
    remapping_bytes: usize,
    folder: PathBuf,
    /// Paths that move scans by at most this many metres are ignored.
    path_tolerance_m: f64,
    flush_every: Duration,
    flushed_at: Instant,
    /// Start of a flush whose result is not known yet.
    flush_begun_at: Option<Instant>,
    /// Number of successful background flushes, and end and duration of the last one.
    flushes: (u64, Option<(SystemTime, Duration)>),
    has_flush_failed: bool,
    /// Warning about refused clouds.
    refused: Repeated,
    refused_at: Option<(Instant, Refusal)>,
    logged_at: Instant,
    sampled_at: Instant,
    /// Time when the map on disk was last complete or last updated by a flush, and the number of its last scan at that
    /// time.
    durable: (Instant, u64),
}

/// Longest wait for a cloud before the timers are checked.
const WAIT: Duration = Duration::from_millis(50);
const LOG_EVERY: Duration = Duration::from_secs(10);
const SAMPLE_EVERY: Duration = Duration::from_secs(1);
/// Box that contains all voxel indices.
const EVERYWHERE: Aabb = Aabb { min: [-1e12; 3], max: [1e12; 3] };

impl Mapping {
    /// Opens the map, or creates it.
    ///
    /// # Errors
    ///
    /// An invalid configuration, or a map that cannot be opened.
    pub fn open(args: &Args, inbox: Arc<Inbox>, orders: Receiver<PlacedOrder>) -> anyhow::Result<Self> {
        let flush_every = Duration::try_from_secs_f64(args.flush_every).map_err(|_| {
            anyhow::anyhow!("--flush-every: {} is not a valid duration; give seconds", args.flush_every)
        })?;
        let own = |config: MapConfig| {
            config.with_memory_bytes(args.map_bytes()).with_range(args.min_range, args.max_range)
        };
        let is_followed = args.path.is_some();
        ensure!(
            !is_followed || args.cloud.len() == 1,
            "--path: the path has poses of one sensor, but there are {} cloud topics; give one with --cloud",
            args.cloud.len()
        );
        let mapper = match MapReader::config_of(&args.output) {
            Ok(config) => {
                // Keep the resolution and tile size of the existing map.
                log::info!("continuing the map {}", args.output.display());
                if let Some(file) = &args.octomap_path {
                    log::info!("--octomap-path {} is ignored: the map exists", file.display());
                }
                if let Some(LayerList(wanted)) = args.layers.filter(|wanted| wanted.0 != config.layers()) {
                    log::warn!(
                        "--layers {wanted} is ignored: the map exists, and its layers are {}",
                        config.layers()
                    );
                }
                ensure!(
                    config.keeps_scans || !is_followed,
                    "--path: the map {} has no kept scans and cannot follow a path; create a new map",
                    args.output.display()
                );
                OutOfCoreTileMapper::open(&args.output, own(config))?
            }
            Err(Error::NoMap { .. }) => {
                let new = |config: MapConfig| -> anyhow::Result<MapConfig> {
                    let config = config.with_sensor_model(args.sensor_model()?);
                    let config = config.with_clearing(args.clearing.map(Clearing::from));
                    let config = match args.layers {
                        Some(LayerList(layers)) => config.with_layers(layers),
                        None => config,
                    };
                    Ok(config.with_kept_scans(args.keep_scans || is_followed))
                };
                if let Some(file) = &args.octomap_path {
                    ensure!(
                        !args.keep_scans && !is_followed,
                        "--octomap-path cannot be combined with --keep-scans or --path: its voxels are of no scan"
                    );
                    let config = first_map::create(file, &args.output, new)?;
                    OutOfCoreTileMapper::open(&args.output, own(config))?
                } else {
                    let config = match args.tile_size {
                        Some(tile_size_m) => MapConfig::new(args.resolution, tile_size_m)?,
                        None => MapConfig::with_resolution(args.resolution)?,
                    };
                    OutOfCoreTileMapper::create(&args.output, own(new(config)?))?
                }
            }
            Err(error) => return Err(error.into()),
        };
        let least_bytes = MemoryLimit::min_bytes(&mapper.config().grid);
        ensure!(
            !is_followed || args.remapping_bytes() >= least_bytes,
            "--memory: --path needs at least {} for this tile size, because remapping gets a quarter",
            ByteSize::b(4 * least_bytes as u64)
        );
        // Remove files of an interrupted remapping.
        if let Err(error) = OnlineRemap::remove_leftovers(&*args.output) {
            log::warn!("{error}");
        }
        let (sensor_m, stamp_ns) = last_sensor(&args.output);
        let frame = args.frame_id.trim_start_matches('/').to_owned();
        let live = Arc::new(LiveMap::new(frame, mapper.reader()?, sensor_m, stamp_ns));
        let layers = mapper.config().layers();
        inbox.want_attributes(attributes_of(&layers));
        let parameters = args.local_parameters(mapper.config())?;
        let local = LocalMapping::new(parameters, args.extent()?.radius_m, live.clone());
        let now = Instant::now();
        let durable = (now, mapper.flushed_scan_number());
        Ok(Self {
            inbox,
            mapper,
            live,
            local,
            latencies: Latencies::default(),
            reader: CloudReader::new(args, layers)?,
            orders,
            saves: Vec::new(),
            path: None,
            remapping: None,
            remapping_bytes: args.remapping_bytes(),
            folder: args.output.clone(),
            path_tolerance_m: args.path_tolerance,
            flush_every,
            flushed_at: now,
            flush_begun_at: None,
            flushes: (0, None),
            has_flush_failed: false,
            refused: Repeated::default(),
            refused_at: None,
            logged_at: now,
            sampled_at: now,
            durable,
        })
    }

    /// Returns the shared read access to the map.
    pub fn live(&self) -> Arc<LiveMap> {
        self.live.clone()
    }

    /// Maps until stopped, then flushes. Counts clouds that the map refuses, and continues after them and after failed
    /// flushes.
    ///
    /// # Errors
    ///
    /// The map can no longer be used, or cannot be written at the end.
    pub fn run(mut self, stop: &Stop) -> anyhow::Result<()> {
        while !stop.is_set() {
            if let Some((cloud, poses)) = self.inbox.take(WAIT)
                && let Err(error) = self.insert(&cloud, &poses)
            {
                return self.give_up(error);
            }
            if let Ok(order) = self.orders.try_recv() {
                self = self.execute(order)?;
            }
            self = self.follow()?;
            self.local.refresh(&self.mapper);
            if let Err(error) = self.flush_if_due() {
                return self.give_up(error);
            }
            self.answer_saves();
            if self.sampled_at.elapsed() >= SAMPLE_EVERY {
                self.sample_health();
                self.sampled_at = Instant::now();
            }
            if self.logged_at.elapsed() >= LOG_EVERY {
                self.log_counters();
                self.logged_at = Instant::now();
            }
        }
        self.remapping = None;
        self.mapper.flush()?;
        self.answer_saves();
        self.log_counters();
        Ok(())
    }

    /// Starts a background flush at the interval or when a request waits for it.
    ///
    /// # Errors
    ///
    /// An error after which the map can no longer be used. Other errors are reported, and the next flush retries.
    fn flush_if_due(&mut self) -> voxtile::Result<()> {
        let is_awaited = self.awaits_flush();
        // If a flush takes longer than the interval, delay the next flush, not clouds.
        if self.mapper.is_flushing() {
            return Ok(());
        }
        if let Some(begun) = self.flush_begun_at.take() {
            let flushed = self.mapper.end_flush();
            if flushed.is_ok() {
                self.flushes = (self.flushes.0 + 1, Some((SystemTime::now(), begun.elapsed())));
            }
            self.note_flush(&flushed);
            flushed.or_else(if_fatal)?;
        }
        // After a failure, only the interval and save requests trigger a flush, not every scan.
        let is_wanted = !self.saves.is_empty() || (is_awaited && !self.has_flush_failed);
        if self.flushed_at.elapsed() >= self.flush_every || is_wanted {
            self.begin_flush()?;
            self.flushed_at = Instant::now();
        }
        Ok(())
    }

    fn begin_flush(&mut self) -> voxtile::Result<()> {
        if !self.mapper.is_dirty() {
            self.note_flush(&Ok(()));
            return Ok(());
        }
        let now = Instant::now();
        let begun = self.mapper.begin_flush();
        match begun {
            Ok(()) => self.flush_begun_at = Some(now),
            Err(_) => self.note_flush(&begun),
        }
        begun.or_else(if_fatal)
    }

    /// Records the result of a flush. On failure, pending save requests get the error, and the next flush retries.
    fn note_flush(&mut self, flushed: &voxtile::Result<()>) {
        self.answer_saves();
        self.has_flush_failed = flushed.is_err();
        let Err(error) = flushed else { return };
        self.inbox.count(|counters| counters.failed_flushes += 1);
        for (_, placed) in std::mem::take(&mut self.saves) {
            placed.answer(Err(format!("the flush failed: {error:#}")));
        }
        let durable = self.mapper.flushed_scan_number();
        log::warn!("a flush failed and will be retried; durable up to scan {durable}: {error:#}");
    }

    /// Flushes the mapped scans, if the disk permits, and returns `error`.
    fn give_up(mut self, error: Error) -> anyhow::Result<()> {
        match self.mapper.flush() {
            Ok(()) => log::info!("flushed the map up to scan {}", self.mapper.scan_number()),
            Err(of_flush) => {
                let durable = self.mapper.flushed_scan_number();
                log::error!("cannot flush: scans after {durable} are lost: {of_flush:#}");
            }
        }
        self.answer_saves();
        self.log_counters();
        Err(error.into())
    }

    fn execute(mut self, placed: PlacedOrder) -> anyhow::Result<Self> {
        let order = placed.order.clone();
        match order {
            Order::Save => self.saves.push((self.mapper.scan_number(), placed)),
            Order::Snapshot(name) => {
                let kept = self.mapper.snapshot(&name).map_err(|error| error.to_string());
                let scan = self.mapper.scan_number();
                placed.answer(kept.map(|()| format!("snapshot {name} of scan {scan}")));
            }
            Order::Reset => return self.edit(placed, |folder| cleared(folder, EVERYWHERE)),
            Order::Clear(region) => return self.edit(placed, |folder| cleared(folder, region)),
            Order::Revert(name) => {
                return self.edit(placed, |folder| {
                    let done = operations::revert(folder, &name, None, |_, _| ())?;
                    Ok(format!("reverted to scan {}", done.scan_number))
                });
            }
        }
        Ok(self)
    }

    /// Follows corrected paths one after the other, concurrently with mapping until few scans remain.
    fn follow(mut self) -> anyhow::Result<Self> {
        if let Some(path) = self.inbox.take_path() {
            // A newer path replaces a waiting one without extending the wait.
            let scan = self.path.take().map_or(self.mapper.scan_number(), |(scan, _)| scan);
            self.path = Some((scan, path));
        }
        if self.remapping.as_ref().is_some_and(Remapping::is_over)
            && let Some(remapping) = self.remapping.take()
        {
            return match remapping.end() {
                Ok(Some(remapped)) => self.change_over(remapped),
                Ok(None) => Ok(self),
                Err(error) => {
                    log::warn!("path ignored: {error}");
                    Ok(self)
                }
            };
        }
        let durable = self.mapper.flushed_scan_number();
        if self.remapping.is_none()
            && let Some((last_scan, path)) = self.path.take_if(|(scan, _)| *scan <= durable)
        {
            let (tolerance_m, memory_bytes) = (self.path_tolerance_m, self.remapping_bytes);
            let order = remapping::Order { last_scan, tolerance_m, memory_bytes };
            match Remapping::begin(self.folder.clone(), path, order) {
                Ok(remapping) => self.remapping = Some(remapping),
                Err(error) => log::warn!("path ignored: cannot start a thread: {error}"),
            }
        }
        Ok(self)
    }

    fn awaits_flush(&mut self) -> bool {
        let (scan, durable) = (self.mapper.scan_number(), self.mapper.flushed_scan_number());
        match &mut self.remapping {
            Some(remapping) => remapping.advance(scan, durable),
            None => self.path.is_some(),
        }
    }

    /// Swaps in the remapped map.
    fn change_over(self, remapped: remapping::Remapped) -> anyhow::Result<Self> {
        let begun = Instant::now();
        let (last_scan, sensor_m) = remapped.last;
        let (mut moved, outcome) = self.change(|_| remapped.online.finish())?;
        match outcome {
            Ok(done) => {
                let sensor_m = sensor_m.filter(|_| moved.mapper.scan_number() == last_scan);
                moved.live.note_opening(moved.mapper.reader()?, sensor_m);
                moved.inbox.count(|counters| counters.remapped += 1);
                log::info!(
                    "remapped: {} of {} scans moved, by {:.2} m at most, {} of {} tiles; the map was closed for {:.1?}",
                    done.mapped.scans_changed,
                    done.mapped.scans,
                    done.largest_move_m,
                    done.mapped.tiles_mapped,
                    done.mapped.tiles,
                    begun.elapsed()
                );
            }
            Err(error) => log::warn!("path ignored: {error}"),
        }
        moved.flushed_at = Instant::now();
        Ok(moved)
    }

    fn edit(
        mut self,
        placed: PlacedOrder,
        change: impl FnOnce(&Path) -> voxtile::Result<String>,
    ) -> anyhow::Result<Self> {
        // Pending and active paths refer to scans before the change, which may no longer exist.
        let paths =
            [self.remapping.take().is_some(), self.path.take().is_some(), self.inbox.take_path().is_some()];
        if paths.contains(&true) {
            log::warn!("path ignored: the map was changed by a service");
        }
        let (changed, outcome) = self.change(change)?;
        placed.answer(outcome.map_err(|error| error.to_string()));
        Ok(changed)
    }

    /// Flushes and closes the map, calls `change` with its folder, and reopens it. Clouds wait meanwhile.
    fn change<T>(
        mut self,
        change: impl FnOnce(&Path) -> voxtile::Result<T>,
    ) -> anyhow::Result<(Self, voxtile::Result<T>)> {
        // Without a flush the change would lose scans, so do not change the map.
        let flushed = self.mapper.flush();
        self.note_flush(&flushed);
        if let Err(error) = flushed {
            return Ok((self, Err(error)));
        }
        self.local.reset();
        let config = self.mapper.config().clone();
        drop(self.mapper);
        let outcome = change(&self.folder);
        // If the changed map cannot be opened, the node ends.
        let mapper = OutOfCoreTileMapper::open(&self.folder, config)?;
        self.live.note_opening(mapper.reader()?, None);
        let durable = (Instant::now(), mapper.flushed_scan_number());
        let mut changed = Self { mapper, durable, ..self };
        // The caller may read the diagnostics next.
        changed.sample_health();
        Ok((changed, outcome))
    }

    fn answer_saves(&mut self) {
        if self.saves.is_empty() {
            return;
        }
        let durable = self.mapper.flushed_scan_number();
        let (done, rest) =
            std::mem::take(&mut self.saves).into_iter().partition(|(scan, _)| *scan <= durable);
        self.saves = rest;
        let done: Vec<_> = done;
        done.into_iter().for_each(|(_, placed)| placed.answer(Ok(format!("durable up to scan {durable}"))));
    }

    /// Stores the health of the map for the diagnostics.
    fn sample_health(&mut self) {
        let (scan_number, flushed) = (self.mapper.scan_number(), self.mapper.flushed_scan_number());
        if !self.mapper.is_dirty() || flushed != self.durable.1 {
            self.durable = (Instant::now(), flushed);
        }
        self.live.note_health(Health {
            statistics: self.mapper.statistics(),
            unflushed_scans: scan_number.saturating_sub(flushed),
            flush_age: self.durable.0.elapsed(),
            is_flushing: self.mapper.is_flushing(),
            has_flush_failed: self.has_flush_failed,
            local_map_bytes: self.local.bytes(),
            latencies: self.latencies.clone(),
            flushes: self.flushes.0,
            failed_flushes: self.inbox.counters().0.failed_flushes,
            last_flush: self.flushes.1,
            refused_at: self.refused_at,
            sampled_at: Some(Instant::now()),
        });
    }

    /// Maps a cloud, unless the map refuses it.
    ///
    /// # Errors
    ///
    /// The map can no longer be used.
    fn insert(&mut self, cloud: &Cloud, poses: &CloudPoses) -> voxtile::Result<()> {
        let Some(mut points) = self.reader.points(cloud, poses) else { return Ok(()) };
        let scan = points.scan(&poses.map_from_sensor, cloud.stamp_ns);
        let inserted = scan.and_then(|scan| {
            let report = self.mapper.insert_points(&scan)?;
            self.reader.check_layers(&scan);
            Ok(report)
        });
        match inserted {
            Ok(report) => {
                // Local maps have no ground: a marked point would be an obstacle there.
                points.remove_ground();
                // Update the local map before `note_scan`: publishers send each version once.
                if let Ok(scan) = points.scan(&poses.map_from_sensor, cloud.stamp_ns) {
                    self.local.insert(&scan);
                }
                let sensor_m = poses.map_from_sensor.position_m;
                let scan_number = self.mapper.scan_number();
                self.live.note_scan(scan_number, sensor_m, cloud.stamp_ns);
                self.latencies.note(cloud.arrived.elapsed());
                let points = report.points.saturating_sub(report.skipped.total());
                self.inbox.count(|counters| {
                    counters.mapped += 1;
                    counters.points += points;
                });
                Ok(())
            }
            Err(error) => self.refuse(error),
        }
    }

    /// Counts a cloud that the map refused. The map is unchanged, and the next cloud may succeed.
    fn refuse(&mut self, error: Error) -> voxtile::Result<()> {
        let Some(refusal) = Refusal::of(&error) else { return Err(error) };
        self.inbox.count(|counters| refusal.count(counters));
        self.refused_at = Some((Instant::now(), refusal));
        // Each cloud may fail for the same reason.
        match self.refused.note(1, Instant::now()) {
            Some(count) => log::warn!("{} refused: {error:#}", counted(count, "cloud")),
            None => log::debug!("cloud refused: {error:#}"),
        }
        Ok(())
    }

    fn log_counters(&self) {
        let (counters, waiting) = self.inbox.counters();
        let [p50, p99] = [50, 99].map(|percent| self.latencies.percentile(percent).unwrap_or_default());
        log::info!(
            "{counters}; {waiting} waiting; map at scan {}; latency p50 {p50:.1?}, p99 {p99:.1?}",
            self.mapper.scan_number()
        );
    }
}

/// Returns the error of a flush if the map can no longer be used after it.
fn if_fatal(error: Error) -> voxtile::Result<()> {
    if Refusal::of(&error).is_some() { Ok(()) } else { Err(error) }
}

/// Sets the voxels of a box to unknown.
fn cleared(folder: &Path, region: Aabb) -> voxtile::Result<String> {
    let cleared = operations::clear(folder, &Part::Inside(region), |_, _| ())?;
    Ok(format!("{} voxels set to unknown", cleared.voxels_cleared))
}

/// Returns the position and stamp of the last scan, or the origin if unknown.
fn last_sensor(folder: &Path) -> (Point, i64) {
    let scans = MapReader::open(folder, 0).and_then(|reader| reader.scans());
    let last = scans.ok().and_then(|scans| scans.last().copied());
    last.map_or(([0.0; 3], 0), |scan| (scan.origin_m, scan.stamp_ns.unwrap_or(0)))
}

#[cfg(test)]
mod tests;
