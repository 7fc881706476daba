use super::pcd_viewpoint::viewpoint_of_file;
use super::poses::{Poses, looks_like_poses};
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use voxtile::scan::Pose;
use voxtile::{Error, Result};

/// The source of the poses of scans.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PoseSource {
    /// The input has a pose with each scan.
    Scans,
    /// A pose file with one pose per scan.
    File(PathBuf),
    /// The `VIEWPOINT` of each PCD file.
    Viewpoint,
    /// None: every scan is in the world frame.
    Identity,
    /// None are known.
    Missing,
}

/// Names of pose files that are searched for.
const POSE_FILES: [&str; 2] = ["poses_tum.txt", "poses_kitti.txt"];
/// Given instead of a pose file: every scan is in the world frame.
pub(super) const IDENTITY: &str = "identity";
/// Most files that an error names.
const MAX_NAMED: usize = 4;

impl fmt::Display for PoseSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scans => f.write_str("with each scan, in the input"),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Viewpoint => f.write_str("VIEWPOINT of each file"),
            Self::Missing => f.write_str("none"),
            Self::Identity => f.write_str("identity: the scans are in the world frame"),
        }
    }
}

/// Finds the poses of PCD files: the requested ones, or a pose file in or beside their folder, or the `VIEWPOINT` of
/// each. `folder` is `None` for a single file.
///
/// # Errors
///
/// An invalid pose file, poses that do not match the scans in number or order of time; more than one scan without any
/// poses.
pub(super) fn poses_of(
    files: &[PathBuf],
    asked_for: Option<&Path>,
    folder: Option<&Path>,
) -> Result<(PoseSource, Option<Vec<Pose>>)> {
    let path = match asked_for {
        Some(path) if path == Path::new(IDENTITY) => {
            return Ok((PoseSource::Identity, Some(vec![Pose::identity(); files.len()])));
        }
        Some(path) => Some(path.to_owned()),
        None => folder.and_then(pose_file_for),
    };
    if let Some(path) = path {
        let poses = Poses::read(&path, files.len())?;
        return of_lines(files, path, poses).map(|(source, poses)| (source, Some(poses)));
    }
    if files.iter().any(|path| is_placed(path)) {
        return Ok((PoseSource::Viewpoint, None));
    }
    if files.len() > 1 {
        return Err(no_poses(files, folder));
    }
    Ok((PoseSource::Identity, None))
}

/// Takes the poses of a file line by line.
///
/// # Errors
///
/// Poses that do not match the scans in number or order of time.
pub(super) fn of_lines(files: &[PathBuf], path: PathBuf, poses: Poses) -> Result<(PoseSource, Vec<Pose>)> {
    poses.check(&path, files)?;
    Ok((PoseSource::File(path), poses.into_poses()))
}

/// Whether the `VIEWPOINT` of a PCD file tells where it was taken: writers without a pose write the identity.
pub(super) fn is_placed(path: &Path) -> bool {
    viewpoint_of_file(path).is_some_and(|viewpoint| !viewpoint.is_identity())
}

fn no_poses(files: &[PathBuf], folder: Option<&Path>) -> Error {
    let folder = folder.unwrap_or(Path::new("."));
    let found = files_like_poses(folder);
    let found = match &found[..] {
        [] => String::new(),
        [one] => format!(" ({one} looks like one)"),
        more => format!(" ({} look like some)", more.join(", ")),
    };
    let reason = format!(
        "{} scans and no poses: there is no poses_tum.txt or poses_kitti.txt in or beside the folder, and no VIEWPOINT in \
         the files but the identity; name a file with --poses FILE{found}, or say --poses identity if all scans are in \
         the world frame",
        files.len()
    );
    Error::argument(folder.display().to_string(), reason)
}

/// The pose file in a folder, or beside it.
pub(super) fn pose_file_for(folder: &Path) -> Option<PathBuf> {
    let beside = above(folder);
    let places = [folder, &*beside];
    places.iter().flat_map(|place| POSE_FILES.map(|name| place.join(name))).find(|path| path.is_file())
}

/// The folder that a folder is in, by the name that a person would use for it.
fn above(folder: &Path) -> PathBuf {
    let is_named = folder.file_name().is_some();
    let parent = folder.parent().filter(|parent| is_named && !parent.as_os_str().is_empty());
    // What a link leads to is somewhere else than its name.
    let is_link = fs::symlink_metadata(folder).is_ok_and(|metadata| metadata.is_symlink());
    parent.filter(|_| !is_link).map_or_else(|| folder.join(".."), Path::to_owned)
}

/// A few files in a folder or beside it that look like pose files.
fn files_like_poses(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for place in [folder.to_owned(), above(folder)] {
        let mut paths: Vec<PathBuf> =
            fs::read_dir(place).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        paths.sort_unstable();
        found.extend(
            paths.iter().filter(|path| looks_like_poses(path)).map(|path| path.display().to_string()),
        );
    }
    found.truncate(MAX_NAMED);
    found
}
