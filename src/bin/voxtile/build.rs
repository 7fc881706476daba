use crate::INTERRUPTED;
use crate::args::{BuildArgs, InsertName, ModelName};
use crate::progress::Progress;
use crate::summary::Summary;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use voxtile::io::{ScanSource, open_scans};
use voxtile::mapper::{MapReader, MapView, Mapper, OutOfCoreTileMapper};
use voxtile::scan::{ScanReport, trace_scan};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::space::Grid;
use voxtile::{Error, InsertMode, MapConfig, Scan};

pub fn run(args: &BuildArgs) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let stop = stop_signal()?;
    let mut source = open_scans(&args.scans, args.poses.as_deref())?;
    let exists = args.output.join("metadata.json").exists();
    if exists && !args.append {
        let hint = "use --append to add these scans to it, or another -o";
        return Err(Error::AlreadyExists { path: args.output.clone(), hint }.into());
    }
    let config = if args.append { config_to_append(args)? } else { config_to_create(args)? };
    // A first scan that cannot be mapped should not leave an empty map behind.
    let first = next_scan(&mut *source)?;
    if let Some(scan) = &first {
        trace_scan(&config.grid, &config.sensor_model, &config.rays, scan)?;
    }
    let mut mapper = if args.append {
        OutOfCoreTileMapper::open(&args.output, config)?
    } else {
        OutOfCoreTileMapper::create(&args.output, config)?
    };
    mapper.set_input_fingerprint(source.fingerprint());

    let mut build = Build { mapper: &mut mapper, report: ScanReport::default(), scans: 0 };
    let outcome = build.insert_all(&mut *source, first, &stop);
    let Build { report, scans, .. } = build;
    // What was accepted is kept, whatever ended the build.
    mapper.flush()?;
    if let Err(error) = outcome {
        return Err(error.context(format!("after {scans} scans, which are in the map")));
    }
    let interrupted = stop.load(Ordering::Relaxed);
    let summary = Summary::of(&args.output, scans, report, &mapper, started.elapsed())?;
    Summary { interrupted, ..summary }.print(args.json)?;
    if interrupted {
        eprintln!("voxtile: stopped after {scans} scans; all of them are in the map");
        return Ok(ExitCode::from(INTERRUPTED));
    }
    Ok(ExitCode::SUCCESS)
}

struct Build<'a> {
    mapper: &'a mut OutOfCoreTileMapper,
    report: ScanReport,
    scans: u64,
}

impl Build<'_> {
    fn insert_all(
        &mut self,
        source: &mut dyn ScanSource,
        first: Option<Scan>,
        stop: &AtomicBool,
    ) -> anyhow::Result<()> {
        let progress = Progress::over_scans(source.len_hint());
        let mut next = first;
        while let Some(scan) = next {
            if stop.load(Ordering::Relaxed) {
                break;
            }
            self.report += self.mapper.insert_scan(&scan)?;
            self.scans += 1;
            progress.step();
            progress.show(self.mapper);
            next = next_scan(source)?;
        }
        progress.say("flushing");
        Ok(())
    }
}

fn next_scan(source: &mut dyn ScanSource) -> voxtile::Result<Option<Scan>> {
    Ok(source.next_scan()?.map(|scan| scan.into_scan()))
}

fn config_to_create(args: &BuildArgs) -> anyhow::Result<MapConfig> {
    let config = MapConfig::new(args.resolution.unwrap_or(0.1), args.tile_size.unwrap_or(10.0))?;
    Ok(for_this_run(args, config)?.validated()?)
}

/// The map's own parameters, and those that were typed, which must be the same.
fn config_to_append(args: &BuildArgs) -> anyhow::Result<MapConfig> {
    let mut config = MapReader::open(&args.output, 1)?.config().clone();
    if args.resolution.is_some() || args.tile_size.is_some() {
        let resolution_m = args.resolution.unwrap_or(config.grid.resolution_m());
        let tile_size_m = args.tile_size.unwrap_or(config.grid.tile_size_m());
        config.grid = Grid::new(resolution_m, tile_size_m)?;
    }
    Ok(for_this_run(args, config)?.validated()?)
}

fn for_this_run(args: &BuildArgs, config: MapConfig) -> anyhow::Result<MapConfig> {
    let insert_mode = match args.insert {
        InsertName::PerScan => InsertMode::PerScan,
        InsertName::PerRay => InsertMode::PerRay,
    };
    let sensor_model = sensor_model(args, config.sensor_model)?;
    Ok(config
        .with_sensor_model(sensor_model)
        .with_range(args.min_range, args.max_range)
        .with_insert_mode(insert_mode)
        .with_cache_tiles(args.cache_tiles))
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
