use super::of_classes::{left_out_remark, without_classes, without_returns};
use super::stream_input::{AnyInput, FileInput, StreamInput};
use crate::class_selection::{ClassSelection, Returns};
use crate::read_options::ReadOptions;
use crate::scans::Fingerprint;
use crate::scans::PointStore;
use crate::scans::{FLAG_CLASSES, FLAG_COLOURS, FLAG_INTENSITIES, MAGIC, MAX_LABEL_BYTES, VERSION};
use crate::scans::{ScanHead, ScanSource};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use voxtile::scan::{AttributeSet, NO_TIME, Pose};
use voxtile::{Error, FormatError, Result};

/// Reads voxtile's scan stream, as written by a [`ScanStreamWriter`](crate::ScanStreamWriter), scan by scan, from a
/// file or a pipe.
///
/// Attributes of points are skipped; see [`read_scan_stream_with`]. `path` is used for errors. With `is_file`, the file is opened for the fingerprint. Otherwise the fingerprint is the
/// label of the stream, and an error if it has none. Reads are small, so `input` should be buffered.
///
/// # Errors
///
/// The input fails or has an invalid header. Errors in a scan are returned with that scan.
pub fn read_scan_stream<R: Read>(input: R, path: &Path, is_file: bool) -> Result<impl ScanSource + use<R>> {
    begin(AnyInput(input), path, is_file, &ReadOptions::default())
}

/// As [`read_scan_stream`], with the attributes and the classes of [`ReadOptions`].
///
/// # Errors
///
/// As for [`read_scan_stream`]. Also fails if classes are selected and the points have none.
pub fn read_scan_stream_with<R: Read>(
    input: R,
    path: &Path,
    is_file: bool,
    options: &ReadOptions,
) -> Result<impl ScanSource + use<R>> {
    begin(AnyInput(input), path, is_file, options)
}

/// As [`read_scan_stream_with`], for a file. The points of skipped scans are not read.
///
/// # Errors
///
/// As for [`read_scan_stream_with`].
pub(crate) fn open(path: &Path, options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    Ok(Box::new(begin(FileInput::open(path)?, path, true, options)?))
}

fn begin<R: StreamInput>(
    input: R,
    path: &Path,
    is_file: bool,
    options: &ReadOptions,
) -> Result<ScanStream<R>> {
    let mut stream = ScanStream {
        path: path.to_owned(),
        is_file,
        input,
        offset: 0,
        label: String::new(),
        has_intensities: false,
        attributes: AttributeSet::NONE,
        wanted: options.attributes,
        classes: options.classes.clone(),
        left_out: 0,
        done: 0,
        is_past_error: false,
        chunk: Vec::new(),
    };
    stream.read_header()?;
    if options.returns != Returns::All {
        return Err(without_returns(&format!("{}, a scan stream", path.display())));
    }
    if !(stream.classes.is_everything() || stream.attributes.classes) {
        return Err(without_classes(&path.display().to_string()));
    }
    Ok(stream)
}

struct ScanStream<R> {
    path: PathBuf,
    is_file: bool,
    input: R,
    offset: u64,
    label: String,
    has_intensities: bool,
    /// Attributes in the stream, and those to return.
    attributes: AttributeSet,
    wanted: AttributeSet,
    classes: ClassSelection,
    /// Number of points left out by their class.
    left_out: u64,
    done: u64,
    /// Whether reading can continue after the scan that caused an error.
    is_past_error: bool,
    /// Encoded points.
    chunk: Vec<u8>,
}

/// Data before the points of a scan.
struct Head {
    count: u32,
    pose_at: u64,
    pose: [f64; 7],
}

/// Sizes of the parts of a point.
const XYZ_BYTES: usize = 12;
const INTENSITY_BYTES: usize = 4;
const COLOUR_BYTES: usize = 4;
const CLASS_BYTES: usize = 2;
const COUNT_BYTES: usize = 4;
const POSE_BYTES: usize = 56;

/// Number of points to read at once.
const CHUNK_POINTS: usize = 4096;

/// Limit for the points to reserve: the count in a damaged stream may have any value.
const MAX_RESERVED: usize = 1 << 16;

impl<R: StreamInput> ScanStream<R> {
    fn read_header(&mut self) -> Result<()> {
        if self.bytes("the magic number")? != *MAGIC {
            return Err(self.wrong(0, "this is not a voxtile scan stream"));
        }
        let version = u32::from_le_bytes(self.bytes("the version")?);
        if version != VERSION {
            return Err(
                self.wrong(8, format!("version {version} is unknown; only version {VERSION} is supported"))
            );
        }
        let flags = u32::from_le_bytes(self.bytes("the flags")?);
        if flags & !(FLAG_INTENSITIES | FLAG_COLOURS | FLAG_CLASSES) != 0 {
            return Err(self.wrong(12, format!("flags {flags:#x} are unknown")));
        }
        self.has_intensities = flags & FLAG_INTENSITIES != 0;
        self.attributes = AttributeSet {
            colours: flags & FLAG_COLOURS != 0,
            classes: flags & FLAG_CLASSES != 0,
            ..AttributeSet::NONE
        };
        let length = u32::from_le_bytes(self.bytes("the length of the label")?);
        if length > MAX_LABEL_BYTES {
            return Err(self
                .wrong(16, format!("the label has {length} bytes; at most {MAX_LABEL_BYTES} are allowed")));
        }
        let mut label = vec![0; length as usize];
        self.fill(&mut label, "the label")?;
        self.label = String::from_utf8(label).map_err(|_| self.wrong(20, "the label is not UTF-8"))?;
        Ok(())
    }

    fn bytes<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.fill(&mut bytes, what)?;
        Ok(bytes)
    }

    fn fill(&mut self, bytes: &mut [u8], what: &str) -> Result<()> {
        self.input.read_exact(bytes).map_err(|error| match error.kind() {
            ErrorKind::UnexpectedEof => self.wrong(self.offset, format!("the stream ends in {what}")),
            _ => Error::io(&self.path, "read", error),
        })?;
        self.offset += bytes.len() as u64;
        Ok(())
    }

    /// Reads the data before the points of a scan, or returns `None` at the end of the stream. It is a single read,
    /// because reads dominate the time to skip a scan.
    fn next_head(&mut self) -> Result<Option<Head>> {
        let mut bytes = [0; COUNT_BYTES + POSE_BYTES];
        let mut filled = 0;
        while filled < bytes.len() {
            match self.input.read(&mut bytes[filled..]) {
                Ok(0) => break,
                Ok(read) => filled += read,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(Error::io(&self.path, "read", error)),
            }
        }
        let ends_in = |at: u64, what| Err(self.wrong(self.offset + at, format!("the stream ends in {what}")));
        match filled {
            0 => return Ok(None),
            1..COUNT_BYTES => return ends_in(1, "the count of points"),
            _ if filled < bytes.len() => return ends_in(COUNT_BYTES as u64, "a pose"),
            _ => {}
        }
        let pose_at = self.offset + COUNT_BYTES as u64;
        self.offset += bytes.len() as u64;
        let (count, pose) = bytes.split_at(COUNT_BYTES);
        let number = |k: usize| f64::from_le_bytes(std::array::from_fn(|byte| pose[8 * k + byte]));
        let count = u32::from_le_bytes(std::array::from_fn(|byte| count[byte]));
        Ok(Some(Head { count, pose_at, pose: std::array::from_fn(number) }))
    }

    fn point_bytes(&self) -> usize {
        let AttributeSet { colours, classes, .. } = self.attributes;
        XYZ_BYTES
            + if self.has_intensities { INTENSITY_BYTES } else { 0 }
            + if colours { COLOUR_BYTES } else { 0 }
            + if classes { CLASS_BYTES } else { 0 }
    }

    /// Adds the points of the chunk, which have attributes.
    fn push_attributed(&mut self, points: &mut PointStore) -> Result<()> {
        let AttributeSet { colours, classes, .. } = self.attributes;
        for record in self.chunk.chunks_exact(self.point_bytes()) {
            let mut rest = record;
            let mut take = |count: usize| {
                let (taken, left) = rest.split_at_checked(count).unwrap_or((rest, &[]));
                rest = left;
                taken
            };
            let float = |bytes: &[u8]| f32::from_le_bytes(bytes.first_chunk().copied().unwrap_or_default());
            let point = [(); 3].map(|()| f64::from(float(take(size_of::<f32>()))));
            let intensity = if self.has_intensities { float(take(INTENSITY_BYTES)) } else { 0.0 };
            let colour = match if colours { take(COLOUR_BYTES) } else { &[] } {
                [1..=255, colour @ ..] => colour.first_chunk().copied(),
                _ => None,
            };
            let class = match if classes { take(CLASS_BYTES) } else { &[] } {
                [1..=255, class] => Some(*class),
                _ => None,
            };
            if self.classes.takes(class) {
                points.push_with(point, intensity, colour, class, NO_TIME)?;
            } else {
                self.left_out += 1;
            }
        }
        Ok(())
    }

    /// Reads encoded points.
    fn read_chunk(&mut self, points: usize) -> Result<()> {
        let mut chunk = std::mem::take(&mut self.chunk);
        chunk.resize(points * self.point_bytes(), 0);
        let mut filled = 0;
        while filled < chunk.len() {
            match self.input.read(&mut chunk[filled..]) {
                Ok(0) => return Err(self.ends_in_points(filled as u64)),
                Ok(read) => filled += read,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(Error::io(&self.path, "read", error)),
            }
        }
        self.offset += filled as u64;
        self.chunk = chunk;
        Ok(())
    }

    /// Creates the error for a stream that ends `bytes` bytes after the start of the current points.
    fn ends_in_points(&self, bytes: u64) -> Error {
        let number = bytes - bytes % 4;
        let what = match (bytes % self.point_bytes() as u64) as usize {
            0..XYZ_BYTES => "a point",
            12..16 if self.has_intensities => "an intensity",
            _ => "the attributes of a point",
        };
        self.wrong(self.offset + number, format!("the stream ends in {what}"))
    }

    /// Skips a scan. Returns `false` at the end of the stream.
    fn pass_scan(&mut self) -> Result<bool> {
        let Some(Head { count, pose_at, pose }) = self.next_head()? else { return Ok(false) };
        let bytes = u64::from(count) * self.point_bytes() as u64;
        let passed = self.input.pass(bytes).map_err(|error| Error::io(&self.path, "read", error))?;
        if passed < bytes {
            return Err(self.ends_in_points(passed));
        }
        self.offset += bytes;
        self.done += 1;
        let pose = self.pose(pose, pose_at);
        self.is_past_error = pose.is_err();
        pose.map(|_| true)
    }

    /// Creates the pose from the numbers at an offset.
    fn pose(&self, numbers: [f64; 7], at: u64) -> Result<Pose> {
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(self.wrong(at, "the pose has a number that is not finite"));
        }
        let [x, y, z, qx, qy, qz, qw] = numbers;
        Pose::of_quaternion([x, y, z], [qx, qy, qz, qw]).map_err(|reason| self.wrong(at + 24, reason))
    }

    fn wrong(&self, offset: u64, reason: impl Into<String>) -> Error {
        FormatError::at_offset(offset, reason).in_input(&self.path)
    }
}

impl<R: StreamInput> ScanSource for ScanStream<R> {
    fn len_hint(&self) -> Option<usize> {
        None
    }

    fn format(&self) -> String {
        "voxtile's scan stream".to_owned()
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        let Some(Head { count, pose_at, pose }) = self.next_head()? else { return Ok(None) };
        self.is_past_error = false;
        let count = count as usize;
        let AttributeSet { colours, classes, .. } = self.attributes;
        let is_wanted = AttributeSet {
            colours: colours && self.wanted.colours,
            classes: classes && self.wanted.classes,
            ..AttributeSet::NONE
        };
        points.begin_with(self.has_intensities, is_wanted);
        points.reserve(count.min(MAX_RESERVED));
        let mut left = count;
        while left > 0 {
            let here = left.min(CHUNK_POINTS);
            self.read_chunk(here)?;
            if !self.attributes.is_none() {
                self.push_attributed(points)?;
                left -= here;
                continue;
            }
            let (numbers, _) = self.chunk.as_chunks::<4>();
            let number = |bytes: [u8; 4]| f32::from_le_bytes(bytes);
            let point = |[x, y, z]: [[u8; 4]; 3]| [x, y, z].map(|bytes| f64::from(number(bytes)));
            match self.has_intensities {
                true => points.extend(
                    numbers.as_chunks::<4>().0.iter().map(|&[x, y, z, i]| (point([x, y, z]), number(i))),
                )?,
                false => points.extend(numbers.as_chunks::<3>().0.iter().map(|&xyz| (point(xyz), 0.0)))?,
            }
            left -= here;
        }
        let name = self.done.to_string();
        self.done += 1;
        let pose = self.pose(pose, pose_at);
        self.is_past_error = pose.is_err();
        let world_from_sensor = pose?;
        Ok(Some(ScanHead { name, stamp_ns: None, world_from_sensor }))
    }

    fn remarks(&self) -> Vec<String> {
        left_out_remark(self.left_out, "their class").into_iter().collect()
    }

    fn skip(&mut self, scans: usize) -> Result<usize> {
        for skipped in 0..scans {
            if !self.pass_scan()? {
                return Ok(skipped);
            }
        }
        Ok(scans)
    }

    fn pass_unread(&mut self) -> bool {
        std::mem::take(&mut self.is_past_error)
    }

    fn fingerprint(&self) -> Result<String> {
        if self.is_file {
            return Fingerprint::of_file(&self.path);
        }
        if self.label.is_empty() {
            let reason = "a stream without a label cannot be identified, so its build cannot be resumed: store it in a \
                          file, or give it a label when writing it";
            return Err(Error::argument(self.path.display().to_string(), reason));
        }
        Ok(format!("stream {:?}", self.label))
    }
}
