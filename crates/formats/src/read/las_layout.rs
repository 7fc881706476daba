use super::las_count::Counts;
use super::las_records::{self, Record};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// Header of a LAS file, checked against the file size.
pub(super) struct Layout {
    /// The header. If it is a short one, the bytes after it are included.
    header: Vec<u8>,
    pub(super) file_bytes: u64,
    pub(super) points_at: u64,
    /// Point counts in the header.
    pub(super) counts: Counts,
    /// Number of points to read.
    pub(super) points: u64,
    pub(super) format: PointFormat,
    /// Size of an uncompressed point.
    pub(super) record_bytes: u64,
    pub(super) is_compressed: bool,
    pub(super) has_wkt: bool,
    records: Vec<Record>,
    /// Remarks for the user about the header.
    pub(super) remarks: Vec<String>,
}

/// Layout of the fields to read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PointFormat {
    /// Formats 6 and above have wider flags.
    pub(super) is_extended: bool,
    pub(super) time_at: Option<usize>,
    /// Offset of red, green and blue.
    pub(super) colour_at: Option<usize>,
}

/// Sizes of the LAS 1.4 and LAS 1.5 headers.
const LONG_HEADER_BYTES: usize = 375;
const HEADER_BYTES: usize = 393;
/// Size of the header before LAS 1.3.
const SHORT_HEADER_BYTES: u64 = 227;
/// Offsets of the three scales and three offsets, and of the maximum and minimum of each axis.
const SCALES_AT: usize = 131;
const BOUNDS_AT: usize = 179;
/// Limit for scales and offsets: a hundred times the distance to the sun, in metres.
const MAX_COORDINATE: f64 = 1e13;
/// Size of a point by point format.
const POINT_BYTES: [u64; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];
const COMPRESSED: u64 = 0x80;
/// Bits of the global encoding.
const IS_STANDARD_TIME: u64 = 1;
const HAS_WKT: u64 = 1 << 4;
const HAS_TIME_OFFSET: u64 = 1 << 6;
/// Adjusted standard GPS time subtracts this many seconds. LAS 1.5 stores the offset in millions of seconds.
const STANDARD_OFFSET_S: i64 = 1_000_000_000;
const TIME_OFFSET_AT: usize = 391;

impl Layout {
    pub(super) fn read(path: &Path, file: &mut File) -> Result<Self> {
        let fail = |error| Error::io(path, "read", error);
        let file_bytes = file.metadata().map_err(fail)?.len();
        let mut header = Vec::new();
        file.seek(SeekFrom::Start(0)).map_err(fail)?;
        file.take(HEADER_BYTES as u64).read_to_end(&mut header).map_err(fail)?;
        let wrong = |at: u64, reason: String| FormatError::at_offset(at, reason).in_input(path);
        if !header.starts_with(b"LASF") || (header.len() as u64) < SHORT_HEADER_BYTES {
            return Err(wrong(0, "the file ends within its header, or is not a LAS file".into()));
        }
        let (minor, header_bytes) = (number(&header, 25, 1), number(&header, 94, 2));
        let points_at = number(&header, 96, 4);
        let format = number(&header, 104, 1);
        let record_bytes = number(&header, 105, 2);
        let encoding = number(&header, 6, 2);
        let is_long =
            minor >= 4 && header.len() >= LONG_HEADER_BYTES && header_bytes >= LONG_HEADER_BYTES as u64;
        let counts =
            Counts { legacy: number(&header, 107, 4), large: is_long.then(|| number(&header, 247, 8)) };
        if points_at < header_bytes || points_at > file_bytes {
            let reason = format!("points begin at byte {points_at}, but the file has {file_bytes} bytes");
            return Err(wrong(96, reason));
        }
        let is_compressed = format & COMPRESSED != 0;
        let id = format & !COMPRESSED;
        let Some(least_bytes) = POINT_BYTES.get(id as usize) else {
            return Err(wrong(104, format!("point format {id} is unknown; formats 0 to 10 are supported")));
        };
        if record_bytes < *least_bytes {
            let reason = format!(
                "points of format {id} have {least_bytes} bytes, but the header states {record_bytes}"
            );
            return Err(wrong(105, reason));
        }
        check_scales(&header).map_err(|(at, reason)| wrong(at, reason))?;
        let mut layout = Self {
            header,
            file_bytes,
            points_at,
            points: counts.choose(0, u64::MAX),
            counts,
            format: PointFormat::of(id),
            record_bytes,
            is_compressed,
            has_wkt: encoding & HAS_WKT != 0,
            records: Vec::new(),
            remarks: Vec::new(),
        };
        layout.read_records(file, header_bytes, is_long).map_err(fail)?;
        Ok(layout)
    }

    /// Reads the records with the coordinate system and the compression, before the points and, since LAS 1.4, after
    /// them.
    fn read_records(&mut self, file: &mut File, header_bytes: u64, is_long: bool) -> std::io::Result<()> {
        let count = number(&self.header, 100, 4);
        let before = las_records::Span { start: header_bytes, end: self.points_at, count, wide: 2 };
        let found = before.read(file, &mut self.records)?;
        if found != count {
            self.remarks.push(format!(
                "the header announces {count} records before the points; {found} exist and are used"
            ));
        }
        let (start, count) = (number(&self.header, 235, 8), number(&self.header, 243, 4));
        if is_long && count > 0 {
            let behind = las_records::Span { start, end: self.file_bytes, count, wide: 8 };
            let found = if start >= self.points_at { behind.read(file, &mut self.records)? } else { 0 };
            if found != count {
                self.remarks.push(format!(
                    "the header announces {count} records after the points; {found} exist and are used"
                ));
            }
        }
        Ok(())
    }

    /// Returns an upper bound for the end of uncompressed points: the start of the data after them, or the file size.
    pub(super) fn points_end(&self) -> u64 {
        let minor = number(&self.header, 25, 1);
        // Waveform packets exist since LAS 1.3, extended records since LAS 1.4.
        let waves_at = if minor >= 3 { number(&self.header, 227, 8) } else { 0 };
        let records_at = if self.counts.large.is_some() { number(&self.header, 235, 8) } else { 0 };
        let ends = [waves_at, records_at].into_iter().filter(|end| *end >= self.points_at);
        ends.fold(self.file_bytes, u64::min)
    }

    /// Returns the scale and the offset of an axis.
    pub(super) fn transform(&self, axis: usize) -> (f64, f64) {
        (double(&self.header, SCALES_AT + 8 * axis), double(&self.header, SCALES_AT + 24 + 8 * axis))
    }

    /// Returns the minimum and maximum of an axis, if the header's values are finite.
    pub(super) fn bounds(&self, axis: usize) -> Option<(f64, f64)> {
        let (most, least) =
            (double(&self.header, BOUNDS_AT + 16 * axis), double(&self.header, BOUNDS_AT + 8 + 16 * axis));
        (least.is_finite() && most.is_finite() && least <= most).then_some((least, most))
    }

    /// Returns the epoch of GPS times, in nanoseconds of GPS time; 0 if they count from the start of a week.
    pub(super) fn zero_ns(&self) -> i64 {
        let (minor, encoding) = (number(&self.header, 25, 1), number(&self.header, 6, 2));
        let offset_s = match (encoding & IS_STANDARD_TIME != 0, minor >= 5 && encoding & HAS_TIME_OFFSET != 0)
        {
            (_, true) => number(&self.header, TIME_OFFSET_AT, 2) as i64 * 1_000_000,
            (true, false) => STANDARD_OFFSET_S,
            (false, false) => 0,
        };
        // At most 6.6e10 s.
        offset_s.saturating_mul(1_000_000_000)
    }

    /// Returns the coordinate system record with this ID.
    pub(super) fn record(&self, id: u16) -> Option<&[u8]> {
        las_records::find(&self.records, las_records::PROJECTION, id)
    }

    /// Returns the LASzip record, which describes the compression.
    pub(super) fn laszip(&self) -> Option<&[u8]> {
        las_records::find(&self.records, las_records::LASZIP, las_records::LASZIP_ID)
    }
}

impl PointFormat {
    fn of(id: u64) -> Self {
        let time_at = match id {
            0 | 2 => None,
            1 | 3..=5 => Some(20),
            _ => Some(22),
        };
        let colour_at = match id {
            2 => Some(20),
            3 | 5 => Some(28),
            7 | 8 | 10 => Some(30),
            _ => None,
        };
        Self { is_extended: id >= 6, time_at, colour_at }
    }
}

/// Checks that scales and offsets give finite coordinates.
fn check_scales(header: &[u8]) -> std::result::Result<(), (u64, String)> {
    for (k, axis) in ["x", "y", "z", "x", "y", "z"].into_iter().enumerate() {
        let (at, what) = (SCALES_AT + 8 * k, if k < 3 { "scale" } else { "offset" });
        let value = double(header, at);
        if !(value.abs() < MAX_COORDINATE && (value != 0.0 || what == "offset")) {
            return Err((
                at as u64,
                format!("the {what} of {axis} is {value}, which does not give valid coordinates"),
            ));
        }
    }
    Ok(())
}

/// Reads a little-endian number of up to eight bytes. Missing bytes are zero.
pub(super) fn number(bytes: &[u8], at: usize, width: usize) -> u64 {
    let bytes = bytes.iter().skip(at).take(width);
    bytes.enumerate().fold(0, |sum, (k, byte)| sum | u64::from(*byte) << (8 * k.min(7)))
}

/// Reads a little-endian double.
pub(super) fn double(bytes: &[u8], at: usize) -> f64 {
    f64::from_bits(number(bytes, at, 8))
}
