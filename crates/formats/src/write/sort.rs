use super::Result;
use super::spool::{Spool, SpoolReader};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::path::{Path, PathBuf};

/// Bytes of records that are sorted at once, and of those that wait while sorted runs are merged.
const MEMORY_BYTES: usize = 32 << 20;

/// Records of a fixed size, sorted by their bytes in constant memory. Keys are written with [`key`], so that bytes
/// compare as numbers do.
pub(super) struct ExternalSort<const N: usize> {
    folder: PathBuf,
    memory_bytes: usize,
    records: Vec<[u8; N]>,
    /// Sorted runs, one after the other.
    spool: Option<Spool>,
    /// Where each run ends.
    run_ends: Vec<u64>,
}

/// A number as bytes that compare as numbers do.
pub(super) fn key(number: i32) -> [u8; 4] {
    ((number as u32) ^ (1 << 31)).to_be_bytes()
}

/// The number of a [`key`].
pub(super) fn of_key(bytes: [u8; 4]) -> i32 {
    (u32::from_be_bytes(bytes) ^ (1 << 31)) as i32
}

/// A part of a record. Records are as long as their writers say: what is not there is zero.
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

    /// All records in order.
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

/// Records in order.
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

/// Sorted runs that become one.
pub(super) struct Merge<const N: usize> {
    reader: SpoolReader,
    runs: Vec<Run>,
    heap: BinaryHeap<Reverse<([u8; N], usize)>>,
    buffer_bytes: u64,
}

struct Run {
    /// Where the bytes behind the buffer begin.
    next: u64,
    end: u64,
    buffer: Vec<u8>,
    /// How much of the buffer is used up.
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

    /// The next record of a run waits for its turn.
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
