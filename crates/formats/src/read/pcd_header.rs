use super::foreign::without_bom;
use crate::RigidPose;
use voxtile::FormatError;
use voxtile::scan::Pose;

type Result<T> = std::result::Result<T, FormatError>;

/// Encoding of the points.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    Binary,
    Compressed,
}

pub(super) struct Field {
    pub(super) name: String,
    /// Bytes per value: 1, 2, 4 or 8.
    pub(super) size: usize,
    /// `I`, `U` or `F`.
    pub(super) kind: u8,
    pub(super) count: usize,
    /// Byte offset of the field in a point.
    pub(super) offset: usize,
    /// Index of the field's first value in a point.
    pub(super) first_value: usize,
}

/// Header of a PCD file.
pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    pub(super) points: usize,
    pub(super) point_bytes: usize,
    pub(super) encoding: Encoding,
    /// The `VIEWPOINT` as written, or `None` if it is all zeros.
    pub(super) world_from_sensor: Result<Option<RigidPose>>,
    pub(super) data_at: usize,
    pub(super) data_line: u64,
}

/// Limit for the size of the header.
pub(super) const MAX_HEADER_BYTES: usize = 1 << 16;

/// Limit for the size of a point, which is read at once.
const MAX_POINT_BYTES: usize = 1 << 20;

const KEYS: [&str; 11] = [
    "VERSION",
    "FIELDS",
    "COLUMNS",
    "SIZE",
    "TYPE",
    "COUNT",
    "WIDTH",
    "HEIGHT",
    "VIEWPOINT",
    "POINTS",
    "DATA",
];

/// Returns whether a file starts like PCD: comments, then a known key, in any case.
pub(crate) fn is_start(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let is_comment = |line: &&str| line.is_empty() || (line.starts_with('#') && !is_magic(line));
    let first = text.split(['\n', '\r']).map(str::trim).find(|line| !is_comment(line)).unwrap_or_default();
    let mut words = first.split_ascii_whitespace();
    let key = words.next().unwrap_or_default().to_ascii_uppercase();
    is_magic(first)
        || matches!(key.as_str(), "FIELDS" | "COLUMNS") && words.clone().next().is_some()
        || key == "VERSION" && words.next().is_some_and(|number| number.parse::<f32>().is_ok())
}

fn is_magic(line: &str) -> bool {
    line.get(..6).is_some_and(|start| start.eq_ignore_ascii_case("# .PCD"))
}

impl Header {
    /// Parses the header at the start of a file.
    ///
    /// # Errors
    ///
    /// The header is invalid; the error gives the line.
    pub(super) fn parse(file: &[u8]) -> Result<Self> {
        let mut entries: Vec<(String, Vec<String>, u64)> = Vec::new();
        let (mut at, mut line_number) = (file.len() - without_bom(file).len(), 0);
        let end = line_end(file);
        loop {
            line_number += 1;
            let Some(length) = file[at..].iter().position(|&byte| byte == end) else {
                let reason = "the header has no DATA line: this is not a PCD file";
                return Err(FormatError::at_line(line_number, reason));
            };
            let line = String::from_utf8_lossy(&file[at..at + length]).into_owned();
            at += length + 1;
            let mut words = line.split_ascii_whitespace().map(str::to_owned);
            let Some(word) = words.next().filter(|key| !key.starts_with('#')) else { continue };
            let key = word.to_ascii_uppercase();
            if !KEYS.contains(&key.as_str()) {
                return Err(FormatError::at_line(
                    line_number,
                    format!("`{word:.40}` is not a key of a PCD header"),
                ));
            }
            let is_data = key == "DATA";
            entries.push((key, words.collect(), line_number));
            if is_data {
                break;
            }
        }
        Self::from_entries(&entries, at, line_number)
    }

    fn from_entries(entries: &[(String, Vec<String>, u64)], data_at: usize, data_line: u64) -> Result<Self> {
        let find =
            |key: &str| entries.iter().find(|(name, ..)| name == key).map(|(_, words, line)| (words, *line));
        let need = |key: &str| {
            find(key).ok_or_else(|| FormatError::at_line(data_line, format!("the header has no {key} line")))
        };
        let (names, _) = find("FIELDS")
            .or_else(|| find("COLUMNS"))
            .ok_or_else(|| FormatError::at_line(data_line, "the header has no FIELDS line"))?;
        let (sizes, sizes_line) = need("SIZE")?;
        let (kinds, kinds_line) = need("TYPE")?;
        let ones = vec!["1".to_owned(); names.len()];
        let (counts, counts_line) = find("COUNT").unwrap_or((&ones, data_line));
        for (key, words, line) in
            [("SIZE", sizes, sizes_line), ("TYPE", kinds, kinds_line), ("COUNT", counts, counts_line)]
        {
            if words.len() != names.len() {
                let reason = format!("{key} has {} entries for {} fields", words.len(), names.len());
                return Err(FormatError::at_line(line, reason));
            }
        }
        let mut fields: Vec<Field> = Vec::new();
        let (mut offset, mut first_value) = (0_usize, 0_usize);
        for (number, name) in names.iter().enumerate() {
            let size = parse(&sizes[number], sizes_line)?;
            let count: usize = parse(&counts[number], counts_line)?;
            let kind = kinds[number].as_bytes().first().copied().unwrap_or_default().to_ascii_uppercase();
            let is_known = matches!((kind, size), (b'I' | b'U', 1 | 2 | 4 | 8) | (b'F', 4 | 8));
            if !is_known || count > 1 << 16 {
                let reason = format!(
                    "field {name} has an unsupported combination of type {}, size {size} and count {count}",
                    kinds[number]
                );
                return Err(FormatError::at_line(sizes_line, reason));
            }
            fields.push(Field { name: name.clone(), size, kind, count, offset, first_value });
            (offset, first_value) = (offset + size * count, first_value + count);
            if offset > MAX_POINT_BYTES {
                let reason = format!("a point has more than {MAX_POINT_BYTES} bytes up to field {name}");
                return Err(FormatError::at_line(sizes_line, reason));
            }
        }
        let points = number_of_points(&find, data_line)?;
        let world_from_sensor = find("VIEWPOINT").map_or(Ok(None), |(words, line)| viewpoint(words, line));
        let (encoding, line) = need("DATA")?;
        let encoding = encoding.first().map(|word| word.to_ascii_lowercase());
        let encoding = match encoding.as_deref() {
            Some("ascii") => Encoding::Ascii,
            Some("binary") => Encoding::Binary,
            Some("binary_compressed") => Encoding::Compressed,
            other => {
                let reason = format!(
                    "DATA must be ascii, binary or binary_compressed, not {}",
                    other.unwrap_or_default()
                );
                return Err(FormatError::at_line(line, reason));
            }
        };
        Ok(Self { fields, points, point_bytes: offset, encoding, world_from_sensor, data_at, data_line })
    }
}

/// Returns the last byte of line ends: CR if the first line ends with CR alone, else LF.
fn line_end(file: &[u8]) -> u8 {
    let first = file.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
    match first.map(|at| (file[at], file.get(at + 1))) {
        Some((b'\r', after)) if after != Some(&b'\n') => b'\r',
        _ => b'\n',
    }
}

fn number_of_points<'a>(
    find: &impl Fn(&str) -> Option<(&'a Vec<String>, u64)>,
    data_line: u64,
) -> Result<usize> {
    let number = |key: &str| -> Result<Option<(usize, u64)>> {
        let Some((words, line)) = find(key) else { return Ok(None) };
        let word = words.first().ok_or_else(|| FormatError::at_line(line, format!("{key} has no number")))?;
        Ok(Some((parse(word, line)?, line)))
    };
    let size = match (number("WIDTH")?, number("HEIGHT")?) {
        (Some((width, _)), height) => width.checked_mul(height.map_or(1, |(height, _)| height)),
        (None, _) => None,
    };
    match (number("POINTS")?, size) {
        (Some((points, line)), Some(size)) if points != size => {
            Err(FormatError::at_line(line, format!("POINTS {points} is not WIDTH times HEIGHT, {size}")))
        }
        (Some((points, _)), _) => Ok(points),
        (None, Some(size)) => Ok(size),
        (None, None) => {
            Err(FormatError::at_line(data_line, "the header has neither POINTS nor WIDTH and HEIGHT"))
        }
    }
}

fn viewpoint(words: &[String], line: u64) -> Result<Option<RigidPose>> {
    let numbers = words.iter().map(|word| parse(word, line)).collect::<Result<Vec<f64>>>()?;
    if numbers.len() == 7 && numbers.iter().all(|number| *number == 0.0) {
        return Ok(None);
    }
    match numbers[..] {
        [x, y, z, qw, qx, qy, qz] if numbers.iter().all(|number| number.is_finite()) => {
            let pose = RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] };
            match Pose::of_quaternion(pose.position_m, pose.quaternion) {
                Ok(_) => Ok(Some(pose)),
                Err(reason) => Err(FormatError::at_line(line, format!("VIEWPOINT has {reason}"))),
            }
        }
        _ => Err(FormatError::at_line(line, "VIEWPOINT needs seven finite numbers: tx ty tz qw qx qy qz")),
    }
}

fn parse<N: std::str::FromStr>(word: &str, line: u64) -> Result<N> {
    word.parse().map_err(|_| FormatError::at_line(line, format!("`{word}` is not a valid number")))
}
