use super::pcd_clouds::PcdClouds;
use super::pcd_folder::{PcdFolder, pcd_files_of};
use super::pose_source::{IDENTITY, pose_file_for};
use super::posed_clouds::{CloudPoses, PosedClouds};
use super::poses::read_poses;
use super::read_options::ReadOptions;
use super::source::{ScanSource, open_scans};
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};
use voxtile_clouds::poses::Trajectory;
use voxtile_clouds::read::{self, Format};
use voxtile_clouds::{CloudSource, stamp_of_name};

/// Opens scans of any known format: what [`open_scans`] takes, point clouds and recordings of other programs. What the
/// input is, is told by its content first and by its name second.
///
/// # Errors
///
/// Nothing that is known, options that do not fit, a file that cannot be read; scans without any poses.
pub fn open_any_scans(path: &Path, options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    let options = options.with_not_clouds();
    Ok(options.selection.clone().of(open_all(path, &options)?))
}

fn open_all(path: &Path, options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let is_own =
        path.is_file() && ["graph", "log", "scans"].iter().any(|own| extension.eq_ignore_ascii_case(own));
    if !path.exists() || (is_own && options.open.format.is_none()) {
        return open_scans(path, options.poses.as_deref());
    }
    let (path, format) = format_of(path, options)?;
    let path = &*path;
    if format == Format::Pcd {
        return open_pcd(path, options);
    }
    let source: Box<dyn CloudSource> = match format {
        #[cfg(feature = "ros")]
        Format::Bag1 | Format::Mcap | Format::Db3 | Format::Bag2Folder => open_recording(path, options)?,
        #[cfg(not(feature = "ros"))]
        Format::Bag1 | Format::Mcap | Format::Db3 | Format::Bag2Folder => {
            let reason = format!("is a {format}, which this build leaves out: build with --features ros");
            return Err(Error::argument(path.display().to_string(), reason));
        }
        _ => {
            let open = read::OpenOptions { format: Some(format), ..options.open.clone() };
            read::open(path, &open)?
        }
    };
    let has_own =
        matches!(format, Format::Bag1 | Format::Mcap | Format::Db3 | Format::Bag2Folder | Format::E57)
            || options.open.sensor_origin_m.is_some();
    let poses = poses_for(path, options, has_own, source.len_hint())?;
    Ok(Box::new(PosedClouds::new(source, path, poses, options.clouds.clone())?))
}

/// The input itself, which may be a folder `scans` in the one that was named, and what it is.
fn format_of(path: &Path, options: &ReadOptions) -> Result<(PathBuf, Format)> {
    let inner = path.join("scans");
    if path.is_dir() && options.open.format.is_none_or(|format| format == Format::Pcd) {
        for folder in [path, &inner] {
            if pcd_files_of(folder).is_ok_and(|files| !files.is_empty()) {
                return Ok((folder.to_owned(), Format::Pcd));
            }
        }
    }
    let guess = |path: &Path| Format::guess_without(path, &options.open.not_clouds);
    match options.open.format {
        Some(format) if inner.is_dir() && guess(path).is_err() => Ok((inner, format)),
        Some(format) => Ok((path.to_owned(), format)),
        None => match guess(path) {
            Ok(format) => Ok((path.to_owned(), format)),
            // PCD has many beginnings; what is wrong with a file says its reader.
            Err(_) if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pcd")) => {
                Ok((path.to_owned(), Format::Pcd))
            }
            Err(_) if inner.is_dir() => Ok((inner.clone(), guess(&inner)?)),
            Err(error) => Err(error.into()),
        },
    }
}

fn open_pcd(path: &Path, options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    let files = if path.is_dir() { pcd_files_of(path)? } else { vec![path.to_owned()] };
    let poses = options.poses.as_deref();
    // A line a file, as ever, unless the names of all files are time stamps.
    let are_by_line = poses.is_none_or(|poses| {
        poses == Path::new(IDENTITY)
            || files.iter().any(|file| stamp_of_name(file).is_none())
            || read_poses(poses).is_ok_and(|poses| poses.len() == files.len())
    });
    if are_by_line && options.calib.is_none() && options.clouds.is_plain() {
        return match path.is_dir() {
            true => Ok(Box::new(PcdFolder::open(path, poses)?)),
            false => Ok(Box::new(PcdFolder::open_file(path, poses)?)),
        };
    }
    let count = files.len() as u64;
    let poses = poses_for(path, options, count == 1, Some(count))?;
    let clouds = Box::new(PcdClouds::new(files, options.open.scratch.as_deref()));
    Ok(Box::new(PosedClouds::new(clouds, path, poses, options.clouds.clone())?))
}

/// Where the poses of an input come from; some formats bring their own.
fn poses_for(path: &Path, options: &ReadOptions, has_own: bool, clouds: Option<u64>) -> Result<CloudPoses> {
    let file = match &options.poses {
        Some(file) if file == Path::new(IDENTITY) => return Ok(CloudPoses::Identity),
        Some(file) => Some(file.clone()),
        None if has_own => return Ok(CloudPoses::Source),
        None => pose_file_for(if path.is_dir() { path } else { path.parent().unwrap_or(Path::new(".")) }),
    };
    match file {
        Some(file) => {
            let trajectory = Trajectory::read(&file, options.calib.as_deref())?;
            Ok(CloudPoses::File(file, trajectory))
        }
        None if clouds == Some(1) => Ok(CloudPoses::Identity),
        None if options.clouds.may_lack_poses => Ok(CloudPoses::Missing),
        None => {
            let reason = "has no poses, and there is no poses_tum.txt or poses_kitti.txt in or beside it: name a file with \
                          --poses FILE, or say --poses identity if all scans are in the world frame; --sensor-origin X Y Z is \
                          for one station, --no-rays for points alone";
            Err(Error::argument(path.display().to_string(), reason))
        }
    }
}

/// Opens a recording; poses of a file go before its own.
#[cfg(feature = "ros")]
fn open_recording(path: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    use voxtile_clouds::poses::most_gap_ns;
    use voxtile_clouds::ros::{BagOptions, PoseSource, open_bag};
    options.check_for_recording()?;
    let recording = &options.recording;
    let poses = match (&options.poses, &recording.odometry_topic) {
        (Some(_), _) => PoseSource::None,
        (None, Some(_)) => PoseSource::Odometry,
        (None, None) => PoseSource::Tf,
    };
    let bag = BagOptions {
        topic: recording.topic.clone(),
        odometry_topic: recording.odometry_topic.clone(),
        fixed_frame: recording.fixed_frame.clone(),
        poses,
        most_gap_ns: Some(most_gap_ns(options.clouds.pose_tolerance_ns)),
        scratch: options.open.scratch.clone(),
    };
    Ok(Box::new(open_bag(&[path.to_owned()], &bag)?))
}
