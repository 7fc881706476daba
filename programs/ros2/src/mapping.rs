use crate::args::Args;
use crate::cloud::Cloud;
use crate::inbox::Inbox;
use crate::live_map::LiveMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use voxtile::{Error, MapConfig, MapReader, MapView, Mapper, OutOfCoreTileMapper, Point, Pose, ScanRef};
use voxtile_clouds::RigidPose;
use voxtile_clouds::ros::Wire;
use voxtile_clouds::ros::messages::PointCloud2;

/// The thread that maps: clouds from the inbox into the map, flushed by a timer.
pub struct Mapping {
    inbox: Arc<Inbox>,
    mapper: OutOfCoreTileMapper,
    live: Arc<LiveMap>,
    flush_every: Duration,
    flushed_at: Instant,
    told_at: Instant,
}

/// How long it waits for a cloud before it looks at its timers.
const WAIT: Duration = Duration::from_millis(50);
const TELL_EVERY: Duration = Duration::from_secs(10);

impl Mapping {
    /// Opens the map, or makes it.
    ///
    /// # Errors
    ///
    /// A wrong configuration, a map that cannot be opened.
    pub fn open(args: &Args, inbox: Arc<Inbox>) -> anyhow::Result<Self> {
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
                OutOfCoreTileMapper::create(&args.output, own(config))?
            }
            Err(error) => return Err(error.into()),
        };
        let (sensor_m, stamp_ns) = last_place(&args.output);
        let frame = args.frame_id.trim_start_matches('/').to_owned();
        let live = Arc::new(LiveMap::new(frame, mapper.reader()?, sensor_m, stamp_ns));
        let now = Instant::now();
        Ok(Self { inbox, mapper, live, flush_every, flushed_at: now, told_at: now })
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
    pub fn run(&mut self, stop: &AtomicBool) -> anyhow::Result<()> {
        while !stop.load(Ordering::Relaxed) {
            if let Some((cloud, pose)) = self.inbox.take(WAIT) {
                self.insert(&cloud, &pose)?;
            }
            // One that takes longer than the timer is waited for by the next, not by clouds.
            if self.flushed_at.elapsed() >= self.flush_every && !self.mapper.is_flushing() {
                if self.mapper.is_dirty() {
                    self.mapper.begin_flush()?;
                }
                self.flushed_at = Instant::now();
            }
            if self.told_at.elapsed() >= TELL_EVERY {
                self.tell();
                self.told_at = Instant::now();
            }
        }
        self.mapper.flush()?;
        self.tell();
        Ok(())
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
        log::info!("{counters}; {waiting} wait; the map is at scan {}", self.mapper.scan_number());
    }
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
