use crate::clean::{Cleaned, Phase};
use rustc_hash::FxHashMap;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{NewMarks, Replay, mark_moving};
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
    let (marks, points) = (unmarked(&scans), scans.scans().iter().map(|scan| scan.points).sum());
    let points_changed = scans.scans().iter().map(|scan| scan.moving_points).sum();
    let numbers = marks.numbers().to_vec();
    let of_scan = move |number| marks.of_scan(number);
    let replayed =
        mark_moving(&scans, numbers, of_scan, how, |done, all| progress(Phase::Undoing, done, all))?;
    Ok(Cleaned { replayed, points, points_changed })
}

/// Returns marks without a marked point for all scans that have marks.
pub fn unmarked(scans: &KeptSummary) -> NewMarks {
    let marked = scans.scans().iter().filter(|scan| scan.moving_points > 0);
    let counts: FxHashMap<u64, u64> = marked.map(|scan| (scan.number, scan.points)).collect();
    let numbers: Vec<u64> = counts.keys().copied().collect();
    let none = move |number: u64| Ok(MovingMarks::none(counts.get(&number).copied().unwrap_or_default()));
    NewMarks::new(numbers, none)
}
