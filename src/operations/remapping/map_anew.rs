use crate::config::{MapConfig, RayConfig};
use crate::error::Result;
use crate::mapper::{MapReader, Mapper, OutOfCoreTileMapper};
use crate::scan::{ScanReport, Stop};
use crate::store::{InputRecord, MapPath};
use serde::Serialize;

/// What came of mapping the scans of a map anew.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MappedAnew {
    /// Scans of the new map.
    pub scans: u64,
    /// What happened to their points.
    #[serde(flatten)]
    pub report: ScanReport,
}

/// Makes another map of the scans that a map keeps, with other parameters. Each scan's rays are those that it was
/// mapped with, as `rays` changes them.
///
/// `progress` is told the scans done and all. The new map keeps scans if `config` says so.
///
/// # Errors
///
/// A map that keeps no scans; a wrong configuration; a folder with other content; damage; a disk that refuses; a
/// request to stop.
pub fn map_anew(
    map: &MapReader,
    output: impl Into<MapPath>,
    config: MapConfig,
    rays: impl Fn(&RayConfig) -> RayConfig,
    stop: &Stop,
    mut progress: impl FnMut(u64, u64),
) -> Result<MappedAnew> {
    let all = map.kept_scans()?;
    let config = MapConfig { rays: rays(&config.rays), ..config };
    let count = map.scans()?.len() as u64;
    let mut mapper = OutOfCoreTileMapper::create(output, config)?;
    mapper.stop_with(stop.clone());
    let name = map.folder().file_name().map(|name| name.to_string_lossy().into_owned());
    mapper.begin_input(InputRecord::from(name.unwrap_or_default()))?;
    let mut mapped = MappedAnew::default();
    for scan in all {
        stop.check()?;
        let scan = scan?;
        mapper.set_rays(rays(scan.rays()))?;
        mapped.report += mapper.insert_points(&scan)?;
        mapped.scans += 1;
        progress(mapped.scans, count);
    }
    mapper.flush()?;
    Ok(mapped)
}
