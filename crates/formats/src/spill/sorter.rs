use super::budget::Budget;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use voxtile::Result;

/// Fixed-size record that [`Sorter`] can sort.
pub(crate) trait Record: Copy {
    /// Size in a temporary file, at most [`MAX_RECORD_BYTES`].
    const BYTES: usize;

    /// Encodes the record into exactly [`Self::BYTES`] bytes.
    fn encode(&self, bytes: &mut [u8]);

    /// Decodes a record.
    fn decode(bytes: &[u8]) -> Self;

    /// Compares two records. The sort is stable for equal ones.
    fn order(&self, other: &Self) -> Ordering;
}

/// Limit for the size of a record.
const MAX_RECORD_BYTES: usize = 128;
/// Limit for the bytes of a run to read at once; at least 16 records are read.
const MAX_BUFFER_BYTES: usize = 1 << 16;

/// External merge sort in bounded memory: sorted runs are written to a temporary file and then merged.
#[derive(Debug)]
pub(crate) struct Sorter<T> {
    memory_bytes: usize,
    budget: Budget,
    part: Vec<T>,
    max_records: usize,
    file: Option<BufWriter<File>>,
    /// Number of records of each run in the file.
    runs: Vec<u64>,
}

impl<T: Record> Sorter<T> {
    pub(crate) fn new(budget: &Budget, memory_bytes: usize) -> Self {
        // The stable sort needs half as much memory again.
        let max_records = (memory_bytes / 3 * 2 / size_of::<T>()).max(16);
        let budget = budget.clone();
        Self { memory_bytes, budget, part: Vec::new(), max_records, file: None, runs: Vec::new() }
    }

    pub(crate) fn push(&mut self, record: T) -> Result<()> {
        if self.part.len() >= self.max_records {
            self.write_part()?;
        }
        if self.part.len() == self.part.capacity() {
            let more = self.part.len().max(16).min(self.max_records - self.part.len());
            self.part.reserve_exact(more);
        }
        self.part.push(record);
        Ok(())
    }

    #[cfg(all(test, feature = "las"))]
    pub(crate) fn is_in_file(&self) -> bool {
        self.file.is_some()
    }

    fn write_part(&mut self) -> Result<()> {
        let mut file = match self.file.take() {
            Some(file) => file,
            None => BufWriter::with_capacity(1 << 16, self.budget.file()?),
        };
        self.part.sort_by(T::order);
        let mut bytes = [0; MAX_RECORD_BYTES];
        let bytes = bytes.get_mut(..T::BYTES).unwrap_or_default();
        for record in &self.part {
            record.encode(bytes);
            file.write_all(bytes).map_err(|error| self.budget.cannot("write", error))?;
        }
        self.runs.push(self.part.len() as u64);
        self.part.clear();
        self.file = Some(file);
        Ok(())
    }

    /// Returns the records in order.
    pub(crate) fn finish(mut self) -> Result<Sorted<T>> {
        if self.file.is_none() {
            self.part.sort_by(T::order);
        } else if !self.part.is_empty() {
            self.write_part()?;
        }
        let file = match self.file.take() {
            Some(file) => {
                let file = file.into_inner();
                Some(file.map_err(|error| self.budget.cannot("write", error.into_error()))?)
            }
            None => None,
        };
        let share = self.memory_bytes / self.runs.len().max(1);
        let buffer_bytes = share.min(MAX_BUFFER_BYTES).max(16 * T::BYTES) / T::BYTES * T::BYTES;
        let (mut at, mut runs) = (0, Vec::with_capacity(self.runs.len()));
        for records in self.runs {
            let end = at + records * T::BYTES as u64;
            runs.push(Run { at, end, buffer_bytes, buffer: Vec::new(), used: 0 });
            at = end;
        }
        // If there is a file, no records are left in memory.
        let here = std::mem::take(&mut self.part).into_iter();
        let mut sorted = Sorted { budget: self.budget, here, file, runs, next: BinaryHeap::new() };
        for run in 0..sorted.runs.len() {
            sorted.refill(run)?;
        }
        Ok(sorted)
    }
}

/// Sorted run in the temporary file.
#[derive(Debug)]
struct Run {
    at: u64,
    end: u64,
    buffer_bytes: usize,
    buffer: Vec<u8>,
    used: usize,
}

/// Head of a run during the merge.
#[derive(Debug)]
struct Next<T> {
    record: T,
    run: usize,
}

/// Sorted records.
#[derive(Debug)]
pub(crate) struct Sorted<T> {
    budget: Budget,
    /// All records, if they fit in memory.
    here: std::vec::IntoIter<T>,
    file: Option<File>,
    runs: Vec<Run>,
    next: BinaryHeap<Next<T>>,
}

impl<T: Record> Sorted<T> {
    /// Returns the next record.
    pub(crate) fn next(&mut self) -> Result<Option<T>> {
        if let Some(record) = self.here.next() {
            return Ok(Some(record));
        }
        let Some(Next { record, run }) = self.next.pop() else { return Ok(None) };
        self.refill(run)?;
        Ok(Some(record))
    }

    /// Reads the next record of a run.
    fn refill(&mut self, number: usize) -> Result<()> {
        let (Some(run), Some(file)) = (self.runs.get_mut(number), &mut self.file) else { return Ok(()) };
        if run.used >= run.buffer.len() {
            let bytes = (run.end - run.at).min(run.buffer_bytes as u64);
            run.buffer.resize(bytes as usize, 0);
            run.used = 0;
            file.seek(SeekFrom::Start(run.at))
                .and_then(|_| file.read_exact(&mut run.buffer))
                .map_err(|error| self.budget.cannot("read", error))?;
            run.at += bytes;
        }
        if let Some(bytes) = run.buffer.get(run.used..run.used + T::BYTES) {
            run.used += T::BYTES;
            self.next.push(Next { record: T::decode(bytes), run: number });
        }
        Ok(())
    }
}

impl<T: Record> Ord for Next<T> {
    /// The maximum of the heap is the first record in order; of equal records, the one from the earlier run.
    fn cmp(&self, other: &Self) -> Ordering {
        other.record.order(&self.record).then(other.run.cmp(&self.run))
    }
}

impl<T: Record> PartialOrd for Next<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T: Record> PartialEq for Next<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<T: Record> Eq for Next<T> {}
