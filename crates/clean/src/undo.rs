use crate::clean::{Cleaned, Phase};
use rustc_hash::FxHashMap;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{Replay, mark_moving};
use voxtile::scan::MovingMarks;
use voxtile::{MapPath, Result};

/// Removes all marks of moving points: the map is that of before the marks, bit by bit. `progress` receives the number
/// of scans done and in total.
///
/// # Errors
///
/// As for [`mark_moving`]. The map is unchanged then.
pub fn undo(
    map: impl Into<MapPath>,
    how: &Replay,
    mut progress: impl FnMut(Phase, u64, u64),
) -> Result<Cleaned> {
    let scans = KeptSummary::read(map)?;
    let marked = scans.scans().iter().filter(|scan| scan.moving_points > 0);
    let counts: FxHashMap<u64, u64> = marked.clone().map(|scan| (scan.number, scan.points)).collect();
    let numbers: Vec<u64> = counts.keys().copied().collect();
    let none = move |number: u64| {
        let points = counts.get(&number).copied().unwrap_or_default();
        Ok(MovingMarks::none(points))
    };
    let points = scans.scans().iter().map(|scan| scan.points).sum();
    let points_changed = marked.map(|scan| scan.moving_points).sum();
    let replayed = mark_moving(&scans, numbers, none, how, |done, all| progress(Phase::Undoing, done, all))?;
    Ok(Cleaned { replayed, points, points_changed })
}
