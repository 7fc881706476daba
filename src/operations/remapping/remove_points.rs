use super::completion::complete_earlier;
use super::points_in_box::{PointsInBox, check_box};
use super::replay::{Replay, Replayed, replay};
use crate::error::Result;
use crate::mapper::KeptSummary;
use crate::space::Aabb;
use crate::store::MapPath;
use serde::Serialize;

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
    check_box(region, &folder)?;
    let scans = KeptSummary::read(MapPath::on(disk, folder))?;
    let found = PointsInBox::search(&scans, region, 0..=u64::MAX, &how.stop)?;
    remove_found_points(&scans, &found, how, progress)
}

/// Like [`remove_points`], with the points that searches of all scans have found.
///
/// # Errors
///
/// As for [`remove_points`], and a scan that was not searched.
pub fn remove_found_points(
    scans: &KeptSummary,
    found: &PointsInBox,
    how: &Replay,
    progress: impl FnMut(u64, u64),
) -> Result<PointsRemoved> {
    scans.check_keeps_all()?;
    let mapped = replay(scans, found.changes(scans)?, how, progress)?;
    if mapped.scans_changed == 0 && !how.is_dry_run {
        // Remove the files of an earlier call that may have been killed after its commit.
        let (disk, folder) = scans.place();
        complete_earlier(disk, folder)?;
    }
    Ok(PointsRemoved { mapped, points_removed: found.points() })
}
