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

/// Poses of a sensor, sensor to world, in the order of their file and by time. Many are in a temporary file.
#[derive(Clone, Debug, Default)]
pub struct Trajectory {
    path: PathBuf,
    /// In the order of the file. A pose that was lost has its place.
    poses: PoseList,
    /// In strict order of time and without lost ones, where that is another list.
    by_time: Option<PoseList>,
    /// Time stamps of lost poses.
    lost: PoseList,
    has_stamps: bool,
    /// Whether the file has them, taken or not.
    is_stamped: bool,
    /// Number of the first pose whose stamp is earlier than the one before, from 1.
    goes_back: Option<u64>,
    /// Poses are of a camera; those of the lidar are `[0] * pose * [1]`.
    lidar: Option<[RigidPose; 2]>,
    /// Quaternions are written w first, which no name of a column says.
    is_w_first: bool,
    /// How the text is written, if it is one.
    form: Form,
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
    /// The pose of this time was lost: its row is no pose.
    Lost,
    /// After the last pose.
    After {
        /// Its stamp.
        last_ns: i64,
    },
    /// The file has no stamps: its poses are known by number only.
    WithoutStamps,
}

/// What remarks on time stamps have in common.
const OF_STAMPS: &str = "time stamps of poses";

/// The last pose before a time and the first at it or after it.
fn around(poses: &PoseList, stamp_ns: i64) -> Result<[Option<TimedPose>; 2]> {
    let after = poses.before(stamp_ns)?;
    let earlier = after.checked_sub(1).map(|before| poses.get(before)).transpose()?.flatten();
    Ok([earlier, poses.get(after)?])
}

impl Trajectory {
    /// Reads a file of poses: TUM (`t x y z qx qy qz qw`), KITTI (12 numbers of a 3x4 matrix), matrices of 4x4, tables
    /// with names of columns (EuRoC, exports of ROS), arrays of NumPy (`.npy`) of N x 8, N x 3 x 4 or N x 4 x 4.
    ///
    /// Stamps are seconds; of nanoseconds, if their column says so or they would lie thousands of years ahead.
    /// Positions are metres, if the names of their columns name no other unit. Rows that are no poses are left out and
    /// keep their numbers; a remark counts them and names the first.
    /// `calib` is the `calib.txt` of a KITTI sequence, whose poses are of the camera: they become those of the lidar.
    ///
    /// # Errors
    ///
    /// It cannot be read; no pose at all, or most lines are something else: the first with its number; a unit that is
    /// not known.
    pub fn read(path: &Path, calib: Option<&Path>) -> Result<Self> {
        Self::read_within(path, calib, &Budget::default())
    }

    /// As [`Trajectory::read`], in so much memory. Each pose takes 64 bytes, of memory or of a temporary file.
    ///
    /// # Errors
    ///
    /// As for [`Trajectory::read`]; a temporary file that cannot be written.
    pub fn read_within(path: &Path, calib: Option<&Path>, budget: &Budget) -> Result<Self> {
        Self::read_by(Rules::Strict, path, calib, budget)
    }

    /// As [`Trajectory::read_within`], by these rules.
    pub(crate) fn read_by(rules: Rules, path: &Path, calib: Option<&Path>, budget: &Budget) -> Result<Self> {
        let mut rows = PoseRows::new(budget);
        let input = PoseInput::open(path)?;
        let mut form = Form::default();
        if npy::is_npy(path, input.head()) {
            form.is_matrix = npy::read(path, input, &mut rows)?
        } else {
            form = text::read(path, input, rules, &mut rows)?;
        }
        // Earlier versions took the poses of PCD files by number, whatever stood where their time should.
        let must_have_stamps = rules == Rules::Strict || !form.is_plain;
        let Some(mut trajectory) = rows.finish(path, must_have_stamps)? else {
            return Err(Error::argument(path.display().to_string(), "holds no pose"));
        };
        trajectory.form = form;
        if let Some([x, y, z]) = form.unit {
            let units = if x == y && y == z { x.to_owned() } else { format!("{x}, {y} and {z}") };
            trajectory.remarks.push(format!("positions are in {units} by the names of their columns"));
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

    /// The pose at a time. Between two poses there is one if they are at most twice the tolerance apart, see
    /// [`most_gap_ns`]; none is ever extrapolated. Poses that are further apart, the first and the last are taken up to
    /// a millisecond away, by which programs round.
    ///
    /// # Errors
    ///
    /// A temporary file that cannot be read.
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

    /// Whether a lost pose is at a time, and nearer to it than the pose that is so far away.
    fn is_lost_at(&self, stamp_ns: i64, pose_apart_ns: Option<u64>) -> Result<bool> {
        let lost = around(&self.lost, stamp_ns)?.into_iter().flatten();
        let apart_ns = lost.map(|timed| timed.stamp_ns.abs_diff(stamp_ns)).min();
        Ok(apart_ns
            .is_some_and(|apart| apart <= SAME_TIME_NS && pose_apart_ns.is_none_or(|pose| apart < pose)))
    }

    /// The poses in strict order of time, if they have stamps.
    fn stamped(&self) -> Option<&PoseList> {
        self.has_stamps.then(|| self.by_time.as_ref().unwrap_or(&self.poses))
    }

    /// The pose of the lidar, of one as it was written.
    fn of_lidar(&self, mut pose: RigidPose) -> RigidPose {
        if self.is_w_first {
            pose.quaternion = w_first(pose.quaternion);
        }
        self.lidar.map_or(pose, |[before, after]| before.then(&pose).then(&after))
    }

    /// The pose of a number, from 0, in the order of the file. `None` also of one that was lost.
    ///
    /// # Errors
    ///
    /// A temporary file that cannot be read.
    pub fn by_number(&self, number: usize) -> Result<Option<RigidPose>> {
        let timed = self.poses.get(number)?.filter(|timed| !is_lost(&timed.pose));
        Ok(timed.map(|timed| self.of_lidar(timed.pose)))
    }

    /// Whether the pose of a number was lost: its row is no pose.
    fn is_lost(&self, number: usize) -> Result<bool> {
        Ok(self.poses.get(number)?.is_some_and(|timed| is_lost(&timed.pose)))
    }

    /// Which way a sensor on the body goes, as far as the first thousands of poses tell.
    pub(super) fn direction(&self, body_from_sensor: &RigidPose) -> Result<Direction> {
        let mut direction = Direction::default();
        for number in 0..self.len().min(Direction::MAX_POSES) {
            if let Some(pose) = self.by_number(number)? {
                direction.insert(&pose.then(body_from_sensor));
            }
        }
        Ok(direction)
    }

    /// Whether its poses are matrices, as those of KITTI are.
    pub(super) fn are_matrices(&self) -> bool {
        self.form.is_matrix
    }

    /// Adds a remark.
    pub(super) fn remark(&mut self, remark: String) {
        self.remarks.push(remark);
    }

    /// The time stamp of a pose by its number, from 0, in the order of the file.
    pub(crate) fn stamp_of(&self, number: usize) -> Result<Option<i64>> {
        let timed = if self.has_stamps { self.poses.get(number)? } else { None };
        Ok(timed.as_ref().and_then(stamp_of))
    }

    /// Leaves the poses their numbers alone.
    pub(crate) fn forget_stamps(&mut self) {
        (self.has_stamps, self.by_time, self.lost, self.goes_back) = Default::default();
        self.remarks.retain(|remark| !remark.contains(OF_STAMPS));
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// How the file is written, if it is a text.
    pub(crate) fn form(&self) -> Form {
        self.form
    }

    /// The pose of a cloud by its number, from 0, where stamps do not tell it.
    ///
    /// # Errors
    ///
    /// Not as many poses as clouds: which belong together is not known then; a temporary file that cannot be read.
    /// `None` if its pose was lost.
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

    /// Checks that the poses may be taken line by line, for clouds that have no time stamps: stamps that go back tell
    /// that the lines are in another order than the clouds.
    ///
    /// # Errors
    ///
    /// A time stamp is earlier than the one before.
    pub fn check_order(&self) -> Result<()> {
        let Some(number) = self.goes_back else { return Ok(()) };
        let reason = format!(
            "its time stamps go back (pose {number} is earlier than the one before), but there are no time stamps of \
             clouds to compare with, and line by line these are the poses of the clouds in their order: put the lines \
             in that order (stamps that mean nothing may all be 0)"
        );
        Err(Error::argument(self.path.display().to_string(), reason))
    }

    /// Whether a time stamp is earlier than the one before.
    pub fn goes_back(&self) -> bool {
        self.goes_back.is_some()
    }

    fn other_number(&self, clouds: &str) -> Error {
        // The poses have times, and what the clouds are called tells none.
        let names = if self.is_stamped {
            "; the names of the clouds tell no times (1700000000.123456789, 1700000000_123456789 and \
             1700000000123456789 would)"
        } else {
            ""
        };
        let reason = format!(
            "{} poses for {clouds}, which have no time stamps in common: there must be one pose a cloud, in \
             their order (files in the natural order of their names, scan2 before scan10){names}",
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
        self.len() == 0
    }

    /// First and last time stamp, if poses have stamps.
    ///
    /// # Errors
    ///
    /// A temporary file that cannot be read.
    pub fn span_ns(&self) -> Result<Option<[i64; 2]>> {
        let Some(poses) = self.stamped() else { return Ok(None) };
        let (first, last) = (poses.get(0)?, poses.get(poses.len().saturating_sub(1))?);
        Ok(first.zip(last).map(|(first, last)| [first.stamp_ns, last.stamp_ns]))
    }

    /// Whether poses have stamps; they are known by number only otherwise.
    pub fn has_stamps(&self) -> bool {
        self.has_stamps
    }

    /// The different stamps, in order.
    pub fn stamps_ns(&self) -> impl Iterator<Item = Result<i64>> + '_ {
        let poses = self.stamped();
        let count = poses.map_or(0, PoseList::len);
        let stamps = poses.map(move |poses| (0..count).map(|number| poses.get(number)));
        stamps.into_iter().flatten().filter_map(|timed| timed.map(|timed| Some(timed?.stamp_ns)).transpose())
    }

    /// What a person should know of the file.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }
}
