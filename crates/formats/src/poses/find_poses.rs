use super::pose_source::PoseSource;
use super::posed_clouds::CloudPoses;
use super::{Rules, Trajectory, looks_like_poses};
use crate::read_options::ReadOptions;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Pose file names to search for.
const POSE_FILES: [&str; 2] = ["poses_tum.txt", "poses_kitti.txt"];
/// Value of the option `poses` if all scans are in the world frame.
const IDENTITY: &str = "identity";
/// Maximum number of files named in an error.
const MAX_NAMED: usize = 4;
/// Extensions of possible pose files.
const POSE_EXTENSIONS: [&str; 5] = ["txt", "tum", "kitti", "csv", "g2o"];
/// Number of bytes read to detect whether a file contains poses.
const GLANCE_BYTES: u64 = 1 << 14;

/// Finds the poses of an input: the given file, the input's own poses, or a file in the input's folder or its parent. A
/// single cloud needs none. `are_images`: the sensor is a camera, which looks along its z.
///
/// # Errors
///
/// A file cannot be read, or there are no poses where they are needed.
pub(crate) fn find_poses(
    path: &Path,
    own: Option<PoseSource>,
    clouds: Option<u64>,
    are_images: bool,
    rules: Rules,
    options: &ReadOptions,
) -> Result<CloudPoses> {
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new(".")) };
    let file = match &options.poses {
        Some(file) if file == Path::new(IDENTITY) => return Ok(CloudPoses::Identity),
        Some(file) => Some(file.clone()),
        None => match own {
            Some(own) => return Ok(CloudPoses::Source(own)),
            None => pose_file_for(folder),
        },
    };
    match file {
        Some(file) => {
            let budget = options.budget();
            let mut trajectory = Trajectory::read_by(rules, &file, options.calib.as_deref(), &budget)?;
            if !are_images && !options.clouds.is_world_frame {
                remark_frame(&mut trajectory, &file, folder, options)?;
            }
            Ok(CloudPoses::File(Box::new(trajectory)))
        }
        None if clouds == Some(1) => Ok(CloudPoses::Identity),
        None if options.clouds.may_lack_poses => Ok(CloudPoses::Missing),
        None => Err(no_poses(path, folder)),
    }
}

/// Names of files with the pose of the lidar in the camera frame.
const CALIB_FILES: [&str; 2] = ["calib.txt", "calib_velo_to_cam.txt"];

/// Adds a remark if the poses seem to belong to a frame other than the sensor's.
fn remark_frame(
    trajectory: &mut Trajectory,
    file: &Path,
    folder: &Path,
    options: &ReadOptions,
) -> Result<()> {
    let direction = trajectory.direction(&options.clouds.body_from_sensor)?;
    let may_need_calib = options.calib.is_none() && trajectory.are_matrices() && direction.may_be_of_camera();
    let calib = may_need_calib.then(|| calib_for(file, folder)).flatten();
    let mut remarks = direction.remarks(options.calib.is_some(), calib.is_some());
    if let Some(calib) = calib {
        let hint = if direction.is_along_z() { ", and these move along z like a camera" } else { "" };
        let calib = calib.display();
        remarks.push(format!(
            "{calib} contains Tr, the pose of the lidar in the camera frame: if these are poses of the camera, as in \
             KITTI{hint}, add `calib` {calib}"
        ));
    }
    remarks.into_iter().for_each(|remark| trajectory.remark(remark));
    Ok(())
}

/// Finds the KITTI `calib.txt` next to the poses or the clouds.
fn calib_for(file: &Path, folder: &Path) -> Option<PathBuf> {
    let of_file = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let places = [of_file.to_owned(), folder.to_owned(), above(folder)];
    let mut paths = places.iter().flat_map(|place| CALIB_FILES.map(|name| place.join(name)));
    paths.find(|path| path.is_file() && super::calib::read(path).is_ok())
}

/// Finds the pose file in a folder or in its parent.
pub(crate) fn pose_file_for(folder: &Path) -> Option<PathBuf> {
    let parent = above(folder);
    let places = [folder, &*parent];
    places.iter().flat_map(|place| POSE_FILES.map(|name| place.join(name))).find(|path| path.is_file())
}

fn no_poses(path: &Path, folder: &Path) -> Error {
    let found = match &files_like_poses(folder)[..] {
        [] => String::new(),
        [one] => format!(" ({one} looks like one)"),
        more => format!(" ({} look like some)", more.join(", ")),
    };
    let reason = format!(
        "has no poses: there is no poses_tum.txt or poses_kitti.txt in it or its parent (PCD files have no VIEWPOINT \
         except the identity); give a file with `poses` FILE{found}, or use `poses` identity if all scans are in the \
         world frame, `sensor_origin` X Y Z for a single station, or `no_rays` for points without rays"
    );
    Error::argument(path.display().to_string(), reason)
}

/// Returns the parent of a folder, as a user would name it.
fn above(folder: &Path) -> PathBuf {
    let is_named = folder.file_name().is_some();
    let parent = folder.parent().filter(|parent| is_named && !parent.as_os_str().is_empty());
    // The parent of a symbolic link's target differs from the parent of its name.
    let is_link = fs::symlink_metadata(folder).is_ok_and(|metadata| metadata.is_symlink());
    parent.filter(|_| !is_link).map_or_else(|| folder.join(".."), Path::to_owned)
}

/// Returns a few files in a folder or its parent that look like pose files.
fn files_like_poses(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for place in [folder.to_owned(), above(folder)] {
        let mut paths: Vec<PathBuf> =
            fs::read_dir(place).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        paths.sort_unstable();
        found.extend(paths.iter().filter(|path| may_be_poses(path)).map(|path| path.display().to_string()));
    }
    found.truncate(MAX_NAMED);
    found
}

/// Returns whether a file is a text that starts with poses.
fn may_be_poses(path: &Path) -> bool {
    let is_text = path
        .extension()
        .is_some_and(|extension| POSE_EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known)));
    let mut start = Vec::new();
    let mut glance = || File::open(path)?.take(GLANCE_BYTES).read_to_end(&mut start);
    is_text && path.is_file() && glance().is_ok() && looks_like_poses(&start)
}
