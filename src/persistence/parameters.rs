//! Conversion between a map's configuration and `metadata.json`.

use crate::config::MapConfig;
use crate::error::{FormatError, Result};
use crate::store::{Extension, InputRecord, MapParameters, Metadata, hex};
use std::path::Path;

/// Returns the metadata of a new map. The store fills in bounds and numbers.
pub(crate) fn new_metadata(config: &MapConfig, map_id: [u8; 16], inputs: &[InputRecord]) -> Metadata {
    let ext = Extension {
        empty: true,
        map_id: hex(&map_id),
        flush_number: 0,
        scan_number: 0,
        sensor_model: config.sensor_model,
        occupancy_threshold: config.occupancy_threshold,
        rays: config.rays.stored(),
        inputs: inputs.to_vec(),
        decayed_scan: 0,
        storage: config.storage,
        layers: config.layers(),
        crs: config.crs.clone(),
        keeps_scans: config.keeps_scans,
        keeps_motion: false,
        catalog: None,
        scan_records: None,
        snapshots: None,
    };
    let (resolution_m, tile_size_m) = (config.grid.resolution_m(), config.grid.tile_size_m());
    Metadata { resolution_m, tile_size_m, bounds: None, ext: Some(ext) }
}

/// Returns the configuration in a map's metadata. A map of the original format has the default sensor model.
///
/// # Errors
///
/// Invalid parameters; `path` is the file that contains them.
pub(crate) fn config_from(metadata: &Metadata, path: &Path) -> Result<MapConfig> {
    let wrong = |error: String| FormatError::at_offset(0, error).in_map(path, None);
    let config = MapConfig::new(metadata.resolution_m, metadata.tile_size_m);
    let mut config = config.map_err(|error| wrong(error.to_string()))?.with_storage(metadata.storage());
    if let Some(ext) = &metadata.ext {
        config.sensor_model = ext.sensor_model;
        config.occupancy_threshold = ext.occupancy_threshold;
        config.rays = ext.rays;
        config.keeps_scans = ext.keeps_scans;
        config.crs.clone_from(&ext.crs);
        config.layers = Some(ext.layers);
    }
    config.validated().map_err(|error| wrong(error.to_string()))
}

/// Returns the parameters that every tile's file contains.
pub(crate) fn map_parameters(config: &MapConfig) -> MapParameters {
    MapParameters {
        resolution: config.grid.resolution_m(),
        tile_size: config.grid.tile_size_m(),
        sensor_model: config.sensor_model,
        occupancy_threshold: config.occupancy_threshold,
        clearing: config.rays.stored().clearing,
        layers: config.layers(),
    }
}
