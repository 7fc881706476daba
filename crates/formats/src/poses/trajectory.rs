use super::RigidPose;
use super::direction::Direction;
use super::gap::{SAME_TIME_NS, most_gap_ns};
use super::pose_input::PoseInput;
use super::pose_rows::{PoseLists, PoseRows, Stamps, is_lost, stamp_of};
use super::quaternion_order::w_first;
use super::text::{Form, Rules};
use super::{npy, text};
use crate::read::cloud::CloudSource;
use crate::spill::{Budget, PoseList, TimedPose};
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Poses of a sensor in the world frame, in file order and sorted by time. Long lists are kept in a temporary file.
#[derive(Clone, Debug, Default)]
pub struct Trajectory {
    path: PathBuf,
    /// Poses in file order, including lost ones (rows with invalid numbers), so that the index is the row number.
    poses: PoseList,
    /// Sorted by strictly increasing time, without lost poses; `None` if `poses` is already so.
    by_time: Option<PoseList>,
    /// Time stamps of lost poses.
    lost: PoseList,
    has_stamps: bool,
    /// Whether the file has stamps, even if they are not used.
    is_stamped: bool,
    /// Number of the first pose, from 1, whose stamp is earlier than the one before.
    goes_back: Option<u64>,
    /// Transforms for poses of a camera: the pose of the lidar is `[0] * pose * [1]`.
    lidar: Option<[RigidPose; 2]>,
    /// Whether unnamed quaternion columns are read w first.
    is_w_first: bool,
    /// Form of the text, if the file is text.
    form: Form,
    remarks: Vec<String>,
}

/// Result of looking up a time in a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    /// A pose with exactly this stamp, unchanged.
    Exact(RigidPose),
    /// Interpolated between two poses: positions linearly, rotations by slerp.
    Between(RigidPose),
    /// The poses before and after are too far apart for the tolerance.
    Gap {
        /// Time between the two poses, in nanoseconds.
        gap_ns: u64,
    },
    /// The time is before the first pose.
    Before {
        /// Stamp of the first pose.
        first_ns: i64,
    },
    /// The row of this time is not a valid pose.
    Lost,
    /// The time is after the last pose.
    After {
        /// Stamp of the last pose.
        last_ns: i64,
    },
    /// The file has no stamps; poses are identified by number only.
    WithoutStamps,
}

/// Common part of the remarks on time stamps.
const OF_STAMPS: &str = "time stamps of poses";

/// Returns the last pose before a time and the first pose at or after it.
fn around(poses: &PoseList, stamp_ns: i64) -> Result<[Option<TimedPose>; 2]> {
    let after = poses.before(stamp_ns)?;
    let earlier = after.checked_sub(1).map(|before| poses.get(before)).transpose()?.flatten();
    Ok([earlier, poses.get(after)?])
}

impl Trajectory {
    /// Reads a pose file: TUM (`t x y z qx qy qz qw`), KITTI (12 numbers of a 3x4 matrix), 4x4 matrices, tables with
    /// column names (EuRoC, ROS exports), or NumPy arrays (`.npy`) of N x 8, N x 3 x 4 or N x 4 x 4.
    ///
    /// Stamps are in seconds, or in smaller units if the column name or the magnitude shows it. Positions are in metres
    /// unless the column names state another unit. Invalid rows are skipped but still counted in row numbers; a remark
    /// gives their number and names the first. `calib` is the `calib.txt` of a KITTI sequence, whose poses are the
    /// camera's: they are converted to poses of the lidar.
    ///
    /// # Errors
    ///
    /// The file cannot be read, it contains no pose, most lines are invalid (the error names the first), or a unit is
    /// unknown.
    pub fn read(path: &Path, calib: Option<&Path>) -> Result<Self> {
        Self::read_within(path, calib, &Budget::default())
    }

    /// As [`Trajectory::read`], within a memory budget. Each pose takes 64 bytes, in memory or in a temporary file.
    ///
    /// # Errors
    ///
    /// As for [`Trajectory::read`]. Also fails if a temporary file cannot be written.
    pub fn read_within(path: &Path, calib: Option<&Path>, budget: &Budget) -> Result<Self> {
        Self::read_by(Rules::Strict, path, calib, budget)
    }

    /// As [`Trajectory::read_within`], with the given rules.
    pub(crate) fn read_by(rules: Rules, path: &Path, calib: Option<&Path>, budget: &Budget) -> Result<Self> {
        let mut rows = PoseRows::new(budget);
        let input = PoseInput::open(path)?;
        let mut form = Form::default();
        if npy::is_npy(path, input.head()) {
            form.is_matrix = npy::read(path, input, &mut rows)?
        } else {
            form = text::read(path, input, rules, &mut rows)?;
        }
        // Older versions matched the poses of PCD files by number, whatever the time column contained.
        let must_have_stamps = rules == Rules::Strict || !form.is_plain;
        let Some(mut trajectory) = rows.finish(path, must_have_stamps)? else {
            return Err(Error::argument(path.display().to_string(), "contains no pose"));
        };
        trajectory.form = form;
        if let Some([x, y, z]) = form.unit {
            let units = if x == y && y == z { x.to_owned() } else { format!("{x}, {y} and {z}") };
            trajectory.remarks.push(format!("positions are in {units}, as stated in their column names"));
        }
        if let Some(calib) = calib {
            let camera_from_lidar = super::calib::read(calib)?;
            trajectory.lidar = Some([camera_from_lidar.inverse(), camera_from_lidar]);
        }
        Ok(trajectory)
    }

    pub(super) fn new(path: &Path, lists: PoseLists, stamps: Stamps, is_w_first: bool) -> Self {
        let Stamps { has_stamps, goes_back, remarks } = stamps;
        let PoseLists { poses, by_time, lost } = lists;
        Self {
            path: path.to_owned(),
            poses,
            by_time,
            lost,
            has_stamps,
            is_stamped: has_stamps,
            goes_back,
            lidar: None,
            is_w_first,
            form: Form::default(),
            remarks,
        }
    }

    /// Returns the pose at a time. Between two poses it is interpolated if they are at most twice the tolerance apart
    /// (see [`most_gap_ns`]). Poses are never extrapolated: in larger gaps, before the first and after the last pose,
    /// only a pose within one millisecond is used, which covers rounding of stamps.
    ///
    /// # Errors
    ///
    /// A temporary file cannot be read.
    pub fn at(&self, stamp_ns: i64, tolerance_ns: i64) -> Result<Found> {
        let Some(poses) = self.stamped() else { return Ok(Found::WithoutStamps) };
        let [earlier, later] = around(poses, stamp_ns)?;
        let apart_ns = |timed: &TimedPose| timed.stamp_ns.abs_diff(stamp_ns);
        let nearest = [earlier, later].into_iter().flatten().min_by_key(apart_ns);
        let near = nearest.filter(|timed| apart_ns(timed) <= SAME_TIME_NS);
        if near.is_none_or(|near| apart_ns(&near) > 0)
            && self.is_lost_at(stamp_ns, near.map(|near| apart_ns(&near)))?
        {
            return Ok(Found::Lost);
        }
        let end = |beyond: Found| near.map_or(beyond, |near| Found::Exact(self.of_lidar(near.pose)));
        Ok(match (earlier, later) {
            (_, Some(same)) if same.stamp_ns == stamp_ns => Found::Exact(self.of_lidar(same.pose)),
            (Some(before), Some(after)) => {
                let gap_ns = before.stamp_ns.abs_diff(after.stamp_ns);
                if gap_ns > most_gap_ns(tolerance_ns).unsigned_abs() {
                    return Ok(end(Found::Gap { gap_ns }));
                }
                let share = before.stamp_ns.abs_diff(stamp_ns) as f64 / gap_ns as f64;
                let [before, after] = [before, after].map(|timed| self.of_lidar(timed.pose));
                Found::Between(before.towards(&after, share))
            }
            (None, Some(first)) => end(Found::Before { first_ns: first.stamp_ns }),
            (Some(last), None) => end(Found::After { last_ns: last.stamp_ns }),
            (None, None) => Found::WithoutStamps,
        })
    }

    /// Returns whether a lost pose is close to a time, and closer than the nearest valid pose.
    fn is_lost_at(&self, stamp_ns: i64, pose_apart_ns: Option<u64>) -> Result<bool> {
        let lost = around(&self.lost, stamp_ns)?.into_iter().flatten();
        let apart_ns = lost.map(|timed| timed.stamp_ns.abs_diff(stamp_ns)).min();
        Ok(apart_ns
            .is_some_and(|apart| apart <= SAME_TIME_NS && pose_apart_ns.is_none_or(|pose| apart < pose)))
    }

    /// Returns the poses sorted by time, if they have stamps.
    fn stamped(&self) -> Option<&PoseList> {
        self.has_stamps.then(|| self.by_time.as_ref().unwrap_or(&self.poses))
    }

    /// Converts a pose as stored to the pose of the lidar.
    fn of_lidar(&self, mut pose: RigidPose) -> RigidPose {
        if self.is_w_first {
            pose.quaternion = w_first(pose.quaternion);
        }
        self.lidar.map_or(pose, |[before, after]| before.then(&pose).then(&after))
    }

    /// Returns the pose of a row in file order, from 0. `None` if there is no such row or its pose was lost.
    ///
    /// # Errors
    ///
    /// A temporary file cannot be read.
    pub fn by_number(&self, number: usize) -> Result<Option<RigidPose>> {
        let timed = self.poses.get(number)?.filter(|timed| !is_lost(&timed.pose));
        Ok(timed.map(|timed| self.of_lidar(timed.pose)))
    }

    /// Returns whether the pose of a row was lost.
    fn is_lost(&self, number: usize) -> Result<bool> {
        Ok(self.poses.get(number)?.is_some_and(|timed| is_lost(&timed.pose)))
    }

    /// Returns the direction of travel of a sensor on the body, from the first poses.
    pub(super) fn direction(&self, body_from_sensor: &RigidPose) -> Result<Direction> {
        let mut direction = Direction::default();
        for number in 0..self.len().min(Direction::MAX_POSES) {
            if let Some(pose) = self.by_number(number)? {
                direction.insert(&pose.then(body_from_sensor));
            }
        }
        Ok(direction)
    }

    /// Returns whether the poses are matrices, as in KITTI files.
    pub(super) fn are_matrices(&self) -> bool {
        self.form.is_matrix
    }

    pub(super) fn remark(&mut self, remark: String) {
        self.remarks.push(remark);
    }

    /// Returns the time stamp of a row in file order, from 0.
    pub(crate) fn stamp_of(&self, number: usize) -> Result<Option<i64>> {
        let timed = if self.has_stamps { self.poses.get(number)? } else { None };
        Ok(timed.as_ref().and_then(stamp_of))
    }

    /// Drops the stamps, so that poses are matched by number.
    pub(crate) fn forget_stamps(&mut self) {
        (self.has_stamps, self.by_time, self.lost, self.goes_back) = Default::default();
        self.remarks.retain(|remark| !remark.contains(OF_STAMPS));
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the form of the text, if the file is text.
    pub(crate) fn form(&self) -> Form {
        self.form
    }

    /// Returns the pose of a cloud by its number, from 0, for clouds without stamps. `None` if its pose was lost.
    ///
    /// # Errors
    ///
    /// The numbers of poses and clouds differ, so they cannot be matched; a temporary file cannot be read.
    pub fn of_cloud(&self, number: u64, source: &dyn CloudSource) -> Result<Option<RigidPose>> {
        self.check_clouds(source)?;
        self.check_order()?;
        let number = usize::try_from(number).unwrap_or(usize::MAX);
        let pose = self.by_number(number)?;
        if pose.is_none() && !self.is_lost(number)? {
            return Err(self.other_number(&format!("at least {} clouds", number.saturating_add(1))));
        }
        Ok(pose)
    }

    /// Checks that there are as many poses as clouds, if the number of clouds is known in advance.
    ///
    /// # Errors
    ///
    /// The numbers differ.
    pub fn check_clouds(&self, source: &dyn CloudSource) -> Result<()> {
        let Some(clouds) = source.len_hint().filter(|clouds| *clouds != self.len() as u64) else {
            return Ok(());
        };
        // Name the first and the last cloud, because a file that is not a cloud is often one of them.
        let named = source.ends().map(|[first, last]| format!(" ({first} to {last})")).unwrap_or_default();
        Err(self.other_number(&format!("{clouds} clouds{named}")))
    }

    /// Checks that the poses can be matched by number, for clouds without time stamps. If the stamps do not ascend, the
    /// lines are in another order than the clouds.
    ///
    /// # Errors
    ///
    /// A time stamp is earlier than the one before.
    pub fn check_order(&self) -> Result<()> {
        let Some(number) = self.goes_back else { return Ok(()) };
        let reason = format!(
            "its time stamps are not in order (pose {number} is earlier than the one before). The clouds have no time \
             stamps, so poses are assigned line by line: sort the lines in the order of the clouds, or set all stamps \
             to 0"
        );
        Err(Error::argument(self.path.display().to_string(), reason))
    }

    /// Returns whether a time stamp is earlier than the one before.
    pub fn goes_back(&self) -> bool {
        self.goes_back.is_some()
    }

    fn other_number(&self, clouds: &str) -> Error {
        // The poses have stamps, but the names of the clouds contain none.
        let names = if self.is_stamped {
            "; the file names of the clouds contain no times such as 1700000000.123456789, 1700000000_123456789 or \
             1700000000123456789"
        } else {
            ""
        };
        let reason = format!(
            "{} poses for {clouds}, and not both have time stamps: there must be one pose per cloud, in the same order \
             (files of a folder in natural order, scan2 before scan10){names}",
            self.len()
        );
        Error::argument(self.path.display().to_string(), reason)
    }

    /// Returns the number of poses in the file.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// Returns whether there are no poses.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the first and last time stamp, if poses have stamps.
    ///
    /// # Errors
    ///
    /// A temporary file cannot be read.
    pub fn span_ns(&self) -> Result<Option<[i64; 2]>> {
        let Some(poses) = self.stamped() else { return Ok(None) };
        let (first, last) = (poses.get(0)?, poses.get(poses.len().saturating_sub(1))?);
        Ok(first.zip(last).map(|(first, last)| [first.stamp_ns, last.stamp_ns]))
    }

    /// Returns whether poses have stamps. Otherwise they are identified by number only.
    pub fn has_stamps(&self) -> bool {
        self.has_stamps
    }

    /// Returns the distinct stamps in increasing order.
    pub fn stamps_ns(&self) -> impl Iterator<Item = Result<i64>> + '_ {
        let poses = self.stamped();
        let count = poses.map_or(0, PoseList::len);
        let stamps = poses.map(move |poses| (0..count).map(|number| poses.get(number)));
        stamps.into_iter().flatten().filter_map(|timed| timed.map(|timed| Some(timed?.stamp_ns)).transpose())
    }

    /// Returns remarks for the user about the file.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }
}
