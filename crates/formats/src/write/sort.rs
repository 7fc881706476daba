use super::Result;
use super::spool::{Spool, SpoolReader};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::path::{Path, PathBuf};

/// Memory for the records of one run, and for the read buffers of a merge.
const MEMORY_BYTES: usize = 32 << 20;

/// External sort of fixed-size records by their bytes in constant memory. [`key`] encodes numbers so that their bytes
/// sort in numeric order.
pub(super) struct ExternalSort<const N: usize> {
    folder: PathBuf,
    memory_bytes: usize,
    records: Vec<[u8; N]>,
    /// Sorted runs, concatenated.
    spool: Option<Spool>,
    /// End offset of each run.
    run_ends: Vec<u64>,
}

/// Encodes a number as bytes that sort in numeric order.
pub(super) fn key(number: i32) -> [u8; 4] {
    ((number as u32) ^ (1 << 31)).to_be_bytes()
}

/// Decodes a [`key`].
pub(super) fn of_key(bytes: [u8; 4]) -> i32 {
    (u32::from_be_bytes(bytes) ^ (1 << 31)) as i32
}

/// Returns a part of a record. Missing bytes are zero.
pub(super) fn part<const M: usize>(record: &[u8], at: usize) -> [u8; M] {
    let mut bytes = [0; M];
    if let Some(found) = record.get(at..at + M) {
        bytes.copy_from_slice(found);
    }
    bytes
}

impl<const N: usize> ExternalSort<N> {
    pub(super) fn new(folder: &Path) -> Self {
        Self::with_memory(folder, MEMORY_BYTES)
    }

    fn with_memory(folder: &Path, memory_bytes: usize) -> Self {
        let folder = folder.to_owned();
        Self { folder, memory_bytes, records: Vec::new(), spool: None, run_ends: Vec::new() }
    }

    pub(super) fn push(&mut self, record: [u8; N]) -> Result<()> {
        self.records.push(record);
        if self.records.len() >= (self.memory_bytes / N.max(1)).max(1) {
            self.spill()?;
        }
        Ok(())
    }

    fn spill(&mut self) -> Result<()> {
        self.records.sort_unstable();
        let spool = match &mut self.spool {
            Some(spool) => spool,
            none => none.insert(Spool::new(&self.folder)?),
        };
        for record in &self.records {
            spool.write(record)?;
        }
        self.run_ends.push(spool.len());
        self.records.clear();
        Ok(())
    }

    /// Returns all records in order.
    pub(super) fn into_sorted(mut self) -> Result<Sorted<N>> {
        let Some(_) = &self.spool else {
            self.records.sort_unstable();
            return Ok(Sorted::Memory(self.records.into_iter()));
        };
        if !self.records.is_empty() {
            self.spill()?;
        }
        self.records = Vec::new();
        let Some(spool) = self.spool else {
            return Ok(Sorted::Memory(Vec::new().into_iter()));
        };
        let starts = std::iter::once(0).chain(self.run_ends.iter().copied());
        let runs: Vec<_> = starts
            .zip(&self.run_ends)
            .map(|(next, &end)| Run { next, end, buffer: Vec::new(), at: 0 })
            .collect();
        let share = (self.memory_bytes / runs.len().max(1) / N.max(1)).max(16) * N;
        let count = runs.len();
        let mut merge =
            Merge { reader: spool.into_reader()?, runs, heap: BinaryHeap::new(), buffer_bytes: share as u64 };
        for run in 0..count {
            merge.refill(run)?;
        }
        Ok(Sorted::Merge(merge))
    }
}

/// Sorted records.
pub(super) enum Sorted<const N: usize> {
    Memory(std::vec::IntoIter<[u8; N]>),
    Merge(Merge<N>),
}

impl<const N: usize> Sorted<N> {
    pub(super) fn next(&mut self) -> Result<Option<[u8; N]>> {
        match self {
            Self::Memory(records) => Ok(records.next()),
            Self::Merge(merge) => merge.next(),
        }
    }
}

/// Merge of sorted runs.
pub(super) struct Merge<const N: usize> {
    reader: SpoolReader,
    runs: Vec<Run>,
    heap: BinaryHeap<Reverse<([u8; N], usize)>>,
    buffer_bytes: u64,
}

struct Run {
    /// Offset of the bytes after the buffer.
    next: u64,
    end: u64,
    buffer: Vec<u8>,
    /// Number of consumed bytes of the buffer.
    at: usize,
}

impl<const N: usize> Merge<N> {
    fn next(&mut self) -> Result<Option<[u8; N]>> {
        let Some(Reverse((record, run))) = self.heap.pop() else {
            return Ok(None);
        };
        self.refill(run)?;
        Ok(Some(record))
    }

    /// Adds the next record of a run to the merge.
    fn refill(&mut self, number: usize) -> Result<()> {
        let Some(run) = self.runs.get_mut(number) else {
            return Ok(());
        };
        if run.at >= run.buffer.len() {
            if run.next >= run.end {
                return Ok(());
            }
            let most = self.buffer_bytes.min(run.end - run.next);
            self.reader.read_at(run.next, &mut run.buffer, most)?;
            run.next += most;
            run.at = 0;
        }
        self.heap.push(Reverse((part(&run.buffer, run.at), number)));
        run.at += N;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(memory_bytes: usize, numbers: &[i32]) -> Vec<i32> {
        let folder = tempfile::tempdir().unwrap();
        let mut sort = ExternalSort::<4>::with_memory(folder.path(), memory_bytes);
        for &number in numbers {
            sort.push(key(number)).unwrap();
        }
        let mut sorted = sort.into_sorted().unwrap();
        std::iter::from_fn(|| sorted.next().unwrap().map(of_key)).collect()
    }

    #[test]
    fn runs_of_any_size_give_the_same_order() {
        let numbers: Vec<i32> = (0..1000_i32).map(|n| n.wrapping_mul(0x9E37_79B1_u32 as i32)).collect();
        let mut expected = numbers.clone();
        expected.sort_unstable();
        for memory_bytes in [4, 100, 397, 4000, 1 << 20] {
            assert_eq!(sorted(memory_bytes, &numbers), expected, "{memory_bytes} bytes");
        }
        assert_eq!(sorted(4, &[]), Vec::<i32>::new());
        assert_eq!(sorted(8, &[i32::MAX, 0, i32::MIN, -1]), [i32::MIN, -1, 0, i32::MAX]);
    }
}
