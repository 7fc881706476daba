use super::pcd::is_special;
use super::pcd_clouds::PcdClouds;
use super::pcd_folder::{PcdFolder, pcd_files_of};
use super::pose_source::{IDENTITY, is_placed, pose_file_for};
use super::posed_clouds::{CloudPoses, PosedClouds};
use super::poses::Poses;
use super::read_options::ReadOptions;
use super::source::{ScanSource, open_scans};
use crate::clouds::poses::Trajectory;
use crate::clouds::read::{self, Format, FromOrigin};
use crate::clouds::{CloudSource, stamp_of_name};
use std::fs::{self, DirEntry};
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

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
    let has_own = match format {
        Format::Bag1 | Format::Mcap | Format::Db3 | Format::Bag2Folder | Format::E57 => true,
        Format::DepthImages => has_pose_beside_an_image(path),
        _ => false,
    } || options.open.sensor_origin_m.is_some();
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

/// Whether depth images have files with their poses, as those of 7-Scenes have.
fn has_pose_beside_an_image(folder: &Path) -> bool {
    let is_pose = |entry: DirEntry| entry.file_name().to_string_lossy().ends_with(".pose.txt");
    fs::read_dir(folder).is_ok_and(|entries| entries.flatten().any(is_pose))
}

fn open_pcd(path: &Path, options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    let files = if path.is_dir() { pcd_files_of(path)? } else { vec![path.to_owned()] };
    let count = files.len() as u64;
    let origin_m = options.open.sensor_origin_m;
    let pose_file = match options.poses.as_deref() {
        Some(poses) => Some(poses).filter(|poses| *poses != Path::new(IDENTITY)).map(Path::to_owned),
        // A pose file beside a single PCD file belongs to its whole folder.
        None => path.is_dir().then(|| pose_file_for(path)).flatten(),
    };
    let are_named = options.poses.is_some() || pose_file.is_some();
    let have_own = !are_named && (count == 1 || files.iter().any(|file| is_placed(file)));
    let are_missing = !are_named && !have_own && options.clouds.may_lack_poses;
    let is_plain = options.calib.is_none() && options.clouds.is_plain() && origin_m.is_none();
    let mut trajectory = None;
    if is_plain && !are_missing {
        let found = match pose_file {
            Some(poses) => Some((lines_of(&poses, &files, options)?, poses)),
            None => None,
        };
        let poses = options.poses.as_deref();
        match found {
            Some((Lines::OnePerFile(lines), poses)) => {
                return Ok(Box::new(PcdFolder::with_lines(files, poses, lines)?));
            }
            Some((Lines::Others(others), poses)) => trajectory = Some((poses, others)),
            None if path.is_dir() => return Ok(Box::new(PcdFolder::open(path, poses)?)),
            None => return Ok(Box::new(PcdFolder::open_file(path, poses)?)),
        }
    }
    let poses = match trajectory {
        Some((poses, trajectory)) => CloudPoses::File(poses, trajectory),
        None => poses_for(path, options, have_own || origin_m.is_some(), Some(count))?,
    };
    let clouds = Box::new(PcdClouds::new(files, &options.open, origin_m.is_none()));
    let clouds: Box<dyn CloudSource> = match origin_m {
        Some(origin_m) => Box::new(FromOrigin::new(clouds, origin_m)?),
        None => clouds,
    };
    Ok(Box::new(PosedClouds::new(clouds, path, poses, options.clouds.clone())?))
}

/// The poses of PCD files.
enum Lines {
    OnePerFile(Poses),
    Others(Box<Trajectory>),
}

/// Reads a file of poses, as those of the files line by line. They are not where stamps tell otherwise, and where the
/// file is of a form that only [`Trajectory`] reads.
fn lines_of(poses: &Path, files: &[PathBuf], options: &ReadOptions) -> Result<Lines> {
    if is_special(poses) {
        let reason = "is a FIFO, a socket or a device, and poses of PCD files may be read twice: save what it gives to a \
                      file";
        return Err(Error::argument(poses.display().to_string(), reason));
    }
    let trajectory = || Trajectory::read_within(poses, None, &options.open.budget());
    let lines = match Poses::read(poses, files.len()) {
        Ok(lines) => lines,
        // What is wrong with a file that is no text of poses, is told line by line.
        Err(error) => return trajectory().map(|others| Lines::Others(Box::new(others))).map_err(|_| error),
    };
    let names: Option<Vec<i64>> = files.iter().map(|file| stamp_of_name(file)).collect();
    let Some((names, others)) = names.zip(trajectory().ok()) else { return Ok(Lines::OnePerFile(lines)) };
    let Some([first_ns, last_ns]) = others.span_ns()? else { return Ok(Lines::OnePerFile(lines)) };
    // Clocks of which neither knows the other tell nothing.
    let are_apart = !names.iter().any(|name| (first_ns..=last_ns).contains(name));
    match lines.len() == files.len() && (are_apart || lines.have_stamps(&names)) {
        true => Ok(Lines::OnePerFile(lines)),
        false => Ok(Lines::Others(Box::new(others))),
    }
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
            let trajectory =
                Trajectory::read_within(&file, options.calib.as_deref(), &options.open.budget())?;
            Ok(CloudPoses::File(file, Box::new(trajectory)))
        }
        None if clouds == Some(1) => Ok(CloudPoses::Identity),
        None if options.clouds.may_lack_poses => Ok(CloudPoses::Missing),
        None => {
            let reason = "has no poses, and there is no poses_tum.txt or poses_kitti.txt in or beside it: name a file with \
                          `poses` FILE, or say `poses` identity if all scans are in the world frame; `sensor_origin` X Y Z is \
                          for one station, `no_rays` for points alone";
            Err(Error::argument(path.display().to_string(), reason))
        }
    }
}

/// Opens a recording; poses of a file go before its own.
#[cfg(feature = "ros")]
fn open_recording(path: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    use crate::clouds::poses::most_gap_ns;
    use crate::clouds::ros::{BagOptions, PoseSource, open_bag};
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
        memory_bytes: options.open.memory_bytes,
        scratch: options.open.scratch.clone(),
    };
    Ok(Box::new(open_bag(&[path.to_owned()], &bag)?))
}
