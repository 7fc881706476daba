use super::fingerprint::Fingerprint;
use super::point_store::PointStore;
use super::scan_stream_writer::{FLAG_INTENSITIES, MAGIC, MAX_LABEL_BYTES, VERSION};
use super::source::{ScanHead, ScanSource};
use crate::error::{Error, FormatError, Result};
use crate::scan::Pose;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Reads voxtile's scan stream, as written by a [`ScanStreamWriter`](super::ScanStreamWriter), scan by scan, from a
/// file or a pipe.
///
/// `path` is for errors. With `is_file` the file is opened for the fingerprint; otherwise the fingerprint is the
/// stream's label, and an error if it has none. Reads are small: `input` should be buffered.
///
/// # Errors
///
/// A stream that fails or has another header; errors in a scan are returned with that scan.
pub fn read_scan_stream<R: Read>(input: R, path: &Path, is_file: bool) -> Result<impl ScanSource + use<R>> {
    let mut stream = ScanStream {
        path: path.to_owned(),
        is_file,
        input,
        offset: 0,
        label: String::new(),
        has_intensities: false,
        done: 0,
        is_past_error: false,
    };
    stream.read_header()?;
    Ok(stream)
}

struct ScanStream<R> {
    path: PathBuf,
    is_file: bool,
    input: R,
    offset: u64,
    label: String,
    has_intensities: bool,
    done: u64,
    /// Whether the input is behind the scan that caused an error.
    is_past_error: bool,
}

/// Most points reserved at once: the count in a damaged stream may be any number.
const MOST_RESERVED: usize = 1 << 16;

impl<R: Read> ScanStream<R> {
    fn read_header(&mut self) -> Result<()> {
        if self.bytes("the magic number")? != *MAGIC {
            return Err(self.wrong(0, "this is no scan stream of voxtile's"));
        }
        let version = u32::from_le_bytes(self.bytes("the version")?);
        if version != VERSION {
            return Err(self.wrong(8, format!("version {version} is not known, only version {VERSION}")));
        }
        let flags = u32::from_le_bytes(self.bytes("the flags")?);
        if flags & !FLAG_INTENSITIES != 0 {
            return Err(self.wrong(12, format!("flags {flags:#x} are not known")));
        }
        self.has_intensities = flags & FLAG_INTENSITIES != 0;
        let length = u32::from_le_bytes(self.bytes("the length of the label")?);
        if length > MAX_LABEL_BYTES {
            return Err(
                self.wrong(16, format!("a label of {length} bytes; it has {MAX_LABEL_BYTES} at most"))
            );
        }
        let mut label = vec![0; length as usize];
        self.fill(&mut label, "the label")?;
        self.label = String::from_utf8(label).map_err(|_| self.wrong(20, "the label is no UTF-8"))?;
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

    /// The number of points at the start of a scan; `None` at the end of the stream.
    fn next_count(&mut self) -> Result<Option<u32>> {
        let mut first = [0];
        loop {
            match self.input.read(&mut first) {
                Ok(0) => return Ok(None),
                Ok(_) => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(Error::io(&self.path, "read", error)),
            }
        }
        self.offset += 1;
        let [b, c, d] = self.bytes("the count of points")?;
        Ok(Some(u32::from_le_bytes([first[0], b, c, d])))
    }

    fn pose_numbers(&mut self) -> Result<[f64; 7]> {
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = f64::from_le_bytes(self.bytes("a pose")?);
        }
        Ok(numbers)
    }

    /// The pose from the numbers that start at an offset.
    fn pose(&self, numbers: [f64; 7], at: u64) -> Result<Pose> {
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(self.wrong(at, "a pose that is not finite"));
        }
        let [x, y, z, qx, qy, qz, qw] = numbers;
        Pose::of_quaternion([x, y, z], [qx, qy, qz, qw]).map_err(|reason| self.wrong(at + 24, reason))
    }

    fn wrong(&self, offset: u64, reason: impl Into<String>) -> Error {
        FormatError::at_offset(offset, reason).in_input(&self.path)
    }
}

impl<R: Read> ScanSource for ScanStream<R> {
    fn len_hint(&self) -> Option<usize> {
        None
    }

    fn format(&self) -> String {
        "voxtile's scan stream".to_owned()
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        let Some(count) = self.next_count()? else { return Ok(None) };
        self.is_past_error = false;
        let at = self.offset;
        let numbers = self.pose_numbers()?;
        let count = count as usize;
        points.begin(self.has_intensities);
        points.reserve(count.min(MOST_RESERVED));
        for _ in 0..count {
            let mut point = [0.0; 3];
            for coordinate in &mut point {
                *coordinate = f64::from(f32::from_le_bytes(self.bytes("a point")?));
            }
            let intensity = match self.has_intensities {
                true => f32::from_le_bytes(self.bytes("an intensity")?),
                false => 0.0,
            };
            points.push(point, intensity)?;
        }
        let name = self.done.to_string();
        self.done += 1;
        let pose = self.pose(numbers, at);
        self.is_past_error = pose.is_err();
        let world_from_sensor = pose?;
        Ok(Some(ScanHead { name, stamp_ns: None, world_from_sensor }))
    }

    fn pass_unread(&mut self) -> bool {
        std::mem::take(&mut self.is_past_error)
    }

    fn fingerprint(&self) -> Result<String> {
        if self.is_file {
            return Fingerprint::of_file(&self.path);
        }
        if self.label.is_empty() {
            let reason = "a stream without a label cannot be told from others, so that a build of it cannot be \
                          resumed; store it in a file, or give it a label where it is made";
            return Err(Error::argument(self.path.display().to_string(), reason));
        }
        Ok(format!("stream {:?}", self.label))
    }
}
