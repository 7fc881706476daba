use super::replay::{Replay, Replayed, replay};
use super::scan_change::NewMarks;
use crate::error::Result;
use crate::mapper::KeptSummary;
use crate::scan::MovingMarks;

/// Marks points of kept scans as hits of something that was moving. A marked point is no hit and protects no voxel from
/// misses; the misses of its ray stay. Affected tiles are replayed, and one commit changes tiles and marks.
///
/// `marks` returns the new marks of each scan in `numbers`: one per point, in the order of the points. They replace the
/// earlier marks, so marks without a marked point restore the scan. Other scans are unchanged. `progress` receives the
/// number of scans done and in total.
///
/// # Errors
///
/// A map that keeps no scans or has other scans too; marks that do not match the points of a scan; errors of `marks`,
/// which is called up to twice for each scan; a damaged segment or catalog; another writer, or
/// [`Error::Changed`](crate::Error::Changed) if one has flushed since `scans` was read; an I/O error; a request to
/// stop. The map is unchanged then. A snapshot `keep_as` may have been created.
pub fn mark_moving(
    scans: &KeptSummary,
    numbers: impl IntoIterator<Item = u64>,
    marks: impl Fn(u64) -> Result<MovingMarks> + Send + Sync + 'static,
    how: &Replay,
    progress: impl FnMut(u64, u64),
) -> Result<Replayed> {
    scans.check_keeps_all()?;
    replay(scans, NewMarks::new(numbers, marks).changes(), how, progress)
}
