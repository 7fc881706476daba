use super::las_count::cut_off;
use super::las_layout::{Layout, PointFormat};
use super::las_units::Units;
use super::laz_chunks::Chunks;
use super::laz_points::{End, LazPoints};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
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
}

impl LasPoints {
    /// Opens the points. `chunks` is set for a compressed file.
    pub(super) fn open(path: &Path, layout: &Layout, chunks: Option<Chunks>, units: &Units) -> Result<Self> {
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
            fields: Fields { format: layout.format, transforms, metres: units.metres },
            record_bytes: layout.record_bytes.max(1) as usize,
            at_a_time: (MAX_BATCH_BYTES / layout.record_bytes.max(1)).clamp(1, AT_A_TIME),
            points: layout.points,
            done: 0,
            withheld: 0,
            is_cut: false,
        })
    }

    pub(super) fn has_times(&self) -> bool {
        self.fields.format.time_at.is_some()
    }

    /// Visits the points, except those marked as deleted ("withheld").
    pub(super) fn visit(&mut self, visit: &mut dyn FnMut(LasPoint) -> Result<()>) -> Result<()> {
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
                match self.fields.of(point) {
                    Some(point) => visit(point)?,
                    None => self.withheld += 1,
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
        withheld.into_iter().chain(cut).collect()
    }
}

impl Fields {
    /// Decodes a point, unless it is withheld.
    fn of(&self, bytes: &[u8]) -> Option<LasPoint> {
        // The withheld flag is bit 7 of the classification in formats 0 to 5, and bit 2 of the flags in later formats.
        let withheld = if self.format.is_extended { 0b100 } else { 0b1000_0000 };
        if bytes.get(15).copied().unwrap_or(0) & withheld != 0 {
            return None;
        }
        let [flat, high] = self.metres;
        let coordinate = |axis: usize, (scale, offset): (f64, f64)| {
            let whole = chunk::<4>(bytes, 4 * axis).map_or(0, i32::from_le_bytes);
            scale * f64::from(whole) + offset
        };
        let [x, y, z] = self.transforms;
        Some(LasPoint {
            position_m: [coordinate(0, x) * flat, coordinate(1, y) * flat, coordinate(2, z) * high],
            intensity: chunk::<2>(bytes, 12).map_or(0, u16::from_le_bytes),
            time_s: self.format.time_at.and_then(|at| chunk::<8>(bytes, at)).map_or(0.0, f64::from_le_bytes),
        })
    }
}

fn chunk<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..).and_then(|bytes| bytes.first_chunk()).copied()
}
