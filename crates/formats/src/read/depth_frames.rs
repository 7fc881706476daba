use super::cloud::{CloudHead, CloudPoint, CloudSource};
use super::colour_image::ColourImage;
use super::depth::depth_of;
use super::gray16::{self, size};
use super::input_file::open_input;
use super::intrinsics::Intrinsics;
use super::one::Visit;
use super::regular::check_regular;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use voxtile::scan::AttributeSet;
use voxtile::{FormatError, Result};

/// A depth image to read.
pub(super) struct Frame {
    pub(super) path: PathBuf,
    pub(super) head: CloudHead,
    /// Image with the colours of the pixels.
    pub(super) colours: Option<PathBuf>,
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
    /// Whether colours are read.
    reads_colours: bool,
    /// Number of images without a colour image, if colours are read.
    without_colours: u64,
    current: Option<(PathBuf, Option<ColourImage>)>,
}

impl DepthFrames {
    pub(super) fn new(
        format: String,
        frames: Box<dyn Frames>,
        code: DepthCode,
        wanted: AttributeSet,
    ) -> Self {
        let reads_colours = wanted.colours;
        Self { format, frames, code, reads_colours, without_colours: 0, current: None }
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
        let colours = frame.colours.filter(|_| self.reads_colours);
        let colours = colours.map(|colours| ColourImage::open(&colours, &frame.path, (width, height)));
        let colours = colours.transpose()?;
        self.without_colours += u64::from(self.reads_colours && colours.is_none());
        head.attributes = AttributeSet { colours: colours.is_some(), classes: false, ..AttributeSet::NONE };
        head.points = Some(u64::from(width) * u64::from(height));
        head.fields = vec!["depth".into()];
        self.current = Some((frame.path, colours));
        Ok(Some(head))
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        match self.current.take() {
            Some((path, colours)) => read(&path, colours, &self.code, visit),
            None => Ok(()),
        }
    }

    fn remarks(&self) -> Vec<String> {
        let without = (self.without_colours > 0).then(|| {
            format!("{} depth images have no colour image, and their points no colours", self.without_colours)
        });
        self.frames.remarks().into_iter().chain(without).collect()
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
fn read(path: &Path, mut colours: Option<ColourImage>, code: &DepthCode, visit: Visit<'_>) -> Result<()> {
    let mut reader = open(path)?;
    let mut row_colours = Vec::new();
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
        if let Some(colours) = &mut colours {
            colours.next_row(&mut row_colours)?;
        }
        for (column, pixel) in pixels.data().as_chunks::<2>().0.iter().enumerate() {
            let depth = depth_of(u16::from_be_bytes(*pixel));
            let direction = code.camera.direction(column as f64, f64::from(row));
            let depth_m = depth.map_or(1.0, |depth| depth / code.scale);
            let position_m = direction.map(|axis| axis * depth_m);
            let colour = row_colours.get(column).copied();
            visit(CloudPoint { is_return: depth.is_some(), colour, ..CloudPoint::hit(position_m) })?;
        }
    }
    Ok(())
}
