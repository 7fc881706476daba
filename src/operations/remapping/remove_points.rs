use super::filtered_scan::FilteredScan;
use super::revision::{Fate, MappedAgain, Rework, check_region, complete_earlier, rework};
use crate::error::Result;
use crate::mapper::MapReader;
use crate::scan::ScanPoints;
use crate::space::Aabb;
use crate::store::{KeptRecord, MapPath};
use rustc_hash::FxHashSet;
use serde::Serialize;

/// What was removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PointsRemoved {
    /// What was mapped again.
    #[serde(flatten)]
    pub mapped: MappedAgain,
    /// Points that are gone.
    pub points_removed: u64,
}

/// Takes all points in a box out of the scans that a map keeps, as if they had never been measured: what their rays
/// touched is mapped again from the rest. Metres, world frame; the upper faces are outside. Snapshots stay.
///
/// `progress` is told the scans done and all.
///
/// # Errors
///
/// As for [`remap`](super::remap()); a box that is none.
pub fn remove_points(
    map: impl Into<MapPath>,
    region: &Aabb,
    how: &Rework,
    progress: impl FnMut(u64, u64),
) -> Result<PointsRemoved> {
    let (disk, folder) = map.into().into_parts();
    check_region(region, &folder)?;
    let (mut changed, mut points_removed) = (FxHashSet::default(), 0);
    let seen = {
        let reader = MapReader::open(MapPath::on(disk.clone(), &folder), 1)?;
        reader.check_keeps_all()?;
        for scan in reader.kept_scans()? {
            how.stop.check()?;
            let scan = scan?;
            let points = FilteredScan::new(&scan, *region, true)?.len() as u64;
            if points > 0 {
                points_removed += points;
                changed.insert(scan.number());
            }
        }
        reader.flush_number()
    };
    let fate = |record: &KeptRecord| match changed.contains(&record.number) {
        true => Fate::Loses(*region),
        false => Fate::Stays,
    };
    let mapped = rework(MapPath::on(disk.clone(), &folder), seen, how, fate, progress)?;
    if mapped.scans_changed == 0 && !how.is_dry_run {
        // An earlier call may have been killed after its commit.
        complete_earlier(disk, &folder)?;
    }
    Ok(PointsRemoved { mapped, points_removed })
}
