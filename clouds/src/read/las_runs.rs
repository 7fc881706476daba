use super::las_points::LasPoint;
use crate::error::{Error, Result};
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Bytes of a point in a temporary file.
const POINT_BYTES: usize = 34;
/// Bytes that are read of a run at a time, at most and at least.
const MOST_BUFFER_BYTES: usize = 1 << 16;
const LEAST_BUFFER_BYTES: usize = POINT_BYTES * 16;

/// Sorts points by time in bounded memory: parts of them are sorted and written to a temporary file, then merged.
/// Points of the same time keep their order.
pub(super) struct Sorter {
    memory_bytes: usize,
    scratch: PathBuf,
    part: Vec<LasPoint>,
    most_points: usize,
    file: Option<BufWriter<File>>,
    /// Points of each run that was written.
    runs: Vec<u64>,
}

impl Sorter {
    pub(super) fn new(memory_bytes: usize, scratch: Option<&Path>) -> Self {
        let most_points = (memory_bytes / size_of::<LasPoint>()).max(16);
        Self {
            memory_bytes,
            scratch: scratch.map_or_else(std::env::temp_dir, Path::to_owned),
            part: Vec::new(),
            most_points,
            file: None,
            runs: Vec::new(),
        }
    }

    pub(super) fn push(&mut self, point: LasPoint) -> Result<()> {
        if self.part.len() >= self.most_points {
            self.write_part()?;
        }
        self.part.push(point);
        Ok(())
    }

    fn write_part(&mut self) -> Result<()> {
        let scratch = self.scratch.clone();
        let fail = |error| Error::io(&scratch, "write a temporary file in", error);
        // A stable sort: points of the same time keep their order.
        self.part.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let mut file = match self.file.take() {
            Some(file) => file,
            None => BufWriter::with_capacity(1 << 16, tempfile::tempfile_in(&scratch).map_err(fail)?),
        };
        for point in &self.part {
            file.write_all(&encode(point)).map_err(fail)?;
        }
        self.runs.push(self.part.len() as u64);
        self.part.clear();
        self.file = Some(file);
        Ok(())
    }

    /// The points in the order of time.
    pub(super) fn finish(mut self) -> Result<Sorted> {
        let scratch = self.scratch.clone();
        let fail = |error| Error::io(&scratch, "write a temporary file in", error);
        if self.file.is_none() {
            self.part.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
            return Ok(Sorted {
                scratch,
                here: self.part.into_iter(),
                file: None,
                runs: Vec::new(),
                next: BinaryHeap::new(),
            });
        }
        if !self.part.is_empty() {
            self.write_part()?;
        }
        self.part = Vec::new();
        let file = match self.file.take() {
            Some(file) => Some(file.into_inner().map_err(|error| fail(error.into_error()))?),
            None => None,
        };
        let share = self.memory_bytes / self.runs.len().max(1);
        let buffer_bytes = share.clamp(LEAST_BUFFER_BYTES, MOST_BUFFER_BYTES) / POINT_BYTES * POINT_BYTES;
        let mut at = 0;
        let mut runs = Vec::new();
        for points in self.runs {
            let end = at + points * POINT_BYTES as u64;
            runs.push(Run { at, end, buffer_bytes, buffer: Vec::new(), used: 0 });
            at = end;
        }
        let mut sorted =
            Sorted { scratch, here: Vec::new().into_iter(), file, runs, next: BinaryHeap::new() };
        for run in 0..sorted.runs.len() {
            sorted.refill(run)?;
        }
        Ok(sorted)
    }
}

/// A sorted part of the temporary file.
struct Run {
    at: u64,
    end: u64,
    buffer_bytes: usize,
    buffer: Vec<u8>,
    used: usize,
}

/// The first point of a run that was not given yet.
struct Next {
    point: LasPoint,
    run: usize,
}

/// Points in the order of time.
pub(super) struct Sorted {
    scratch: PathBuf,
    /// All points, if they fitted in memory.
    here: std::vec::IntoIter<LasPoint>,
    file: Option<File>,
    runs: Vec<Run>,
    next: BinaryHeap<Next>,
}

impl Sorted {
    /// The next point.
    pub(super) fn next(&mut self) -> Result<Option<LasPoint>> {
        if let Some(point) = self.here.next() {
            return Ok(Some(point));
        }
        let Some(Next { point, run }) = self.next.pop() else { return Ok(None) };
        self.refill(run)?;
        Ok(Some(point))
    }

    /// Takes the next point of a run.
    fn refill(&mut self, number: usize) -> Result<()> {
        let (Some(run), Some(file)) = (self.runs.get_mut(number), &mut self.file) else { return Ok(()) };
        if run.used >= run.buffer.len() {
            let bytes = (run.end - run.at).min(run.buffer_bytes as u64);
            run.buffer.resize(bytes as usize, 0);
            run.used = 0;
            file.seek(SeekFrom::Start(run.at))
                .and_then(|_| file.read_exact(&mut run.buffer))
                .map_err(|error| Error::io(&self.scratch, "read a temporary file in", error))?;
            run.at += bytes;
        }
        if let Some(bytes) = run.buffer.get(run.used..).and_then(|rest| rest.first_chunk()) {
            run.used += POINT_BYTES;
            self.next.push(Next { point: decode(bytes), run: number });
        }
        Ok(())
    }
}

fn encode(point: &LasPoint) -> [u8; POINT_BYTES] {
    let [x, y, z] = point.position_m;
    let mut bytes = [0; POINT_BYTES];
    let numbers = [point.time_s, x, y, z].into_iter().flat_map(f64::to_le_bytes);
    for (to, from) in bytes.iter_mut().zip(numbers.chain(point.intensity.to_le_bytes())) {
        *to = from;
    }
    bytes
}

fn decode(bytes: &[u8; POINT_BYTES]) -> LasPoint {
    let double = |k: usize| f64::from_le_bytes(std::array::from_fn(|at| bytes[8 * k + at]));
    LasPoint {
        time_s: double(0),
        position_m: [double(1), double(2), double(3)],
        intensity: u16::from_le_bytes([bytes[32], bytes[33]]),
    }
}

impl Ord for Next {
    /// The greatest of the heap is the earliest; of equal times, that of the earlier run.
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.point.time_s.total_cmp(&self.point.time_s).then(other.run.cmp(&self.run))
    }
}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Next {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Next {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_runs_and_one_give_the_same_stable_order() {
        let points: Vec<LasPoint> = (0..5000_u32)
            .map(|k| LasPoint {
                position_m: [f64::from(k), -1.5, 1e6 + 0.001],
                intensity: (k % 65_536) as u16,
                time_s: f64::from(k.wrapping_mul(2_654_435_761) >> 22) * 0.25,
            })
            .collect();
        let mut wanted = points.clone();
        wanted.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        for memory_bytes in [0, 40 * 100, 1 << 20] {
            let mut sorter = Sorter::new(memory_bytes, None);
            for point in &points {
                sorter.push(*point).unwrap();
            }
            assert_eq!(sorter.file.is_some(), memory_bytes < 1 << 20);
            let mut sorted = sorter.finish().unwrap();
            let mut found = Vec::new();
            while let Some(point) = sorted.next().unwrap() {
                found.push(point);
            }
            assert_eq!(found, wanted, "{memory_bytes}");
        }
    }
}
