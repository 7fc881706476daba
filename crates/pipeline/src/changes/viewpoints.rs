use crate::map_at::AnyMap;
use std::path::Path;
use voxtile::mapper::{MapReader, MapView};
use voxtile::{Point, Result};
use voxtile_compare::Viewpoints;
use voxtile_formats::poses::Trajectory;

/// Positions of a map's sensor.
#[derive(Clone, Debug)]
pub struct SensorPositions {
    /// In metres, in the frame of the map.
    pub positions_m: Vec<Point>,
    /// Maximum range of the map's scans in metres; `None` for no limit.
    pub range_m: Option<f64>,
}

impl SensorPositions {
    /// Reads the positions: those of a pose file, or else of the scans that the map keeps. `None` if neither is there.
    ///
    /// # Errors
    ///
    /// The pose file cannot be read or contains no valid pose. Kept scans that cannot be read are only warned of.
    pub fn read(map: &AnyMap, poses: Option<&Path>) -> Result<Option<Self>> {
        match (poses, map) {
            (Some(poses), _) => Self::of_file(poses, map.config().rays.max_range_m).map(Some),
            (None, AnyMap::Map(reader)) => Ok(Self::of_kept_scans(reader)),
            (None, AnyMap::Octree(_)) => Ok(None),
        }
    }

    fn of_kept_scans(map: &MapReader) -> Option<Self> {
        let read = || -> Result<Self> {
            let (mut scans, mut positions_m, mut range_m) = (map.kept_scans()?, Vec::new(), Some(0.0_f64));
            while let Some(record) = scans.next_record()? {
                positions_m.push(record.origin_m());
                range_m = range_m.zip(record.rays.max_range_m).map(|(a, b)| a.max(b));
            }
            Ok(Self { positions_m, range_m })
        };
        if !map.keeps_scans() {
            return None;
        }
        match read() {
            Ok(found) => Some(found).filter(|found| !found.positions_m.is_empty()),
            Err(error) => {
                let name = map.folder().display();
                log::warn!(
                    "{name}: no positions of the sensor, because the kept scans cannot be read: {error}"
                );
                None
            }
        }
    }

    fn of_file(path: &Path, range_m: Option<f64>) -> Result<Self> {
        let trajectory = Trajectory::read(path, None)?;
        let mut positions_m = Vec::new();
        for number in 0..trajectory.len() {
            positions_m.extend(trajectory.by_number(number)?.map(|pose| pose.position_m));
        }
        Ok(Self { positions_m, range_m })
    }

    fn viewpoints(self) -> Result<Viewpoints> {
        Viewpoints::new(self.positions_m, self.range_m)
    }
}

/// Returns the positions of a map's sensor for a comparison: those of a pose file, or else of the scans that the map
/// keeps. `None` if neither is there.
///
/// # Errors
///
/// As for [`SensorPositions::read`].
pub fn viewpoints_of(map: &AnyMap, poses: Option<&Path>) -> Result<Option<Viewpoints>> {
    SensorPositions::read(map, poses)?.map(SensorPositions::viewpoints).transpose()
}

/// Returns the positions from which a map's kept scans were taken; `None` if it keeps none, or with a warning, if they
/// cannot be read.
pub fn kept_viewpoints(map: &MapReader) -> Option<Viewpoints> {
    SensorPositions::of_kept_scans(map).and_then(|positions| positions.viewpoints().ok())
}
