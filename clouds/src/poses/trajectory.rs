use super::gap::most_gap_ns;
use super::{npy, text};
use crate::cloud::CloudSource;
use crate::error::{Error, Result};
use crate::pose::RigidPose;
use std::path::{Path, PathBuf};

/// Poses of a sensor, sensor to world, in the order of their file and by time.
#[derive(Clone, Debug, Default)]
pub struct Trajectory {
    path: PathBuf,
    /// In the order of the file.
    poses: Vec<RigidPose>,
    /// Strictly increasing stamps, each with the number of its pose; empty where the file has none.
    stamps: Vec<(i64, usize)>,
    /// How far a stamp may be from the time that it was rounded from.
    rounding_ns: u64,
    remarks: Vec<String>,
}

/// What a trajectory knows of a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    /// A pose with this very stamp, as it was written.
    Exact(RigidPose),
    /// Between two poses: positions along a line, rotations at constant speed.
    Between(RigidPose),
    /// The poses before and after are too far apart for the tolerance.
    Gap {
        /// Nanoseconds from one to the other.
        gap_ns: u64,
    },
    /// Before the first pose.
    Before {
        /// Its stamp.
        first_ns: i64,
    },
    /// After the last pose.
    After {
        /// Its stamp.
        last_ns: i64,
    },
    /// The file has no stamps: its poses are known by number only.
    WithoutStamps,
}

/// A line or a row of a file of poses.
pub(super) struct Row {
    pub(super) stamp_ns: Option<i64>,
    pub(super) pose: RigidPose,
}

impl Trajectory {
    /// Reads a file of poses: TUM (`t x y z qx qy qz qw`), KITTI (12 numbers of a 3x4 matrix), matrices of 4x4, tables
    /// with names of columns (EuRoC, exports of ROS), arrays of NumPy (`.npy`) of N x 8, N x 3 x 4 or N x 4 x 4.
    ///
    /// Stamps are seconds; of nanoseconds, if their column says so or they would lie thousands of years ahead.
    /// `calib` is the `calib.txt` of a KITTI sequence, whose poses are of the camera: they become those of the lidar.
    ///
    /// # Errors
    ///
    /// It cannot be read; a line that is no pose, with its number; no pose at all.
    pub fn read(path: &Path, calib: Option<&Path>) -> Result<Self> {
        let rows = if npy::is_npy(path)? { npy::read(path)? } else { text::read(path)? };
        if rows.is_empty() {
            return Err(Error::argument(path.display().to_string(), "holds no pose"));
        }
        let mut trajectory = Self::of_rows(path, rows);
        if let Some(calib) = calib {
            let camera_from_lidar = super::calib::read(calib)?;
            let lidar_from_camera = camera_from_lidar.inverse();
            for pose in &mut trajectory.poses {
                *pose = lidar_from_camera.then(pose).then(&camera_from_lidar);
            }
        }
        Ok(trajectory)
    }

    fn of_rows(path: &Path, rows: Vec<Row>) -> Self {
        let mut remarks = Vec::new();
        let are_stamped = rows.iter().all(|row| row.stamp_ns.is_some());
        let mut stamps: Vec<(i64, usize)> =
            rows.iter().enumerate().filter_map(|(number, row)| Some((row.stamp_ns?, number))).collect();
        let back = stamps.windows(2).filter(|pair| matches!(pair, [a, b] if b.0 < a.0)).count();
        if back > 0 {
            remarks.push(format!("{back} time stamps of poses go back; the poses were sorted by time"));
            stamps.sort_unstable();
        }
        let all = stamps.len();
        // Of equal stamps the last stays.
        stamps.reverse();
        stamps.dedup_by_key(|(stamp_ns, _)| *stamp_ns);
        stamps.reverse();
        if stamps.len() < all {
            let twice = all - stamps.len();
            remarks.push(format!("{twice} time stamps of poses occur again; the last pose of each is taken"));
        }
        if !are_stamped {
            stamps.clear();
        }
        let poses = rows.into_iter().map(|row| row.pose).collect();
        let rounding_ns = rounding_of(&stamps);
        Self { path: path.to_owned(), poses, stamps, rounding_ns, remarks }
    }

    /// The pose at a time. Between two poses there is one if they are at most twice the tolerance apart, see
    /// [`most_gap_ns`]; none is ever extrapolated.
    /// A time that is before the first stamp or after the last one only because that was rounded has the pose there.
    pub fn at(&self, stamp_ns: i64, tolerance_ns: i64) -> Found {
        let after = self.stamps.partition_point(|&(stamp, _)| stamp < stamp_ns);
        let later = self.stamps.get(after).copied();
        let earlier = after.checked_sub(1).and_then(|before| self.stamps.get(before)).copied();
        let pose = |number: usize| self.poses.get(number).copied().unwrap_or(RigidPose::IDENTITY);
        match (earlier, later) {
            (_, Some((stamp, number))) if stamp == stamp_ns => Found::Exact(pose(number)),
            (Some((before_ns, before)), Some((after_ns, after))) => {
                let gap_ns = before_ns.abs_diff(after_ns);
                if gap_ns > most_gap_ns(tolerance_ns).unsigned_abs() {
                    return Found::Gap { gap_ns };
                }
                let share = before_ns.abs_diff(stamp_ns) as f64 / gap_ns as f64;
                Found::Between(pose(before).towards(&pose(after), share))
            }
            (None, Some((end_ns, number))) | (Some((end_ns, number)), None)
                if end_ns.abs_diff(stamp_ns) <= self.rounding_ns =>
            {
                Found::Exact(pose(number))
            }
            (None, Some((first_ns, _))) => Found::Before { first_ns },
            (Some((last_ns, _)), None) => Found::After { last_ns },
            (None, None) => Found::WithoutStamps,
        }
    }

    /// The pose of a number, from 0, in the order of the file.
    pub fn by_number(&self, number: usize) -> Option<RigidPose> {
        self.poses.get(number).copied()
    }

    /// The pose of a cloud by its number, from 0, where stamps do not tell it.
    ///
    /// # Errors
    ///
    /// Not as many poses as clouds: which belong together is not known then.
    pub fn of_cloud(&self, number: u64, source: &dyn CloudSource) -> Result<RigidPose> {
        self.check_clouds(source)?;
        let pose = usize::try_from(number).ok().and_then(|number| self.by_number(number));
        pose.ok_or_else(|| self.other_number(&format!("at least {} clouds", number.saturating_add(1))))
    }

    /// Checks that there are as many poses as clouds, if that number is known before they are read.
    ///
    /// # Errors
    ///
    /// There are not.
    pub fn check_clouds(&self, source: &dyn CloudSource) -> Result<()> {
        let Some(clouds) = source.len_hint().filter(|clouds| *clouds != self.len() as u64) else {
            return Ok(());
        };
        // A file that is no cloud is often at an end of the list.
        let named = source.ends().map(|[first, last]| format!(" ({first} to {last})")).unwrap_or_default();
        Err(self.other_number(&format!("{clouds} clouds{named}")))
    }

    fn other_number(&self, clouds: &str) -> Error {
        let reason = format!(
            "{} poses for {clouds}, which have no time stamps in common: there must be one pose a cloud, in \
             their order (files in the natural order of their names, scan2 before scan10)",
            self.len()
        );
        Error::argument(self.path.display().to_string(), reason)
    }

    /// Number of poses in the file.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// Whether there is no pose.
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// First and last time stamp, if poses have stamps.
    pub fn span_ns(&self) -> Option<[i64; 2]> {
        Some([self.stamps.first()?.0, self.stamps.last()?.0])
    }

    /// The different stamps, in order.
    pub fn stamps_ns(&self) -> impl Iterator<Item = i64> + '_ {
        self.stamps.iter().map(|&(stamp_ns, _)| stamp_ns)
    }

    /// What a person should know of the file.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }
}

/// Half of the digit that all stamps end with: programs write them with a few decimals. At most half a millisecond,
/// for stamps of whole seconds need not be rounded.
fn rounding_of(stamps: &[(i64, usize)]) -> u64 {
    const MOST_NS: i64 = 1_000_000;
    let mut digit_ns = 1;
    while digit_ns < MOST_NS && stamps.iter().all(|(stamp_ns, _)| stamp_ns % (10 * digit_ns) == 0) {
        digit_ns *= 10;
    }
    if stamps.is_empty() { 0 } else { digit_ns.unsigned_abs() / 2 }
}
