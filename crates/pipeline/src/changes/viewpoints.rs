use crate::map_at::AnyMap;
use std::path::Path;
use voxtile::mapper::{MapReader, MapView};
use voxtile::{Point, Result};
use voxtile_compare::Viewpoints;
use voxtile_formats::poses::Trajectory;

/// Returns the positions of a map's sensor: those of a pose file, or else of the scans that the map keeps. `None` if
/// neither is there.
///
/// # Errors
///
/// The pose file cannot be read or contains no valid pose. Kept scans that cannot be read are only warned of.
pub fn viewpoints_of(map: &AnyMap, poses: Option<&Path>) -> Result<Option<Viewpoints>> {
    match (poses, map) {
        (Some(poses), _) => viewpoints_of_file(poses, map.config().rays.max_range_m).map(Some),
        (None, AnyMap::Map(reader)) => Ok(kept_viewpoints(reader)),
        (None, AnyMap::Octree(_)) => Ok(None),
    }
}

/// Returns the positions from which a map's kept scans were taken; `None` if it keeps none, or with a warning, if they
/// cannot be read.
pub fn kept_viewpoints(map: &MapReader) -> Option<Viewpoints> {
    let read = || -> Result<Option<Viewpoints>> {
        let (mut scans, mut positions, mut farthest_m) = (map.kept_scans()?, Vec::new(), Some(0.0_f64));
        while let Some(record) = scans.next_record()? {
            positions.push(record.origin_m());
            farthest_m = farthest_m.zip(record.rays.max_range_m).map(|(a, b)| a.max(b));
        }
        if positions.is_empty() {
            return Ok(None);
        }
        Viewpoints::new(positions, farthest_m).map(Some)
    };
    if !map.keeps_scans() {
        return None;
    }
    read().unwrap_or_else(|error| {
        let name = map.folder().display();
        log::warn!("{name}: hidden voxels count as not seen, because its kept scans cannot be read: {error}");
        None
    })
}

fn viewpoints_of_file(path: &Path, range_m: Option<f64>) -> Result<Viewpoints> {
    let trajectory = Trajectory::read(path, None)?;
    let mut positions: Vec<Point> = Vec::new();
    for number in 0..trajectory.len() {
        positions.extend(trajectory.by_number(number)?.map(|pose| pose.position_m));
    }
    Viewpoints::new(positions, range_m)
}
