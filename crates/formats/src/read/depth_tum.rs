use super::cloud::{CloudHead, CloudSource};
use super::colour_list::ColourList;
use super::depth_frames::{DepthCode, DepthFrames, Frame, Frames};
use super::inside::is_inside;
use super::intrinsics::Intrinsics;
use super::lines::Lines;
use super::listing::is_rosbag2;
use super::one::head_of;
use super::regular::check_regular;
use super::stamp;
use super::text_line::comment_of;
use crate::read_options::ReadOptions;
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Lines of `depth.txt`: a stamp in seconds and a file name.
struct TumFrames {
    folder: PathBuf,
    lines: Lines,
    /// Number of invalid lines.
    bad: u64,
    first_bad: Option<Error>,
    has_frame: bool,
    colours: Option<ColourList>,
}

/// Image units per metre.
const SCALE: f64 = 5000.0;

/// Returns whether a folder has the list of a TUM RGB-D data set. A ROS 2 bag with a file of that name is not one.
pub(crate) fn is_folder(folder: &Path) -> bool {
    let list = folder.join("depth.txt");
    list.exists() && !list.is_dir() && !is_rosbag2(folder)
}

/// Opens a TUM RGB-D folder. Its `groundtruth.txt` is read as a pose file.
pub(crate) fn open(folder: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    let camera = match options.intrinsics {
        Some(camera) => camera,
        None => Intrinsics::find(folder, options.intrinsics_path.as_deref())?,
    };
    let code = DepthCode { camera, scale: options.depth_scale.unwrap_or(SCALE) };
    let list = folder.join("depth.txt");
    check_regular(&list)?;
    let frames = TumFrames {
        folder: folder.to_owned(),
        lines: Lines::open(&list)?,
        bad: 0,
        first_bad: None,
        has_frame: false,
        colours: if options.attributes.colours { ColourList::of(folder)? } else { None },
    };
    Ok(Box::new(DepthFrames::new(
        "depth images (TUM RGB-D)".to_owned(),
        Box::new(frames),
        code,
        options.attributes,
    )))
}

impl Frames for TumFrames {
    fn next(&mut self) -> Result<Option<Frame>> {
        while let Some((_, line)) = self.lines.next()? {
            let line = line.trim();
            if line.is_empty() || comment_of(line).is_some() {
                continue;
            }
            match frame(line) {
                Ok((_, file)) if !is_inside(Path::new(file)) => {
                    let reason = format!(
                        "`{file:.80}` is outside of the folder; images must be in it, for instance depth/1.png"
                    );
                    return Err(self.lines.error(reason));
                }
                Ok((stamp_ns, file)) => {
                    let path = self.folder.join(file);
                    let head = CloudHead { stamp_ns: Some(stamp_ns), ..head_of(&path) };
                    self.has_frame = true;
                    let colours = match &mut self.colours {
                        Some(list) => list.at(stamp_ns)?,
                        None => None,
                    };
                    return Ok(Some(Frame { path, head, colours }));
                }
                Err(reason) => {
                    self.bad += 1;
                    self.first_bad.get_or_insert_with(|| self.lines.error(reason));
                }
            }
        }
        match self.first_bad.take_if(|_| !self.has_frame) {
            Some(error) => Err(error),
            None => Ok(None),
        }
    }

    fn remarks(&self) -> Vec<String> {
        let Some(first) = &self.first_bad else { return Vec::new() };
        let lines = if self.bad == 1 { "1 line is".to_owned() } else { format!("{} lines are", self.bad) };
        vec![format!("{lines} invalid and skipped, the first: {first:#}")]
    }
}

/// Parses the stamp and the file name of a line.
pub(super) fn frame(line: &str) -> std::result::Result<(i64, &str), String> {
    let Some((stamp, file)) = line.split_once([' ', '\t', ',']) else {
        return Err("a line must have a time stamp in seconds and the file name of a depth image".into());
    };
    let stamp_ns =
        stamp::of_seconds(stamp).ok_or_else(|| format!("`{stamp:.40}` is not a time stamp in seconds"))?;
    Ok((stamp_ns, file.trim()))
}
