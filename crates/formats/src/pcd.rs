use super::lzf;
use super::pcd_header::{Encoding, Header, MAX_HEADER_BYTES};
use super::point_store::{PointRoom, PointStore};
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;
use voxtile::scan::Pose;
use voxtile::space::Point;
use voxtile::{Error, FormatError};
use voxtile_scratch::ScratchFile;

/// The points of a PCD file.
#[derive(Clone, Debug)]
pub struct PcdCloud {
    /// Points in metres, sensor frame; NaN where the sensor saw nothing.
    pub points: Vec<Point>,
    /// Intensities, from the field `intensity`, `i` or `reflectivity`.
    pub intensities: Option<Vec<f32>>,
    /// The `VIEWPOINT`.
    pub world_from_sensor: Pose,
}

/// Reads a PCD file (versions 0.5 to 0.7; `ascii`, `binary` or `binary_compressed`). Bytes after the last point are
/// ignored: PCL pads its files.
///
/// # Errors
///
/// An invalid header (with the line), points that are missing or not numbers.
pub fn read_pcd(file: &[u8]) -> Result<PcdCloud, FormatError> {
    let mut points = PointStore::default();
    match read(Cursor::new(file), file.len() as u64, &mut points) {
        Ok(world_from_sensor) => {
            let (points, intensities) = points.into_parts();
            Ok(PcdCloud { points, intensities, world_from_sensor })
        }
        Err(PcdError::Format(error)) => Err(error),
        Err(PcdError::Read(error)) => Err(FormatError::at_offset(0, error.to_string())),
        Err(PcdError::Store(error)) => Err(FormatError::at_offset(0, format!("{error:#}"))),
    }
}

/// The same from a file of any size; returns the `VIEWPOINT`.
pub(super) fn read_pcd_file(path: &Path, points: &mut PointStore) -> voxtile::Result<Pose> {
    if is_special(path) {
        let reason = "is a FIFO, a socket or a device, not a file: save what it gives to a file";
        return Err(Error::argument(path.display().to_string(), reason));
    }
    let open = || {
        let file = File::open(path)?;
        let bytes = file.metadata()?.len();
        Ok((BufReader::with_capacity(1 << 16, file), bytes))
    };
    let (input, bytes) = open().map_err(|error| Error::io(path, "read", error))?;
    read(input, bytes, points).map_err(|error| match error {
        PcdError::Format(error) => error.in_input(path),
        PcdError::Read(error) => Error::io(path, "read", error),
        PcdError::Store(error) => error,
    })
}

/// Whether a path is neither a file nor a folder: opening it may wait for ever, and its bytes come once.
pub(super) fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir())
}

/// Why a file cannot be read.
enum PcdError {
    Format(FormatError),
    Read(io::Error),
    /// The points cannot be stored.
    Store(Error),
}

impl From<FormatError> for PcdError {
    fn from(error: FormatError) -> Self {
        Self::Format(error)
    }
}

impl From<io::Error> for PcdError {
    fn from(error: io::Error) -> Self {
        Self::Read(error)
    }
}

impl From<Error> for PcdError {
    fn from(error: Error) -> Self {
        Self::Store(error)
    }
}

type Result<T, E = PcdError> = std::result::Result<T, E>;

fn read(mut input: impl BufRead + Seek, file_bytes: u64, points: &mut PointStore) -> Result<Pose> {
    let mut start = Vec::new();
    (&mut input).take(MAX_HEADER_BYTES as u64).read_to_end(&mut start)?;
    let header = Header::parse(&start)?;
    drop(start);
    input.seek(SeekFrom::Start(header.data_at as u64))?;
    let columns = Columns::of(&header)?;
    points.begin(columns.intensity.is_some());
    match header.encoding {
        Encoding::Ascii => read_ascii(&header, &columns, input, points)?,
        Encoding::Binary => read_binary(&header, &columns, input, file_bytes, points)?,
        Encoding::Compressed => read_compressed(&header, &columns, input, file_bytes, points)?,
    }
    Ok(header.world_from_sensor)
}

/// Which fields are read.
struct Columns {
    xyz: [usize; 3],
    intensity: Option<usize>,
}

const INTENSITY_NAMES: [&str; 4] = ["intensity", "Intensity", "i", "reflectivity"];

impl Columns {
    fn of(header: &Header) -> Result<Self, FormatError> {
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

/// A longer line is an error.
const MAX_LINE_BYTES: u64 = 1 << 20;

fn read_ascii(
    header: &Header,
    columns: &Columns,
    mut input: impl BufRead,
    points: &mut PointStore,
) -> Result<()> {
    let mut number = header.data_line;
    let mut line = Vec::new();
    for done in 0..header.points {
        loop {
            line.clear();
            number += 1;
            let read = (&mut input).take(MAX_LINE_BYTES).read_until(b'\n', &mut line)?;
            if read == 0 {
                let reason = format!("the file ends after {done} of {} points", header.points);
                return Err(FormatError::at_line(header.data_line + done as u64, reason).into());
            }
            if read as u64 == MAX_LINE_BYTES {
                return Err(FormatError::at_line(number, "the line is too long for a PCD file").into());
            }
            if !line.trim_ascii().is_empty() {
                break;
            }
        }
        let text = String::from_utf8_lossy(&line);
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let value = |column: usize| -> Result<f64, FormatError> {
            let field = &header.fields[column];
            let word = words.get(field.first_value).ok_or_else(|| {
                FormatError::at_line(
                    number,
                    format!("{} values; field {} is missing", words.len(), field.name),
                )
            })?;
            // A number of a four-byte field is rounded to it, as in the binary encodings.
            let parsed = match (field.kind, field.size) {
                (b'F', 4) => word.parse::<f32>().map(f64::from),
                _ => word.parse(),
            };
            parsed.map_err(|_| FormatError::at_line(number, format!("`{word}` is not a number")))
        };
        let [x, y, z] = columns.xyz;
        let point = [value(x)?, value(y)?, value(z)?];
        let intensity = columns.intensity.map(value).transpose()?.unwrap_or_default();
        points.push(point, intensity as f32)?;
    }
    Ok(())
}

/// Bytes that are read at a time.
const BYTES_AT_A_TIME: usize = 1 << 16;

/// Bytes of one field that are read at a time.
const MAX_FIELD_BYTES: usize = 1 << 20;

/// Points one after the other.
fn read_binary(
    header: &Header,
    columns: &Columns,
    mut input: impl Read,
    file_bytes: u64,
    points: &mut PointStore,
) -> Result<()> {
    let there = file_bytes.saturating_sub(header.data_at as u64);
    let wanted = (header.point_bytes as u64).checked_mul(header.points as u64);
    if wanted.is_none_or(|wanted| wanted > there) {
        let points = there / (header.point_bytes as u64).max(1);
        let reason = format!("the file ends after {points} of {} points", header.points);
        return Err(FormatError::at_offset(file_bytes, reason).into());
    }
    points.reserve(header.points);
    let at_a_time = (BYTES_AT_A_TIME / header.point_bytes.max(1)).max(1);
    let mut bytes = Vec::new();
    for first in (0..header.points).step_by(at_a_time) {
        bytes.resize(at_a_time.min(header.points - first) * header.point_bytes, 0);
        input.read_exact(&mut bytes)?;
        for record in bytes.chunks_exact(header.point_bytes) {
            let value = |column: usize| {
                let field = &header.fields[column];
                number(field.kind, &record[field.offset..field.offset + field.size])
            };
            let intensity = columns.intensity.map_or(0.0, value);
            points.push(columns.xyz.map(value), intensity as f32)?;
        }
    }
    Ok(())
}

/// Compressed size, uncompressed size, then the compressed fields one after the other.
fn read_compressed(
    header: &Header,
    columns: &Columns,
    mut input: impl Read,
    file_bytes: u64,
    points: &mut PointStore,
) -> Result<()> {
    let wrong = |reason: String| PcdError::Format(FormatError::at_offset(header.data_at as u64, reason));
    let there = file_bytes.saturating_sub(header.data_at as u64);
    let mut sizes = [0; 8];
    if there < sizes.len() as u64 {
        return Err(wrong("the file ends before the sizes of the packed data".into()));
    }
    input.read_exact(&mut sizes)?;
    let there = there - sizes.len() as u64;
    let size = |at: usize| u64::from(u32::from_le_bytes(std::array::from_fn(|k| sizes[at + k])));
    let wanted = (header.point_bytes as u64).saturating_mul(header.points as u64);
    let (packed, unpacked) = (size(0), size(4));
    if unpacked != wanted {
        return Err(wrong(format!(
            "{unpacked} bytes unpacked for {} points of {}",
            header.points, header.point_bytes
        )));
    }
    if packed > there {
        return Err(wrong(format!("{packed} bytes of packed data announced, {there} there")));
    }
    if wanted == 0 {
        return Ok(());
    }
    if !lzf::is_possible(packed, wanted) {
        return Err(wrong("the packed data is damaged".into()));
    }
    let mut fields = Fields::new(points.room(), wanted)?;
    let is_whole = match &mut fields {
        Fields::InMemory(bytes) => lzf::decompress(&mut input.take(packed), wanted, bytes)?,
        Fields::InFile(file) => lzf::decompress(&mut input.take(packed), wanted, file)?,
    };
    if !is_whole {
        return Err(wrong("the packed data is damaged".into()));
    }
    points.reserve(header.points);
    let wanted: Vec<usize> = columns.xyz.into_iter().chain(columns.intensity).collect();
    let strides = wanted.iter().map(|&column| header.fields[column].size * header.fields[column].count);
    let at_a_time = (MAX_FIELD_BYTES / strides.max().unwrap_or(1)).clamp(1, BYTES_AT_A_TIME / 8);
    let mut values = vec![Vec::new(); wanted.len()];
    for first in (0..header.points).step_by(at_a_time) {
        let count = at_a_time.min(header.points - first);
        for (values, &column) in values.iter_mut().zip(&wanted) {
            fields.read(header, column, first, count, values)?;
        }
        for k in 0..count {
            let intensity = values.get(3).map_or(0.0, |values| values[k]);
            points.push(std::array::from_fn(|axis| values[axis][k]), intensity as f32)?;
        }
    }
    Ok(())
}

/// The decompressed values, field after field.
enum Fields {
    InMemory(Vec<u8>),
    InFile(ScratchFile),
}

impl Fields {
    fn new(room: &PointRoom, bytes: u64) -> voxtile::Result<Self> {
        match usize::try_from(bytes) {
            // It grows as data arrives.
            Ok(bytes) if !room.is_too_much(bytes) => Ok(Self::InMemory(Vec::new())),
            _ => room.file().map(Self::InFile),
        }
    }

    /// The values of a field of some points.
    fn read(
        &mut self,
        header: &Header,
        column: usize,
        first: usize,
        count: usize,
        values: &mut Vec<f64>,
    ) -> io::Result<()> {
        let field = &header.fields[column];
        let stride = field.size * field.count;
        let at = field.offset * header.points + first * stride;
        let bytes = count * stride;
        let bytes = match self {
            Self::InMemory(all) => all.get(at..at + bytes).ok_or(io::ErrorKind::UnexpectedEof)?,
            Self::InFile(file) => file.bytes(at as u64, bytes)?,
        };
        values.clear();
        values.extend(bytes.chunks_exact(stride).map(|point| number(field.kind, &point[..field.size])));
        Ok(())
    }
}

/// A little-endian number.
fn number(kind: u8, bytes: &[u8]) -> f64 {
    // Zero-extended to eight bytes.
    let mut wide = [0; 8];
    wide[..bytes.len()].copy_from_slice(bytes);
    let unsigned = u64::from_le_bytes(wide);
    let unused_bits = 64 - 8 * bytes.len();
    match (kind, bytes.len()) {
        (b'F', 4) => f64::from(f32::from_bits(unsigned as u32)),
        (b'F', _) => f64::from_bits(unsigned),
        (b'U', _) => unsigned as f64,
        _ => ((unsigned << unused_bits) as i64 >> unused_bits) as f64,
    }
}
