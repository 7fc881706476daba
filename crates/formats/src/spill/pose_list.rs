use super::budget::Budget;
use super::file_part::FilePart;
use crate::poses::RigidPose;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};
use voxtile::Result;

/// Pose with its time stamp, which is 0 if there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TimedPose {
    pub(crate) stamp_ns: i64,
    pub(crate) pose: RigidPose,
}

/// List of poses, in memory or, if long, in a temporary file.
#[derive(Clone, Debug)]
pub(crate) enum PoseList {
    Memory(Vec<TimedPose>),
    File(FilePart),
}

/// Size of a pose in a file, in bytes.
const POSE_BYTES: usize = 8 + 7 * 8;

impl Default for PoseList {
    fn default() -> Self {
        Self::Memory(Vec::new())
    }
}

impl PoseList {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Memory(poses) => poses.len(),
            Self::File(part) => usize::try_from(part.len() / POSE_BYTES as u64).unwrap_or(usize::MAX),
        }
    }

    pub(crate) fn get(&self, number: usize) -> Result<Option<TimedPose>> {
        match self {
            Self::Memory(poses) => Ok(poses.get(number).copied()),
            Self::File(_) if number >= self.len() => Ok(None),
            Self::File(part) => {
                let mut bytes = [0; POSE_BYTES];
                part.read_at(number as u64 * POSE_BYTES as u64, &mut bytes)?;
                Ok(Some(TimedPose::decode(&bytes)))
            }
        }
    }

    /// Returns a range of the poses.
    #[cfg(feature = "ros")]
    pub(crate) fn part(&self, range: std::ops::Range<usize>) -> Self {
        let bytes = |poses: usize| poses as u64 * POSE_BYTES as u64;
        match self {
            Self::Memory(poses) => Self::Memory(poses.get(range).unwrap_or_default().to_vec()),
            Self::File(part) => Self::File(part.part(bytes(range.start), bytes(range.len()))),
        }
    }

    /// Returns the number of poses before a time, for a list sorted by time.
    pub(crate) fn before(&self, stamp_ns: i64) -> Result<usize> {
        if let Self::Memory(poses) = self {
            return Ok(poses.partition_point(|pose| pose.stamp_ns < stamp_ns));
        }
        let (mut low, mut high) = (0, self.len());
        while low < high {
            let middle = low.midpoint(high);
            if self.get(middle)?.is_some_and(|pose| pose.stamp_ns < stamp_ns) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        Ok(low)
    }
}

impl TimedPose {
    /// Size in a file, in bytes.
    pub(crate) const BYTES: usize = POSE_BYTES;

    pub(crate) fn encode(&self) -> [u8; POSE_BYTES] {
        let mut bytes = [0; POSE_BYTES];
        let (numbers, _) = bytes.as_chunks_mut::<8>();
        let RigidPose { position_m, quaternion } = self.pose;
        let values = position_m.into_iter().chain(quaternion).map(f64::to_le_bytes);
        for (to, from) in numbers.iter_mut().zip(std::iter::once(self.stamp_ns.to_le_bytes()).chain(values)) {
            *to = from;
        }
        bytes
    }

    pub(crate) fn decode(bytes: &[u8; POSE_BYTES]) -> Self {
        let (numbers, _) = bytes.as_chunks::<8>();
        let [stamp, values @ ..] = numbers else { return Self::default() };
        let value = |at: usize| values.get(at).copied().map_or(0.0, f64::from_le_bytes);
        let pose = RigidPose {
            position_m: std::array::from_fn(value),
            quaternion: std::array::from_fn(|k| value(3 + k)),
        };
        Self { stamp_ns: i64::from_le_bytes(*stamp), pose }
    }
}

impl Default for TimedPose {
    fn default() -> Self {
        Self { stamp_ns: 0, pose: RigidPose::IDENTITY }
    }
}

/// Writer of a list of poses.
#[derive(Debug)]
pub(crate) struct PoseWriter {
    budget: Budget,
    max_in_memory: usize,
    poses: Vec<TimedPose>,
    file: Option<BufWriter<File>>,
    filed: u64,
}

impl PoseWriter {
    /// Creates a writer. Poses beyond `memory_bytes` go to a file.
    pub(crate) fn new(budget: &Budget, memory_bytes: usize) -> Self {
        let max_in_memory = memory_bytes / size_of::<TimedPose>();
        Self { budget: budget.clone(), max_in_memory, poses: Vec::new(), file: None, filed: 0 }
    }

    pub(crate) fn push(&mut self, pose: TimedPose) -> Result<()> {
        if self.file.is_none() && self.poses.len() < self.max_in_memory {
            self.poses.push(pose);
            return Ok(());
        }
        let mut file = match self.file.take() {
            Some(file) => file,
            None => BufWriter::with_capacity(1 << 16, self.budget.file()?),
        };
        let cannot = |error| self.budget.cannot("write", error);
        for pose in self.poses.drain(..).chain([pose]) {
            file.write_all(&pose.encode()).map_err(cannot)?;
            self.filed += 1;
        }
        self.poses = Vec::new();
        self.file = Some(file);
        Ok(())
    }

    pub(crate) fn finish(self) -> Result<PoseList> {
        let Some(file) = self.file else { return Ok(PoseList::Memory(self.poses)) };
        let file = file.into_inner().map_err(|error| self.budget.cannot("write", error.into_error()))?;
        let folder = self.budget.scratch.clone().unwrap_or_else(std::env::temp_dir);
        let len = self.filed * POSE_BYTES as u64;
        Ok(PoseList::File(FilePart::new(Arc::new(Mutex::new(file)), Arc::<Path>::from(folder), 0, len)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_in_file_and_memory_are_equal() {
        let pose = |k: i64| {
            let x = k as f64 * 0.1;
            TimedPose {
                stamp_ns: 3 * k - 7,
                pose: RigidPose {
                    position_m: [x, -x, 1e300],
                    quaternion: [0.1, -0.2, f64::MIN_POSITIVE, 1.0],
                },
            }
        };
        let list = |memory_bytes: usize| {
            let mut writer = PoseWriter::new(&Budget::default(), memory_bytes);
            (0..100).for_each(|k| writer.push(pose(k)).unwrap());
            writer.finish().unwrap()
        };
        let (memory, file) = (list(1 << 20), list(640));
        assert!(matches!((&memory, &file), (PoseList::Memory(_), PoseList::File(_))));
        assert_eq!((memory.len(), file.len()), (100, 100));
        for k in [0, 1, 50, 99, 100] {
            assert_eq!(memory.get(k).unwrap(), file.get(k).unwrap());
        }
        for stamp_ns in -10..300 {
            assert_eq!(memory.before(stamp_ns).unwrap(), file.before(stamp_ns).unwrap());
        }
    }
}
