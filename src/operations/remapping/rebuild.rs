use super::new_poses::{NewPoses, check_can_move};
use super::retiling::Retiling;
use crate::config::{Layers, MapConfig, RayConfig};
use crate::error::{Error, Result};
use crate::mapper::{KeptScan, MapReader, MapView, Mapper, OutOfCoreTileMapper};
use crate::scan::{ScanReport, Stop};
use crate::store::{InputRecord, KeptRecord, MapPath, StagedMap, TileStore};
use serde::Serialize;
use std::path::Path;

/// Result of [`rebuild`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Rebuilt {
    /// Number of scans in the new map.
    pub scans: u64,
    /// Counts of their points.
    #[serde(flatten)]
    pub report: ScanReport,
    /// Scans that do not hold what the layers of the new map need.
    pub scans_without: ScansWithout,
}

/// Numbers of kept scans with points that do not hold what a layer needs; 0 for layers that the map does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ScansWithout {
    /// Scans without colours.
    pub colour: u64,
    /// Scans without intensities.
    pub intensity: u64,
    /// Scans without classes.
    pub class: u64,
    /// Scans without a time stamp.
    pub time: u64,
}

impl ScansWithout {
    fn note(&mut self, scan: &KeptRecord, layers: &Layers) {
        self.colour += u64::from(layers.colour && !scan.has_colours);
        self.intensity += u64::from(layers.intensity_max.is_some() && !scan.has_intensities);
        self.class += u64::from(layers.class && !scan.has_classes);
        self.time += u64::from(layers.time && scan.stamp_ns.is_none());
    }

    /// Name of each layer, and the number of scans.
    pub fn by_layer(&self) -> [(&'static str, u64); 4] {
        let Self { colour, intensity, class, time } = *self;
        [("colour", colour), ("intensity", intensity), ("class", class), ("time", time)]
    }
}

/// Creates another map from the scans that a map keeps, with other parameters. `rays` changes the ray settings of each
/// scan. The region is that of the source map, regardless of `config`, converted to the new tile size.
///
/// `progress` receives the number of scans done and in total. The new map keeps scans if `config.keeps_scans` is set.
/// It appears only when it is complete; until then it is in `MAP.unfinished`.
///
/// # Errors
///
/// A map that keeps no scans or has other scans too; a layer that the map does not have and no scan can fill; a region
/// whose borders are not borders of the new tiles; an invalid configuration; a folder with other content; another
/// process that creates the same map; damage; an I/O error; a request to stop. There is no map then. The exception is a
/// failure of the last step, the sync of the folder that contains the map.
pub fn rebuild(
    map: &MapReader,
    output: impl Into<MapPath>,
    config: MapConfig,
    rays: impl Fn(&RayConfig) -> RayConfig,
    stop: &Stop,
    progress: impl FnMut(u64, u64),
) -> Result<Rebuilt> {
    rebuild_with_poses(map, output, config, rays, &NewPoses::Numbered(Vec::new()), stop, progress)
}

/// As [`rebuild`], with new poses. Scans without a new pose keep theirs.
///
/// # Errors
///
/// As for [`rebuild`]; missing, surplus or non-finite poses; a new pose of a scan whose points are in the world frame.
pub fn rebuild_with_poses(
    map: &MapReader,
    output: impl Into<MapPath>,
    config: MapConfig,
    rays: impl Fn(&RayConfig) -> RayConfig,
    poses: &NewPoses,
    stop: &Stop,
    progress: impl FnMut(u64, u64),
) -> Result<Rebuilt> {
    let retiling = Retiling::between(&map.config().grid, &config.grid);
    let rays = |own: &RayConfig| retiling.rays(own).map(|own| rays(&own));
    let of_map = RayConfig { region: map.config().rays.region, ..config.rays };
    let config = MapConfig { rays: rays(&of_map)?, ..config };
    // Report invalid ray settings before anything is created.
    let (layers, mut with_points, mut scans_without) = (config.layers(), 0, ScansWithout::default());
    let scans = map.kept_summary_with(|record| {
        if record.points > 0 {
            with_points += 1;
            scans_without.note(record, &layers);
        }
        rays(&record.rays).map(drop)
    })?;
    scans.check_keeps_all()?;
    scans.check_marks(|_| false)?;
    check_filled(&map.config().layers(), with_points, &scans_without)?;
    let poses = poses.by_number(&scans)?;
    for scan in scans.scans().iter().filter(|scan| poses.contains_key(&scan.number)) {
        check_can_move(scan)?;
    }
    let count = scans.scans().len() as u64;
    drop(scans);
    let (disk, folder) = output.into().into_parts();
    let create =
        |unfinished: &Path| OutOfCoreTileMapper::create(MapPath::on(disk.clone(), unfinished), config);
    let mut made = StagedMap::begin_by(disk.clone(), &folder, create)?;
    let moved = |scan: KeptScan| match poses.get(&scan.number()) {
        Some(pose) => scan.with_pose(pose.clone()),
        None => scan,
    };
    let mapped = map_scans(map, made.writer(), moved, rays, stop, count, progress)?;
    made.finish()?;
    Ok(Rebuilt { scans_without, ..mapped })
}

/// Checks that the scans fill the layers that the map does not have yet.
fn check_filled(own: &Layers, scans: u64, without: &ScansWithout) -> Result<()> {
    let missing = without
        .by_layer()
        .into_iter()
        .filter(|(layer, count)| scans > 0 && *count == scans && !own.names().any(|name| name == *layer));
    let missing: Vec<_> = missing.map(|(layer, _)| layer).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let reason = format!(
        "the kept scans hold nothing for {}: a map keeps colours and classes only if it has their layer; leave them \
         out, or build a map from the original files",
        missing.join(", ")
    );
    Err(Error::argument("layers", reason))
}

/// Inserts all scans, and flushes.
fn map_scans(
    map: &MapReader,
    mapper: &mut OutOfCoreTileMapper,
    moved: impl Fn(KeptScan) -> KeptScan,
    rays: impl Fn(&RayConfig) -> Result<RayConfig>,
    stop: &Stop,
    count: u64,
    mut progress: impl FnMut(u64, u64),
) -> Result<Rebuilt> {
    mapper.stop_with(stop.clone());
    let name = map.folder().file_name().map(|name| name.to_string_lossy().into_owned());
    mapper.begin_input(InputRecord::from(name.unwrap_or_default()))?;
    let mut mapped = Rebuilt::default();
    for scan in map.kept_scans()? {
        stop.check()?;
        let scan = moved(scan?);
        mapper.set_rays(rays(scan.rays())?)?;
        mapped.report += mapper.insert_points(&scan)?;
        mapped.scans += 1;
        progress(mapped.scans, count);
    }
    mapper.flush()?;
    // Finish the commit now, so that the map has no remaining work when it becomes visible.
    mapper.with_store(TileStore::checkpoint)?;
    Ok(mapped)
}
