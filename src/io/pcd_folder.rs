use super::fingerprint::Fingerprint;
use super::pcd::read_pcd;
use super::poses::read_poses;
use super::sensor_scan::SensorScan;
use super::source::ScanSource;
use crate::error::{Error, Result};
use nalgebra::Isometry3;
use std::fs;
use std::path::{Path, PathBuf};

/// PCD files in the order of their names, one scan each, and their poses.
pub(super) struct PcdFolder {
    files: Vec<PathBuf>,
    /// One a file; `None` takes each file's `VIEWPOINT`.
    poses: Option<Vec<Isometry3<f64>>>,
    next: usize,
}

const POSE_FILES: [&str; 2] = ["poses_tum.txt", "poses_kitti.txt"];

impl PcdFolder {
    pub(super) fn open(path: &Path, poses: Option<&Path>) -> Result<Self> {
        let mut folder = path.to_owned();
        let mut files = pcd_files(&folder)?;
        if files.is_empty() && folder.join("scans").is_dir() {
            folder = folder.join("scans");
            files = pcd_files(&folder)?;
        }
        if files.is_empty() {
            let reason = "no .pcd file in this folder, nor in a folder scans/ below it";
            return Err(Error::argument(path.display().to_string(), reason));
        }
        Self::new(files, poses, &folder)
    }

    pub(super) fn open_file(path: &Path, poses: Option<&Path>) -> Result<Self> {
        // The poses beside a single file are those of its whole folder.
        let nowhere = Path::new("");
        Self::new(vec![path.to_owned()], poses, nowhere)
    }

    fn new(files: Vec<PathBuf>, poses: Option<&Path>, folder: &Path) -> Result<Self> {
        let found = poses.map(Path::to_owned).or_else(|| poses_for(folder));
        let Some(path) = found else { return Ok(Self { files, poses: None, next: 0 }) };
        let poses = read_poses(&path)?;
        if poses.len() != files.len() {
            let (poses, files) = (poses.len(), files.len());
            let reason = format!(
                "{poses} poses for {files} scan files; there must be one line a file, in sorted order"
            );
            return Err(Error::argument(path.display().to_string(), reason));
        }
        Ok(Self { files, poses: Some(poses), next: 0 })
    }
}

impl ScanSource for PcdFolder {
    fn len_hint(&self) -> Option<usize> {
        Some(self.files.len())
    }

    fn next_scan(&mut self) -> Result<Option<SensorScan>> {
        let Some(path) = self.files.get(self.next) else { return Ok(None) };
        let bytes = fs::read(path).map_err(|error| Error::io(path, "read", error))?;
        let cloud = read_pcd(&bytes).map_err(|error| error.in_input(path))?;
        let world_from_sensor = self.poses.as_ref().map_or(cloud.world_from_sensor, |poses| poses[self.next]);
        self.next += 1;
        Ok(Some(SensorScan {
            name: name_of(path),
            points_in_sensor: cloud.points,
            intensities: cloud.intensities,
            world_from_sensor,
        }))
    }

    fn skip(&mut self, scans: usize) -> Result<usize> {
        let skipped = scans.min(self.files.len() - self.next);
        self.next += skipped;
        Ok(skipped)
    }

    fn fingerprint(&self) -> Result<String> {
        let mut fingerprint = Fingerprint::default();
        self.files.iter().try_for_each(|path| fingerprint.add_file(path))?;
        self.poses.iter().flatten().for_each(|pose| fingerprint.add_pose(pose));
        Ok(fingerprint.finish())
    }
}

fn pcd_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let cannot = |error| Error::io(folder, "list", error);
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(cannot)? {
        let path = entry.map_err(cannot)?.path();
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pcd")) {
            files.push(path);
        }
    }
    files.sort_unstable_by(|a, b| a.file_name().cmp(&b.file_name()));
    Ok(files)
}

/// The pose file in a folder, or beside it.
fn poses_for(folder: &Path) -> Option<PathBuf> {
    if folder.as_os_str().is_empty() {
        return None;
    }
    let beside = folder.join("..");
    let places = [folder, &*beside];
    places.iter().flat_map(|place| POSE_FILES.map(|name| place.join(name))).find(|path| path.is_file())
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
