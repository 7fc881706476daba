use crate::sparse_poses::interpolated_poses;
use std::path::Path;
use std::sync::Arc;
use voxtile::mapper::{KeptScanHead, KeptSummary, NewPose};
use voxtile::operations::NewPoses;
use voxtile::scan::Pose;
use voxtile::{Error, Result};
use voxtile_formats::ReadOptions;
use voxtile_formats::poses::{Found, SweepPeriods, Trajectory};
use voxtile_formats::{Budget, RigidPose};

/// Maximum number of scans named in an error.
const MAX_NAMED: usize = 5;

/// A pose file and the settings for reading it.
#[derive(Debug)]
pub struct PoseFile<'a> {
    /// The pose file.
    pub path: &'a Path,
    /// KITTI `calib.txt`, for poses of the camera.
    pub calib: Option<&'a Path>,
    /// Pose of the sensor in the body frame, which the poses describe; `None` for that with which each scan was built.
    pub body_from_sensor: Option<RigidPose>,
    /// Maximum time from a scan to the nearer of the two poses around it, in nanoseconds.
    pub tolerance_ns: i64,
    /// Memory budget for reading.
    pub budget: Budget,
    /// Whether the file may have the poses of some scans alone.
    pub which: WhichScans,
}

/// Scans that a pose file has poses for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhichScans {
    /// All scans.
    #[default]
    All,
    /// Those with a pose at their time stamp; the others move with them ([`interpolated_poses`]).
    Stamped,
    /// Every n-th scan from the first on; the others move with them.
    Every(u64),
}

impl<'a> PoseFile<'a> {
    /// Returns the pose of the sensor of a scan in the body frame, if it is another frame.
    fn mount_of(&self, scan: &KeptScanHead) -> Option<RigidPose> {
        let of_build = scan.body_from_sensor.map(|[x, y, z, qx, qy, qz, qw]| RigidPose {
            position_m: [x, y, z],
            quaternion: [qx, qy, qz, qw],
        });
        self.body_from_sensor.or(of_build)
    }

    /// Returns the pose file of the read options, or `None` if scans keep their own poses.
    pub fn of_reading(options: &'a ReadOptions) -> Option<Self> {
        let body = options.clouds.body_from_sensor;
        Some(Self {
            path: options.poses.as_deref()?,
            calib: options.calib.as_deref(),
            body_from_sensor: (body != RigidPose::IDENTITY).then_some(body),
            tolerance_ns: options.clouds.pose_tolerance_ns,
            budget: options.budget(),
            which: WhichScans::All,
        })
    }
}

/// Returns the poses of a file for the scans that a map keeps, as a build with this file would assign them, or those of
/// all scans from a file with the poses of some.
///
/// # Errors
///
/// The map does not keep all its scans, the file cannot be read, or its poses do not fit the scans.
pub fn poses_for(from: &PoseFile<'_>, scans: &KeptSummary) -> Result<NewPoses> {
    scans.check_keeps_all()?;
    let summary = scans;
    let scans = scans.scans();
    let &PoseFile { path: file, calib, tolerance_ns, ref budget, which, .. } = from;
    if std::fs::metadata(file).is_ok_and(|meta| !meta.is_file() && !meta.is_dir()) {
        let reason = "is a FIFO, a socket or a device, but new poses may be read twice: save them to a file";
        return Err(Error::argument(file.display().to_string(), reason));
    }
    let trajectory = Trajectory::read_within(file, calib, budget)?;
    // Equal stamps, for instance all 0, are ignored.
    if trajectory.span_ns()?.is_none_or(|[first, last]| first < last) {
        trajectory.remarks().iter().for_each(|remark| log::warn!("{}: {remark}", file.display()));
    }
    if which != WhichScans::All {
        let some = poses_of_some(&trajectory, from, scans)?;
        return interpolated_poses(summary, &some);
    }
    let have_stamps = scans.iter().all(|scan| scan.stamp_ns.is_some());
    // Poses that are not sorted by time can only be matched by stamp.
    let is_by_line = !(have_stamps && trajectory.goes_back());
    if is_by_line && trajectory.len() == scans.len() && is_in_step(&trajectory, scans, tolerance_ns)? {
        trajectory.check_order()?;
        let mut poses = Vec::with_capacity(scans.len());
        for (number, scan) in scans.iter().enumerate() {
            let pose = trajectory.by_number(number)?.ok_or_else(|| {
                let reason = format!(
                    "scan {} has an invalid pose, but a map needs a pose for every scan; remove the scan with \
                     `remove-scans`",
                    scan.number
                );
                Error::argument(file.display().to_string(), reason)
            })?;
            let found = Found::Exact(pose);
            poses.extend(new_pose(summary, scan, &trajectory, from, &found)?);
        }
        return Ok(NewPoses::Moving(poses));
    }
    if !trajectory.has_stamps() || !have_stamps {
        let reason = other_number(trajectory.len(), scans);
        return Err(Error::argument(file.display().to_string(), reason));
    }
    by_time(&trajectory, from, summary)
}

/// Returns the poses of a part of the scans, by their numbers.
fn poses_of_some(
    trajectory: &Trajectory,
    from: &PoseFile<'_>,
    scans: &[KeptScanHead],
) -> Result<Vec<(u64, Pose)>> {
    let PoseFile { path: file, which, .. } = *from;
    let wrong = |reason: String| Error::argument(file.display().to_string(), reason);
    let mut some = Vec::new();
    if let WhichScans::Every(step) = which {
        let step = usize::try_from(step.max(1)).unwrap_or(usize::MAX);
        let wanted = scans.len().div_ceil(step);
        if trajectory.len() != wanted {
            let (poses, all) = (trajectory.len(), scans.len());
            return Err(wrong(format!(
                "{poses} poses, but {all} kept scans in steps of {step} need {wanted}; give another step, or poses with \
                 time stamps"
            )));
        }
        for (number, scan) in scans.iter().step_by(step).enumerate() {
            if let Some(pose) = trajectory.by_number(number)? {
                some.push((scan.number, sensor_pose(&pose, from.mount_of(scan).as_ref())?));
            }
        }
        return Ok(some);
    }
    for scan in scans {
        // Poses between two are worse than what the scan did since the one before.
        let found = scan.stamp_ns.map(|stamp_ns| trajectory.at(stamp_ns, 0)).transpose()?;
        if let Some(Found::Exact(pose)) = found {
            some.push((scan.number, sensor_pose(&pose, from.mount_of(scan).as_ref())?));
        }
    }
    match some.is_empty() {
        true => Err(wrong("no kept scan has a pose within a millisecond of its time stamp".to_owned())),
        false => Ok(some),
    }
}

/// Returns whether pose `k` can belong to scan `k` for all `k`: no stamps differ by more than the tolerance.
fn is_in_step(trajectory: &Trajectory, scans: &[KeptScanHead], tolerance_ns: i64) -> Result<bool> {
    let most = u64::try_from(tolerance_ns).unwrap_or(0);
    for (of_pose, scan) in trajectory.stamps_ns().zip(scans) {
        let of_pose = of_pose?;
        if scan.stamp_ns.is_some_and(|of_scan| of_pose.abs_diff(of_scan) > most) {
            return Ok(false);
        }
    }
    Ok(true)
}

fn other_number(poses: usize, scans: &[KeptScanHead]) -> String {
    let all = scans.len();
    match scans.get(poses) {
        Some(scan) => format!(
            "{poses} poses for {all} kept scans of the map: they are missing from scan {} on, and there are no time \
             stamps to match them",
            scan.number
        ),
        None => format!(
            "{poses} poses for {all} kept scans of the map: there are {} too many, and there are no time stamps to \
             match them",
            poses - all
        ),
    }
}

fn by_time(trajectory: &Trajectory, from: &PoseFile<'_>, summary: &KeptSummary) -> Result<NewPoses> {
    let scans = summary.scans();
    let (mut poses, mut missing) = (Vec::with_capacity(scans.len()), Vec::new());
    for scan in scans {
        let stamp_ns = scan.stamp_ns.unwrap_or_default();
        let found = trajectory.at(stamp_ns, from.tolerance_ns)?;
        match new_pose(summary, scan, trajectory, from, &found)? {
            Some(pose) => poses.push(pose),
            None => missing.push(format!("{} at {:.6} s", scan.number, stamp_ns as f64 * 1e-9)),
        }
    }
    if missing.is_empty() {
        return Ok(NewPoses::Moving(poses));
    }
    let named = missing[..missing.len().min(MAX_NAMED)].join(", ");
    let more = match missing.len().saturating_sub(MAX_NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let reason =
        format!("has no pose close in time to scan {named}{more}; raise `pose_tolerance` to allow for more");
    Err(Error::argument(from.path.display().to_string(), reason))
}

/// Returns the pose of a scan from that of the body, and its motion if its points have times and the poses have time
/// stamps: as reading the scan with these poses would. `None` if the pose is unknown.
fn new_pose(
    summary: &KeptSummary,
    scan: &KeptScanHead,
    trajectory: &Trajectory,
    from: &PoseFile<'_>,
    found: &Found,
) -> Result<Option<(u64, NewPose)>> {
    let (Found::Exact(body) | Found::Between(body)) = found else { return Ok(None) };
    let mount = from.mount_of(scan);
    let sensor = |body: &RigidPose| mount.as_ref().map_or(*body, |sensor| body.then(sensor));
    let mut new = NewPose::from(sensor_pose(body, mount.as_ref())?);
    if let (Some(old), Some(stamp_ns)) = (summary.sweep(scan.number), scan.stamp_ns)
        && trajectory.has_stamps()
    {
        let mut unreadable = None;
        let sweep = SweepPeriods::of(old).sweep(stamp_ns, &sensor(body), |at_ns| {
            match trajectory.at(at_ns, from.tolerance_ns) {
                Ok(Found::Exact(body) | Found::Between(body)) => Some(sensor(&body)),
                Ok(_) => None,
                Err(error) => {
                    unreadable.get_or_insert(error);
                    None
                }
            }
        });
        new.sweep = Some(Arc::new(unreadable.map_or(sweep, Err)?));
    }
    Ok(Some((scan.number, new)))
}

fn sensor_pose(body: &RigidPose, body_from_sensor: Option<&RigidPose>) -> Result<Pose> {
    let sensor = body_from_sensor.map_or(*body, |sensor| body.then(sensor));
    Pose::from_quaternion(sensor.position_m, sensor.quaternion)
}
