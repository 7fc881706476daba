use crate::build_options::{BuildOptions, SensorModelKind};
use crate::region_tiles::tiles_of;
use crate::scan_input::ScanInput;
use voxtile::mapper::{MapReader, MapView};
use voxtile::sensor::{Iwlo, LogOdds, SensorModel};
use voxtile::space::GridError;
use voxtile::{Error, InsertMode, MapConfig, RayConfig, Storage};

/// Default edge of a voxel in metres.
const RESOLUTION_M: f64 = 0.1;
/// Default maximum range of rays in metres.
const MAX_RANGE_M: f64 = 100.0;

/// Returns the parameters of a new map.
pub fn config_to_create(options: &BuildOptions) -> anyhow::Result<MapConfig> {
    let resolution_m = options.resolution_m.unwrap_or(RESOLUTION_M);
    let config = match options.tile_size_m {
        Some(tile_size_m) => MapConfig::new(resolution_m, tile_size_m),
        None => MapConfig::with_resolution(resolution_m),
    };
    let mut config = config.map_err(name_the_option)?.with_storage(options.storage.unwrap_or_default());
    config.occupancy_threshold = options.occupancy_threshold.unwrap_or(config.occupancy_threshold);
    Ok(for_this_run(options, config, None)?.validated()?)
}

/// Returns the parameters of an existing map. Given options must agree with them.
pub fn config_to_go_on(options: &BuildOptions, input: &ScanInput) -> anyhow::Result<MapConfig> {
    let map = MapReader::open(&options.output, 0)?;
    let mut config = map.config().clone();
    let grid = config.grid.replaced(options.resolution_m, options.tile_size_m);
    config.grid = grid.map_err(|error| name_the_option(error.into()))?;
    check_storage(options, config.storage)?;
    check_threshold(options, config.occupancy_threshold)?;
    let begun = options.resume.then(|| rays_begun(input, &map));
    Ok(for_this_run(options, config, begun)?.validated()?)
}

/// Returns the ray settings of the input to resume. A later input may have changed the map's current ones. Whether it
/// is the same input is only known once it is read; its settings are compared then.
fn rays_begun(input: &ScanInput, map: &MapReader) -> RayConfig {
    let name = input.name_of_paths();
    let inputs = map.metadata().ext.as_ref().map_or(&[][..], |ext| &ext.inputs);
    let input = inputs.iter().rfind(|input| input.is_named(&name)).or(inputs.last());
    input.and_then(|input| input.rays).unwrap_or(map.config().rays)
}

/// Adds advice to the error that the tile size is not a multiple of the voxel size.
fn name_the_option(error: Error) -> anyhow::Error {
    match error {
        Error::Grid(GridError::NotWhole { smaller_m, larger_m, .. }) => {
            let fitting = match smaller_m == larger_m {
                true => format!("`tile_size` {smaller_m}"),
                false => format!("`tile_size` {smaller_m} or `tile_size` {larger_m}"),
            };
            anyhow::Error::new(error).context(format!("add {fitting}, or choose another `resolution`"))
        }
        error => error.into(),
    }
}

fn check_storage(options: &BuildOptions, own: Storage) -> voxtile::Result<()> {
    match options.storage {
        Some(wanted) if wanted != own => {
            let reason = format!("the map's tiles are stored as {own}: omit this option, or convert the map");
            Err(Error::argument("storage", reason))
        }
        _ => Ok(()),
    }
}

fn check_threshold(options: &BuildOptions, own: f64) -> voxtile::Result<()> {
    match options.occupancy_threshold {
        Some(wanted) if wanted != own => {
            Err(Error::argument("occupancy_threshold", format!("the map has {own}: omit this option")))
        }
        _ => Ok(()),
    }
}

/// Applies the options of this run. Settings of an existing input cannot be changed; contradictions are refused later.
fn for_this_run(
    options: &BuildOptions,
    config: MapConfig,
    begun: Option<RayConfig>,
) -> anyhow::Result<MapConfig> {
    let begun_mode = begun.map_or(InsertMode::PerScan, |rays| rays.insert_mode);
    let insert_mode = options.insert_mode.unwrap_or(begun_mode);
    let min_range_m = options.min_range_m.unwrap_or(begun.map_or(0.0, |rays| rays.min_range_m));
    let begun_max_m = begun.map_or(Some(MAX_RANGE_M), |rays| rays.max_range_m);
    let sensor_model = sensor_model(options, config.sensor_model)?;
    let mut config =
        config.with_sensor_model(sensor_model).with_insert_mode(insert_mode).with_octree(options.octree);
    config.rays.clearing = options.clearing.or(config.rays.clearing);
    config.layers = options.layers.or(config.layers);
    config.memory = options.memory;
    config.keeps_scans |= options.keep_scans;
    config.rays.no_return_range_m =
        options.clear_no_return_m.or(begun.and_then(|rays| rays.no_return_range_m));
    config.rays.region = match &options.region {
        Some(region) => Some(tiles_of(region, &config.grid)?),
        None => begun.and_then(|rays| rays.region),
    };
    config.rays.min_range_m = min_range_m;
    config.rays.max_range_m = options.max_range_m.or(begun_max_m);
    Ok(config)
}

fn sensor_model(options: &BuildOptions, own: SensorModel) -> anyhow::Result<SensorModel> {
    let model = match (options.sensor_model, own) {
        (None, own) => own,
        (Some(SensorModelKind::LogOdds), SensorModel::LogOdds(own)) => SensorModel::LogOdds(own),
        (Some(SensorModelKind::LogOdds), _) => SensorModel::default(),
        (Some(SensorModelKind::Iwlo), SensorModel::Iwlo(own)) => SensorModel::Iwlo(own),
        (Some(SensorModelKind::Iwlo), _) => SensorModel::Iwlo(Iwlo::default()),
    };
    if options.probabilities.is_some() && !matches!(model, SensorModel::LogOdds(_)) {
        return Err(
            Error::argument("probabilities", "only the sensor model log-odds has these parameters").into()
        );
    }
    if let Some([hit, miss, least, most]) = options.probabilities {
        return Ok(SensorModel::LogOdds(LogOdds::from_probabilities(hit, miss, least, most)?));
    }
    let SensorModel::Iwlo(mut iwlo) = model else {
        if options.intensity_threshold.is_some() || options.intensity_max.is_some() {
            let reason = "only the sensor model iwlo has these parameters: add `sensor_model` iwlo";
            return Err(Error::argument("intensity_threshold, intensity_max", reason).into());
        }
        return Ok(model);
    };
    iwlo.intensity_threshold = options.intensity_threshold.unwrap_or(iwlo.intensity_threshold);
    iwlo.intensity_max = options.intensity_max.unwrap_or(iwlo.intensity_max);
    Ok(SensorModel::Iwlo(iwlo.validated()?))
}
