use crate::args::Args;
use crate::cloud::Cloud;
use crate::cloud_points::CloudPoints;
use crate::health::Health;
use crate::inbox::Inbox;
use crate::latencies::Latencies;
use crate::live_map::LiveMap;
use crate::local_mapping::LocalMapping;
use crate::refusal::Refusal;
use crate::remapping::{self, Remapping};
use crate::services::{Order, PlacedOrder};
use anyhow::ensure;
use bytesize::ByteSize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};
use voxtile::operations::{self, OnlineRemap, Part};
use voxtile::{
    Aabb, Error, MapConfig, MapReader, MapView, Mapper, MemoryLimit, OutOfCoreTileMapper, Point, Stop,
};
use voxtile_formats::RigidPose;
use voxtile_formats::ros::Wire;
use voxtile_formats::ros::messages::{PointCloud2, StampedPose};

/// The thread that maps: clouds from the inbox into the map, flushed by a timer.
pub struct Mapping {
    inbox: Arc<Inbox>,
    mapper: OutOfCoreTileMapper,
    live: Arc<LiveMap>,
    local: LocalMapping,
    latencies: Latencies,
    orders: Receiver<PlacedOrder>,
    /// Orders to save, with the scan that has to be durable.
    saves: Vec<(u64, PlacedOrder)>,
    /// A corrected path, with the last scan before it came, which has to be durable before it is followed.
    path: Option<(u64, Vec<StampedPose>)>,
    remapping: Option<Remapping>,
    /// Bytes of a remapping.
    remapping_bytes: usize,
    folder: PathBuf,
    /// What moves scans no farther, in metres, is no correction.
    path_tolerance_m: f64,
    flush_every: Duration,
    flushed_at: Instant,
    /// Whether one was begun whose end is not known yet.
    is_flush_begun: bool,
    has_flush_failed: bool,
    /// When a refused cloud was last warned of.
    warned_at: Option<Instant>,
    told_at: Instant,
    looked_at: Instant,
    /// When the map on disk was last seen to be up to date or to have become newer, and its last scan then.
    durable: (Instant, u64),
}

/// How long it waits for a cloud before it looks at its timers.
const WAIT: Duration = Duration::from_millis(50);
const TELL_EVERY: Duration = Duration::from_secs(10);
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// Beyond the last voxel that has an index.
const EVERYWHERE: Aabb = Aabb { min: [-1e12; 3], max: [1e12; 3] };

impl Mapping {
    /// Opens the map, or makes it.
    ///
    /// # Errors
    ///
    /// A wrong configuration, a map that cannot be opened.
    pub fn open(args: &Args, inbox: Arc<Inbox>, orders: Receiver<PlacedOrder>) -> anyhow::Result<Self> {
        let flush_every = Duration::try_from_secs_f64(args.flush_every)
            .map_err(|_| anyhow::anyhow!("--flush-every: {} is no time; give seconds", args.flush_every))?;
        let own = |config: MapConfig| {
            config.with_memory_bytes(args.map_bytes()).with_range(args.min_range, args.max_range)
        };
        let is_followed = args.path.is_some();
        ensure!(
            !is_followed || args.cloud.len() == 1,
            "--path: its poses are of one sensor, and there are {} topics of clouds; name one with --cloud",
            args.cloud.len()
        );
        let mapper = match MapReader::config_of(&args.output) {
            Ok(config) => {
                // Resolution and tiles are the map's own.
                log::info!("going on with the map {}", args.output.display());
                ensure!(
                    config.keeps_scans || !is_followed,
                    "--path: the map {} keeps no scans, so that it cannot follow; begin another one",
                    args.output.display()
                );
                OutOfCoreTileMapper::open(&args.output, own(config))?
            }
            Err(Error::NoMap { .. }) => {
                let config = MapConfig::new(args.resolution, args.tile_size)?;
                let config = config.with_sensor_model(args.sensor_model()?);
                let config = config.with_kept_scans(args.keep_scans || is_followed);
                OutOfCoreTileMapper::create(&args.output, own(config))?
            }
            Err(error) => return Err(error.into()),
        };
        let least_bytes = MemoryLimit::min_bytes(&mapper.config().grid);
        ensure!(
            !is_followed || args.remapping_bytes() >= least_bytes,
            "--memory: --path needs {} for maps with such tiles, to have a quarter of it for remapping",
            ByteSize::b(4 * least_bytes as u64)
        );
        // What a remapping has left that was killed.
        if let Err(error) = OnlineRemap::remove_leftovers(&*args.output) {
            log::warn!("{error}");
        }
        let (sensor_m, stamp_ns) = last_place(&args.output);
        let frame = args.frame_id.trim_start_matches('/').to_owned();
        let live = Arc::new(LiveMap::new(frame, mapper.reader()?, sensor_m, stamp_ns));
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
            orders,
            saves: Vec::new(),
            path: None,
            remapping: None,
            remapping_bytes: args.remapping_bytes(),
            folder: args.output.clone(),
            path_tolerance_m: args.path_tolerance,
            flush_every,
            flushed_at: now,
            is_flush_begun: false,
            has_flush_failed: false,
            warned_at: None,
            told_at: now,
            looked_at: now,
            durable,
        })
    }

    /// The map for those who look at it meanwhile.
    pub fn live(&self) -> Arc<LiveMap> {
        self.live.clone()
    }

    /// Maps until it is told to stop; what was mapped is flushed then. What the map refuses is counted, and mapping
    /// goes on; so it does after a flush that has failed.
    ///
    /// # Errors
    ///
    /// The map is none to go on with, or cannot be written at the end.
    pub fn run(mut self, stop: &Stop) -> anyhow::Result<()> {
        while !stop.is_set() {
            if let Some((cloud, pose)) = self.inbox.take(WAIT)
                && let Err(error) = self.insert(&cloud, &pose)
            {
                return self.give_up(error);
            }
            if let Ok(order) = self.orders.try_recv() {
                self = self.obey(order)?;
            }
            self = self.follow()?;
            self.local.refresh(&self.mapper);
            if let Err(error) = self.flush_in_time() {
                return self.give_up(error);
            }
            self.answer_saves();
            if self.looked_at.elapsed() >= LOOK_EVERY {
                self.look();
                self.looked_at = Instant::now();
            }
            if self.told_at.elapsed() >= TELL_EVERY {
                self.tell();
                self.told_at = Instant::now();
            }
        }
        self.remapping = None;
        self.mapper.flush()?;
        self.answer_saves();
        self.tell();
        Ok(())
    }

    /// Flushes beside the mapping when it is time, or somebody waits for it.
    ///
    /// # Errors
    ///
    /// One after which the map is none to go on with; others are told, and the next flush makes up for them.
    fn flush_in_time(&mut self) -> voxtile::Result<()> {
        let is_awaited = self.awaits_flush();
        // One that takes longer than the timer is waited for by the next, not by clouds.
        if self.mapper.is_flushing() {
            return Ok(());
        }
        if std::mem::take(&mut self.is_flush_begun) {
            let flushed = self.mapper.end_flush();
            self.note_flush(&flushed);
            flushed.or_else(if_none_to_go_on_with)?;
        }
        // A disk that refuses is not asked after every scan.
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
        let begun = self.mapper.begin_flush();
        match begun {
            Ok(()) => self.is_flush_begun = true,
            Err(_) => self.note_flush(&begun),
        }
        begun.or_else(if_none_to_go_on_with)
    }

    /// Notes how a flush has ended. Who waits for one that has failed is told so, and the next one makes up for it.
    fn note_flush(&mut self, flushed: &voxtile::Result<()>) {
        self.answer_saves();
        self.has_flush_failed = flushed.is_err();
        let Err(error) = flushed else { return };
        self.inbox.count(|counters| counters.failed_flushes += 1);
        for (_, placed) in std::mem::take(&mut self.saves) {
            placed.answer(Err(format!("the flush has failed: {error:#}")));
        }
        let durable = self.mapper.flushed_scan_number();
        log::warn!("a flush has failed, and is tried again; durable up to scan {durable}: {error:#}");
    }

    /// Ends by an error, with all that was mapped made durable if the disk lets it.
    fn give_up(mut self, error: Error) -> anyhow::Result<()> {
        match self.mapper.flush() {
            Ok(()) => log::info!("what was mapped is flushed, up to scan {}", self.mapper.scan_number()),
            Err(of_flush) => {
                let durable = self.mapper.flushed_scan_number();
                log::error!(
                    "what was mapped after scan {durable} is lost, it cannot be flushed: {of_flush:#}"
                );
            }
        }
        self.answer_saves();
        self.tell();
        Err(error.into())
    }

    /// Does what a service asks for, or begins it.
    fn obey(mut self, placed: PlacedOrder) -> anyhow::Result<Self> {
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
                    Ok(format!("the map is as of scan {} again", done.scan_number))
                });
            }
        }
        Ok(self)
    }

    /// Follows corrected paths, one after the other: beside the mapper, until what is left is short.
    fn follow(mut self) -> anyhow::Result<Self> {
        if let Some(path) = self.inbox.take_path() {
            // A later one takes its place, and does not wait longer for that.
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
                    log::warn!("a path is left out: {error}");
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
                Err(error) => log::warn!("a path is left out, a thread cannot be started: {error}"),
            }
        }
        Ok(self)
    }

    /// Whether a path goes on with the next flush.
    fn awaits_flush(&mut self) -> bool {
        let (scan, durable) = (self.mapper.scan_number(), self.mapper.flushed_scan_number());
        match &mut self.remapping {
            Some(remapping) => remapping.advance(scan, durable),
            None => self.path.is_some(),
        }
    }

    /// Makes the map what was mapped beside it.
    fn change_over(self, remapped: remapping::Remapped) -> anyhow::Result<Self> {
        let begun = Instant::now();
        let (last_scan, sensor_m) = remapped.last;
        let (mut moved, outcome) = self.change(|_| remapped.beside.finish())?;
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
            Err(error) => log::warn!("a path is left out: {error}"),
        }
        moved.flushed_at = Instant::now();
        Ok(moved)
    }

    fn edit(
        mut self,
        placed: PlacedOrder,
        change: impl FnOnce(&Path) -> voxtile::Result<String>,
    ) -> anyhow::Result<Self> {
        // A path that waits is about the scans before, as the one that is followed; perhaps they are no more.
        let paths =
            [self.remapping.take().is_some(), self.path.take().is_some(), self.inbox.take_path().is_some()];
        if paths.contains(&true) {
            log::warn!("a path is left out: the map is changed meanwhile");
        }
        let (changed, outcome) = self.change(change)?;
        placed.answer(outcome.map_err(|error| error.to_string()));
        Ok(changed)
    }

    /// Changes the map as a whole: it is flushed and closed for that, and clouds wait.
    fn change<T>(
        mut self,
        change: impl FnOnce(&Path) -> voxtile::Result<T>,
    ) -> anyhow::Result<(Self, voxtile::Result<T>)> {
        // What is not flushed would be lost, so the map stays as it is.
        let flushed = self.mapper.flush();
        self.note_flush(&flushed);
        if let Err(error) = flushed {
            return Ok((self, Err(error)));
        }
        self.local.forget();
        let config = self.mapper.config().clone();
        drop(self.mapper);
        let outcome = change(&self.folder);
        // A map that is not as it was is none to go on with.
        let mapper = OutOfCoreTileMapper::open(&self.folder, config)?;
        self.live.note_opening(mapper.reader()?, None);
        let durable = (Instant::now(), mapper.flushed_scan_number());
        let mut changed = Self { mapper, durable, ..self };
        // Who asked for the change looks at the diagnostics next.
        changed.look();
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

    /// Writes down for others how the map is.
    fn look(&mut self) {
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
        });
    }

    /// Maps a cloud, unless the map refuses it.
    ///
    /// # Errors
    ///
    /// The map is none to go on with.
    fn insert(&mut self, cloud: &Cloud, world_from_sensor: &RigidPose) -> voxtile::Result<()> {
        // The inbox has decoded it once: it is whole, and there is room for its points.
        let Ok(message) = PointCloud2::decode(Wire::Cdr, &cloud.cdr) else { return Ok(()) };
        let points = CloudPoints::of(&message);
        let scan = points.scan(world_from_sensor, cloud.stamp_ns);
        match scan.and_then(|scan| self.mapper.insert_points(&scan).map(|_| scan)) {
            Ok(scan) => {
                // Before others hear of the scan: they publish once what they see then.
                self.local.follow(&scan);
                let (scan_number, sensor_m) = (self.mapper.scan_number(), world_from_sensor.position_m);
                self.live.note_scan(scan_number, sensor_m, cloud.stamp_ns);
                self.latencies.note(cloud.arrived.elapsed());
                self.inbox.count(|counters| counters.mapped += 1);
                Ok(())
            }
            Err(error) => self.refuse(error),
        }
    }

    /// Counts a cloud that the map has refused. The map is as before, and the next cloud may do.
    fn refuse(&mut self, error: Error) -> voxtile::Result<()> {
        let Some(refusal) = Refusal::of(&error) else { return Err(error) };
        self.inbox.count(|counters| refusal.count(counters));
        // It may be the same with every cloud that comes.
        if self.warned_at.is_none_or(|at| at.elapsed() >= LOOK_EVERY) {
            log::warn!("a cloud is left out: {error:#}");
            self.warned_at = Some(Instant::now());
        } else {
            log::debug!("a cloud is left out: {error:#}");
        }
        Ok(())
    }

    fn tell(&self) {
        let (counters, waiting) = self.inbox.counters();
        let [p50, p99] = [50, 99].map(|percent| self.latencies.percentile(percent).unwrap_or_default());
        log::info!(
            "{counters}; {waiting} wait; the map is at scan {}; {p50:.1?} from cloud to map, p99 {p99:.1?}",
            self.mapper.scan_number()
        );
    }
}

/// The error of a flush after which the map is none to go on with.
fn if_none_to_go_on_with(error: Error) -> voxtile::Result<()> {
    if Refusal::of(&error).is_some() { Ok(()) } else { Err(error) }
}

/// Makes the voxels of a box unknown.
fn cleared(folder: &Path, region: Aabb) -> voxtile::Result<String> {
    let cleared = operations::clear(folder, &Part::Inside(region), |_, _| ())?;
    Ok(format!("{} voxels are unknown now", cleared.voxels_cleared))
}

/// Where the sensor of a map was last, and when; the origin where the map does not tell.
fn last_place(folder: &Path) -> (Point, i64) {
    let scans = MapReader::open(folder, 0).and_then(|reader| reader.scans());
    let last = scans.ok().and_then(|scans| scans.last().copied());
    last.map_or(([0.0; 3], 0), |scan| (scan.origin_m, scan.stamp_ns.unwrap_or(0)))
}

#[cfg(test)]
mod tests;
