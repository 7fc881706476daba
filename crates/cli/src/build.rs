use crate::args::{BuildArgs, InsertName, ModelName};
use crate::counted::Counted;
use crate::failure::JsonTo;
use crate::logging::print_message;
use crate::octree_choice::octree_config;
use crate::part::region_of;
use crate::progress::at_terminal;
use crate::read_options::read_options;
use crate::run::INTERRUPTED;
use crate::{stop_signal, summary};
use bytesize::ByteSize;
use std::process::ExitCode;
use voxtile::{InsertMode, MemoryLimit, Storage};
use voxtile_pipeline::{BuildOptions, SensorModelKind, build};

pub fn run(args: &BuildArgs) -> anyhow::Result<ExitCode> {
    let watch = at_terminal(stop_signal::catch()?);
    let Some(built) = build(&options_of(args)?, &watch)? else { return Ok(stopped_early(args)) };
    let (interrupted, all) = (built.interrupted, built.resumed_after + built.scans);
    summary::print(built, args.json)?;
    if interrupted {
        print_message(format_args!(
            "stopped after {}; all of them are in the map; continue with --resume",
            Counted(all, "scan")
        ));
        return Ok(ExitCode::from(INTERRUPTED));
    }
    Ok(ExitCode::SUCCESS)
}

/// Reports a stop before the first scan was mapped.
fn stopped_early(args: &BuildArgs) -> ExitCode {
    let message = "stopped before the first scan; the map has not changed";
    JsonTo::output_if(args.json).report_stopped(message);
    ExitCode::from(INTERRUPTED)
}

/// Returns the limit of `--memory`, or the default.
pub fn memory_of(memory: Option<ByteSize>) -> MemoryLimit {
    memory.map_or(MemoryLimit::Default, |memory| {
        MemoryLimit::Bytes(usize::try_from(memory.as_u64()).unwrap_or(usize::MAX))
    })
}

fn options_of(args: &BuildArgs) -> voxtile::Result<BuildOptions> {
    let mut options = BuildOptions { scans: args.scans.clone(), ..BuildOptions::new("", &args.output) };
    options.read = read_options(&args.read)?;
    options.resolution_m = args.resolution;
    options.tile_size_m = args.tile_size;
    options.storage = args.storage.map(Storage::from);
    options.memory = args.cache_tiles.map_or(memory_of(args.memory), MemoryLimit::tiles);
    options.min_range_m = args.min_range;
    options.max_range_m = args.max_range;
    options.sensor_model = args.sensor_model.map(|name| match name {
        ModelName::LogOdds => SensorModelKind::LogOdds,
        ModelName::Iwlo => SensorModelKind::Iwlo,
    });
    options.probabilities = args.probabilities.as_deref().and_then(|four| four.try_into().ok());
    options.occupancy_threshold = args.occupancy_threshold;
    options.intensity_threshold = args.intensity_threshold;
    options.intensity_max = args.intensity_max;
    options.insert_mode = args.insert.map(|name| match name {
        InsertName::PerScan => InsertMode::PerScan,
        InsertName::PerRay => InsertMode::PerRay,
    });
    options.clearing = args.clearing.map(Into::into);
    options.layers = args.layers;
    options.keep_scans = args.keep_scans;
    options.region = args.region.as_deref().map(region_of).transpose()?;
    options.clear_no_return_m = args.clear_no_return;
    options.no_rays = args.no_rays;
    options.append = args.append;
    options.resume = args.resume;
    options.again = args.again;
    options.skip_bad = args.skip_bad;
    options.strict = args.strict;
    options.flush_every = args.flush_every;
    options.when_behind = args.when_behind.into();
    options.octree = octree_config(&args.octree)?;
    Ok(options)
}
