use super::cloud::CloudSource;
use super::depth_frames::{DepthCode, DepthFrames, Frame, Frames};
use super::intrinsics::Intrinsics;
use super::listing::{Listing, extension_of, is_named_depth};
use super::name_stamps::NameStamps;
use super::regular::check_regular;
use crate::poses::RigidPose;
use crate::poses::matrix_of;
use crate::read_options::ReadOptions;
use std::fs::{self, DirEntry};
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// Depth images in order of their names, each with an optional pose file such as `frame-000000.pose.txt`.
struct ImageFrames {
    files: u64,
    paths: std::vec::IntoIter<PathBuf>,
    stamps: NameStamps,
    lost: u64,
    /// Description of the first unreadable pose.
    first_bad: Option<String>,
}

/// Image units per metre: millimetres.
const SCALE: f64 = 1000.0;
/// Limit for a pose file.
const MAX_POSE_BYTES: u64 = 1 << 14;

/// Returns whether depth images have pose files, as in the 7-Scenes data set.
pub(crate) fn has_poses(folder: &Path) -> bool {
    let is_pose = |entry: DirEntry| entry.file_name().to_string_lossy().ends_with(".pose.txt");
    fs::read_dir(folder).is_ok_and(|entries| entries.flatten().any(is_pose))
}

pub(crate) fn open(folder: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    let listing = Listing::read(folder, &options.not_clouds())?;
    let mut paths: Vec<PathBuf> =
        listing.clouds().filter(|path| extension_of(path) == "png").cloned().collect();
    // If colour images are present too, only the images named as depth are used.
    if paths.iter().any(|path| is_named_depth(path)) {
        paths.retain(|path| is_named_depth(path));
    }
    if paths.is_empty() {
        return Err(Error::argument(folder.display().to_string(), "no file in it ends with .png"));
    }
    let camera = match options.intrinsics {
        Some(camera) => camera,
        None => Intrinsics::find(folder, options.intrinsics_path.as_deref())?,
    };
    let code = DepthCode { camera, scale: options.depth_scale.unwrap_or(SCALE) };
    let (files, stamps) = (paths.len() as u64, NameStamps::of(&paths));
    let frames = ImageFrames { files, paths: paths.into_iter(), stamps, lost: 0, first_bad: None };
    Ok(Box::new(DepthFrames::new("depth images".to_owned(), Box::new(frames), code, options.attributes)))
}

impl Frames for ImageFrames {
    fn next(&mut self) -> Result<Option<Frame>> {
        let Some(path) = self.paths.next() else { return Ok(None) };
        let mut head = self.stamps.head_of(&path);
        let stem = head.name.trim_end_matches(".png").trim_end_matches(".depth").to_owned();
        let pose_file = path.with_file_name(format!("{stem}.pose.txt"));
        check_regular(&pose_file)?;
        if pose_file.is_file() {
            match pose(&pose_file) {
                Ok(pose) => head.world_from_sensor = pose,
                Err(error @ Error::Malformed { .. }) => {
                    self.first_bad.get_or_insert_with(|| format!("{error:#}"));
                }
                Err(error) => return Err(error),
            }
            self.lost += u64::from(head.world_from_sensor.is_none());
        }
        // As in the 7-Scenes data set.
        let colours = path.with_file_name(format!("{stem}.color.png"));
        let colours = Some(colours).filter(|colours| *colours != path && colours.exists());
        Ok(Some(Frame { path, head, colours }))
    }

    fn len_hint(&self) -> Option<u64> {
        Some(self.files)
    }

    fn remarks(&self) -> Vec<String> {
        let lost = self.lost;
        if lost == 0 {
            return self.stamps.remark().into_iter().collect();
        }
        let mut remark = format!("{lost} images have a pose of NaN, because tracking was lost");
        if let Some(first) = &self.first_bad {
            remark = format!("{lost} images have an invalid pose or none: {first}");
        }
        self.stamps.remark().into_iter().chain([remark]).collect()
    }
}

/// Reads the pose of the camera in the world: a 4x4 matrix. `None` where tracking was lost.
fn pose(path: &Path) -> Result<Option<RigidPose>> {
    use std::io::Read;
    let mut text = String::new();
    std::fs::File::open(path)
        .and_then(|file| file.take(MAX_POSE_BYTES).read_to_string(&mut text))
        .map_err(|error| Error::io(path, "read", error))?;
    let wrong = |reason: String| FormatError::at_line(1, reason).in_input(path);
    let mut numbers = Vec::new();
    for word in text.split_ascii_whitespace() {
        // Windows programs write `-1.#IND` for NaN.
        let number = if word.contains('#') { Ok(f64::NAN) } else { word.parse::<f64>() };
        numbers.push(number.map_err(|_| wrong(format!("`{word:.40}` is not a number")))?);
    }
    if numbers.len() != 16 {
        return Err(wrong(format!("{} numbers; a pose is a 4x4 matrix", numbers.len())));
    }
    if !numbers.iter().all(|number| number.is_finite()) {
        return Ok(None);
    }
    matrix_of(&numbers).map(Some).map_err(wrong)
}
