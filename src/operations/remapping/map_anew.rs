use super::retiling::Retiling;
use crate::config::{MapConfig, RayConfig};
use crate::error::Result;
use crate::mapper::{MapReader, MapView, Mapper, OutOfCoreTileMapper};
use crate::scan::{ScanReport, Stop};
use crate::store::{InputRecord, MapPath, StagedMap, TileStore};
use serde::Serialize;
use std::path::Path;

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
/// mapped with, as `rays` changes them. So is the region of the new map that of the map, whatever `config` says; where
/// its tiles have another size, it is said in these.
///
/// `progress` is told the scans done and all. The new map keeps scans if `config` says so. It is there whole or not at
/// all: until the end it lies beside its place, as `MAP.unfinished`.
///
/// # Errors
///
/// A map that keeps no scans or consists of more than these; a region with borders that the new tiles do not have; a
/// wrong configuration; a folder with other content; another process that makes the same map; damage; a disk that
/// refuses; a request to stop. There is no map then, unless it was the name of the finished one that could not be made
/// durable.
pub fn map_anew(
    map: &MapReader,
    output: impl Into<MapPath>,
    config: MapConfig,
    rays: impl Fn(&RayConfig) -> RayConfig,
    stop: &Stop,
    progress: impl FnMut(u64, u64),
) -> Result<MappedAnew> {
    let retiling = Retiling::between(&map.config().grid, &config.grid);
    let rays = |own: &RayConfig| retiling.rays(own).map(|own| rays(&own));
    let of_map = RayConfig { region: map.config().rays.region, ..config.rays };
    let config = MapConfig { rays: rays(&of_map)?, ..config };
    // What their rays cannot become is refused before anything is made.
    let scans = map.kept_summary_with(|record| rays(&record.rays).map(drop))?;
    scans.check_keeps_all()?;
    let count = scans.scans().len() as u64;
    drop(scans);
    let (disk, folder) = output.into().into_parts();
    let create =
        |unfinished: &Path| OutOfCoreTileMapper::create(MapPath::on(disk.clone(), unfinished), config);
    let mut made = StagedMap::begin_by(disk.clone(), &folder, create)?;
    let mapped = map_scans(map, made.writer(), rays, stop, count, progress)?;
    made.finish()?;
    Ok(mapped)
}

/// Maps all scans, and flushes.
fn map_scans(
    map: &MapReader,
    mapper: &mut OutOfCoreTileMapper,
    rays: impl Fn(&RayConfig) -> Result<RayConfig>,
    stop: &Stop,
    count: u64,
    mut progress: impl FnMut(u64, u64),
) -> Result<MappedAnew> {
    mapper.stop_with(stop.clone());
    let name = map.folder().file_name().map(|name| name.to_string_lossy().into_owned());
    mapper.begin_input(InputRecord::from(name.unwrap_or_default()))?;
    let mut mapped = MappedAnew::default();
    for scan in map.kept_scans()? {
        stop.check()?;
        let scan = scan?;
        mapper.set_rays(rays(scan.rays())?)?;
        mapped.report += mapper.insert_points(&scan)?;
        mapped.scans += 1;
        progress(mapped.scans, count);
    }
    mapper.flush()?;
    // What a flush may leave to the next opening of the map is not left here: nobody else is to see it.
    mapper.with_store(TileStore::checkpoint)?;
    Ok(mapped)
}
