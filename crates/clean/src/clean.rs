use crate::search::{Found, Search};
use serde::Serialize;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{Replay, Replayed, mark_moving};
use voxtile::{Aabb, MapPath, Result};

/// Options of [`clean`].
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
#[must_use]
pub struct Clean {
    /// Options of the replay.
    pub replay: Replay,
    /// Box in metres, world frame, outside of which no point is marked. Default: no limit.
    pub region: Option<Aabb>,
    /// Number of scans that must hit a thing in the same voxel for it to count as parked, not as moving. Default: none;
    /// parked things that leave are marked.
    pub parked_scans: Option<u32>,
}

impl Clean {
    /// Returns the options with this replay.
    pub fn new(replay: Replay) -> Self {
        Self { replay, ..Self::default() }
    }

    /// Sets the box in metres, world frame, outside of which no point is marked.
    pub fn with_region(self, region: impl Into<Option<Aabb>>) -> Self {
        Self { region: region.into(), ..self }
    }

    /// Sets the number of scans that must hit a thing in the same voxel for it to count as parked.
    pub fn with_parked_scans(self, parked_scans: impl Into<Option<u32>>) -> Self {
        Self { parked_scans: parked_scans.into(), ..self }
    }
}

/// Result of [`clean`] or [`undo`](crate::undo()).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Cleaned {
    /// Counts of the replay.
    #[serde(flatten)]
    pub replayed: Replayed,
    /// Number of points of all kept scans.
    pub points: u64,
    /// Number of points that are marked as moving, or whose marks were removed by `undo`.
    pub points_changed: u64,
}

/// Phase of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Phase {
    /// Marks are removed by `undo`.
    Undoing,
    /// Temporary maps of the scans are built.
    Mapping,
    /// The scans that hit each place are counted, if parked things are not to be marked.
    Counting,
    /// Scans are compared with the map.
    Finding,
    /// Affected tiles are replayed.
    Replaying,
}

/// Marks the points of kept scans that hit something that moved, so that they are no hits: their voxels become free
/// where other rays passed them. The points and the misses of their rays stay.
///
/// A voxel that a scan hits was seen through if other scans, before or after, passed it often enough: the map calls it
/// free, or a temporary map of the scans in reverse order. A point is marked if at least three fifths of the voxels around its own that the same scan hits were seen
/// through, within 0.35 m along each axis, rounded to whole voxels. Things that stood still and left later are marked
/// too if their place was seen through afterwards, except with `parked_scans`.
///
/// The result depends on the kept scans alone, not on earlier marks. `progress` receives the number of scans done and in
/// total in each phase.
///
/// # Errors
///
/// A map that keeps no scans or has other scans too; another writer, or [`Error::Changed`](voxtile::Error::Changed) if
/// one has flushed meanwhile; damage; an I/O error; a request to stop. The map is unchanged then. A snapshot `keep_as`
/// may have been created.
pub fn clean(
    map: impl Into<MapPath>,
    how: &Clean,
    mut progress: impl FnMut(Phase, u64, u64),
) -> Result<Cleaned> {
    let (disk, folder) = map.into().into_parts();
    let at = || MapPath::on(disk.clone(), &folder);
    let scans = KeptSummary::read(at())?;
    how.replay.check(&scans)?;
    drop(scans);

    let search = Search {
        region: how.region,
        parked_scans: how.parked_scans,
        memory: how.replay.memory,
        stop: how.replay.stop.clone(),
    };
    let Found { scans, marks, points, moving_points } = search.run(at(), &mut progress)?;
    let (numbers, of_scan) = (marks.numbers(), move |number| marks.of_scan(number));
    let replayed = mark_moving(&scans, numbers, of_scan, &how.replay, |done, all| {
        progress(Phase::Replaying, done, all)
    })?;
    Ok(Cleaned { replayed, points, points_changed: moving_points })
}
