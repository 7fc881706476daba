use super::lzf;
use super::poses::unit_quaternion;
use crate::error::FormatError;
use crate::space::Point;
use nalgebra::{Isometry3, Quaternion, Translation3};

/// The points of a PCD file.
#[derive(Clone, Debug)]
pub struct PcdCloud {
    /// Points in metres, sensor frame; NaN where the sensor saw nothing.
    pub points: Vec<Point>,
    /// Intensities, from the field `intensity`, `i` or `reflectivity`.
    pub intensities: Option<Vec<f32>>,
    /// The `VIEWPOINT`.
    pub world_from_sensor: Isometry3<f64>,
}

type Result<T> = std::result::Result<T, FormatError>;

/// Reads a PCD file (versions 0.5 to 0.7; `ascii`, `binary` or `binary_compressed`). What follows the last point is
/// left unread: PCL pads its files.
///
/// # Errors
///
/// A header that is not as it should be (with the line), points that are missing or are no numbers.
pub fn read_pcd(file: &[u8]) -> Result<PcdCloud> {
    let header = Header::parse(file)?;
    let data = &file[header.data_at..];
    let columns = Columns::of(&header)?;
    let values = match header.encoding {
        Encoding::Ascii => return header.read_ascii(data, &columns),
        Encoding::Binary => Values { bytes: data, header: &header, by_column: false },
        Encoding::Compressed => {
            let unpacked = header.unpack(data)?;
            return Values { bytes: &unpacked, header: &header, by_column: true }.read(&columns);
        }
    };
    values.read(&columns)
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Binary,
    Compressed,
}

struct Field {
    name: String,
    /// Bytes of one value: 1, 2, 4 or 8.
    size: usize,
    /// `I`, `U` or `F`.
    kind: u8,
    count: usize,
    /// Bytes before this field in a point.
    offset: usize,
    /// Values before this field in a point.
    first_value: usize,
}

struct Header {
    fields: Vec<Field>,
    points: usize,
    point_bytes: usize,
    encoding: Encoding,
    world_from_sensor: Isometry3<f64>,
    data_at: usize,
    data_line: u64,
}

/// Which fields are read.
struct Columns {
    xyz: [usize; 3],
    intensity: Option<usize>,
}

const INTENSITY_NAMES: [&str; 4] = ["intensity", "Intensity", "i", "reflectivity"];

impl Header {
    fn parse(file: &[u8]) -> Result<Self> {
        let mut entries: Vec<(String, Vec<String>, u64)> = Vec::new();
        let (mut at, mut line_number) = (0, 0);
        loop {
            line_number += 1;
            let Some(length) = file[at..].iter().position(|&byte| byte == b'\n') else {
                let reason = "the header ends without a line DATA; this is no PCD file";
                return Err(FormatError::at_line(line_number, reason));
            };
            let line = String::from_utf8_lossy(&file[at..at + length]).into_owned();
            at += length + 1;
            let mut words = line.split_ascii_whitespace().map(str::to_owned);
            let Some(key) = words.next().filter(|key| !key.starts_with('#')) else { continue };
            if !KEYS.contains(&key.as_str()) {
                return Err(FormatError::at_line(line_number, format!("`{key}` is no key of a PCD header")));
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
            find(key).ok_or_else(|| FormatError::at_line(data_line, format!("the header has no line {key}")))
        };
        let (names, _) = find("FIELDS")
            .or_else(|| find("COLUMNS"))
            .ok_or_else(|| FormatError::at_line(data_line, "the header has no line FIELDS"))?;
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
                let reason =
                    format!("field {name} of type {} size {size} count {count} is not known", kinds[number]);
                return Err(FormatError::at_line(sizes_line, reason));
            }
            fields.push(Field { name: name.clone(), size, kind, count, offset, first_value });
            (offset, first_value) = (offset + size * count, first_value + count);
        }
        let points = number_of_points(&find, data_line)?;
        let world_from_sensor = match find("VIEWPOINT") {
            None => Isometry3::identity(),
            Some((words, line)) => viewpoint(words, line)?,
        };
        let (encoding, line) = need("DATA")?;
        let encoding = match encoding.first().map(String::as_str) {
            Some("ascii") => Encoding::Ascii,
            Some("binary") => Encoding::Binary,
            Some("binary_compressed") => Encoding::Compressed,
            other => {
                let reason =
                    format!("DATA {} is not ascii, binary or binary_compressed", other.unwrap_or_default());
                return Err(FormatError::at_line(line, reason));
            }
        };
        Ok(Self { fields, points, point_bytes: offset, encoding, world_from_sensor, data_at, data_line })
    }

    fn read_ascii(&self, data: &[u8], columns: &Columns) -> Result<PcdCloud> {
        let mut cloud = self.empty_cloud(columns);
        let mut lines = (self.data_line + 1..).zip(data.split(|&byte| byte == b'\n'));
        for done in 0..self.points {
            let (number, line) = loop {
                let Some((number, line)) = lines.next() else {
                    let reason = format!("the file ends after {done} of {} points", self.points);
                    return Err(FormatError::at_line(self.data_line + done as u64, reason));
                };
                if !line.trim_ascii().is_empty() {
                    break (number, line);
                }
            };
            let line = String::from_utf8_lossy(line);
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let value = |column: usize| -> Result<f64> {
                let field = &self.fields[column];
                let word = words.get(field.first_value).ok_or_else(|| {
                    FormatError::at_line(
                        number,
                        format!("{} values; field {} is missing", words.len(), field.name),
                    )
                })?;
                // A number of a four-byte field is one of its values, as in the binary encodings.
                let parsed = match (field.kind, field.size) {
                    (b'F', 4) => word.parse::<f32>().map(f64::from),
                    _ => word.parse(),
                };
                parsed.map_err(|_| FormatError::at_line(number, format!("`{word}` is not a number")))
            };
            let [x, y, z] = columns.xyz;
            cloud.points.push([value(x)?, value(y)?, value(z)?]);
            if let (Some(column), Some(intensities)) = (columns.intensity, &mut cloud.intensities) {
                intensities.push(value(column)? as f32);
            }
        }
        Ok(cloud)
    }

    /// Unpacks `binary_compressed`: packed size, unpacked size, then the fields one after the other.
    fn unpack(&self, data: &[u8]) -> Result<Vec<u8>> {
        let wrong = |reason: String| FormatError::at_offset(self.data_at as u64, reason);
        let (sizes, packed) = data
            .split_at_checked(8)
            .ok_or_else(|| wrong("the file ends before the sizes of the packed data".into()))?;
        let size = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| sizes[at + k])) as usize;
        let wanted = self.point_bytes.saturating_mul(self.points);
        if size(4) != wanted {
            return Err(wrong(format!(
                "{} bytes unpacked for {} points of {}",
                size(4),
                self.points,
                self.point_bytes
            )));
        }
        if size(0) > packed.len() {
            return Err(wrong(format!("{} bytes of packed data announced, {} there", size(0), packed.len())));
        }
        if wanted == 0 {
            return Ok(Vec::new());
        }
        lzf::unpack(&packed[..size(0)], wanted).ok_or_else(|| wrong("the packed data is damaged".into()))
    }

    fn empty_cloud(&self, columns: &Columns) -> PcdCloud {
        let intensities = columns.intensity.map(|_| Vec::new());
        PcdCloud { points: Vec::new(), intensities, world_from_sensor: self.world_from_sensor }
    }
}

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

impl Columns {
    fn of(header: &Header) -> Result<Self> {
        let find = |name: &str| header.fields.iter().position(|field| field.name == name && field.count > 0);
        let need = |name: &str| {
            find(name).ok_or_else(|| {
                FormatError::at_line(header.data_line, format!("the points have no field {name}"))
            })
        };
        let intensity = INTENSITY_NAMES.iter().find_map(|name| find(name));
        Ok(Self { xyz: [need("x")?, need("y")?, need("z")?], intensity })
    }
}

/// Binary values: point after point, or, when packed, field after field.
struct Values<'a> {
    bytes: &'a [u8],
    header: &'a Header,
    by_column: bool,
}

impl Values<'_> {
    fn read(&self, columns: &Columns) -> Result<PcdCloud> {
        let header = self.header;
        let wanted = header.point_bytes.checked_mul(header.points);
        if wanted.is_none_or(|wanted| wanted > self.bytes.len()) {
            let there = self.bytes.len() / header.point_bytes.max(1);
            let reason = format!("the file ends after {there} of {} points", header.points);
            return Err(FormatError::at_offset((header.data_at + self.bytes.len()) as u64, reason));
        }
        let mut cloud = header.empty_cloud(columns);
        cloud.points.reserve_exact(header.points);
        for point in 0..header.points {
            cloud.points.push(columns.xyz.map(|column| self.value(point, column)));
            if let (Some(column), Some(intensities)) = (columns.intensity, &mut cloud.intensities) {
                intensities.push(self.value(point, column) as f32);
            }
        }
        Ok(cloud)
    }

    fn value(&self, point: usize, column: usize) -> f64 {
        let field = &self.header.fields[column];
        let at = if self.by_column {
            field.offset * self.header.points + point * field.size * field.count
        } else {
            point * self.header.point_bytes + field.offset
        };
        let bytes = &self.bytes[at..at + field.size];
        // Little-endian, widened to eight bytes.
        let mut wide = [0; 8];
        wide[..field.size].copy_from_slice(bytes);
        let unsigned = u64::from_le_bytes(wide);
        let unused_bits = 64 - 8 * field.size;
        match (field.kind, field.size) {
            (b'F', 4) => f64::from(f32::from_bits(unsigned as u32)),
            (b'F', _) => f64::from_bits(unsigned),
            (b'U', _) => unsigned as f64,
            _ => ((unsigned << unused_bits) as i64 >> unused_bits) as f64,
        }
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

fn viewpoint(words: &[String], line: u64) -> Result<Isometry3<f64>> {
    let numbers = words.iter().map(|word| parse(word, line)).collect::<Result<Vec<f64>>>()?;
    match numbers[..] {
        [x, y, z, qw, qx, qy, qz] if numbers.iter().all(|number| number.is_finite()) => {
            let rotation = unit_quaternion(Quaternion::new(qw, qx, qy, qz))
                .map_err(|reason| FormatError::at_line(line, format!("VIEWPOINT has {reason}")))?;
            Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
        }
        _ => Err(FormatError::at_line(line, "VIEWPOINT needs seven finite numbers: tx ty tz qw qx qy qz")),
    }
}

fn parse<N: std::str::FromStr>(word: &str, line: u64) -> Result<N> {
    word.parse().map_err(|_| FormatError::at_line(line, format!("`{word}` is not a number that fits here")))
}
