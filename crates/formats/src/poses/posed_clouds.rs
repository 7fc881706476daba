use super::pose_source::PoseSource;
use super::{Found, SweepPeriods, Trajectory};
use crate::scans::Fingerprint;
use crate::scans::PointStore;
use crate::scans::{ScanHead, ScanSource};
use crate::{CloudHead, CloudSource, PoseAt, RigidPose};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxtile::scan::{AttributeSet, NO_TIME, Pose, Sweep, no_return};
use voxtile::space::Point;
use voxtile::{Error, Result};

/// How clouds get their poses, and how their points are transformed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CloudOptions {
    /// Maximum time from a cloud to the nearer of the two poses around it, in nanoseconds. The two poses may be twice
    /// as far apart; a cloud in a longer gap has no pose.
    pub pose_tolerance_ns: i64,
    /// Pose of the sensor in the body frame, which the trajectory describes.
    pub body_from_sensor: RigidPose,
    /// Points are already in the world frame; poses only give the ray origins.
    pub is_world_frame: bool,
    /// Applies motion compensation: points keep their own times, and the scan the motion of the sensor, by which each
    /// point is moved to its place at the time of its cloud when it is mapped.
    pub is_deskewed: bool,
    /// A cloud without a pose is in the world frame. Only valid for points without rays.
    pub may_lack_poses: bool,
    /// The pose file is that of several inputs, so its poses cannot be matched by the number of a cloud.
    pub are_poses_shared: bool,
    /// Whether clouds without a pose cause a remark.
    pub are_poses_needed: bool,
    /// Points without a return are kept as rays: [`RayConfig::no_return_range_m`](voxtile::RayConfig).
    pub has_no_returns: bool,
}

impl CloudOptions {
    /// Returns whether poses are used unchanged, without extrinsics, world frame or deskewing.
    pub(crate) fn is_plain(&self) -> bool {
        self.body_from_sensor == RigidPose::IDENTITY && !self.is_world_frame && !self.is_deskewed
    }
}

impl Default for CloudOptions {
    fn default() -> Self {
        Self {
            pose_tolerance_ns: 500_000_000,
            body_from_sensor: RigidPose::IDENTITY,
            is_world_frame: false,
            is_deskewed: false,
            may_lack_poses: false,
            are_poses_shared: false,
            are_poses_needed: true,
            has_no_returns: false,
        }
    }
}

/// Origin of the poses of clouds.
pub(crate) enum CloudPoses {
    /// A pose file, matched by time stamp or else by number.
    File(Box<Trajectory>),
    /// The cloud source provides them; the value is for display.
    Source(PoseSource),
    /// Every cloud is in the world frame.
    Identity,
    /// No poses are known.
    Missing,
}

/// Turns clouds into scans by adding poses. Clouds without a pose are skipped and counted.
pub(crate) struct PosedClouds {
    source: Box<dyn CloudSource>,
    path: PathBuf,
    /// Files from which earlier versions of voxtile computed the fingerprint of an input.
    files: Vec<PathBuf>,
    poses: CloudPoses,
    options: CloudOptions,
    /// Number of clouds read so far.
    number: u64,
    without_pose: u64,
    is_at_end: bool,
    /// Whether the poses are unusable, so that every further cloud would fail too.
    has_bad_poses: bool,
    /// Whether any cloud had a pose.
    has_pose: bool,
    /// Reasons for missing poses, each with the names of the first clouds affected.
    reasons: Vec<(String, Vec<String>)>,
    fields: Vec<String>,
    /// Number of points that deskewing left unchanged because there is no pose at their time.
    stayed: u64,
    /// Number of clouds that were not deskewed because they have no point times.
    without_times: u64,
}

/// Why deskewing does not apply.
const IN_WORLD: &str = "points in the world frame are already motion-compensated";
/// Maximum number of reasons in a remark, and of cloud names for each reason.
const MAX_NAMED: usize = 3;

impl PosedClouds {
    pub(crate) fn new(
        source: Box<dyn CloudSource>,
        path: &Path,
        poses: CloudPoses,
        options: CloudOptions,
    ) -> Result<Self> {
        if options.is_deskewed && options.is_world_frame {
            return Err(Error::argument(
                "deskew, world_frame",
                format!("{IN_WORLD}; omit one of the two options"),
            ));
        }
        if let CloudPoses::File(trajectory) = &poses
            && !trajectory.has_stamps()
        {
            if options.are_poses_shared {
                let reason = format!(
                    "{}: these poses are matched with the clouds by number, and there are several inputs: give poses \
                     with time stamps for clouds with time stamps, or one input after the other with `append`",
                    trajectory.path().display()
                );
                return Err(Error::argument("poses", reason));
            }
            trajectory.check_clouds(&*source)?;
        }
        let (number, without_pose, is_at_end, has_pose, reasons, fields) = Default::default();
        let (has_bad_poses, stayed, without_times) = Default::default();
        Ok(Self {
            source,
            path: path.to_owned(),
            files: Vec::new(),
            poses,
            options,
            number,
            without_pose,
            is_at_end,
            has_bad_poses,
            has_pose,
            reasons,
            fields,
            stayed,
            without_times,
        })
    }

    /// Sets the files from which the input fingerprint of older map versions is computed.
    pub(crate) fn set_files(&mut self, files: Vec<PathBuf>) {
        self.files = files;
    }

    /// Returns the body pose for a cloud, or the reason why there is none.
    fn pose_of(&self, head: &CloudHead, number: u64) -> Result<std::result::Result<RigidPose, String>> {
        let tolerance_ns = self.options.pose_tolerance_ns;
        Ok(match (&self.poses, head.stamp_ns) {
            (CloudPoses::Identity, _) => Ok(RigidPose::IDENTITY),
            (CloudPoses::Missing, _) => Err("the input has no poses, and no pose file was given".to_owned()),
            (CloudPoses::Source(_), _) => {
                head.world_from_sensor.ok_or_else(|| "the input has no pose for it".to_owned())
            }
            (CloudPoses::File(trajectory), Some(stamp_ns)) if trajectory.has_stamps() => {
                match trajectory.at(stamp_ns, tolerance_ns)? {
                    Found::Exact(pose) | Found::Between(pose) => Ok(pose),
                    Found::Gap { gap_ns } => {
                        let gap_s = gap_ns as f64 * 1e-9;
                        Err(format!(
                            "the poses around it are {gap_s:.3} s apart; `pose_tolerance` permits larger gaps"
                        ))
                    }
                    Found::Lost => Err("the pose at its time was lost".to_owned()),
                    Found::Before { first_ns } => Err(outside(first_ns, stamp_ns, "before the first pose")),
                    Found::After { last_ns } => Err(outside(stamp_ns, last_ns, "after the last pose")),
                    Found::WithoutStamps => Err("the poses have no time stamps".to_owned()),
                }
            }
            (CloudPoses::File(trajectory), _) => {
                let pose = trajectory.of_cloud(number, &*self.source)?;
                pose.ok_or_else(|| "its pose was lost".to_owned())
            }
        })
    }

    /// Returns the next cloud and its number. An unreadable cloud also uses up a number, so that later clouds keep
    /// theirs.
    fn next_cloud(&mut self) -> Result<Option<(u64, CloudHead)>> {
        let found = self.source.next_cloud();
        let number = self.number;
        self.number += u64::from(!matches!(found, Ok(None)));
        Ok(found?.map(|head| (number, head)))
    }

    /// Returns the number of poses left over at the end of the clouds, if poses are matched by number.
    fn poses_left(&self) -> Option<u64> {
        let CloudPoses::File(trajectory) = &self.poses else { return None };
        let left = (trajectory.len() as u64).saturating_sub(self.number);
        (self.is_at_end && !trajectory.has_stamps() && left > 0).then_some(left)
    }

    fn note_without_pose(&mut self, head: &CloudHead, why: &str) {
        self.without_pose += 1;
        log::debug!("{}: cloud {} has no pose: {why}", self.path.display(), head.name);
        if let Some((_, names)) = self.reasons.iter_mut().find(|(known, _)| known == why) {
            if names.len() <= MAX_NAMED {
                names.push(head.name.clone());
            }
        } else if self.reasons.len() <= MAX_NAMED {
            self.reasons.push((why.to_owned(), vec![head.name.clone()]));
        }
    }

    /// Describes the reasons for missing poses, each once.
    fn why_without_pose(&self) -> String {
        let list = |names: &[String]| {
            let more = if names.len() > MAX_NAMED { ", ..." } else { "" };
            names.iter().take(MAX_NAMED).map(String::as_str).collect::<Vec<_>>().join(", ") + more
        };
        let reasons = self.reasons.iter().take(MAX_NAMED);
        let reasons: Vec<String> = reasons.map(|(why, names)| format!("{}: {why}", list(names))).collect();
        let more = if self.reasons.len() > MAX_NAMED { "; ..." } else { "" };
        reasons.join("; ") + more
    }

    /// Reads the points of the current cloud.
    fn read_points(&mut self, head: &CloudHead, body: &RigidPose, points: &mut PointStore) -> Result<Pose> {
        let sensor = body.then(&self.options.body_from_sensor);
        let mut world_from_sensor = Pose::from_quaternion(sensor.position_m, sensor.quaternion)?;
        let is_in_world = self.options.is_world_frame || head.is_in_world;
        if is_in_world && self.options.is_deskewed {
            return Err(Error::argument("deskew", IN_WORLD));
        }
        if is_in_world {
            // A rotation and its inverse would change the last bits of the points; the identity does not.
            world_from_sensor = Pose::from_quaternion(sensor.position_m, RigidPose::IDENTITY.quaternion)?;
        }
        let Self { source, options, .. } = self;
        let stamp_ns = head.stamp_ns.filter(|_| options.is_deskewed && head.has_times);
        self.without_times += u64::from(options.is_deskewed && stamp_ns.is_none());
        let mut periods = SweepPeriods::default();
        let attributes = AttributeSet { times: stamp_ns.is_some(), ..head.attributes };
        points.begin_with(head.has_intensities, attributes);
        let origin = if is_in_world { sensor.position_m } else { [0.0; 3] };
        source.read_points(&mut |point| {
            let position_m = point.position_m;
            let in_sensor: Point = if point.is_return || !options.has_no_returns {
                // Points at the position of the sensor are skipped when they are mapped.
                let place = if point.is_return { position_m } else { origin };
                if is_in_world { std::array::from_fn(|k| place[k] - origin[k]) } else { place }
            } else {
                // A point without a return is kept if its direction is known.
                let direction = std::array::from_fn(|k| position_m[k] - origin[k]);
                let is_known = position_m.iter().all(|coordinate| coordinate.is_finite());
                let far = is_known.then(|| no_return([0.0; 3], direction)).flatten();
                far.unwrap_or([f64::NAN; 3])
            };
            if attributes.is_none() {
                return points.push(in_sensor, point.intensity);
            }
            let time_ns = if attributes.times { point.after_stamp_ns() } else { NO_TIME };
            periods.add(time_ns);
            points.push_with(in_sensor, point.intensity, point.colour, point.class, time_ns)
        })?;
        if let Some(stamp_ns) = stamp_ns {
            let sweep = self.sweep_of(&periods, stamp_ns, &sensor)?;
            self.stayed += points_outside(points, &sweep)?;
            points.set_sweep(Some(Arc::new(sweep)));
        }
        Ok(world_from_sensor)
    }

    /// Returns the motion of the sensor during the current cloud.
    fn sweep_of(&self, periods: &SweepPeriods, stamp_ns: i64, sensor: &RigidPose) -> Result<Sweep> {
        let own = self.source.poses();
        let mut unreadable = None;
        let sweep = periods.sweep(stamp_ns, sensor, |at_ns| {
            match body_at(&self.poses, own.as_ref(), &self.options, at_ns) {
                Ok(body) => Some(body?.then(&self.options.body_from_sensor)),
                Err(error) => {
                    unreadable.get_or_insert(error);
                    None
                }
            }
        });
        unreadable.map_or(sweep, Err)
    }

    /// Returns the pose of the sensor in the body frame, if it is another frame.
    fn mount(&self) -> Option<[f64; 7]> {
        let body_from_sensor = &self.options.body_from_sensor;
        let ([x, y, z], [qx, qy, qz, qw]) = (body_from_sensor.position_m, body_from_sensor.quaternion);
        (*body_from_sensor != RigidPose::IDENTITY).then_some([x, y, z, qx, qy, qz, qw])
    }
}

/// Returns the number of points with a time at which the pose of the sensor is unknown.
fn points_outside(points: &PointStore, sweep: &Sweep) -> Result<u64> {
    let mut outside = 0;
    let (mut last, mut is_covered) = (NO_TIME, true);
    points.for_each_attributed_chunk(0..points.len(), &mut |_, _, attributes| {
        for &time_ns in attributes.times_ns {
            if time_ns != last {
                (last, is_covered) = (time_ns, time_ns == NO_TIME || sweep.covers(time_ns));
            }
            outside += u64::from(!is_covered);
        }
        true
    })?;
    Ok(outside)
}

/// Returns the body pose at a time other than that of the current cloud.
fn body_at(
    poses: &CloudPoses,
    own: Option<&PoseAt>,
    options: &CloudOptions,
    at_ns: i64,
) -> Result<Option<RigidPose>> {
    match poses {
        CloudPoses::File(trajectory) => match trajectory.at(at_ns, options.pose_tolerance_ns)? {
            Found::Exact(body) | Found::Between(body) => Ok(Some(body)),
            _ => Ok(None),
        },
        CloudPoses::Source(_) => own.map_or(Ok(None), |own| own(at_ns)),
        CloudPoses::Identity | CloudPoses::Missing => Ok(None),
    }
}

/// Explains why a stamp has no pose: the trajectory begins or ends `later_ns - earlier_ns` away from it.
fn outside(later_ns: i64, earlier_ns: i64, place: &str) -> String {
    /// Offsets between common clocks, in seconds: GPS and Unix time, and the adjusted standard GPS time of LAS.
    const CLOCKS_S: [f64; 3] = [315_964_800.0, 1e9, 1e9 + 315_964_800.0];
    let apart_s = (i128::from(later_ns) - i128::from(earlier_ns)) as f64 * 1e-9;
    // Tolerance for leap seconds and the duration of a drive.
    let is_clock = |clock_s: &f64| (apart_s - clock_s).abs() < 100_000.0;
    let hint = if CLOCKS_S.iter().any(is_clock) {
        "; do the clocks differ, for instance GPS and Unix time?"
    } else {
        ""
    };
    format!("it is {apart_s:.3} s {place}{hint}")
}

impl ScanSource for PosedClouds {
    fn len_hint(&self) -> Option<usize> {
        self.source.len_hint().and_then(|clouds| usize::try_from(clouds).ok())
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        while let Some((number, head)) = self.next_cloud()? {
            let found = self.pose_of(&head, number);
            self.has_bad_poses |= found.is_err();
            let body = match found? {
                Ok(body) => body,
                Err(why) => {
                    if self.options.are_poses_needed {
                        self.note_without_pose(&head, &why);
                    }
                    if !self.options.may_lack_poses {
                        continue;
                    }
                    RigidPose::IDENTITY
                }
            };
            let world_from_sensor = self.read_points(&head, &body, points)?;
            self.has_pose = true;
            let CloudHead { name, stamp_ns, fields, .. } = head;
            self.fields = fields;
            points.set_body_from_sensor(self.mount());
            return Ok(Some(ScanHead { name, stamp_ns, world_from_sensor }));
        }
        self.is_at_end = true;
        if self.without_pose > 0 && !self.has_pose && !self.options.may_lack_poses {
            // An empty map would hide the problem, so this is an error.
            let mut why = self.why_without_pose();
            if matches!(self.poses, CloudPoses::Source(_)) {
                // The source reports which of its own poses are missing.
                why = self.source.remarks().into_iter().fold(why, |why, remark| why + "; " + &remark);
            }
            let reason = format!(
                "none of its {} clouds has a pose ({why}); give a pose file with `poses` FILE, or map points without \
                     rays with `no_rays`",
                self.without_pose
            );
            return Err(Error::argument(self.path.display().to_string(), reason));
        }
        Ok(None)
    }

    fn skip(&mut self, scans: usize) -> Result<usize> {
        let mut skipped = 0;
        while skipped < scans
            && let Some((number, head)) = self.next_cloud()?
        {
            let found = self.pose_of(&head, number);
            self.has_bad_poses |= found.is_err();
            match found? {
                Err(why) if !self.options.may_lack_poses => self.note_without_pose(&head, &why),
                _ => {
                    self.has_pose = true;
                    skipped += 1;
                }
            }
        }
        Ok(skipped)
    }

    fn pass_unread(&mut self) -> bool {
        // There is no scan to skip at the end.
        !self.is_at_end && !self.has_bad_poses
    }

    fn pose_source(&self) -> PoseSource {
        match &self.poses {
            CloudPoses::File(trajectory) => PoseSource::File(trajectory.path().to_owned()),
            CloudPoses::Source(source) => source.clone(),
            CloudPoses::Identity => PoseSource::Identity,
            CloudPoses::Missing => PoseSource::Missing,
        }
    }

    fn format(&self) -> String {
        self.source.format().to_owned()
    }

    fn fields(&self) -> Vec<String> {
        self.fields.clone()
    }

    fn crs(&self) -> Option<String> {
        self.source.crs().map(str::to_owned)
    }

    fn remarks(&self) -> Vec<String> {
        let mut remarks = self.source.remarks();
        if let CloudPoses::File(trajectory) = &self.poses {
            remarks.extend(trajectory.remarks().iter().cloned());
        }
        if let Some(left) = self.poses_left() {
            let clouds = self.number;
            remarks.push(format!(
                "there are {left} more poses than clouds ({clouds}), and the poses have no time stamps: does the first \
                 pose belong to the first cloud?"
            ));
        }
        if self.without_pose > 0 {
            let clouds = if self.without_pose == 1 { "cloud has" } else { "clouds have" };
            let why = self.why_without_pose();
            remarks.push(format!("{} {clouds} no pose: skipped ({why})", self.without_pose));
        }
        if self.without_times > 0 {
            let clouds = if self.without_times == 1 { "cloud has" } else { "clouds have" };
            remarks.push(format!(
                "{} {clouds} no point times or no stamp: `deskew` had no effect there",
                self.without_times
            ));
        }
        if self.stayed > 0 {
            let points = if self.stayed == 1 { "point" } else { "points" };
            remarks
                .push(format!("{} {points} not deskewed: there is no pose at their own times", self.stayed));
        }
        remarks
    }

    fn fingerprint(&self) -> Result<String> {
        if self.files.is_empty() {
            let reason = "maps of older versions do not support this kind of input";
            return Err(Error::argument(self.path.display().to_string(), reason));
        }
        let mut fingerprint = Fingerprint::default();
        self.files.iter().try_for_each(|path| fingerprint.add_file(path))?;
        match &self.poses {
            CloudPoses::File(trajectory) => {
                for number in 0..trajectory.len() {
                    let pose = trajectory.by_number(number)?.unwrap_or(RigidPose::IDENTITY);
                    fingerprint.add_pose(&Pose::from_quaternion(pose.position_m, pose.quaternion)?);
                }
            }
            CloudPoses::Identity => {
                self.files.iter().for_each(|_| fingerprint.add_pose(&Pose::identity()));
            }
            CloudPoses::Source(_) | CloudPoses::Missing => {}
        }
        Ok(fingerprint.finish())
    }
}
