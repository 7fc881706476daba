use super::completion::complete_earlier;
use super::filtered_scan::FilteredScan;
use super::replay::{Replay, Replayed, replay};
use super::revision::{Change, Changes};
use crate::error::{Error, Result};
use crate::mapper::MapReader;
use crate::scan::ScanPoints;
use crate::space::Aabb;
use crate::store::MapPath;
use serde::Serialize;
use std::path::Path;

/// Result of [`remove_points`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PointsRemoved {
    /// Counts of the replay.
    #[serde(flatten)]
    pub mapped: Replayed,
    /// Number of removed points.
    pub points_removed: u64,
}

/// Removes all points in a box from the kept scans of a map, as if they had never been measured: tiles that their rays
/// touch are replayed from the other points. The box is in metres in the world frame, and excludes its upper faces.
/// Snapshots are unchanged.
///
/// `progress` receives the number of scans done and in total.
///
/// # Errors
///
/// As for [`remap`](super::remap()), and an invalid box.
pub fn remove_points(
    map: impl Into<MapPath>,
    region: &Aabb,
    how: &Replay,
    progress: impl FnMut(u64, u64),
) -> Result<PointsRemoved> {
    let (disk, folder) = map.into().into_parts();
    check_region(region, &folder)?;
    let (mut changes, mut points_removed) = (Changes::default(), 0);
    let summary = {
        let reader = MapReader::open(MapPath::on(disk.clone(), &folder), 0)?;
        let summary = reader.kept_summary()?;
        summary.check_keeps_all()?;
        for scan in reader.kept_scans()? {
            how.stop.check()?;
            let scan = scan?;
            let points = FilteredScan::new(&scan, *region, true)?.len() as u64;
            if points > 0 {
                points_removed += points;
                changes.insert(scan.number(), Change::Filter(*region));
            }
        }
        summary
    };
    let mapped = replay(&summary, changes, how, progress)?;
    if mapped.scans_changed == 0 && !how.is_dry_run {
        // Remove the files of an earlier call that may have been killed after its commit.
        complete_earlier(disk, &folder)?;
    }
    Ok(PointsRemoved { mapped, points_removed })
}

fn check_region(region: &Aabb, map: &Path) -> Result<()> {
    let is_box = (0..3).all(|axis| region.min[axis] < region.max[axis]);
    if is_box {
        return Ok(());
    }
    let reason = format!("not a box (map {}); give the lower corner first", map.display());
    Err(Error::argument("region", reason))
}
