use crate::INTERRUPTED;
use crate::args::{BuildArgs, InsertName, ModelName};
use crate::flush_schedule::FlushSchedule;
use crate::map_at::whole_map;
use crate::octree_choice::octree_config;
use crate::progress::Progress;
use crate::scan_input::{self, is_standard_input};
use crate::summary::Summary;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use voxtile::io::ScanSource;
use voxtile::mapper::{MapReader, MapView, Mapper, OutOfCoreTileMapper};
use voxtile::scan::{ScanReport, ScanTracer};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::space::Grid;
use voxtile::{Error, InsertMode, MapConfig, MemoryLimit, Scan, Storage};

/// Where rays are cut unless something else is asked for.
const MAX_RANGE_M: f64 = 100.0;

/// What a build may use of memory unless something else is asked for.
const DEFAULT_MEMORY_BYTES: usize = 512 << 20;

pub fn run(args: &BuildArgs) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let stop = stop_signal()?;
    let mut source = scan_input::open(&args.scans, args.poses.as_deref())?;
    let fingerprint = fingerprint(args, &*source)?;
    let exists = exists(args)?;
    let config = if exists { config_to_go_on(args)? } else { config_to_create(args)? };
    let mut first = None;
    let mut mapper = if exists {
        OutOfCoreTileMapper::open(&args.output, config)?
    } else {
        // A first scan that cannot be mapped should not leave an empty map behind.
        first = next_scan(&mut *source)?;
        check(first.as_ref(), &config)?;
        OutOfCoreTileMapper::create(whole_map(&args.output)?, config)?
    };
    let done = if args.resume {
        mapper.resume_input(&fingerprint)?
    } else {
        mapper.begin_input(fingerprint)?;
        0
    };
    pass_over(&mut *source, done, &args.scans)?;

    let progress = Progress::over_scans(source.len_hint());
    progress.pass(done);
    let mut build = Build {
        mapper: &mut mapper,
        schedule: FlushSchedule::new(args.flush_every),
        progress,
        report: ScanReport::default(),
        scans: 0,
    };
    let outcome = build.insert_all(first, &mut *source, &stop);
    build.progress.say("flushing");
    // What was accepted is kept, whatever ended the build.
    let flushed = build.mapper.flush().map_err(|error| say_what_is_safe(error, build.mapper, args.append));
    let Build { report, scans, .. } = build;
    match (outcome, flushed) {
        (Err(error), Ok(())) => {
            return Err(error.context(format!("after {scans} scans, which are in the map")));
        }
        (Err(error), Err(flush_error)) => return Err(error.context(format!("{flush_error:#}; before that"))),
        (Ok(()), flushed) => flushed?,
    }
    let interrupted = stop.load(Ordering::Relaxed);
    let summary = Summary::of(&args.output, scans, report, &mapper, started.elapsed())?;
    Summary { interrupted, resumed_after: done, ..summary }.print(args.json)?;
    if interrupted {
        let all = done + scans;
        eprintln!("voxtile: stopped after {all} scans; all of them are in the map; --resume goes on");
        return Ok(ExitCode::from(INTERRUPTED));
    }
    Ok(ExitCode::SUCCESS)
}

struct Build<'a> {
    mapper: &'a mut OutOfCoreTileMapper,
    schedule: FlushSchedule,
    progress: Progress,
    report: ScanReport,
    scans: u64,
}

impl Build<'_> {
    fn insert_all(
        &mut self,
        mut first: Option<Scan>,
        source: &mut dyn ScanSource,
        stop: &AtomicBool,
    ) -> anyhow::Result<()> {
        while let Some(scan) = first.take().map_or_else(|| next_scan(source), |scan| Ok(Some(scan)))? {
            if stop.load(Ordering::Relaxed) {
                break;
            }
            self.report += self.mapper.insert_scan(&scan)?;
            self.scans += 1;
            self.progress.step();
            self.progress.show(self.mapper);
            if self.schedule.is_due() {
                self.mapper.flush()?;
                self.schedule.flushed();
            }
        }
        Ok(())
    }
}

/// After a flush that failed: what a user can rely on.
fn say_what_is_safe(error: Error, mapper: &OutOfCoreTileMapper, is_appending: bool) -> anyhow::Error {
    let (folder, scan_number) = (mapper.folder(), mapper.flushed_scan_number());
    let how = if is_appending { "with --resume in place of --append" } else { "with --resume" };
    anyhow::Error::new(error).context(format!(
        "{}: the map is as of scan {scan_number}; once the cause is gone, the same command {how} goes on from there",
        folder.display()
    ))
}

/// Whether there is a map to go on with.
fn exists(args: &BuildArgs) -> anyhow::Result<bool> {
    let exists = match MapReader::open(&args.output, 1) {
        Err(Error::NoMap { .. }) => false,
        // Damage is told by the mapper, which opens the map next.
        _ => true,
    };
    if exists && !args.append && !args.resume {
        let hint = "use --resume to go on with these scans, --append to add them to it, or another -o";
        return Err(Error::AlreadyExists { path: args.output.clone(), hint }.into());
    }
    if !exists && args.append {
        return Err(Error::NoMap { path: args.output.clone() }.into());
    }
    Ok(exists)
}

/// What the map remembers of its input. Only who wants to resume needs to tell one stream from another.
fn fingerprint(args: &BuildArgs, source: &dyn ScanSource) -> voxtile::Result<String> {
    match source.fingerprint() {
        Err(Error::InvalidArgument { .. }) if is_standard_input(&args.scans) && !args.resume => {
            Ok("a stream without a label".to_owned())
        }
        fingerprint => fingerprint,
    }
}

fn check(scan: Option<&Scan>, config: &MapConfig) -> voxtile::Result<()> {
    let Some(scan) = scan else { return Ok(()) };
    ScanTracer::check(&config.grid, &config.sensor_model, scan)
}

/// Passes over scans that are in the map.
fn pass_over(source: &mut dyn ScanSource, done: u64, scans: &Path) -> anyhow::Result<()> {
    let count = usize::try_from(done).unwrap_or(usize::MAX);
    let passed = source.skip(count)?;
    if passed < count {
        let reason = format!("has {passed} scans, and the map has taken {done} from it");
        return Err(Error::argument(scans.display().to_string(), reason).into());
    }
    Ok(())
}

fn next_scan(source: &mut dyn ScanSource) -> voxtile::Result<Option<Scan>> {
    Ok(source.next_scan()?.map(|scan| scan.into_scan()))
}

fn config_to_create(args: &BuildArgs) -> anyhow::Result<MapConfig> {
    let config = MapConfig::new(args.resolution.unwrap_or(0.1), args.tile_size.unwrap_or(10.0))?
        .with_storage(args.storage.map(Storage::from).unwrap_or_default());
    Ok(for_this_run(args, config)?.validated()?)
}

/// The map's own parameters, and those that were typed, which must be the same.
fn config_to_go_on(args: &BuildArgs) -> anyhow::Result<MapConfig> {
    let mut config = MapReader::open(&args.output, 1)?.config().clone();
    if args.resolution.is_some() || args.tile_size.is_some() {
        let resolution_m = args.resolution.unwrap_or(config.grid.resolution_m());
        let tile_size_m = args.tile_size.unwrap_or(config.grid.tile_size_m());
        config.grid = Grid::new(resolution_m, tile_size_m)?;
    }
    check_storage(args, config.storage)?;
    Ok(for_this_run(args, config)?.validated()?)
}

fn check_storage(args: &BuildArgs, own: Storage) -> voxtile::Result<()> {
    match args.storage.map(Storage::from) {
        Some(wanted) if wanted != own => {
            let reason = format!("the map's tiles are stored as {own}; leave it out, or convert the map");
            Err(Error::argument("--storage", reason))
        }
        _ => Ok(()),
    }
}

fn for_this_run(args: &BuildArgs, config: MapConfig) -> anyhow::Result<MapConfig> {
    // What was begun goes on as it was, unless something else is asked for, which is then refused.
    let begun = args.resume.then_some(config.rays);
    let insert_mode = match args.insert {
        Some(InsertName::PerScan) => InsertMode::PerScan,
        Some(InsertName::PerRay) => InsertMode::PerRay,
        None => begun.map_or(InsertMode::PerScan, |rays| rays.insert_mode),
    };
    let min_range_m = args.min_range.unwrap_or(begun.map_or(0.0, |rays| rays.min_range_m));
    let begun_max_m = begun.map_or(Some(MAX_RANGE_M), |rays| rays.max_range_m);
    let sensor_model = sensor_model(args, config.sensor_model)?;
    let mut config = config
        .with_sensor_model(sensor_model)
        .with_insert_mode(insert_mode)
        .with_octree(octree_config(&args.octree)?);
    config = match (args.cache_tiles, args.memory) {
        (Some(tiles), _) => config.with_cache_tiles(tiles),
        (None, Some(memory)) => config.with_memory_bytes(memory.bytes()),
        (None, None) => {
            let least = MemoryLimit::least_bytes(&config.grid);
            config.with_memory_bytes(least.max(DEFAULT_MEMORY_BYTES))
        }
    };
    config.rays.min_range_m = min_range_m;
    config.rays.max_range_m = args.max_range.or(begun_max_m);
    Ok(config)
}

fn sensor_model(args: &BuildArgs, own: SensorModel) -> anyhow::Result<SensorModel> {
    let model = match (args.sensor_model, own) {
        (None, own) => own,
        (Some(ModelName::LogOdds), SensorModel::LogOdds(own)) => SensorModel::LogOdds(own),
        (Some(ModelName::LogOdds), _) => SensorModel::default(),
        (Some(ModelName::Iwlo), SensorModel::Iwlo(own)) => SensorModel::Iwlo(own),
        (Some(ModelName::Iwlo), _) => SensorModel::Iwlo(Iwlo::default()),
    };
    let SensorModel::Iwlo(mut iwlo) = model else {
        if args.intensity_threshold.is_some() || args.intensity_max.is_some() {
            let reason = "only the sensor model iwlo has these; add --sensor-model iwlo";
            return Err(Error::argument("--intensity-threshold, --intensity-max", reason).into());
        }
        return Ok(model);
    };
    iwlo.intensity_threshold = args.intensity_threshold.unwrap_or(iwlo.intensity_threshold);
    iwlo.intensity_max = args.intensity_max.unwrap_or(iwlo.intensity_max);
    Ok(SensorModel::Iwlo(iwlo.validated()?))
}

/// Set by the first Ctrl-C or SIGTERM; a second one ends the process at once.
fn stop_signal() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, i32::from(INTERRUPTED), stop.clone())?;
        signal_hook::flag::register(signal, stop.clone())?;
    }
    Ok(stop)
}
