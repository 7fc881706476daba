//! voxtile's side of the comparison: does one task with a stream of scans and prints one line of JSON.
//!
//! Reads the whole stream into memory, and times only the named task.

use anyhow::{Context, Result, bail};
use clap::{Args, Parser, Subcommand};
use peers::{Answers, BuildOutcome, MemoryOutcome, QuestionsOutcome, VoxelRecord};
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;
use std::fs::{self, File};
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use voxtile::scan::ScanPoints;
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::space::{Point, VoxelIndex};
use voxtile::{
    InMemoryMapper, InsertMode, MapConfig, MapView, Mapper, Occupancy, OutOfCoreTileMapper, Queries, Scan,
};
use voxtile_simulation::Random;
use workload::ScanReader;

const TILE_SIZE_M: f64 = 10.0;
/// Larger than the number of tiles of any workload, so that none is evicted.
const CACHE_TILES: usize = 1 << 20;

/// Run one task of the comparison with voxtile
#[derive(Debug, Parser)]
#[command(name = "voxtile_contender")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Time the insertion of all scans into an empty map, with the selected steps
    Build(BuildArguments),
    /// Measure the memory of the map of all scans
    Memory(MapArguments),
    /// Write points to query: N anywhere in the bounding box of the known voxels, N centers of known voxels
    WritePoints(WritePointsArguments),
    /// Time point queries, one by one
    Questions(QuestionsArguments),
    /// Write every known voxel to a file
    Dump(DumpArguments),
}

#[derive(Debug, Args)]
struct MapArguments {
    /// The stream of scans
    stream: PathBuf,
    /// Use at most the first N scans
    #[arg(long, value_name = "N")]
    scans: Option<usize>,
    /// Edge of a voxel in metres
    #[arg(long, value_name = "M")]
    resolution: f64,
    /// Cut rays at this range in metres [default: no limit]
    #[arg(long, value_name = "M")]
    max_range: Option<f64>,
    /// Update a voxel for each ray instead of once a scan
    #[arg(long)]
    per_ray: bool,
    /// Use intensity-weighted log-odds, with the intensities from this file
    #[arg(long, value_name = "FILE")]
    intensities: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct BuildArguments {
    #[command(flatten)]
    map: MapArguments,
    /// Insert all scans in one call instead of one by one
    #[arg(long)]
    together: bool,
    /// Update the octrees after every scan
    #[arg(long)]
    sync: bool,
    /// Build out of core, in new folders below this one, and flush
    #[arg(long, value_name = "FOLDER", conflicts_with = "sync")]
    folder: Option<PathBuf>,
    /// Repeat the build until this many seconds are measured
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    least_seconds: f64,
}

#[derive(Debug, Args)]
struct WritePointsArguments {
    #[command(flatten)]
    map: MapArguments,
    #[command(flatten)]
    points: PointFiles,
    /// Number of points per file
    #[arg(long, value_name = "N")]
    count: usize,
}

#[derive(Debug, Args)]
struct QuestionsArguments {
    #[command(flatten)]
    map: MapArguments,
    #[command(flatten)]
    points: PointFiles,
    /// Repeat the queries until this many seconds are measured
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    least_seconds: f64,
}

#[derive(Debug, Args)]
struct PointFiles {
    /// Points anywhere in the bounding box
    #[arg(long, value_name = "FILE")]
    anywhere: PathBuf,
    /// Centers of known voxels
    #[arg(long, value_name = "FILE")]
    known: PathBuf,
}

#[derive(Debug, Args)]
struct DumpArguments {
    #[command(flatten)]
    map: MapArguments,
    /// Output file
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Build(arguments) => build(&arguments),
        Task::Memory(arguments) => memory(&arguments),
        Task::WritePoints(arguments) => write_points(&arguments),
        Task::Questions(arguments) => questions(&arguments),
        Task::Dump(arguments) => dump(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("voxtile_contender: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn build(arguments: &BuildArguments) -> Result<()> {
    let scans = arguments.map.scans()?;
    let config = arguments.map.config()?;
    let (mut cpu, mut wall, mut builds) = (Duration::ZERO, Duration::ZERO, 0);
    while builds == 0 || wall.as_secs_f64() < arguments.least_seconds {
        let stopwatch = Stopwatch::start()?;
        let took = if let Some(folder) = &arguments.folder {
            let folder = folder.join(format!("map_{}_{builds}", std::process::id()));
            let mut mapper = OutOfCoreTileMapper::create(&folder, config.clone())?;
            insert(&mut mapper, &scans, arguments.together)?;
            mapper.flush()?;
            // Keeps the map: a file system may be slow soon after many files were removed.
            stopwatch.stop()?
        } else {
            let mut mapper = InMemoryMapper::new(config.clone())?;
            if arguments.sync {
                for scan in &scans {
                    mapper.insert_scan(scan)?;
                    mapper.sync_octrees();
                }
            } else {
                insert(&mut mapper, &scans, arguments.together)?;
            }
            // The map is dropped after the measurement.
            stopwatch.stop()?
        };
        cpu += took.cpu;
        wall += took.wall;
        builds += 1;
    }
    print(&BuildOutcome {
        scans: scans.len() as u64,
        builds,
        cpu_s: cpu.as_secs_f64() / f64::from(builds),
        wall_s: wall.as_secs_f64() / f64::from(builds),
    })
}

fn memory(arguments: &MapArguments) -> Result<()> {
    let scans = arguments.scans()?;
    let before = resident_bytes()?;
    let mut mapper = InMemoryMapper::new(arguments.config()?)?;
    insert(&mut mapper, &scans, false)?;
    let resident = resident_bytes()?.saturating_sub(before);
    let counts = mapper.statistics().cached;
    mapper.sync_octrees();
    print(&MemoryOutcome {
        voxels: counts.voxels,
        bytes: counts.bytes(),
        resident_bytes: resident,
        synced_bytes: mapper.statistics().cached.bytes(),
        synced_resident_bytes: resident_bytes()?.saturating_sub(before),
    })
}

fn write_points(arguments: &WritePointsArguments) -> Result<()> {
    let mapper = arguments.map.mapper()?;
    let mut random = Random::of(1, &[arguments.count as i64]);
    let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
    for tile in mapper.tiles() {
        for voxel in tile?.voxels() {
            low = std::array::from_fn(|k| low[k].min(voxel.index[k]));
            high = std::array::from_fn(|k| high[k].max(voxel.index[k]));
        }
    }
    let voxels = mapper.statistics().cached.voxels;
    if voxels == 0 {
        bail!("{}: the map of these scans is empty", arguments.map.stream.display());
    }
    let grid = &mapper.config().grid;
    let (low_m, high_m) = (grid.center_m(low), grid.center_m(high));
    let anywhere = (0..arguments.count)
        .map(|_| std::array::from_fn(|k| random.between(low_m[k], high_m[k]) as f32))
        .collect::<Vec<_>>();
    peers::write_points(&arguments.points.anywhere, &anywhere)?;

    // Each draw is the number of a voxel in the map's order; one pass finds all of them.
    let mut draws: Vec<(u64, usize)> =
        (0..arguments.count).map(|place| (random.below(voxels), place)).collect();
    draws.sort_unstable();
    let mut known = vec![[0.0; 3]; arguments.count];
    let mut draws = draws.into_iter().peekable();
    let mut number = 0;
    for tile in mapper.tiles() {
        for voxel in tile?.voxels() {
            while let Some((_, place)) = draws.next_if(|draw| draw.0 == number) {
                known[place] = grid.center_m(voxel.index).map(|x| x as f32);
            }
            number += 1;
        }
    }
    peers::write_points(&arguments.points.known, &known)?;
    print(&serde_json::json!({ "voxels": voxels, "low": low, "high": high }))
}

fn questions(arguments: &QuestionsArguments) -> Result<()> {
    let mapper = arguments.map.mapper()?;
    let answers = |file: &Path| -> Result<Answers> {
        let points: Vec<Point> =
            peers::read_points(file)?.into_iter().map(|point| point.map(f64::from)).collect();
        let (mut queried, mut cpu) = (0_usize, Duration::ZERO);
        loop {
            let (mut known, mut occupied) = (0, 0);
            let stopwatch = Stopwatch::start()?;
            for &point in &points {
                match mapper.occupancy_at(point)? {
                    Occupancy::Unknown => {}
                    Occupancy::Free(_) => known += 1,
                    Occupancy::Occupied(_) => (known, occupied) = (known + 1, occupied + 1),
                }
            }
            cpu += stopwatch.stop()?.cpu;
            queried += points.len();
            if cpu.as_secs_f64() >= arguments.least_seconds || points.is_empty() {
                let ns = cpu.as_secs_f64() * 1e9 / queried.max(1) as f64;
                return Ok(Answers { ns, known, occupied });
            }
        }
    };
    let PointFiles { anywhere, known } = &arguments.points;
    print(&QuestionsOutcome { anywhere: answers(anywhere)?, known: answers(known)? })
}

fn dump(arguments: &DumpArguments) -> Result<()> {
    let mapper = arguments.map.mapper()?;
    let cannot_write = || format!("{}: cannot write the voxels", arguments.output.display());
    let mut out = BufWriter::new(File::create(&arguments.output).with_context(cannot_write)?);
    for tile in mapper.tiles() {
        let tile = tile?;
        let records = tile.voxels().map(|voxel| {
            let (index, evidence): (VoxelIndex, _) = (voxel.index, voxel.evidence);
            VoxelRecord { index, observation_count: evidence.observation_count, log_odds: evidence.log_odds }
        });
        peers::write_voxels(&mut out, records).with_context(cannot_write)?;
    }
    print(&serde_json::json!({ "voxels": mapper.statistics().cached.voxels }))
}

impl MapArguments {
    fn config(&self) -> Result<MapConfig> {
        let mut config = MapConfig::new(self.resolution, TILE_SIZE_M)?
            .with_range(0.0, self.max_range)
            .with_cache_tiles(CACHE_TILES);
        if self.per_ray {
            config = config.with_insert_mode(InsertMode::PerRay);
        }
        if self.intensities.is_some() {
            config = config.with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
        }
        Ok(config)
    }

    fn scans(&self) -> Result<Vec<Scan>> {
        let opened = |path: &PathBuf| -> Result<_> {
            let file = File::open(path).with_context(|| format!("{}: cannot read", path.display()))?;
            Ok(BufReader::with_capacity(1 << 16, file))
        };
        let intensities = self.intensities.as_ref().map(opened).transpose()?;
        ScanReader::new(opened(&self.stream)?, intensities)
            .take(self.scans.unwrap_or(usize::MAX))
            .collect::<Result<_, _>>()
            .with_context(|| format!("{}: cannot read", self.stream.display()))
    }

    /// Builds the map of all scans.
    fn mapper(&self) -> Result<InMemoryMapper> {
        let mut mapper = InMemoryMapper::new(self.config()?)?;
        insert(&mut mapper, &self.scans()?, false)?;
        Ok(mapper)
    }
}

fn insert(mapper: &mut impl Mapper, scans: &[Scan], are_together: bool) -> voxtile::Result<()> {
    if are_together {
        let scans: Vec<&dyn ScanPoints> = scans.iter().map(|scan| scan as _).collect();
        return mapper.insert_all(&scans, &mut Vec::new());
    }
    scans.iter().try_for_each(|scan| mapper.insert_scan(scan).map(drop))
}

/// CPU time of the process (all threads) and wall time.
struct Stopwatch {
    cpu: Duration,
    wall: Instant,
}

struct Elapsed {
    cpu: Duration,
    wall: Duration,
}

impl Stopwatch {
    fn start() -> Result<Self> {
        Ok(Self { cpu: process_cpu_time()?, wall: Instant::now() })
    }

    fn stop(&self) -> Result<Elapsed> {
        let wall = self.wall.elapsed();
        Ok(Elapsed { cpu: process_cpu_time()?.saturating_sub(self.cpu), wall })
    }
}

fn process_cpu_time() -> Result<Duration> {
    Duration::try_from(clock_gettime(ClockId::ProcessCPUTime))
        .context("the CPU clock returned an invalid time")
}

/// Resident memory of the process in bytes, from Linux.
fn resident_bytes() -> Result<u64> {
    let path = "/proc/self/status";
    let status = fs::read_to_string(path).with_context(|| format!("{path}: cannot read"))?;
    let kib = status.lines().find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB"));
    Ok(1024 * kib.with_context(|| format!("{path}: no line VmRSS"))?.parse::<u64>()?)
}

fn print(outcome: &impl Serialize) -> Result<()> {
    println!("{}", serde_json::to_string(outcome)?);
    Ok(())
}
