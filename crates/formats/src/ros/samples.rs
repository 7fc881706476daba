use crate::poses::RigidPose;
use crate::spill::{PoseList, TimedPose};
use std::collections::BTreeMap;
use voxtile::Result;

/// Poses of a frame in its parent, by stamp: in memory or, for a long recording, in a temporary file.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    memory: BTreeMap<i64, RigidPose>,
    /// Samples in a file, sorted by strictly increasing time. Each sample is either here or in `memory`.
    filed: PoseList,
    /// First and last stamp of the samples that are being sorted.
    waiting: Option<(i64, i64)>,
    /// Number of this list among the samples that are being sorted.
    pub(super) number: Option<u32>,
}

/// Samples at or before a time, and at or after it.
pub(super) type Around = (Option<TimedPose>, Option<TimedPose>);

impl Samples {
    /// Adds a sample. It replaces one with the same stamp.
    pub(super) fn insert(&mut self, stamp_ns: i64, pose: RigidPose) {
        self.memory.insert(stamp_ns, pose);
    }

    /// Returns the number of samples that are in order; `waiting` is not counted.
    pub(super) fn len(&self) -> usize {
        self.memory.len() + self.filed.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0 && self.waiting.is_none()
    }

    /// Returns whether there are samples with more than one stamp.
    pub(super) fn has_several(&self) -> bool {
        let all = joined(ends(&self.memory), self.waiting);
        self.filed.len() > 1 || all.is_some_and(|(first_ns, last_ns)| first_ns < last_ns)
    }

    pub(super) fn around(&self, stamp_ns: i64) -> Result<Around> {
        if self.filed.len() == 0 {
            let timed = |(&stamp_ns, &pose): (&i64, &RigidPose)| TimedPose { stamp_ns, pose };
            let before = self.memory.range(..=stamp_ns).next_back().map(timed);
            return Ok((before, self.memory.range(stamp_ns..).next().map(timed)));
        }
        let at = self.filed.before(stamp_ns)?;
        let after = self.filed.get(at)?;
        let before = match after {
            Some(after) if after.stamp_ns == stamp_ns => Some(after),
            _ => at.checked_sub(1).map(|before| self.filed.get(before)).transpose()?.flatten(),
        };
        Ok((before, after))
    }

    /// Drops samples in memory that are more than `span_ns` older than the last one.
    pub(super) fn forget_older_than(&mut self, span_ns: i64) {
        if let Some((&last_ns, _)) = self.memory.last_key_value() {
            self.memory = self.memory.split_off(&last_ns.saturating_sub(span_ns));
        }
    }

    /// Drops the older half of the samples in memory, rounded up.
    pub(super) fn forget_older_half(&mut self) {
        let middle = self.memory.len().div_ceil(2);
        self.memory = match self.memory.keys().nth(middle) {
            Some(&middle_ns) => self.memory.split_off(&middle_ns),
            None => BTreeMap::new(),
        };
    }

    /// Removes the samples from memory, for sorting.
    pub(super) fn drain(&mut self) -> impl ExactSizeIterator<Item = TimedPose> + use<> {
        let samples = std::mem::take(&mut self.memory);
        self.waiting = joined(self.waiting, ends(&samples));
        samples.into_iter().map(|(stamp_ns, pose)| TimedPose { stamp_ns, pose })
    }

    /// Sets the samples that were sorted into a file.
    pub(super) fn file(&mut self, sorted: PoseList) {
        (self.filed, self.waiting) = (sorted, None);
    }
}

/// Returns the first and the last stamp.
fn ends(samples: &BTreeMap<i64, RigidPose>) -> Option<(i64, i64)> {
    Some((*samples.first_key_value()?.0, *samples.last_key_value()?.0))
}

/// Returns the range that covers both ranges.
fn joined(one: Option<(i64, i64)>, other: Option<(i64, i64)>) -> Option<(i64, i64)> {
    let Some(((first_ns, last_ns), other)) = one.zip(other) else { return one.or(other) };
    Some((first_ns.min(other.0), last_ns.max(other.1)))
}
