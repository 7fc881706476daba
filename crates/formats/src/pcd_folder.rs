use super::file_order::{name_of, sort_naturally};
use super::fingerprint::Fingerprint;
use super::pcd::read_pcd_file;
use super::pcd_viewpoint::viewpoint_of_file;
use super::point_store::PointStore;

use super::pose_source::of_lines;
use super::pose_source::{PoseSource, poses_of};

use super::poses::Poses;
use super::source::{ScanHead, ScanSource};
use std::fs;
use std::path::{Path, PathBuf};
use voxtile::scan::Pose;
use voxtile::{Error, FormatError, Result};

/// PCD files in natural order of their names, one scan each, with their poses.
pub(super) struct PcdFolder {
    files: Vec<PathBuf>,
    /// One per file; `None` takes each file's `VIEWPOINT`.
    poses: Option<Vec<Pose>>,
    pose_source: PoseSource,
    next: usize,
}

impl PcdFolder {
    pub(super) fn open(path: &Path, poses: Option<&Path>) -> Result<Self> {
        let mut folder = path.to_owned();
        let mut files = pcd_files_of(&folder)?;
        if files.is_empty() && folder.join("scans").is_dir() {
            folder = folder.join("scans");
            files = pcd_files_of(&folder)?;
        }
        if files.is_empty() {
            let reason = "no .pcd file in this folder, nor in a folder scans/ below it";
            return Err(Error::argument(path.display().to_string(), reason));
        }
        Self::new(files, poses, Some(&folder))
    }

    pub(super) fn open_file(path: &Path, poses: Option<&Path>) -> Result<Self> {
        // A pose file beside a single PCD file belongs to its whole folder.
        Self::new(vec![path.to_owned()], poses, None)
    }

    /// The files of a folder with poses that were read.
    pub(super) fn with_lines(files: Vec<PathBuf>, path: PathBuf, lines: Poses) -> Result<Self> {
        let (pose_source, poses) = of_lines(&files, path, lines)?;
        Ok(Self { files, poses: Some(poses), pose_source, next: 0 })
    }

    fn new(files: Vec<PathBuf>, poses: Option<&Path>, folder: Option<&Path>) -> Result<Self> {
        let (pose_source, poses) = poses_of(&files, poses, folder)?;
        Ok(Self { files, poses, pose_source, next: 0 })
    }
}

impl ScanSource for PcdFolder {
    fn len_hint(&self) -> Option<usize> {
        Some(self.files.len())
    }

    fn format(&self) -> String {
        "PCD".to_owned()
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        let Some(path) = self.files.get(self.next) else { return Ok(None) };
        let viewpoint = read_pcd_file(path, points)?;
        if self.pose_source == PoseSource::Viewpoint && viewpoint_of_file(path).is_none() {
            let reason = "no VIEWPOINT in this file, which other files of the folder have: where it was taken is not known";
            return Err(FormatError::at_line(1, reason).in_input(path));
        }
        let world_from_sensor = self.poses.as_ref().map_or(viewpoint, |poses| poses[self.next]);
        self.next += 1;
        Ok(Some(ScanHead { name: name_of(path), stamp_ns: None, world_from_sensor }))
    }

    fn skip(&mut self, scans: usize) -> Result<usize> {
        let skipped = scans.min(self.files.len() - self.next);
        self.next += skipped;
        Ok(skipped)
    }

    fn pass_unread(&mut self) -> bool {
        self.next += 1;
        true
    }

    fn pose_source(&self) -> PoseSource {
        self.pose_source.clone()
    }

    fn fingerprint(&self) -> Result<String> {
        let mut fingerprint = Fingerprint::default();
        self.files.iter().try_for_each(|path| fingerprint.add_file(path))?;
        self.poses.iter().flatten().for_each(|pose| fingerprint.add_pose(pose));
        Ok(fingerprint.finish())
    }
}

pub(super) fn pcd_files_of(folder: &Path) -> Result<Vec<PathBuf>> {
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
