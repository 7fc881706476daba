use super::attribute_columns::{AttributeColumns, AttributeValues};
use super::bin_columns::{BinStart, Reading, Verdict};
use super::cloud::CloudHead;
use super::columns::{Clock, Meaning};
use super::input_file::open_input;
use super::label_file::LabelFile;
use super::one::{Points, Visit};
use super::scalar::Scalar;
use crate::read_options::ReadOptions;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

const KITTI: [&str; 4] = ["x", "y", "z", "intensity"];
const NUSCENES: [&str; 5] = ["x", "y", "z", "intensity", "ring"];
/// Number of bytes used to guess the columns: a whole number of points of three to eight floats or doubles.
const GLANCE_BYTES: u64 = 3 * 840 * 8;
/// Minimum number of points from which the columns can be concluded.
const FEW_POINTS: usize = 16;
/// Limit well above the number of columns of any sensor.
const MAX_FIELDS: usize = 256;

/// Points of a headerless file of numbers.
struct BinPoints {
    path: PathBuf,
    input: BufReader<File>,
    meaning: Meaning,
    clock: Clock,
    attributes: AttributeColumns,
    /// Converts values to attributes.
    values: AttributeValues,
    /// Classes of the points in a file of their own.
    labels: Option<LabelFile>,
    columns: Columns,
    record: Vec<u8>,
    points: u64,
    remarks: Vec<String>,
}

/// Columns of a file: names, types and byte offsets in a point.
struct Columns {
    names: Vec<String>,
    places: Vec<(usize, Scalar)>,
    point_bytes: usize,
}

impl Columns {
    /// Parses names with optional types after a colon, such as `x:f64`.
    fn of(fields: &[String]) -> Self {
        let mut columns = Self { names: Vec::new(), places: Vec::new(), point_bytes: 0 };
        for field in fields {
            let typed = field.rsplit_once(':').and_then(|(name, kind)| Some((name, Scalar::named(kind)?)));
            let (name, kind) = typed.unwrap_or((field, Scalar::F32));
            columns.names.push(name.to_owned());
            columns.places.push((columns.point_bytes, kind));
            columns.point_bytes += kind.bytes();
        }
        columns
    }

    /// Returns the known columns of an interpretation: x y z, and intensity if there are four columns.
    fn of_reading(reading: Reading) -> Self {
        let mut names: Vec<String> =
            KITTI.iter().take(reading.columns).map(|name| (*name).to_owned()).collect();
        if reading.columns > KITTI.len() {
            names.truncate(3);
        }
        let unknown = names.len()..reading.columns;
        names.extend(unknown.map(|number| format!("column{}", number + 1)));
        let bytes = reading.kind.bytes();
        let places = (0..reading.columns).map(|number| (number * bytes, reading.kind)).collect();
        Self { names, places, point_bytes: reading.columns * bytes }
    }
}

/// Opens a headerless file of numbers. Its size must fit the named columns; if no columns are named, they are guessed
/// from the numbers.
pub(crate) fn open(
    path: &Path,
    mut head: CloudHead,
    options: &ReadOptions,
) -> Result<(CloudHead, Box<dyn Points>)> {
    let fail = |error| Error::io(path, "read", error);
    let mut file = open_input(path)?;
    let bytes = file.metadata().map_err(fail)?.len();
    let (columns, guess) = match &options.fields {
        Some(fields) => (Columns::of(fields), None),
        None => {
            let mut start = Vec::new();
            (&mut file).take(GLANCE_BYTES).read_to_end(&mut start).map_err(fail)?;
            std::io::Seek::rewind(&mut file).map_err(fail)?;
            let columns = guess(path, head.name.ends_with(".pcd.bin"), &start, bytes)?;
            let remark = describe(&columns);
            (columns, Some(remark))
        }
    };
    let list = columns.names.join(", ");
    if columns.names.len() > MAX_FIELDS {
        return Err(Error::argument(
            "fields",
            format!("{} names, but at most {MAX_FIELDS} are supported", columns.names.len()),
        ));
    }
    let meaning =
        Meaning::of(&columns.names, |at| columns.places.get(at).is_some_and(|(_, kind)| kind.is_integer()))
            .map_err(|reason| Error::argument("fields", reason))?
            .ok_or_else(|| Error::argument("fields", format!("`{list}` lacks x, y or z")))?;
    let point_bytes = columns.point_bytes as u64;
    if bytes % point_bytes != 0 {
        let kind =
            if columns.places.iter().all(|(_, kind)| *kind == Scalar::F32) { "floats" } else { "numbers" };
        let reason = format!(
            "{bytes} bytes are not a whole number of points of {} {kind} ({list}): give the correct columns with \
             `fields`, or check whether the file is truncated",
            columns.names.len()
        );
        return Err(FormatError::at_offset(bytes - bytes % point_bytes, reason).in_input(path));
    }
    head.points = Some(bytes / point_bytes);
    head.fields = columns.names.clone();
    head.has_intensities = meaning.intensity.is_some();
    head.has_times = meaning.time.is_some();
    let wanted = options.attributes_to_read();
    let attributes = AttributeColumns::of(columns.names.iter().map(String::as_str), wanted, |_| false);
    let labels = match wanted.classes && attributes.class.is_none() {
        true => LabelFile::open_for(path, bytes / point_bytes)?,
        false => None,
    };
    head.attributes = attributes.set();
    head.attributes.classes |= labels.is_some();
    let points = BinPoints {
        path: path.to_owned(),
        input: BufReader::with_capacity(1 << 16, file),
        meaning,
        clock: Clock::new(head.stamp_ns),
        attributes,
        values: attributes.values(|at| columns.places.get(at).map(|(_, kind)| *kind)),
        labels,
        record: vec![0; columns.point_bytes],
        columns,
        points: bytes / point_bytes,
        remarks: guess.into_iter().chain(meaning.remark()).collect(),
    };
    Ok((head, Box::new(points)))
}

/// Guesses the columns of a file: those of KITTI or nuScenes, unless the numbers contradict them.
fn guess(path: &Path, is_nuscenes: bool, start: &[u8], bytes: u64) -> Result<Columns> {
    let names = if is_nuscenes { &NUSCENES[..] } else { &KITTI[..] };
    let usual = Reading { kind: Scalar::F32, columns: names.len() };
    let wrong = |reason: String| FormatError::at_offset(0, reason).in_input(path);
    let is_whole = bytes.is_multiple_of(usual.point_bytes());
    if !is_nuscenes
        && is_whole
        && bytes.is_multiple_of(4 * NUSCENES.len() as u64)
        && looks_like_nuscenes(start)
    {
        let reason = format!(
            "its size fits {} floats per point ({}) and {}, and the last of {} are integers like the ring of a sensor: \
             give the columns with `fields` {} or {}",
            KITTI.len(),
            KITTI.join(", "),
            NUSCENES.len(),
            NUSCENES.len(),
            NUSCENES.join(","),
            KITTI.join(",")
        );
        return Err(wrong(reason));
    }
    match BinStart::new(start, bytes).judge(usual) {
        Verdict::Wrong(reason) => Err(wrong(reason.to_owned())),
        // The order of colour and time in 6 columns does not affect x, y and z.
        Verdict::Other(other) if matches!(other.columns, 3 | 4 | 6) => Ok(Columns::of_reading(other)),
        Verdict::Other(other) => Err(wrong(format!(
            "its numbers repeat every {} of {}, not every {} of float32: give its columns with `fields`, for instance \
             `fields` {}",
            other.columns,
            other.type_name(),
            usual.columns,
            example(other)
        ))),
        Verdict::Either(one, other) => Err(wrong(format!(
            "its numbers repeat every {} and every {} of {}: give its columns with `fields` {} or {}",
            one.columns,
            other.columns,
            one.type_name(),
            example(one),
            example(other)
        ))),
        Verdict::Doubtful(other) if is_whole => Err(wrong(format!(
            "read as {} columns of float32 ({}), its intensities are negative, and {} columns fit as well: give its \
             columns with `fields` {} or {}",
            usual.columns,
            names.join(", "),
            other.columns,
            names.join(","),
            example(other)
        ))),
        Verdict::Doubtful(_) | Verdict::Right => {
            Ok(Columns::of(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>()))
        }
    }
}

/// Suggests column names for an interpretation, for messages.
fn example(reading: Reading) -> String {
    let kind = if reading.kind == Scalar::F64 { ":f64" } else { "" };
    let names = NUSCENES.map(str::to_owned).into_iter().chain((6..).map(|number| format!("column{number}")));
    names.take(reading.columns).map(|name| name + kind).collect::<Vec<_>>().join(",")
}

/// Describes guessed columns to the user.
fn describe(columns: &Columns) -> String {
    let count = columns.names.len();
    let is_wide = columns.places.iter().any(|(_, kind)| *kind == Scalar::F64);
    let known: Vec<&str> =
        columns.names.iter().map(String::as_str).filter(|name| NUSCENES.contains(name)).collect();
    let rest = if known.len() < count { ", the others are ignored (set with `fields`)" } else { "" };
    format!("{count} columns of {}: {}{rest}", if is_wide { "float64" } else { "float32" }, known.join(" "))
}

/// Returns whether the fifth of five columns looks like the ring numbers of a lidar, and the fourth of four columns
/// does not look like intensities. With a wrong column count, the last column contains coordinates, which are not all
/// whole numbers.
fn looks_like_nuscenes(start: &[u8]) -> bool {
    let floats: Vec<f32> = start.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let last_of = |columns: usize| floats.iter().skip(columns - 1).step_by(columns).copied();
    let is_whole = |value: f32| (0.0..=255.0).contains(&value) && value.fract() == 0.0;
    let mut rings = last_of(NUSCENES.len());
    let is_ring = rings.len() >= FEW_POINTS
        && rings.clone().all(is_whole)
        && rings.next().is_some_and(|first| rings.any(|ring| ring != first));
    let is_intensity = last_of(KITTI.len()).all(is_whole)
        || last_of(KITTI.len()).all(|intensity| (0.0..=1.0).contains(&intensity));
    is_ring && !is_intensity
}

impl Points for BinPoints {
    fn read(&mut self, visit: Visit<'_>) -> Result<()> {
        for _ in 0..self.points {
            self.input.read_exact(&mut self.record).map_err(|error| Error::io(&self.path, "read", error))?;
            let (record, places) = (&self.record, &self.columns.places);
            let value = |at: usize| {
                let (place, kind) = places.get(at).copied().unwrap_or((usize::MAX, Scalar::F32));
                record.get(place..).map_or(f64::NAN, |bytes| kind.value(bytes, false))
            };
            let mut point = self.clock.point(&self.meaning, value);
            self.attributes.set_in(&mut point, &mut self.values, value, |_| None);
            if let Some(labels) = &mut self.labels {
                point.class = self.values.class(f64::from(labels.next()?));
            }
            visit(point)?;
        }
        Ok(())
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.iter().cloned().chain(self.values.remarks()).collect()
    }
}
