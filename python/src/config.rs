//! Configurations of maps from keyword arguments.

use crate::errors::{exception, wrong};
use crate::layers::layers_of;
use crate::options::clearings;
use bytesize::ByteSize;
use pyo3::prelude::*;
use voxtile::sensor::{Iwlo, LogOdds};
use voxtile::{Clearing, InsertMode, MapConfig, MemoryLimit, SensorModel, Storage};

/// Arguments of [`config_of`].
pub struct ConfigArguments<'a, 'py> {
    pub resolution: f64,
    pub tile_size: Option<f64>,
    pub min_range: f64,
    pub max_range: Option<f64>,
    pub insert_mode: &'a str,
    pub clearing: &'a str,
    pub sensor_model: &'a str,
    pub probabilities: Option<[f64; 4]>,
    pub occupancy_threshold: f64,
    pub storage: &'a str,
    pub memory: Option<Bound<'py, PyAny>>,
    pub keep_scans: bool,
    pub layers: Option<Bound<'py, PyAny>>,
}

/// Returns the configuration of a new map.
pub fn config_of(py: Python<'_>, arguments: &ConfigArguments<'_, '_>) -> PyResult<MapConfig> {
    let raised = |error: voxtile::Error| exception(py, &error);
    let insert_mode = match arguments.insert_mode {
        "per-scan" => InsertMode::PerScan,
        "per-ray" => InsertMode::PerRay,
        other => {
            return Err(wrong(py, "insert_mode", format!("{other:?} is neither 'per-scan' nor 'per-ray'")));
        }
    };
    let clearing = clearing_of(py, arguments.clearing)?;
    let sensor_model = match (arguments.sensor_model, arguments.probabilities) {
        ("log-odds", None) => SensorModel::default(),
        ("log-odds", Some([hit, miss, min, max])) => {
            SensorModel::LogOdds(LogOdds::from_probabilities(hit, miss, min, max).map_err(raised)?)
        }
        ("iwlo", None) => SensorModel::Iwlo(Iwlo::default()),
        ("iwlo", Some(_)) => {
            return Err(wrong(py, "probabilities", "only the sensor model 'log-odds' has them"));
        }
        (other, _) => {
            return Err(wrong(py, "sensor_model", format!("{other:?} is neither 'log-odds' nor 'iwlo'")));
        }
    };
    let config = match arguments.tile_size {
        Some(tile_size) => MapConfig::new(arguments.resolution, tile_size),
        None => MapConfig::with_resolution(arguments.resolution),
    };
    let mut config = config
        .map_err(raised)?
        .with_sensor_model(sensor_model)
        .with_range(arguments.min_range, arguments.max_range)
        .with_insert_mode(insert_mode)
        .with_clearing(clearing)
        .with_storage(storage_of(py, arguments.storage)?)
        .with_kept_scans(arguments.keep_scans);
    config.occupancy_threshold = arguments.occupancy_threshold;
    config.layers = arguments.layers.as_ref().map(layers_of).transpose()?;
    config.memory = memory_of(arguments.memory.as_ref())?;
    config.validated().map_err(raised)
}

/// Returns the clearing rule with this name.
pub fn clearing_of(py: Python<'_>, name: &str) -> PyResult<Clearing> {
    let known = clearings().into_iter().find(|(known, _)| *known == name);
    known
        .map(|(_, clearing)| clearing)
        .ok_or_else(|| wrong(py, "clearing", format!("{name:?} is neither 'octomap' nor 'guarded'")))
}

/// Returns the memory limit, or the default.
pub fn memory_of(memory: Option<&Bound<'_, PyAny>>) -> PyResult<MemoryLimit> {
    Ok(memory.map(bytes_of).transpose()?.map_or(MemoryLimit::Default, MemoryLimit::Bytes))
}

/// Returns the storage with this name.
pub fn storage_of(py: Python<'_>, storage: &str) -> PyResult<Storage> {
    match storage {
        "octomap" => Ok(Storage::OctoMap),
        "compact" => Ok(Storage::Compact),
        other => Err(wrong(py, "storage", format!("{other:?} is neither 'octomap' nor 'compact'"))),
    }
}

/// Parses bytes of memory: a number, or a text such as `"512MiB"`.
pub fn bytes_of(memory: &Bound<'_, PyAny>) -> PyResult<usize> {
    let py = memory.py();
    if let Ok(bytes) = memory.extract::<usize>() {
        return Ok(bytes);
    }
    let no_bytes = || {
        wrong(
            py,
            "memory",
            format!("{memory:?} is not a number of bytes; pass a number, or text as '512MiB'"),
        )
    };
    let text: String = memory.extract().map_err(|_| no_bytes())?;
    let size: ByteSize = text.parse().map_err(|_| no_bytes())?;
    usize::try_from(size.as_u64()).map_err(|_| no_bytes())
}
