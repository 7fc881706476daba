use super::RigidPose;
use super::trajectory::Trajectory;
use crate::spill::{Budget, PoseList, PoseWriter, Record, Sorter, TimedPose};
use std::cmp::Ordering;
use std::path::Path;
use voxtile::Result;

/// A line or a row of a file of poses.
pub(super) struct Row {
    pub(super) stamp_ns: Option<i64>,
    pub(super) pose: RigidPose,
}

/// Takes the poses of a file one after the other.
pub(super) struct PoseRows {
    budget: Budget,
    poses: PoseWriter,
    rows: usize,
    are_stamped: bool,
    last_ns: Option<i64>,
    /// How often the time goes back, and how often it stands still.
    back: u64,
    /// Number of the first pose that is earlier than the one before, from 1.
    first_back: Option<u64>,
    still: u64,
    digit_ns: i64,
}

/// What the stamps of a file are like.
#[derive(Default)]
pub(super) struct Stamps {
    pub(super) has_stamps: bool,
    /// Number of the first pose whose stamp is earlier than the one before, from 1.
    pub(super) goes_back: Option<u64>,
    pub(super) rounding_ns: u64,
    pub(super) remarks: Vec<String>,
}

/// Stamps of whole seconds need not be rounded: they are a millisecond's at most.
const MAX_DIGIT_NS: i64 = 1_000_000;

/// A pose by its time and its number in the file.
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
            are_stamped: true,
            last_ns: None,
            back: 0,
            first_back: None,
            still: 0,
            digit_ns: MAX_DIGIT_NS,
        }
    }

    pub(super) fn push(&mut self, row: Row) -> Result<()> {
        let Row { stamp_ns, pose } = row;
        self.rows += 1;
        self.are_stamped &= stamp_ns.is_some();
        if let Some(stamp_ns) = stamp_ns {
            if self.last_ns.is_some_and(|last| stamp_ns < last) {
                self.back += 1;
                self.first_back.get_or_insert(self.rows as u64);
            }
            self.still += u64::from(self.last_ns == Some(stamp_ns));
            self.last_ns = Some(stamp_ns);
            while stamp_ns % self.digit_ns != 0 {
                self.digit_ns /= 10;
            }
        }
        self.poses.push(TimedPose { stamp_ns: stamp_ns.unwrap_or_default(), pose })
    }

    /// The trajectory of these poses; `None` if there are none.
    pub(super) fn finish(self, path: &Path) -> Result<Option<Trajectory>> {
        let poses = self.poses.finish()?;
        if self.rows == 0 {
            return Ok(None);
        }
        let goes_back = self.first_back.filter(|_| self.are_stamped);
        let mut stamps = Stamps { has_stamps: self.are_stamped, goes_back, ..Stamps::default() };
        if self.back > 0 {
            let back = self.back;
            stamps
                .remarks
                .push(format!("{back} time stamps of poses go back; the poses were sorted by time"));
        }
        let mut by_time = None;
        if self.are_stamped {
            // Half of the digit that all stamps end with: programs write them with a few decimals.
            stamps.rounding_ns = self.digit_ns.unsigned_abs() / 2;
            if self.back > 0 || self.still > 0 {
                let sorted = sort(&poses, &self.budget)?;
                let twice = self.rows.saturating_sub(sorted.len());
                if twice > 0 {
                    stamps.remarks.push(format!(
                        "{twice} time stamps of poses occur again; the last pose of each is taken"
                    ));
                }
                by_time = Some(sorted);
            }
        }
        Ok(Some(Trajectory::new(path, poses, by_time, stamps)))
    }
}

/// The poses in strict order of time: of equal stamps the last stays.
fn sort(poses: &PoseList, budget: &Budget) -> Result<PoseList> {
    let mut sorter = Sorter::new(budget, budget.bytes / 4);
    for number in 0..poses.len() {
        if let Some(timed) = poses.get(number)? {
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
