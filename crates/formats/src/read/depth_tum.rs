use super::cloud::CloudSource;
use super::depth_frames::{DepthCode, DepthFrames, Frame, Frames};
use super::inside::is_inside;
use super::intrinsics::Intrinsics;
use super::lines::Lines;
use super::listing::is_rosbag2;
use super::one::head_of;
use super::regular::check_regular;
use super::stamp;
use crate::read_options::ReadOptions;
use std::path::{Path, PathBuf};
use voxtile::Result;

/// The lines of `depth.txt`: a stamp in seconds and a file.
struct TumFrames {
    folder: PathBuf,
    lines: Lines,
}

/// Units of a depth image in a metre.
const SCALE: f64 = 5000.0;

/// Whether a folder has the list of TUM RGB-D. A recording may have one beside it.
pub(crate) fn is_folder(folder: &Path) -> bool {
    let list = folder.join("depth.txt");
    list.exists() && !list.is_dir() && !is_rosbag2(folder)
}

/// Opens a folder of TUM RGB-D. Its poses, `groundtruth.txt`, are a file of poses.
pub(crate) fn open(folder: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    let camera = match options.intrinsics {
        Some(camera) => camera,
        None => Intrinsics::find(folder, options.intrinsics_path.as_deref())?,
    };
    let code = DepthCode { camera, scale: options.depth_scale.unwrap_or(SCALE), is_largest_invalid: false };
    let list = folder.join("depth.txt");
    check_regular(&list)?;
    let frames = TumFrames { folder: folder.to_owned(), lines: Lines::open(&list)? };
    Ok(Box::new(DepthFrames::new("depth images (TUM RGB-D)".to_owned(), Box::new(frames), code)))
}

impl Frames for TumFrames {
    fn next(&mut self) -> Result<Option<Frame>> {
        while let Some((_, line)) = self.lines.next()? {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let Some((stamp, file)) = line.split_once([' ', '\t', ',']) else {
                return Err(self
                    .lines
                    .error("a line has a time stamp in seconds and the file of a depth image"));
            };
            let stamp_ns = stamp::of_seconds(stamp)
                .ok_or_else(|| self.lines.error(format!("`{stamp:.40}` is no time stamp in seconds")))?;
            let file = file.trim();
            if !is_inside(Path::new(file)) {
                let reason =
                    format!("`{file:.80}` leads out of the folder; name images in it, as depth/1.png");
                return Err(self.lines.error(reason));
            }
            let path = self.folder.join(file);
            let mut head = head_of(&path);
            head.stamp_ns = Some(stamp_ns);
            return Ok(Some(Frame { path, head }));
        }
        Ok(None)
    }
}
