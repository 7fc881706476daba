use super::guard::guarded;
use super::las_layout::Layout;
use super::las_trimmed::{Start, Trimmed};
use super::las_units::Units;
use las::{PointData, PointDataBuilder, Reader};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// Points that are decoded at a time, and most bytes of them.
const AT_A_TIME: u64 = 4096;
const MAX_BATCH_BYTES: u64 = 1 << 20;

/// A point of a LAS file, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LasPoint {
    pub(super) position_m: [f64; 3],
    pub(super) intensity: u16,
    /// Seconds of the file's GPS time; 0 without.
    pub(super) time_s: f64,
}

/// The points of a LAS or LAZ file, in order.
pub(super) struct LasPoints {
    path: PathBuf,
    start: Start,
    at_a_time: u64,
    metres: [f64; 2],
    /// Points that are announced, that are there, and that were read.
    announced: u64,
    whole: u64,
    done: u64,
    pub(super) has_times: bool,
    pub(super) withheld: u64,
}

impl LasPoints {
    pub(super) fn open(path: &Path, layout: &Layout, table_at: Option<u64>, units: &Units) -> Result<Self> {
        let start = Start::of(layout, table_at);
        // The library's reader must stay in its thread: this one is only asked whether it takes the file.
        let has_times = Decoder::open(path, &start)?.reader.header().point_format().has_gps_time;
        Ok(Self {
            path: path.to_owned(),
            start,
            at_a_time: (MAX_BATCH_BYTES / layout.record_bytes.max(1)).clamp(1, AT_A_TIME),
            metres: units.metres,
            announced: layout.points,
            whole: layout.whole_points(),
            done: 0,
            has_times,
            withheld: 0,
        })
    }

    /// Visits the points, without those that are marked as deleted ("withheld").
    pub(super) fn visit(&mut self, visit: &mut dyn FnMut(LasPoint) -> Result<()>) -> Result<()> {
        let mut decoder = Decoder::open(&self.path, &self.start)?;
        while self.done < self.whole {
            let wanted = self.at_a_time.min(self.whole - self.done);
            if let Err(reason) = decoder.fill(wanted) {
                return self.one_by_one(decoder, &reason, visit);
            }
            let read = decoder.batch.len() as u64;
            if read == 0 {
                break;
            }
            self.withheld += decoder.hand_out(self.metres, visit)?;
            self.done += read;
        }
        if self.done < self.announced {
            let reason = format!("the file ends after {} of {} points", self.done, self.announced);
            return Err(FormatError::at_record(self.done, reason).in_input(&self.path));
        }
        Ok(())
    }

    /// What is whole before damage: the points of a batch, each for itself.
    fn one_by_one(
        &mut self,
        mut decoder: Decoder,
        reason: &str,
        visit: &mut dyn FnMut(LasPoint) -> Result<()>,
    ) -> Result<()> {
        let done = self.done;
        if guarded(|| decoder.reader.seek(done)).is_ok() {
            for _ in 0..self.at_a_time {
                if decoder.fill(1).is_err() || decoder.batch.is_empty() {
                    break;
                }
                self.withheld += decoder.hand_out(self.metres, visit)?;
                self.done += 1;
            }
        }
        let reason =
            format!("the file is damaged or ends after {} of {} points: {reason}", self.done, self.announced);
        Err(FormatError::at_record(self.done, reason).in_input(&self.path))
    }
}

/// The library's reader.
struct Decoder {
    reader: Reader,
    batch: PointData,
}

impl Decoder {
    fn open(path: &Path, start: &Start) -> Result<Self> {
        let fail = |error| Error::io(path, "read", error);
        let file = File::open(path).map_err(fail)?;
        let input = BufReader::with_capacity(1 << 16, Trimmed::new(start, file));
        let reader = guarded(|| Reader::new(input)).map_err(|reason| {
            FormatError::at_offset(0, format!("the header is invalid: {reason}")).in_input(path)
        })?;
        let batch = PointDataBuilder::new().for_header(reader.header()).build();
        Ok(Self { reader, batch })
    }

    fn fill(&mut self, points: u64) -> std::result::Result<u64, String> {
        let (reader, batch) = (&mut self.reader, &mut self.batch);
        guarded(|| reader.fill_points(points, batch))
    }

    /// Visits the points of the batch; returns how many are withheld.
    fn hand_out(&self, metres: [f64; 2], visit: &mut dyn FnMut(LasPoint) -> Result<()>) -> Result<u64> {
        let batch = &self.batch;
        let transforms = batch.transforms();
        let format = batch.format();
        let record = batch.record_len().max(1);
        // The flag is bit 7 of the classification in old formats, and bit 2 of the flags in new ones.
        let (flag_at, flag) = if format.is_extended { (15, 0b100) } else { (15, 0b1000_0000) };
        let mut times = batch.gps_time();
        let axes = batch.x_raw().zip(batch.y_raw()).zip(batch.z_raw());
        let flags =
            batch.raw_bytes().chunks_exact(record).map(|bytes| bytes.get(flag_at).copied().unwrap_or(0));
        let [flat, high] = metres;
        let mut withheld = 0;
        for ((((x, y), z), intensity), flags) in axes.zip(batch.intensity()).zip(flags) {
            let time_s = times.as_mut().and_then(Iterator::next).unwrap_or(0.0);
            if flags & flag != 0 {
                withheld += 1;
                continue;
            }
            let position_m =
                [transforms.x.direct(x) * flat, transforms.y.direct(y) * flat, transforms.z.direct(z) * high];
            visit(LasPoint { position_m, intensity, time_s })?;
        }
        Ok(withheld)
    }
}
