use super::RigidPose;
use super::quaternion_order::OrderEvidence;
use super::trajectory::Trajectory;
use crate::spill::{Budget, PoseList, PoseWriter, Record, Sorter, TimedPose};
use std::cmp::Ordering;
use std::path::Path;
use voxtile::{Error, Result};

/// A line of text or a row of an array in a pose file.
pub(super) struct Row {
    pub(super) stamp: Stamp,
    pub(super) pose: RigidPose,
    /// Whether the order of the quaternion is unknown because the columns have no names.
    pub(super) has_unnamed_quaternion: bool,
}

/// Time stamp of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stamp {
    /// The format has no stamps.
    None,
    At(i64),
    /// The field is not a valid time.
    Unreadable,
}

/// Reason why a row is not a pose.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BadRow {
    pub(super) reason: String,
    pub(super) kind: BadKind,
    pub(super) stamp: Stamp,
}

/// Kind of an invalid row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum BadKind {
    /// A lost pose: numbers are missing, NaN or infinite, for example because the tracking of the sensor failed.
    Lost,
    /// A row or pose of another layout. If most rows are like this, the file is not a pose file.
    Odd,
    /// Text: not counted as a row.
    Words,
}

/// Collects the poses of a file.
pub(super) struct PoseRows {
    budget: Budget,
    poses: PoseWriter,
    rows: usize,
    stamped: usize,
    /// Number of poses without a readable time stamp.
    without_stamp: usize,
    last_ns: Option<i64>,
    /// Number of stamps earlier than the one before.
    back: u64,
    /// Number of the first pose, from 1, that is earlier than the one before.
    first_back: Option<u64>,
    still: u64,
    bad: BadRows,
    order: OrderEvidence,
}

/// Rows that were skipped.
#[derive(Default)]
struct BadRows {
    lost: u64,
    odd: u64,
    words: u64,
    unstamped: u64,
    first: Option<Error>,
    first_odd: Option<Error>,
    first_unstamped: Option<Error>,
}

/// Properties of the time stamps of a file.
pub(super) struct Stamps {
    pub(super) has_stamps: bool,
    /// Number of the first pose, from 1, whose stamp is earlier than the one before.
    pub(super) goes_back: Option<u64>,
    pub(super) remarks: Vec<String>,
}

/// Poses of a file, by row number and by time.
pub(super) struct PoseLists {
    /// Poses in file order, including lost ones, so that the index is the row number.
    pub(super) poses: PoseList,
    /// Sorted by strictly increasing time, without lost poses; `None` if `poses` is already so.
    pub(super) by_time: Option<PoseList>,
    /// Stamps of lost poses, sorted.
    pub(super) lost: PoseList,
}

/// Placeholder for an unreadable stamp.
const NO_STAMP: i64 = i64::MIN;

/// A pose with its row number in the file.
#[derive(Clone, Copy)]
struct Numbered {
    timed: TimedPose,
    number: u64,
}

impl Record for Numbered {
    const BYTES: usize = TimedPose::BYTES + 8;

    fn encode(&self, bytes: &mut [u8]) {
        for (to, from) in
            bytes.iter_mut().zip(self.timed.encode().into_iter().chain(self.number.to_le_bytes()))
        {
            *to = from;
        }
    }

    fn decode(bytes: &[u8]) -> Self {
        let (timed, number) = bytes.split_at_checked(TimedPose::BYTES).unwrap_or_default();
        Self {
            timed: timed.first_chunk().map(TimedPose::decode).unwrap_or_default(),
            number: number.first_chunk().copied().map_or(0, u64::from_le_bytes),
        }
    }

    fn order(&self, other: &Self) -> Ordering {
        (self.timed.stamp_ns, self.number).cmp(&(other.timed.stamp_ns, other.number))
    }
}

impl PoseRows {
    pub(super) fn new(budget: &Budget) -> Self {
        Self {
            poses: PoseWriter::new(budget, budget.bytes / 4),
            budget: budget.clone(),
            rows: 0,
            stamped: 0,
            without_stamp: 0,
            last_ns: None,
            back: 0,
            first_back: None,
            still: 0,
            bad: BadRows::default(),
            order: OrderEvidence::default(),
        }
    }

    /// Adds a row. `error` creates an error that names the row's location.
    pub(super) fn push(
        &mut self,
        row: std::result::Result<Row, BadRow>,
        error: impl Fn(String) -> Error,
    ) -> Result<()> {
        let (stamp, pose) = match row {
            Ok(Row { stamp, pose, has_unnamed_quaternion }) => {
                if has_unnamed_quaternion {
                    self.order.insert(pose.quaternion);
                }
                (stamp, pose)
            }
            Err(BadRow { reason, kind, stamp }) => {
                let BadRows { lost, odd, words, first, first_odd, .. } = &mut self.bad;
                first.get_or_insert_with(|| error(reason.clone()));
                if kind != BadKind::Lost {
                    first_odd.get_or_insert_with(|| error(reason));
                }
                match kind {
                    BadKind::Lost => *lost += 1,
                    BadKind::Odd => *odd += 1,
                    BadKind::Words => {
                        *words += 1;
                        return Ok(());
                    }
                }
                (stamp, LOST)
            }
        };
        self.rows += 1;
        if stamp == Stamp::Unreadable && !is_lost(&pose) {
            self.bad.unstamped += 1;
            self.bad.first_unstamped.get_or_insert_with(|| error("no time stamp".into()));
        }
        self.without_stamp += usize::from(stamp == Stamp::None && !is_lost(&pose));
        if let Stamp::At(stamp_ns) = stamp {
            self.note_stamp(stamp_ns);
        }
        let stamp_ns = match stamp {
            Stamp::At(stamp_ns) => stamp_ns,
            Stamp::None | Stamp::Unreadable => NO_STAMP,
        };
        self.poses.push(TimedPose { stamp_ns, pose })
    }

    fn note_stamp(&mut self, stamp_ns: i64) {
        self.stamped += 1;
        if self.last_ns.is_some_and(|last| stamp_ns < last) {
            self.back += 1;
            self.first_back.get_or_insert(self.rows as u64);
        }
        self.still += u64::from(self.last_ns == Some(stamp_ns));
        self.last_ns = Some(stamp_ns);
    }

    /// Returns the trajectory, or `None` if the file has no rows.
    ///
    /// # Errors
    ///
    /// No row is a pose or most rows are invalid (the error names the first), or `must_have_stamps` is set and no time
    /// stamp is readable.
    pub(super) fn finish(mut self, path: &Path, must_have_stamps: bool) -> Result<Option<Trajectory>> {
        let good = (self.rows as u64).saturating_sub(self.bad.lost + self.bad.odd);
        let BadRows { odd, words, first, first_odd, first_unstamped, .. } = &mut self.bad;
        let is_other = *odd + *words > good;
        let wrong = first.take_if(|_| good == 0).or_else(|| first_odd.take_if(|_| is_other));
        let has_no_stamp = must_have_stamps && self.stamped == 0;
        if let Some(wrong) = wrong.or_else(|| first_unstamped.take_if(|_| has_no_stamp)) {
            return Err(wrong);
        }
        if self.rows == 0 {
            return Ok(None);
        }
        let has_stamps = self.stamped > 0 && self.without_stamp == 0;
        let mut stamps =
            Stamps { has_stamps, goes_back: self.first_back.filter(|_| has_stamps), remarks: self.remarks() };
        let is_w_first = self.order.is_w_first();
        if is_w_first {
            stamps.remarks.push(
                "there is no header line, and the quaternions are read as qw qx qy qz, because the sensor is then \
                 upright and turns about z; to read them as in TUM files, add the line `# t tx ty tz qx qy qz qw` at \
                 the start"
                    .to_owned(),
            );
        }
        let poses = self.poses.finish()?;
        let mut lists = PoseLists { poses, by_time: None, lost: PoseList::default() };
        if has_stamps {
            let is_whole = self.stamped == self.rows && self.bad.lost + self.bad.odd == 0;
            if self.back > 0 || self.still > 0 || !is_whole {
                let sorted = sort(&lists.poses, &self.budget, |pose| !is_lost(pose))?;
                lists.lost = sort(&lists.poses, &self.budget, is_lost)?;
                let twice = self.stamped.saturating_sub(sorted.len()).saturating_sub(lists.lost.len());
                if twice > 0 && (self.back > 0 || self.still > 0) {
                    stamps.remarks.push(format!(
                        "{twice} time stamps of poses are duplicates; the last pose of each is used"
                    ));
                }
                lists.by_time = Some(sorted);
            }
        }
        Ok(Some(Trajectory::new(path, lists, stamps, is_w_first)))
    }

    fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        let BadRows { lost, odd, words, unstamped, first, first_unstamped, .. } = &self.bad;
        if let Some(first) = first {
            let rows = lost + odd + words;
            let rows =
                if rows == 1 { "1 row of poses is".to_owned() } else { format!("{rows} rows of poses are") };
            remarks.push(format!("{rows} invalid and skipped, the first: {first:#}"));
        }
        if let Some(first) = first_unstamped.as_ref().filter(|_| self.stamped > 0) {
            remarks.push(format!("{unstamped} time stamps of poses are invalid, the first: {first:#}"));
        }
        if self.back > 0 {
            let back = self.back;
            remarks.push(format!(
                "{back} time stamps of poses are earlier than the one before; the poses were sorted \
                                  by time"
            ));
        }
        remarks
    }
}

/// Placeholder for a lost pose.
const LOST: RigidPose = RigidPose { position_m: [f64::NAN; 3], quaternion: [0.0, 0.0, 0.0, 1.0] };

pub(super) fn is_lost(pose: &RigidPose) -> bool {
    pose.position_m.iter().any(|number| number.is_nan())
}

/// Returns the stamp of a pose, if it has one.
pub(super) fn stamp_of(timed: &TimedPose) -> Option<i64> {
    (timed.stamp_ns != NO_STAMP).then_some(timed.stamp_ns)
}

/// Sorts the selected poses by strictly increasing time. Of equal stamps, the last pose remains.
fn sort(poses: &PoseList, budget: &Budget, is_wanted: impl Fn(&RigidPose) -> bool) -> Result<PoseList> {
    let mut sorter = Sorter::new(budget, budget.bytes / 4);
    for number in 0..poses.len() {
        if let Some(timed) = poses.get(number)?
            && stamp_of(&timed).is_some()
            && is_wanted(&timed.pose)
        {
            sorter.push(Numbered { timed, number: number as u64 })?;
        }
    }
    let (mut sorted, mut writer) = (sorter.finish()?, PoseWriter::new(budget, budget.bytes / 4));
    let mut next = sorted.next()?;
    while let Some(Numbered { timed, .. }) = next {
        next = sorted.next()?;
        if next.is_none_or(|next| next.timed.stamp_ns != timed.stamp_ns) {
            writer.push(timed)?;
        }
    }
    writer.finish()
}
