use super::change::{Change, Changes, MarkSource};
use super::new_poses::NewPoses;
use super::points_in_box::PointsInBox;
use super::remap::Remapped;
use super::remove_scans::{ScanSelection, Selection};
use crate::error::{Error, Result};
use crate::mapper::{KeptSummary, MapReader};
use crate::scan::MovingMarks;
use crate::store::MapPath;
use std::sync::Arc;

/// Change of the scans that a map keeps, which several processes replay in parts: [`replay_columns`], then
/// [`replay_part`] for each column. The operation of the change commits them ([`Replay::with_parts`]).
///
/// [`replay_columns`]: super::replay_columns()
/// [`replay_part`]: super::replay_part()
/// [`Replay::with_parts`]: super::Replay::with_parts
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum ScanChange {
    /// New poses, and the tolerance in metres and radians within which scans keep theirs; see
    /// [`remap`](super::remap()).
    Move(NewPoses, Option<(f64, f64)>),
    /// Removal of scans; see [`remove_scans`](super::remove_scans()).
    Remove(ScanSelection),
    /// Removal of points; see [`remove_found_points`](super::remove_found_points()).
    RemovePoints(PointsInBox),
    /// New marks of moving points; see [`mark_moving`](super::mark_moving()).
    Mark(NewMarks),
}

/// New marks of the moving points of scans.
#[derive(Clone, Debug)]
pub struct NewMarks {
    numbers: Vec<u64>,
    source: MarkSource,
}

impl NewMarks {
    /// Marks of the scans of `numbers`, which `marks` returns.
    pub fn new(
        numbers: impl IntoIterator<Item = u64>,
        marks: impl Fn(u64) -> Result<MovingMarks> + Send + Sync + 'static,
    ) -> Self {
        Self { numbers: numbers.into_iter().collect(), source: MarkSource(Arc::new(marks)) }
    }

    /// Numbers of the scans.
    pub fn numbers(&self) -> &[u64] {
        &self.numbers
    }

    /// Returns the new marks of a scan.
    ///
    /// # Errors
    ///
    /// Those of the source.
    pub fn of_scan(&self, number: u64) -> Result<MovingMarks> {
        (self.source.0)(number)
    }

    pub(super) fn changes(&self) -> Changes {
        self.numbers.iter().map(|&number| (number, Change::Mark(self.source.clone()))).collect()
    }
}

impl ScanChange {
    /// Returns the changes of the scans of a map.
    ///
    /// # Errors
    ///
    /// Those of the operation that do not concern the replay.
    pub(super) fn of(&self, scans: &KeptSummary) -> Result<Changes> {
        match self {
            Self::Move(poses, tolerance) => Ok(Remapped::by_poses(scans, poses, *tolerance)?.1),
            Self::Remove(selection) => {
                let (disk, folder) = scans.place();
                let reader = MapReader::open(MapPath::on(disk, folder), 0)?;
                match reader.flush_number() == scans.flush_number() {
                    true => Ok(Selection::of(selection, &reader).removals(scans)),
                    false => Err(Error::Changed { path: folder.to_owned() }),
                }
            }
            Self::RemovePoints(found) => found.changes(scans),
            Self::Mark(marks) => Ok(marks.changes()),
        }
    }
}
