use super::cloud::CloudPoint;
use super::las_colours::LasColours;
use super::las_count::cut_off;
use super::las_layout::{Layout, PointFormat};
use super::las_units::Units;
use super::laz_chunks::Chunks;
use super::laz_points::{End, LazPoints};
use super::of_classes::left_out_remark;
use crate::class_selection::{ClassSelection, Returns};
use crate::read_options::ReadOptions;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use voxtile::scan::AttributeSet;
use voxtile::{Error, FormatError, Result};

/// Number of points to decode in one batch, and the limit for its bytes.
const AT_A_TIME: u64 = 4096;
const MAX_BATCH_BYTES: u64 = 1 << 20;

/// Point of a LAS file, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LasPoint {
    pub(super) position_m: [f64; 3],
    pub(super) intensity: u16,
    /// GPS time of the file in seconds; 0 if there is none.
    pub(super) time_s: f64,
    /// Red, green and blue; 0 if colours are not read.
    pub(super) colour: [u8; 3],
    pub(super) class: u8,
}

impl LasPoint {
    /// Returns the point without its time, with these attributes.
    pub(super) fn cloud_point(&self, set: AttributeSet) -> CloudPoint {
        CloudPoint {
            intensity: f32::from(self.intensity),
            colour: set.colours.then_some(self.colour),
            class: set.classes.then_some(self.class),
            ..CloudPoint::hit(self.position_m)
        }
    }
}

/// Reader of the points of a LAS or LAZ file, in order.
pub(super) struct LasPoints {
    path: PathBuf,
    records: Records,
    fields: Fields,
    record_bytes: usize,
    at_a_time: u64,
    /// Number of points to read, and number read so far.
    points: u64,
    done: u64,
    withheld: u64,
    /// Number of points left out by their class, and by the number of their return.
    left_out: [u64; 2],
    is_cut: bool,
}

/// Source of point records.
enum Records {
    Plain(BufReader<File>),
    Compressed(Box<LazPoints>),
}

/// Extraction of the fields to read.
struct Fields {
    format: PointFormat,
    /// Scale and offset of each axis.
    transforms: [(f64, f64); 3],
    metres: [f64; 2],
    colours: LasColours,
    classes: ClassSelection,
    returns: Returns,
    /// Whether not all points are selected.
    selects: bool,
    /// Attributes to read.
    attributes: AttributeSet,
}

/// Reason for skipping a point.
enum Skipped {
    Withheld,
    ByClass,
    ByReturn,
}

impl LasPoints {
    /// Opens the points. `chunks` is set for a compressed file.
    pub(super) fn open(
        path: &Path,
        layout: &Layout,
        chunks: Option<Chunks>,
        units: &Units,
        options: &ReadOptions,
    ) -> Result<Self> {
        let fail = |error| Error::io(path, "read", error);
        let file = File::open(path).map_err(fail)?;
        let records = match chunks {
            Some(chunks) => Records::Compressed(Box::new(LazPoints::new(path, file, chunks)?)),
            None => {
                let mut input = BufReader::with_capacity(1 << 16, file);
                input.seek(SeekFrom::Start(layout.points_at)).map_err(fail)?;
                Records::Plain(input)
            }
        };
        let transforms = [0, 1, 2].map(|axis| layout.transform(axis));
        Ok(Self {
            path: path.to_owned(),
            records,
            fields: Fields {
                format: layout.format,
                transforms,
                metres: units.metres,
                colours: LasColours::None,
                classes: options.classes.clone(),
                returns: options.returns,
                selects: !options.classes.is_everything() || options.returns != Returns::All,
                attributes: options.attributes_to_read(),
            },
            record_bytes: layout.record_bytes.max(1) as usize,
            at_a_time: (MAX_BATCH_BYTES / layout.record_bytes.max(1)).clamp(1, AT_A_TIME),
            points: layout.points,
            done: 0,
            withheld: 0,
            left_out: [0; 2],
            is_cut: false,
        })
    }

    pub(super) fn has_times(&self) -> bool {
        self.fields.format.time_at.is_some()
    }

    /// Returns whether points have colours, of any scale.
    pub(super) fn has_colours(&self) -> bool {
        self.fields.format.colour_at.is_some()
    }

    pub(super) fn set_colours(&mut self, colours: LasColours) {
        self.fields.colours = colours;
    }

    /// Returns which of the requested attributes the points have.
    pub(super) fn attributes(&self) -> AttributeSet {
        let AttributeSet { colours, classes, .. } = self.fields.attributes;
        AttributeSet { colours: colours && self.fields.colours.are_there(), classes, ..AttributeSet::NONE }
    }

    /// Visits the points, except those marked as deleted ("withheld") and those that are not selected.
    pub(super) fn visit(&mut self, visit: &mut dyn FnMut(LasPoint) -> Result<()>) -> Result<()> {
        self.visit_records(|points, record| {
            match points.fields.of(record) {
                Ok(point) => visit(point)?,
                Err(Skipped::Withheld) => points.withheld += 1,
                Err(Skipped::ByClass) => points.left_out[0] += 1,
                Err(Skipped::ByReturn) => points.left_out[1] += 1,
            }
            Ok(true)
        })
    }

    /// Visits the values of red, green and blue of all points, until `visit` returns `false`.
    pub(super) fn visit_colours(&mut self, mut visit: impl FnMut([u16; 3]) -> bool) -> Result<()> {
        self.visit_records(|points, record| {
            let at = points.fields.format.colour_at;
            Ok(at.and_then(|at| colour_at(record, at)).is_none_or(&mut visit))
        })
    }

    /// Visits the records until `visit` returns `false`.
    fn visit_records(&mut self, mut visit: impl FnMut(&mut Self, &[u8]) -> Result<bool>) -> Result<()> {
        let mut batch = Vec::new();
        while self.done < self.points {
            let wanted = self.at_a_time.min(self.points - self.done) as usize;
            batch.resize(wanted * self.record_bytes, 0);
            let (read, end) = match &mut self.records {
                Records::Plain(input) => match input.read_exact(&mut batch) {
                    Ok(()) => (wanted, None),
                    Err(error) => return Err(Error::io(&self.path, "read", error)),
                },
                Records::Compressed(points) => points.fill(&mut batch, self.record_bytes),
            };
            for point in batch.chunks_exact(self.record_bytes).take(read) {
                if !visit(self, point)? {
                    return Ok(());
                }
            }
            self.done += read as u64;
            if let Some(end) = end {
                return self.ended(end);
            }
        }
        Ok(())
    }

    /// Handles an early end. A file without a chunk table was truncated; the points read so far are valid.
    fn ended(&mut self, end: End) -> Result<()> {
        let has_table = matches!(&self.records, Records::Compressed(points) if points.has_table);
        let reason = match end {
            End::File if !has_table && self.done > 0 => {
                self.is_cut = true;
                return Ok(());
            }
            End::File => format!("the file ends after {} of {} points", self.done, self.points),
            End::Damage(reason) => {
                format!("the file is damaged after {} of {} points: {reason}", self.done, self.points)
            }
        };
        Err(FormatError::at_record(self.done, reason).in_input(&self.path))
    }

    /// Returns remarks for the user about the points read.
    pub(super) fn remarks(&self) -> Vec<String> {
        let withheld = (self.withheld > 0)
            .then(|| format!("{} points are marked as withheld (deleted) and were skipped", self.withheld));
        let cut = self.is_cut.then(|| cut_off(self.done, self.points));
        let [by_class, by_return] = self.left_out;
        let left_out = [left_out_remark(by_class, "their class"), left_out_remark(by_return, "their return")];
        let colours = self.fields.colours.remark();
        withheld.into_iter().chain(left_out.into_iter().flatten()).chain(colours).chain(cut).collect()
    }
}

impl Fields {
    /// Decodes a point, unless it is withheld or not selected.
    fn of(&self, bytes: &[u8]) -> std::result::Result<LasPoint, Skipped> {
        // The withheld flag is bit 7 of the classification in formats 0 to 5, and bit 2 of the flags in later formats.
        let byte = |at: usize| bytes.get(at).copied().unwrap_or(0);
        let withheld = if self.format.is_extended { 0b100 } else { 0b1000_0000 };
        if byte(15) & withheld != 0 {
            return Err(Skipped::Withheld);
        }
        let class = if self.format.is_extended { byte(16) } else { byte(15) & 0b1_1111 };
        if self.selects {
            let bits = if self.format.is_extended { 4 } else { 3 };
            let mask = (1 << bits) - 1;
            if !self.classes.takes(Some(class)) {
                return Err(Skipped::ByClass);
            }
            if !self.returns.takes(byte(14) & mask, (byte(14) >> bits) & mask) {
                return Err(Skipped::ByReturn);
            }
        }
        let colour = match (self.colours, self.format.colour_at) {
            (colours, _) if !colours.are_there() => [0; 3],
            (_, None) => [0; 3],
            (colours, Some(at)) => colour_at(bytes, at).map_or([0; 3], |colour| colours.of(colour)),
        };
        let [flat, high] = self.metres;
        let coordinate = |axis: usize, (scale, offset): (f64, f64)| {
            let whole = chunk::<4>(bytes, 4 * axis).map_or(0, i32::from_le_bytes);
            scale * f64::from(whole) + offset
        };
        let [x, y, z] = self.transforms;
        Ok(LasPoint {
            position_m: [coordinate(0, x) * flat, coordinate(1, y) * flat, coordinate(2, z) * high],
            intensity: chunk::<2>(bytes, 12).map_or(0, u16::from_le_bytes),
            time_s: self.format.time_at.and_then(|at| chunk::<8>(bytes, at)).map_or(0.0, f64::from_le_bytes),
            colour,
            class,
        })
    }
}

/// Returns red, green and blue as stored.
fn colour_at(bytes: &[u8], at: usize) -> Option<[u16; 3]> {
    let colour = chunk::<6>(bytes, at)?;
    let (words, _) = colour.as_chunks::<2>();
    Some(std::array::from_fn(|k| words.get(k).copied().map_or(0, u16::from_le_bytes)))
}

fn chunk<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..).and_then(|bytes| bytes.first_chunk()).copied()
}
