//! Scans of PCD files, including the behaviour that maps created by older versions rely on.

use super::file_order::sort_naturally;
use super::files::Files;
use super::from_origin::FromOrigin;
use super::name_stamps::NameStamps;
use super::of_classes::OfClasses;
use super::one::OneCloud;
use super::pcd::{self, PcdOptions};
use crate::poses::{CloudPoses, PosedClouds};
use crate::poses::{PoseSource, SAME_TIME_NS};
use crate::poses::{Rules, Trajectory};
use crate::poses::{find_poses, pose_file_for};
use crate::read_options::ReadOptions;
use crate::scans::ScanSource;
use crate::{CloudHead, CloudSource, RigidPose};
use std::fs;
use std::path::{Path, PathBuf};
use voxtile::scan::Pose;
use voxtile::{Error, FormatError, Result};

/// Numbers in file names are compared with time stamps only if both exceed this many seconds. Counters are smaller.
const MIN_STAMP_S: f64 = 1e6;

/// Returns whether a folder contains PCD files.
pub(crate) fn is_folder(folder: &Path) -> bool {
    files_of(folder).is_ok_and(|files| !files.is_empty())
}

/// Opens a PCD file or a folder of them. A pose file takes precedence over the `VIEWPOINT` of the files.
///
/// With default options, scans have no time stamps, and plain pose files are matched line by line, unless the stamps in
/// the file names contradict those of the poses.
pub(crate) fn open(path: &Path, options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    let files = if path.is_dir() { files_of(path)? } else { vec![path.to_owned()] };
    if files.is_empty() {
        return Err(Error::argument(path.display().to_string(), "no file in it ends with .pcd"));
    }
    open_files(path, files, None, options)
}

/// Opens PCD files in the given order. `path` is the only file or a folder, where a pose file is searched for.
pub(crate) fn open_files(
    path: &Path,
    files: Vec<PathBuf>,
    remark: Option<String>,
    options: &ReadOptions,
) -> Result<Box<dyn ScanSource + Send>> {
    let is_plain = options.calib.is_none() && options.clouds.is_plain() && options.sensor_origin_m.is_none();
    let stamps = NameStamps::of(&files);
    let mut poses = poses_of(path, &files, is_plain, options)?;
    let has_stamps = match &poses {
        CloudPoses::File(trajectory) => !is_plain || !is_by_line(trajectory, &files, stamps)?,
        CloudPoses::Missing => true,
        CloudPoses::Source(_) | CloudPoses::Identity => !is_plain,
    };
    let is_viewpoint_needed = matches!(poses, CloudPoses::Source(_));
    let must_have_viewpoint = matches!(poses, CloudPoses::Source(PoseSource::Viewpoint));
    let is_alone = files.len() == 1;
    let pcd_options = PcdOptions {
        budget: options.budget(),
        attributes: options.attributes_to_read(),
        is_pose_needed: is_viewpoint_needed,
    };
    let has_origin = options.sensor_origin_m.is_some();
    let open = move |path: &Path| -> Result<Box<dyn CloudSource>> {
        let (mut head, points) = pcd::open(path, stamps.head_of(path), &pcd_options)?;
        if head.world_from_sensor.is_none() && must_have_viewpoint {
            let reason = "this file has no VIEWPOINT, but other files of the folder do: its pose is unknown";
            return Err(FormatError::at_line(1, reason).in_input(path));
        }
        head.stamp_ns = head.stamp_ns.filter(|_| has_stamps);
        head.world_from_sensor = match head.world_from_sensor {
            None if is_alone && !has_origin => Some(RigidPose::IDENTITY),
            // Programs that know no pose write the identity. Ignore it if the sensor origin is given.
            Some(pose) if has_origin && is_identity(&pose) => None,
            // Poses used in calculations are normalised now; poses passed through unchanged are normalised later.
            Some(pose) if !is_plain => Some(normalized(&pose)?),
            pose => pose,
        };
        Ok(Box::new(OneCloud::new("PCD", (head, points))))
    };
    let remarks = stamps.remark().into_iter().filter(|_| has_stamps).chain(remark).collect();
    let clouds =
        Box::new(Files::new("PCD".into(), files.clone(), true, Box::new(open)).with_remarks(remarks));
    let clouds: Box<dyn CloudSource> = match options.sensor_origin_m {
        Some(origin_m) => Box::new(FromOrigin::new(clouds, origin_m)?),
        None => clouds,
    };
    let clouds = OfClasses::of(clouds, options);
    if let (CloudPoses::File(trajectory), false) = (&mut poses, has_stamps) {
        trajectory.check_order()?;
        warn_of_shift(trajectory, &files, stamps)?;
        trajectory.forget_stamps();
    }
    let mut scans = PosedClouds::new(clouds, path, poses, options.clouds.clone())?;
    if !has_stamps {
        scans.set_files(files);
    }
    Ok(Box::new(scans))
}

fn poses_of(path: &Path, files: &[PathBuf], is_plain: bool, options: &ReadOptions) -> Result<CloudPoses> {
    // A pose file next to a single PCD file belongs to the whole folder.
    let has_file = options.poses.is_some() || (path.is_dir() && pose_file_for(path).is_some());
    let own = match options.sensor_origin_m {
        Some(_) => Some(PoseSource::Scans),
        None if has_file => None,
        None if files.iter().any(|file| is_placed(file)) => Some(PoseSource::Viewpoint),
        None => (files.len() == 1).then_some(PoseSource::Identity),
    };
    let own = own.map(|own| if is_plain { own } else { PoseSource::Scans });
    let rules = if is_plain { Rules::Lenient } else { Rules::Strict };
    find_poses(path, own, None, false, rules, options)
}

/// Returns whether poses are matched line by line: the file is plain text, and time stamps in the file names, if any,
/// do not contradict its stamps.
fn is_by_line(trajectory: &Trajectory, files: &[PathBuf], stamps: NameStamps) -> Result<bool> {
    if !trajectory.form().is_plain {
        return Ok(false);
    }
    let stamps: Option<Vec<i64>> = files.iter().map(|file| stamps.stamp(file)).collect();
    let Some((stamps, [first_ns, last_ns])) = stamps.zip(trajectory.span_ns()?) else { return Ok(true) };
    if trajectory.len() != files.len() {
        return Ok(false);
    }
    // Without a common time range, the clocks are unrelated.
    if !stamps.iter().any(|stamp| (first_ns..=last_ns).contains(stamp)) {
        return Ok(true);
    }
    if !trajectory.form().is_in_seconds {
        return Ok(false);
    }
    for (number, of_file) in stamps.into_iter().enumerate() {
        // The stamp is missing if the row has no valid time.
        if trajectory.stamp_of(number)?.is_some_and(|of_pose| of_pose.abs_diff(of_file) > SAME_TIME_NS) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Warns if the numbers in the file names are time stamps and one of them does not match its pose.
fn warn_of_shift(trajectory: &Trajectory, files: &[PathBuf], names: NameStamps) -> Result<()> {
    let mut stamps = Vec::with_capacity(files.len());
    for number in 0..files.len() {
        stamps.extend(trajectory.stamp_of(number)?.map(|stamp_ns| stamp_ns as f64 * 1e-9));
    }
    if let Some((file, seconds)) = first_shifted(&stamps, files, names) {
        log::warn!(
            "{}: the number in the name {} differs by {seconds:.3} s more from its pose's time stamp than in most \
             files: is a pose or a file missing?",
            trajectory.path().display(),
            file.display()
        );
    }
    Ok(())
}

/// Returns the first file whose name does not match its pose, with the difference in seconds.
fn first_shifted<'f>(
    stamps_s: &[f64],
    files: &'f [PathBuf],
    of_names: NameStamps,
) -> Option<(&'f PathBuf, f64)> {
    let (first, last) = (*stamps_s.first()?, *stamps_s.last()?);
    let time_in = |path: &PathBuf| Some(of_names.stamp(path)? as f64 * 1e-9);
    let times: Option<Vec<f64>> = files.iter().map(time_in).collect();
    let names = match times {
        Some(times) => times,
        None => files.iter().map(|path| number_in(path)).collect::<Option<_>>()?,
    };
    if stamps_s.len() != names.len() || first < MIN_STAMP_S || last <= first {
        return None;
    }
    let spacing = (last - first) / (stamps_s.len() - 1) as f64;
    let near = first - (last - first) - 1.0..=last + (last - first) + 1.0;
    let unit = [1.0, 1e-3, 1e-6, 1e-9].into_iter().find(|unit| near.contains(&(names[0] * unit)))?;
    let apart: Vec<f64> = names.iter().zip(stamps_s).map(|(name, stamp)| name * unit - stamp).collect();
    let mut sorted = apart.clone();
    sorted.sort_by(f64::total_cmp);
    let most = sorted[sorted.len() / 2];
    let is_shifted = |&k: &usize| (apart[k] - most).abs() > 0.5 * spacing;
    (0..apart.len()).find(is_shifted).map(|k| (&files[k], (apart[k] - most).abs()))
}

/// Returns the number at the end of a file name.
fn number_in(path: &Path) -> Option<f64> {
    let stem = path.file_stem()?.to_str()?;
    let digits = stem.trim_end_matches(|letter: char| letter.is_ascii_digit() || letter == '.').len();
    stem[digits..].trim_start_matches('.').parse().ok()
}

/// Returns whether the `VIEWPOINT` of a PCD file gives a sensor pose.
fn is_placed(path: &Path) -> bool {
    let options = PcdOptions { is_pose_needed: true, ..PcdOptions::default() };
    let head = pcd::open(path, CloudHead::default(), &options).ok();
    head.and_then(|(head, _)| head.world_from_sensor).is_some_and(|pose| !is_identity(&pose))
}

fn is_identity(pose: &RigidPose) -> bool {
    let [x, y, z, w] = pose.quaternion;
    pose.position_m == [0.0; 3] && [x, y, z] == [0.0; 3] && w != 0.0
}

fn normalized(pose: &RigidPose) -> Result<RigidPose> {
    let pose = Pose::from_quaternion(pose.position_m, pose.quaternion)?;
    Ok(RigidPose { position_m: pose.position_m(), quaternion: pose.quaternion() })
}

fn files_of(folder: &Path) -> Result<Vec<PathBuf>> {
    let cannot = |error| Error::io(folder, "list", error);
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(cannot)? {
        let path = entry.map_err(cannot)?.path();
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pcd")) {
            files.push(path);
        }
    }
    sort_naturally(&mut files);
    Ok(files)
}
