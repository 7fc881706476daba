use crate::args::Args;
use crate::cloud::Cloud;
use crate::health::Health;
use crate::inbox::Inbox;
use crate::latencies::Latencies;
use crate::live_map::LiveMap;
use crate::services::{Order, PlacedOrder};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};
use voxtile::operations::{self, Part};
use voxtile::{
    Aabb, Error, MapConfig, MapReader, MapView, Mapper, OutOfCoreTileMapper, Point, Pose, ScanRef,
};
use voxtile_clouds::RigidPose;
use voxtile_clouds::ros::Wire;
use voxtile_clouds::ros::messages::PointCloud2;

/// The thread that maps: clouds from the inbox into the map, flushed by a timer.
pub struct Mapping {
    inbox: Arc<Inbox>,
    mapper: OutOfCoreTileMapper,
    live: Arc<LiveMap>,
    latencies: Latencies,
    orders: Receiver<PlacedOrder>,
    /// Orders to save, with the scan that has to be durable.
    saves: Vec<(u64, PlacedOrder)>,
    folder: PathBuf,
    flush_every: Duration,
    flushed_at: Instant,
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
        let mapper = match MapReader::config_of(&args.output) {
            Ok(config) => {
                // Resolution and tiles are the map's own.
                log::info!("going on with the map {}", args.output.display());
                OutOfCoreTileMapper::open(&args.output, own(config))?
            }
            Err(Error::NoMap { .. }) => {
                let config = MapConfig::new(args.resolution, args.tile_size)?;
                let config = config.with_sensor_model(args.sensor_model()?);
                OutOfCoreTileMapper::create(&args.output, own(config))?
            }
            Err(error) => return Err(error.into()),
        };
        let (sensor_m, stamp_ns) = last_place(&args.output);
        let frame = args.frame_id.trim_start_matches('/').to_owned();
        let live = Arc::new(LiveMap::new(frame, mapper.reader()?, sensor_m, stamp_ns));
        let now = Instant::now();
        let durable = (now, mapper.flushed_scan_number());
        Ok(Self {
            inbox,
            mapper,
            live,
            latencies: Latencies::default(),
            orders,
            saves: Vec::new(),
            folder: args.output.clone(),
            flush_every,
            flushed_at: now,
            told_at: now,
            looked_at: now,
            durable,
        })
    }

    /// The map for those who look at it meanwhile.
    pub fn live(&self) -> Arc<LiveMap> {
        self.live.clone()
    }

    /// Maps until it is told to stop; what was mapped is flushed then.
    ///
    /// # Errors
    ///
    /// The map cannot be written; a flush beside the mapping that failed is told by the next.
    pub fn run(mut self, stop: &AtomicBool) -> anyhow::Result<()> {
        while !stop.load(Ordering::Relaxed) {
            if let Some((cloud, pose)) = self.inbox.take(WAIT) {
                self.insert(&cloud, &pose)?;
            }
            if let Ok(order) = self.orders.try_recv() {
                self = self.obey(order)?;
            }
            // One that takes longer than the timer is waited for by the next, not by clouds.
            let is_time = self.flushed_at.elapsed() >= self.flush_every || !self.saves.is_empty();
            if is_time && !self.mapper.is_flushing() {
                if self.mapper.is_dirty() {
                    self.mapper.begin_flush()?;
                }
                self.flushed_at = Instant::now();
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
        self.mapper.flush()?;
        self.answer_saves();
        self.tell();
        Ok(())
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
            Order::Reset => return self.edit(placed, &|folder| cleared(folder, EVERYWHERE)),
            Order::Clear(region) => return self.edit(placed, &|folder| cleared(folder, region)),
            Order::Revert(name) => {
                return self.edit(placed, &|folder| {
                    let done = operations::revert(folder, &name, None, |_, _| ())?;
                    Ok(format!("the map is as of scan {} again", done.scan_number))
                });
            }
        }
        Ok(self)
    }

    /// Changes the map as a whole: it is flushed and closed for that, and clouds wait.
    fn edit(
        mut self,
        placed: PlacedOrder,
        change: &dyn Fn(&Path) -> voxtile::Result<String>,
    ) -> anyhow::Result<Self> {
        self.mapper.flush()?;
        self.answer_saves();
        let config = self.mapper.config().clone();
        drop(self.mapper);
        let outcome = change(&self.folder);
        // A map that is not as it was is none to go on with.
        let mapper = OutOfCoreTileMapper::open(&self.folder, config)?;
        self.live.note_opening(mapper.reader()?);
        placed.answer(outcome.map_err(|error| error.to_string()));
        let durable = (Instant::now(), mapper.flushed_scan_number());
        Ok(Self { mapper, durable, ..self })
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
            latencies: self.latencies.clone(),
        });
    }

    fn insert(&mut self, cloud: &Cloud, world_from_sensor: &RigidPose) -> anyhow::Result<()> {
        let Ok(message) = PointCloud2::decode(Wire::Cdr, &cloud.cdr) else { return Ok(()) };
        if let Some(shortage) = message.shortage() {
            log::debug!("a cloud is left out: {shortage}");
            self.inbox.count(|counters| counters.malformed += 1);
            return Ok(());
        }
        let (mut points, mut intensities) = (Vec::new(), Vec::new());
        for point in message.points() {
            // The origin means that nothing came back.
            points.push(if point.is_return { point.position_m } else { [0.0; 3] });
            intensities.push(point.intensity);
        }
        let intensities = message.has_intensities().then_some(&*intensities);
        match insert_points(&mut self.mapper, world_from_sensor, &points, intensities) {
            Ok(()) => {
                let (scan_number, sensor_m) = (self.mapper.scan_number(), world_from_sensor.position_m);
                self.live.note_scan(scan_number, sensor_m, cloud.stamp_ns);
                self.latencies.note(cloud.arrived.elapsed());
                self.inbox.count(|counters| counters.mapped += 1);
            }
            // A pose that is none or beyond all tiles: the next cloud may do.
            Err(error @ (Error::InvalidArgument { .. } | Error::Grid(_))) => {
                log::warn!("a cloud is left out: {error}");
                self.inbox.count(|counters| counters.malformed += 1);
            }
            Err(error) => return Err(error.into()),
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

/// Makes the voxels of a box unknown.
fn cleared(folder: &Path, region: Aabb) -> voxtile::Result<String> {
    let cleared = operations::clear(folder, &Part::Inside(region), |_, _| ())?;
    Ok(format!("{} voxels are unknown now", cleared.voxels_cleared))
}

/// Where the sensor of a map was last, and when; the origin where the map does not tell.
fn last_place(folder: &Path) -> (Point, i64) {
    let scans = MapReader::open(folder, 1).and_then(|reader| reader.scans());
    let last = scans.ok().and_then(|scans| scans.last().copied());
    last.map_or(([0.0; 3], 0), |scan| (scan.origin_m, scan.stamp_ns.unwrap_or(0)))
}

fn insert_points(
    mapper: &mut OutOfCoreTileMapper,
    world_from_sensor: &RigidPose,
    points: &[[f64; 3]],
    intensities: Option<&[f32]>,
) -> voxtile::Result<()> {
    let pose = Pose::from_quaternion(world_from_sensor.position_m, world_from_sensor.quaternion)?;
    let scan = ScanRef::in_sensor(pose, points);
    let scan = match intensities {
        Some(intensities) => scan.with_intensities(intensities)?,
        None => scan,
    };
    mapper.insert_points(&scan).map(drop)
}
