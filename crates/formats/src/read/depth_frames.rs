use super::cloud::{CloudHead, CloudPoint, CloudSource};
use super::depth::depth_of;
use super::gray16::{self, size};
use super::input_file::open_input;
use super::intrinsics::Intrinsics;
use super::one::Visit;
use super::regular::check_regular;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use voxtile::{FormatError, Result};

/// A depth image to read.
pub(super) struct Frame {
    pub(super) path: PathBuf,
    pub(super) head: CloudHead,
}

/// Sequence of depth images with their poses, and remarks on them.
pub(super) trait Frames: Send {
    fn next(&mut self) -> Result<Option<Frame>>;

    fn len_hint(&self) -> Option<u64> {
        None
    }

    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Interpretation of depth images.
#[derive(Clone, Copy)]
pub(super) struct DepthCode {
    pub(super) camera: Intrinsics,
    /// Image units per metre.
    pub(super) scale: f64,
}

/// Source of clouds from depth images.
pub(super) struct DepthFrames {
    format: String,
    frames: Box<dyn Frames>,
    code: DepthCode,
    current: Option<PathBuf>,
}

impl DepthFrames {
    pub(super) fn new(format: String, frames: Box<dyn Frames>, code: DepthCode) -> Self {
        Self { format, frames, code, current: None }
    }
}

impl CloudSource for DepthFrames {
    fn format(&self) -> &str {
        &self.format
    }

    fn len_hint(&self) -> Option<u64> {
        self.frames.len_hint()
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        self.current = None;
        let Some(frame) = self.frames.next()? else { return Ok(None) };
        let mut head = frame.head;
        let (width, height) = size(&open(&frame.path)?);
        head.points = Some(u64::from(width) * u64::from(height));
        head.fields = vec!["depth".into()];
        self.current = Some(frame.path);
        Ok(Some(head))
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        match self.current.take() {
            Some(path) => read(&path, &self.code, visit),
            None => Ok(()),
        }
    }

    fn remarks(&self) -> Vec<String> {
        self.frames.remarks()
    }
}

type Reader = png::Reader<BufReader<File>>;

fn open(path: &Path) -> Result<Reader> {
    check_regular(path)?;
    let file = open_input(path)?;
    let reader = gray16::open(BufReader::with_capacity(1 << 16, file));
    reader.map_err(|(at, reason)| FormatError::at_offset(at, reason).in_input(path))
}

/// Reads an image row by row. Each pixel is a point, or a direction without a return.
fn read(path: &Path, code: &DepthCode, visit: Visit<'_>) -> Result<()> {
    let mut reader = open(path)?;
    let (_, height) = size(&reader);
    for row in 0..height {
        let damaged = |reason: String| {
            FormatError::at_record(u64::from(row), format!("row {row} of {height}: {reason}")).in_input(path)
        };
        let pixels = match reader.next_row() {
            Ok(Some(pixels)) => pixels,
            Ok(None) => return Err(damaged("it is missing".into())),
            Err(error) => return Err(damaged(error.to_string())),
        };
        for (column, pixel) in pixels.data().as_chunks::<2>().0.iter().enumerate() {
            let depth = depth_of(u16::from_be_bytes(*pixel));
            let direction = code.camera.direction(column as f64, f64::from(row));
            let depth_m = depth.map_or(1.0, |depth| depth / code.scale);
            let position_m = direction.map(|axis| axis * depth_m);
            visit(CloudPoint { is_return: depth.is_some(), ..CloudPoint::hit(position_m) })?;
        }
    }
    Ok(())
}
