use super::samples::Samples;
use crate::spill::{Budget, PoseList, PoseWriter, Record, Sorter, TimedPose};
use std::cmp::Ordering;
use voxtile::Result;

/// External sort for the samples of a recording whose transforms exceed the memory budget.
#[derive(Debug)]
pub(super) struct SampleSpool {
    budget: Budget,
    sorter: Sorter<Spooled>,
    /// Number of sample lists that were numbered so far.
    numbers: u32,
    /// Number of times the memory was full.
    rounds: u32,
}

/// A sample with the number of its list.
#[derive(Clone, Copy, Debug)]
struct Spooled {
    number: u32,
    round: u32,
    sample: TimedPose,
}

impl Record for Spooled {
    const BYTES: usize = 8 + TimedPose::BYTES;

    fn encode(&self, bytes: &mut [u8]) {
        let head = [self.number, self.round].into_iter().flat_map(u32::to_le_bytes);
        for (to, from) in bytes.iter_mut().zip(head.chain(self.sample.encode())) {
            *to = from;
        }
    }

    fn decode(bytes: &[u8]) -> Self {
        let (head, sample) = bytes.split_at_checked(8).unwrap_or_default();
        let number = |at: usize| head.get(at..).and_then(|bytes| bytes.first_chunk()).copied();
        let number = |at: usize| number(at).map_or(0, u32::from_le_bytes);
        let sample = sample.first_chunk().map(TimedPose::decode).unwrap_or_default();
        Self { number: number(0), round: number(4), sample }
    }

    fn order(&self, other: &Self) -> Ordering {
        let key = |spooled: &Self| (spooled.number, spooled.sample.stamp_ns, spooled.round);
        key(self).cmp(&key(other))
    }
}

impl SampleSpool {
    pub(super) fn new(budget: &Budget, memory_bytes: usize) -> Self {
        let sorter = Sorter::new(budget, memory_bytes);
        Self { budget: budget.clone(), sorter, numbers: 0, rounds: 0 }
    }

    /// Moves samples from memory to the sorter.
    pub(super) fn take<'s>(&mut self, all: impl Iterator<Item = &'s mut Samples>) -> Result<()> {
        for samples in all {
            let mut drained = samples.drain();
            if drained.len() == 0 {
                continue;
            }
            let number = *samples.number.get_or_insert(self.numbers);
            self.numbers = self.numbers.max(number.saturating_add(1));
            let round = self.rounds;
            drained.try_for_each(|sample| self.sorter.push(Spooled { number, round, sample }))?;
        }
        self.rounds += 1;
        Ok(())
    }

    /// Returns all samples to their lists, stored in a file.
    pub(super) fn finish<'s>(mut self, all: impl Iterator<Item = &'s mut Samples>) -> Result<()> {
        let mut all: Vec<&mut Samples> = all.collect();
        self.take(all.iter_mut().map(|samples| &mut **samples))?;
        // Lists without a number have no samples and are sorted last.
        all.sort_unstable_by_key(|samples| samples.number.unwrap_or(u32::MAX));
        let mut sorted = self.sorter.finish()?;
        let mut writer = PoseWriter::new(&self.budget, 0);
        let mut parts = Vec::new();
        let (mut begin, mut end) = (0, 0);
        let mut next = sorted.next()?;
        while let Some(Spooled { number, sample, .. }) = next {
            next = sorted.next()?;
            let is_same = |other: &Spooled| other.number == number;
            // Of samples with equal stamps, the last one is kept.
            if !next.as_ref().is_some_and(|next| is_same(next) && next.sample.stamp_ns == sample.stamp_ns) {
                writer.push(sample)?;
                end += 1;
            }
            if !next.as_ref().is_some_and(is_same) {
                parts.push((number, begin..end));
                begin = end;
            }
        }
        let list = writer.finish()?;
        for samples in all {
            let part = parts.binary_search_by_key(&samples.number, |(number, _)| Some(*number));
            let range = part.ok().and_then(|at| parts.get(at)).map(|(_, range)| range.clone());
            samples.file(range.map_or_else(PoseList::default, |range| list.part(range)));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poses::RigidPose;

    #[test]
    fn samples_in_file_and_memory_are_equal() {
        let pose = |k: i64| RigidPose { position_m: [k as f64, 0.5, -1.0], ..RigidPose::IDENTITY };
        let (mut memory, mut filed) = (vec![Samples::default(); 3], vec![Samples::default(); 3]);
        let mut spool = SampleSpool::new(&Budget::default(), 0);
        for k in 0..1000_i64 {
            // Stamps repeat, within a round and across rounds.
            let (which, stamp_ns) = ((k % 2) as usize, (k * 7919 % 601) / 2 * 2);
            memory[which].insert(stamp_ns, pose(k));
            filed[which].insert(stamp_ns, pose(k));
            if k % 37 == 0 {
                spool.take(filed.iter_mut()).unwrap();
            }
            assert_eq!(memory[which].has_several(), filed[which].has_several());
            assert_eq!(memory[which].is_empty(), filed[which].is_empty());
        }
        spool.finish(filed.iter_mut()).unwrap();
        for (memory, filed) in memory.iter().zip(&filed) {
            assert_eq!(memory.len(), filed.len());
            for stamp_ns in -3..610 {
                assert_eq!(memory.around(stamp_ns).unwrap(), filed.around(stamp_ns).unwrap());
            }
        }
        assert!(filed[2].is_empty());
    }
}
