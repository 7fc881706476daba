use super::attribute_columns::{AttributeColumns, AttributeValues, ColourColumns};
use super::columns::Meaning;
use super::input_file::open_input;
use super::lines::{Extent, RawLines};
use super::lzf;
use super::one::{Points, Visit};
use super::pcd_header::{Encoding, Field, Header, MAX_HEADER_BYTES};
use super::regular::check_regular;
use super::scalar::Scalar;
use super::skipped_rows::SkippedRows;
use super::text_line;
use crate::scans::SensorScan;
use crate::{Budget, CloudHead, CloudPoint, RigidPose};
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use voxtile::scan::{AttributeSet, PointAttributes, Pose};
use voxtile::{Error, FormatError, Result};
use voxtile_scratch::ScratchFile;

/// Limit for the length of a line.
const MAX_LINE_BYTES: usize = 1 << 20;
/// Size of reads.
const BYTES_AT_A_TIME: usize = 1 << 16;
/// Limit for the bytes of one field to read at once.
const MAX_FIELD_BYTES: usize = 1 << 20;

/// Reads a PCD file (versions 0.5 to 0.7; `ascii`, `binary` or `binary_compressed`) from memory. Bytes after the last
/// point are ignored, because PCL pads its files. The pose is the `VIEWPOINT`. Points without a return are NaN.
///
/// # Errors
///
/// The header is invalid (the error gives the line), or points are missing or not numbers.
pub fn read_pcd(file: &[u8]) -> Result<SensorScan> {
    let (path, head) = (Path::new("PCD"), CloudHead::default());
    let options = PcdOptions { is_pose_needed: true, ..PcdOptions::default() };
    let (head, mut pcd) = begin(path, head, Cursor::new(file), file.len() as u64, &options)?;
    let (mut points_in_sensor, mut intensities) = (Vec::new(), head.has_intensities.then(Vec::new));
    pcd.visit(&mut |point| {
        points_in_sensor.push(point.position_m);
        intensities.iter_mut().for_each(|intensities| intensities.push(point.intensity));
        Ok(())
    })?;
    let RigidPose { position_m, quaternion } = head.world_from_sensor.unwrap_or(RigidPose::IDENTITY);
    let world_from_sensor = Pose::from_quaternion(position_m, quaternion)?;
    let attributes = PointAttributes::default();
    Ok(SensorScan { name: head.name, points_in_sensor, intensities, attributes, world_from_sensor })
}

/// How a PCD file is read.
#[derive(Clone, Debug, Default)]
pub(super) struct PcdOptions {
    /// Memory budget for decompressed data.
    pub(super) budget: Budget,
    pub(super) attributes: AttributeSet,
    /// Whether an invalid `VIEWPOINT` is an error.
    pub(super) is_pose_needed: bool,
}

/// Opens a PCD file and reads its header.
pub(super) fn open(
    path: &Path,
    head: CloudHead,
    options: &PcdOptions,
) -> Result<(CloudHead, Box<dyn Points>)> {
    check_regular(path)?;
    let file = open_input(path)?;
    let bytes = file.metadata().map_err(|error| Error::io(path, "read", error))?.len();
    if bytes == 0 {
        return Err(Error::argument(path.display().to_string(), "the file is empty"));
    }
    let input = BufReader::with_capacity(1 << 16, file);
    let (head, points) = begin(path, head, input, bytes, options)?;
    Ok((head, Box::new(points)))
}

/// Points of a PCD file.
struct PcdPoints<R> {
    path: PathBuf,
    header: Header,
    columns: Columns,
    /// Converts values to attributes.
    attributes: AttributeValues,
    input: R,
    file_bytes: u64,
    /// Memory budget for decompressed data.
    budget: Budget,
    skipped_rows: SkippedRows,
}

/// Reads the header and seeks to the points.
fn begin<R: BufRead + Seek>(
    path: &Path,
    mut head: CloudHead,
    mut input: R,
    file_bytes: u64,
    options: &PcdOptions,
) -> Result<(CloudHead, PcdPoints<R>)> {
    let cannot = |error| Error::io(path, "read", error);
    let mut start = Vec::new();
    (&mut input).take(MAX_HEADER_BYTES as u64).read_to_end(&mut start).map_err(cannot)?;
    let parsed =
        Header::parse(&start).and_then(|header| Ok((Columns::of(&header, options.attributes)?, header)));
    let (columns, mut header) = parsed.map_err(|error| error.in_input(path))?;
    input.seek(SeekFrom::Start(header.data_at as u64)).map_err(cannot)?;
    head.points = Some(header.points as u64);
    head.has_intensities = columns.meaning.intensity.is_some();
    head.attributes = columns.attributes.set();
    head.world_from_sensor = match std::mem::replace(&mut header.world_from_sensor, Ok(None)) {
        Err(error) if options.is_pose_needed => return Err(error.in_input(path)),
        pose => pose.unwrap_or_default(),
    };
    let attributes = columns.attributes.values(|at| header.fields.get(at).and_then(scalar_of));
    let (path, budget, skipped_rows) = (path.to_owned(), options.budget.clone(), SkippedRows::default());
    Ok((head, PcdPoints { path, header, columns, attributes, input, file_bytes, budget, skipped_rows }))
}

impl<R: BufRead + Seek + Send> Points for PcdPoints<R> {
    fn read(&mut self, visit: Visit<'_>) -> Result<()> {
        self.visit(visit)
    }

    fn remarks(&self) -> Vec<String> {
        let columns = self.columns.meaning.remark().into_iter();
        columns.chain(self.skipped_rows.remark()).chain(self.attributes.remarks()).collect()
    }
}

impl<R: BufRead> PcdPoints<R> {
    fn visit(&mut self, visit: Visit<'_>) -> Result<()> {
        match self.header.encoding {
            Encoding::Ascii => self.visit_ascii(visit),
            Encoding::Binary => self.visit_binary(visit),
            Encoding::Compressed => self.visit_compressed(visit),
        }
    }

    fn visit_ascii(&mut self, visit: Visit<'_>) -> Result<()> {
        let Self { path, header, columns, attributes, input, skipped_rows, .. } = self;
        let wrong = |line: u64, reason: String| FormatError::at_line(line, reason).in_input(path);
        let mut lines = RawLines::new(input, MAX_LINE_BYTES);
        let (mut number, mut visited) = (header.data_line, 0_u64);
        let last = columns.all().map(|column| &header.fields[column]).max_by_key(|field| field.first_value);
        for done in 0..header.points {
            loop {
                number += 1;
                match lines.next().map_err(|error| Error::io(path, "read", error))? {
                    None => {
                        let reason = format!("the file ends after {done} of {} points", header.points);
                        return Err(wrong(header.data_line + done as u64, reason));
                    }
                    Some(Extent::Start) => {
                        return Err(wrong(number, "the line is too long for a PCD file".into()));
                    }
                    Some(Extent::Whole) if !lines.line().trim_ascii().is_empty() => break,
                    Some(Extent::Whole) => {}
                }
            }
            let text = String::from_utf8_lossy(lines.line());
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            // A row with too few values is damaged. A word in place of a number is an unknown value.
            if let Some(field) = last.filter(|field| words.len() <= field.first_value) {
                return Err(wrong(
                    number,
                    format!("{} values; field {} is missing", words.len(), field.name),
                ));
            }
            let value = |column: usize| {
                let field = &header.fields[column];
                let word = words.get(field.first_value).copied().unwrap_or_default();
                // Numbers of four-byte fields are rounded to `f32`, as in the binary encodings.
                let parsed = match (field.kind, field.size) {
                    (b'F', 4) => word.parse::<f32>().map(f64::from),
                    _ => word.parse(),
                };
                let other =
                    |_| text_line::number(word).ok_or_else(|| format!("`{word:.40}` is not a number"));
                parsed.or_else(other)
            };
            match columns.point(value) {
                Ok(mut point) => {
                    visited += 1;
                    // An attribute that is not a number is unknown.
                    let known = |column: usize| value(column).unwrap_or(f64::NAN);
                    let word = |column: usize| {
                        let field = header.fields.get(column)?;
                        packed_bits(words.get(field.first_value)?, field.kind)
                    };
                    columns.attributes.set_in(&mut point, attributes, known, word);
                    visit(point)?;
                }
                Err(reason) => skipped_rows.add(number, reason),
            }
        }
        match skipped_rows.error() {
            Some(error) if visited == 0 => Err(error.in_input(path)),
            _ => Ok(()),
        }
    }

    /// Reads points stored point by point.
    fn visit_binary(&mut self, visit: Visit<'_>) -> Result<()> {
        let Self { path, header, columns, attributes, input, file_bytes, .. } = self;
        let there = file_bytes.saturating_sub(header.data_at as u64);
        let wanted = (header.point_bytes as u64).checked_mul(header.points as u64);
        if wanted.is_none_or(|wanted| wanted > there) {
            let points = there / (header.point_bytes as u64).max(1);
            let reason = format!("the file ends after {points} of {} points", header.points);
            return Err(FormatError::at_offset(*file_bytes, reason).in_input(path));
        }
        let at_a_time = (BYTES_AT_A_TIME / header.point_bytes.max(1)).max(1);
        let mut bytes = Vec::new();
        for first in (0..header.points).step_by(at_a_time) {
            bytes.resize(at_a_time.min(header.points - first) * header.point_bytes, 0);
            input.read_exact(&mut bytes).map_err(|error| Error::io(path, "read", error))?;
            for record in bytes.chunks_exact(header.point_bytes) {
                let read = |column: usize, kind: u8| {
                    let field = &header.fields[column];
                    number(kind, &record[field.offset..field.offset + field.size])
                };
                let value = |column: usize| read(column, header.fields[column].kind);
                let bits = |column: usize| Some(read(column, b'U') as u32);
                let mut point =
                    columns.point_of(columns.meaning.xyz.map(value), columns.meaning.intensity.map(value));
                columns.attributes.set_in(&mut point, attributes, value, bits);
                visit(point)?;
            }
        }
        Ok(())
    }

    /// Reads compressed points: the compressed size, the uncompressed size, then the fields one after another.
    fn visit_compressed(&mut self, visit: Visit<'_>) -> Result<()> {
        let Self { path, header, columns, attributes, input, file_bytes, budget, .. } = self;
        let cannot = |error| Error::io(path, "read", error);
        let wrong = |reason: String| FormatError::at_offset(header.data_at as u64, reason).in_input(path);
        let there = file_bytes.saturating_sub(header.data_at as u64);
        let mut sizes = [0; 8];
        if there < sizes.len() as u64 {
            return Err(wrong("the file ends before the sizes of the compressed data".into()));
        }
        input.read_exact(&mut sizes).map_err(cannot)?;
        let there = there - sizes.len() as u64;
        let size = |at: usize| u64::from(u32::from_le_bytes(std::array::from_fn(|k| sizes[at + k])));
        let wanted = (header.point_bytes as u64).saturating_mul(header.points as u64);
        let (packed, unpacked) = (size(0), size(4));
        if unpacked != wanted {
            return Err(wrong(format!(
                "the uncompressed size is {unpacked} bytes for {} points of {}",
                header.points, header.point_bytes
            )));
        }
        if packed > there {
            return Err(wrong(format!(
                "{packed} bytes of compressed data are announced, but there are {there}"
            )));
        }
        if wanted == 0 {
            return Ok(());
        }
        if !lzf::is_possible(packed, wanted) {
            return Err(wrong("the compressed data is damaged".into()));
        }
        let mut fields = Fields::new(budget, wanted)?;
        let is_whole = match &mut fields {
            Fields::InMemory(bytes) => lzf::decompress(&mut (&mut *input).take(packed), wanted, bytes),
            Fields::InFile(file) => lzf::decompress(&mut (&mut *input).take(packed), wanted, file),
        };
        if !is_whole.map_err(cannot)? {
            return Err(wrong("the compressed data is damaged".into()));
        }
        let wanted: Vec<usize> = columns.all().chain(columns.attributes.all()).collect();
        let strides = wanted.iter().map(|&column| header.fields[column].size * header.fields[column].count);
        let at_a_time = (MAX_FIELD_BYTES / strides.max().unwrap_or(1)).clamp(1, BYTES_AT_A_TIME / 8);
        let mut values = vec![Vec::new(); wanted.len()];
        for first in (0..header.points).step_by(at_a_time) {
            let count = at_a_time.min(header.points - first);
            for (values, &column) in values.iter_mut().zip(&wanted) {
                let kind = columns.kind(header, column);
                fields.read(header, column, kind, first, count, values).map_err(cannot)?;
            }
            for k in 0..count {
                let value = |column: usize| {
                    let values = wanted.iter().position(|at| *at == column).and_then(|at| values.get(at));
                    values.and_then(|values| values.get(k)).copied().unwrap_or(f64::NAN)
                };
                let intensity = columns.meaning.intensity.map(|_| values[3][k]);
                let mut point = columns.point_of(std::array::from_fn(|axis| values[axis][k]), intensity);
                let bits = |column: usize| Some(value(column) as u32);
                columns.attributes.set_in(&mut point, attributes, value, bits);
                visit(point)?;
            }
        }
        Ok(())
    }
}

/// Fields to read.
struct Columns {
    meaning: Meaning,
    attributes: AttributeColumns,
}

const INTENSITY_NAMES: [&str; 4] = ["intensity", "Intensity", "i", "reflectivity"];

impl Columns {
    fn of(header: &Header, wanted: AttributeSet) -> std::result::Result<Self, FormatError> {
        let meaning = Self::meaning_of(header)?;
        // Fields without values are not there.
        let names = header.fields.iter().map(|field| if field.count > 0 { field.name.as_str() } else { "" });
        let is_packed = |at: usize| header.fields.get(at).is_some_and(|field| field.size == 4);
        Ok(Self { meaning, attributes: AttributeColumns::of(names, wanted, is_packed) })
    }

    fn meaning_of(header: &Header) -> std::result::Result<Meaning, FormatError> {
        let find = |name: &str| header.fields.iter().position(|field| field.name == name && field.count > 0);
        if let (Some(x), Some(y), Some(z)) = (find("x"), find("y"), find("z")) {
            let mut meaning = Meaning::of_metres([x, y, z]);
            meaning.intensity = INTENSITY_NAMES.iter().find_map(|name| find(name));
            return Ok(meaning);
        }
        // Find the fields as columns of text tables are found: in upper or lower case, with units.
        let names: Vec<String> = header.fields.iter().map(|field| field.name.clone()).collect();
        let meaning = Meaning::of(&names, |_| false);
        let meaning = meaning.map_err(|reason| FormatError::at_line(header.data_line, reason))?;
        let is_there = |meaning: &Meaning| meaning.xyz.iter().all(|at| header.fields[*at].count > 0);
        let Some(mut meaning) = meaning.filter(is_there) else {
            let axes = ["x", "y", "z"].into_iter().filter(|axis| find(axis).is_none());
            let missing = axes.collect::<Vec<_>>().join(", ");
            let names = names.join(" ");
            let reason = format!("the points have no field {missing}; fields: `{names:.200}`");
            return Err(FormatError::at_line(header.data_line, reason));
        };
        meaning.intensity = meaning.intensity.filter(|at| header.fields[*at].count > 0);
        Ok(meaning)
    }

    /// Returns the type to read a field as. A packed colour is read as bits, because as a float it may be NaN.
    fn kind(&self, header: &Header, column: usize) -> u8 {
        match self.attributes.colour {
            Some(ColourColumns::Packed(at)) if at == column => b'U',
            _ => header.fields[column].kind,
        }
    }

    /// Returns the fields to read except attributes: x, y, z, and the intensity if there is one.
    fn all(&self) -> impl Iterator<Item = usize> {
        self.meaning.xyz.into_iter().chain(self.meaning.intensity)
    }

    fn point<E>(
        &self,
        value: impl Fn(usize) -> std::result::Result<f64, E>,
    ) -> std::result::Result<CloudPoint, E> {
        let [x, y, z] = self.meaning.xyz;
        let intensity = self.meaning.intensity.map(&value).transpose()?;
        Ok(self.point_of([value(x)?, value(y)?, value(z)?], intensity))
    }

    /// Creates a point from its values. The point counts as a return even if its values are NaN.
    fn point_of(&self, [x, y, z]: [f64; 3], intensity: Option<f64>) -> CloudPoint {
        let [in_x, in_y, in_z] = self.meaning.units;
        let position_m = [in_x.metres(x), in_y.metres(y), in_z.metres(z)];
        CloudPoint { intensity: intensity.unwrap_or_default() as f32, ..CloudPoint::hit(position_m) }
    }
}

/// Decompressed values, stored field by field.
enum Fields {
    InMemory(Vec<u8>),
    InFile(ScratchFile),
}

impl Fields {
    fn new(budget: &Budget, bytes: u64) -> Result<Self> {
        match bytes > budget.bytes as u64 {
            true => budget.scratch_file().map(Self::InFile),
            // Reserve nothing in advance: the buffer grows as data arrives.
            false => Ok(Self::InMemory(Vec::new())),
        }
    }

    /// Reads the values of one field for a range of points.
    fn read(
        &mut self,
        header: &Header,
        column: usize,
        kind: u8,
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
        values.extend(bytes.chunks_exact(stride).map(|point| number(kind, &point[..field.size])));
        Ok(())
    }
}

/// Returns the type of a field.
fn scalar_of(field: &Field) -> Option<Scalar> {
    let letter = (field.kind as char).to_ascii_lowercase();
    Scalar::named(&format!("{letter}{}", 8 * field.size))
}

/// Parses a packed colour in a text. Programs write the bits as an integer, or as the float with these bits. Floats of
/// colours have an exponent or are NaN.
fn packed_bits(word: &str, kind: u8) -> Option<u32> {
    if kind != b'F' || word.bytes().all(|byte| byte.is_ascii_digit()) {
        return match word.parse::<i64>() {
            Ok(bits) => Some(bits as u32),
            Err(_) => word.parse::<f64>().ok().filter(|bits| *bits >= 0.0).map(|bits| bits as u32),
        };
    }
    // NaN has lost its bits.
    word.parse::<f32>().ok().filter(|value| !value.is_nan()).map(f32::to_bits)
}

/// Decodes a little-endian number.
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
