use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// What the header of a LAS file says, checked against the size of the file.
pub(super) struct Layout {
    /// The header, and what follows a short one.
    pub(super) header: Vec<u8>,
    pub(super) file_bytes: u64,
    pub(super) points_at: u64,
    pub(super) points: u64,
    /// Their number stands in the field of LAS 1.4.
    pub(super) has_large_count: bool,
    /// Bytes of a point that is not compressed.
    pub(super) record_bytes: u64,
    pub(super) is_compressed: bool,
    /// Times count from GPS time + 1e9 s, not from the begin of a week.
    pub(super) has_standard_time: bool,
    pub(super) has_wkt: bool,
    pub(super) records: Vec<Record>,
    /// What a person should know of the number of points.
    pub(super) remark: Option<String>,
}

/// A variable length record.
pub(super) struct Record {
    pub(super) user: String,
    pub(super) id: u16,
    pub(super) data: Vec<u8>,
}

/// Who records of coordinates are of, and the one of the compression.
const PROJECTION: &str = "LASF_Projection";
pub(super) const LASZIP: &str = "laszip encoded";
pub(super) const LASZIP_ID: u16 = 22204;
/// The coordinate system, as text and as keys of GeoTIFF.
pub(super) const WKT_ID: u16 = 2112;
pub(super) const KEYS_ID: u16 = 34735;
/// A header is at most so long in LAS 1.4.
const HEADER_BYTES: usize = 375;
/// Three scales and three offsets.
const SCALES_AT: usize = 131;
/// Neither scales nor offsets are as large: a hundred times the way to the sun.
const MAX_COORDINATE: f64 = 1e13;
/// Records of more bytes, and more of them, have nothing to do with coordinates.
const MAX_RECORD_BYTES: u64 = 1 << 20;
const MAX_RECORDS: u32 = 10_000;

impl Layout {
    pub(super) fn read(path: &Path, file: &mut File) -> Result<Self> {
        let fail = |error| Error::io(path, "read", error);
        let file_bytes = file.metadata().map_err(fail)?.len();
        let mut header = Vec::new();
        file.seek(SeekFrom::Start(0)).map_err(fail)?;
        file.take(HEADER_BYTES as u64).read_to_end(&mut header).map_err(fail)?;
        let wrong = |at: u64, reason: String| FormatError::at_offset(at, reason).in_input(path);
        if !header.starts_with(b"LASF") || header.len() < 227 {
            return Err(wrong(0, "the file ends within its header, or is no LAS".into()));
        }
        let (minor, header_bytes) = (number(&header, 25, 1), number(&header, 94, 2));
        let points_at = number(&header, 96, 4);
        let format = number(&header, 104, 1);
        let record_bytes = number(&header, 105, 2);
        let encoding = number(&header, 6, 2);
        let is_large = minor >= 4 && header.len() == HEADER_BYTES && header_bytes >= HEADER_BYTES as u64;
        let large_points = if is_large { number(&header, 247, 8) } else { 0 };
        let has_large_count = number(&header, 107, 4) == 0;
        let points = if has_large_count { large_points } else { number(&header, 107, 4) };
        if points_at < header_bytes || points_at > file_bytes {
            let reason = format!("points begin at byte {points_at} of a file of {file_bytes} bytes");
            return Err(wrong(96, reason));
        }
        if record_bytes == 0
            || points.checked_mul(record_bytes).and_then(|all| all.checked_add(points_at)).is_none()
        {
            return Err(wrong(105, format!("{points} points of {record_bytes} bytes are impossible")));
        }
        check_scales(&header).map_err(|(at, reason)| wrong(at, reason))?;
        let mut layout = Self {
            header,
            file_bytes,
            points_at,
            points,
            has_large_count,
            record_bytes,
            is_compressed: format & 0x80 != 0,
            has_standard_time: encoding & 1 != 0,
            has_wkt: encoding & 16 != 0,
            records: Vec::new(),
            remark: None,
        };
        layout.count_what_is_there(is_large);
        let count = number(&layout.header, 100, 4);
        layout.read_records(file, header_bytes, count, points_at, 2).map_err(fail)?;
        if is_large {
            let (start, count) = (number(&layout.header, 235, 8), number(&layout.header, 243, 4));
            if start >= points_at {
                layout.read_records(file, start, count, file_bytes, 8).map_err(fail)?;
            }
        }
        Ok(layout)
    }

    /// Reads the records of coordinates and of the compression between two places. What is cut off is left out.
    fn read_records(
        &mut self,
        file: &mut File,
        start: u64,
        count: u64,
        end: u64,
        wide: usize,
    ) -> io::Result<()> {
        let head_bytes = 52 + wide as u64;
        let mut at = start;
        for _ in 0..count.min(u64::from(MAX_RECORDS)) {
            if at.checked_add(head_bytes).is_none_or(|behind| behind > end) {
                break;
            }
            let mut head = vec![0; 52 + wide];
            file.seek(SeekFrom::Start(at))?;
            if file.read_exact(&mut head).is_err() {
                break;
            }
            let user: Vec<u8> = head.iter().skip(2).take(16).copied().take_while(|byte| *byte != 0).collect();
            let (id, bytes) = (number(&head, 18, 2) as u16, number(&head, 20, wide));
            let data_at = at + head_bytes;
            let Some(next) = data_at.checked_add(bytes).filter(|next| *next <= end) else { break };
            let user = String::from_utf8_lossy(&user).into_owned();
            let is_wanted = match user.as_str() {
                PROJECTION => matches!(id, WKT_ID | KEYS_ID),
                LASZIP => id == LASZIP_ID,
                _ => false,
            };
            // Of equal records the first counts.
            if is_wanted && bytes <= MAX_RECORD_BYTES && self.record_of(&user, id).is_none() {
                let mut data = Vec::new();
                (&mut *file).take(bytes).read_to_end(&mut data)?;
                self.records.push(Record { user, id, data });
            }
            at = next;
        }
        Ok(())
    }

    /// Compares the number of points with the room for them. A writer that was killed leaves 0 in the header, for the
    /// number goes there last; then the file itself tells it. Any other number is what other programs go by, too.
    fn count_what_is_there(&mut self, is_large: bool) {
        if self.is_compressed {
            return;
        }
        let room = (self.points_end(is_large) - self.points_at) / self.record_bytes;
        if self.points == 0 && room > 0 {
            self.announce(room, is_large);
            let taken = self.points;
            self.remark = Some(format!(
                "the header announces no points, as a writer leaves it that was stopped: the {taken} that the file has \
                 room for are read"
            ));
        } else if self.points < room {
            let (points, behind) = (self.points, room - self.points);
            self.remark = Some(format!(
                "the header announces {points} points, which are read; the file has room for {behind} more behind them"
            ));
        }
    }

    /// Where points end at the latest: at what the header says to stand behind them, or with the file.
    fn points_end(&self, is_large: bool) -> u64 {
        let minor = number(&self.header, 25, 1);
        // Wave packets since LAS 1.3, long records since LAS 1.4.
        let waves_at = if minor >= 3 { number(&self.header, 227, 8) } else { 0 };
        let records_at = if is_large { number(&self.header, 235, 8) } else { 0 };
        let ends = [waves_at, records_at].into_iter().filter(|end| *end >= self.points_at);
        ends.fold(self.file_bytes, u64::min)
    }

    /// Writes a number of points into the header, which the library goes by.
    fn announce(&mut self, points: u64, is_large: bool) {
        let short = u32::try_from(points).unwrap_or(u32::MAX);
        self.has_large_count = is_large && u64::from(short) < points;
        self.points = if self.has_large_count { points } else { u64::from(short) };
        let (at, width) = if self.has_large_count { (247, 8) } else { (107, 4) };
        let bytes = self.points.to_le_bytes();
        self.header.iter_mut().skip(at).take(width).zip(bytes).for_each(|(byte, new)| *byte = new);
    }

    /// Points that are whole in a file that is not compressed.
    pub(super) fn whole_points(&self) -> u64 {
        if self.is_compressed {
            return self.points;
        }
        self.points.min((self.file_bytes - self.points_at.min(self.file_bytes)) / self.record_bytes.max(1))
    }

    /// The record of coordinates with this number.
    pub(super) fn record(&self, id: u16) -> Option<&[u8]> {
        self.record_of(PROJECTION, id)
    }

    /// The record that says how points are compressed.
    pub(super) fn laszip(&self) -> Option<&[u8]> {
        self.record_of(LASZIP, LASZIP_ID)
    }

    fn record_of(&self, user: &str, id: u16) -> Option<&[u8]> {
        let record = self.records.iter().find(|record| record.user == user && record.id == id);
        record.map(|record| record.data.as_slice())
    }
}

/// Scales and offsets make coordinates of whole numbers: from others than these, no finite ones come.
fn check_scales(header: &[u8]) -> std::result::Result<(), (u64, String)> {
    for (k, axis) in ["x", "y", "z", "x", "y", "z"].into_iter().enumerate() {
        let (at, what) = (SCALES_AT + 8 * k, if k < 3 { "scale" } else { "offset" });
        let value = f64::from_bits(number(header, at, 8));
        if !(value.abs() < MAX_COORDINATE && (value != 0.0 || what == "offset")) {
            return Err((at as u64, format!("the {what} of {axis} is {value}: no coordinates come of it")));
        }
    }
    Ok(())
}

/// A little-endian number of up to eight bytes; what is missing is zero.
pub(super) fn number(bytes: &[u8], at: usize, width: usize) -> u64 {
    let bytes = bytes.iter().skip(at).take(width);
    bytes.enumerate().fold(0, |sum, (k, byte)| sum | u64::from(*byte) << (8 * k.min(7)))
}
