use super::set_range::{SetPosition, SetRange};
use std::collections::BTreeMap;

/// Versions of ranges that were replaced as a whole. A version is the number of the packet with that content. Where
/// ranges overlap, the latest version applies.
#[derive(Clone, Debug, Default)]
pub(super) struct RangeVersions {
    /// Last position and version of each range, by its first position. The ranges are disjoint.
    parts: BTreeMap<SetPosition, (SetPosition, u64)>,
}

impl RangeVersions {
    pub(super) fn len(&self) -> usize {
        self.parts.len()
    }

    /// Returns the earliest version.
    pub(super) fn oldest(&self) -> Option<u64> {
        self.parts.values().map(|(_, as_of)| *as_of).min()
    }

    /// Returns whether a position has version `sequence` or a later one.
    pub(super) fn is_as_of(&self, position: SetPosition, sequence: u64) -> bool {
        let before = self.parts.range(..=position).next_back();
        before.is_some_and(|(_, (last, as_of))| position <= *last && *as_of >= sequence)
    }

    /// Returns the parts of a range without version `sequence` or a later one.
    pub(super) fn gaps(&self, range: SetRange, sequence: u64) -> Vec<SetRange> {
        let mut gaps = Vec::new();
        let mut begin = range.first;
        for (part, as_of) in self.overlapping(range) {
            if as_of < sequence {
                continue;
            }
            if begin < part.first {
                gaps.push(SetRange { first: begin, last: part.first.before() });
            }
            if range.last <= part.last {
                return gaps;
            }
            begin = part.last.next();
        }
        gaps.push(SetRange { first: begin, last: range.last });
        gaps
    }

    /// Sets the version of a range, except where it already has a later version.
    pub(super) fn record(&mut self, range: SetRange, as_of: u64) {
        let gaps = self.gaps(range, as_of);
        let older: Vec<(SetRange, u64)> =
            self.overlapping(range).filter(|(_, version)| *version < as_of).collect();
        for (part, version) in older {
            self.parts.remove(&part.first);
            if part.first < range.first {
                self.parts.insert(part.first, (range.first.before(), version));
            }
            if range.last < part.last {
                self.parts.insert(range.last.next(), (part.last, version));
            }
        }
        gaps.into_iter().for_each(|gap| self.insert(gap, as_of));
    }

    /// Inserts a range that overlaps no other, and merges it with adjacent ranges of the same version.
    fn insert(&mut self, mut part: SetRange, as_of: u64) {
        let before = self.parts.range(..part.first).next_back();
        if let Some((&first, &(last, version))) = before
            && version == as_of
            && last == part.first.before()
        {
            part.first = first;
        }
        if part.last < SetRange::ALL.last
            && let Some(&(last, version)) = self.parts.get(&part.last.next())
            && version == as_of
        {
            self.parts.remove(&part.last.next());
            part.last = last;
        }
        self.parts.insert(part.first, (part.last, as_of));
    }

    /// Removes the ranges of version `sequence` and of earlier versions.
    pub(super) fn forget_up_to(&mut self, sequence: u64) {
        self.parts.retain(|_, (_, as_of)| *as_of > sequence);
    }

    /// Returns the ranges that overlap a range, in order.
    fn overlapping(&self, range: SetRange) -> impl Iterator<Item = (SetRange, u64)> {
        let begin = match self.parts.range(..=range.first).next_back() {
            Some((&first, (last, _))) if *last >= range.first => first,
            _ => range.first,
        };
        let parts = self.parts.range(begin..=range.last);
        parts.map(|(&first, &(last, as_of))| (SetRange { first, last }, as_of))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::space::TileIndex;
    use voxtile_simulation::Random;

    /// Returns a position of a small set: two tiles with 20 codes each, half of them at each end of a tile's codes.
    fn position(number: u64) -> SetPosition {
        let (tile, code) = (TileIndex::new(0, 0, (number / 20) as i32), number % 20);
        let code = if code < 10 { code } else { super::super::set_range::LAST_CODE - (19 - code) };
        SetPosition { tile, code }
    }

    #[test]
    fn every_position_has_the_latest_version_of_its_ranges() {
        for seed in 0..50 {
            let mut random = Random::of(seed, &[]);
            let mut parts = RangeVersions::default();
            // The test uses 20 numbered positions per tile. Ranges begin and end at these, so no other positions need
            // to be compared.
            let mut plain = vec![None::<u64>; 40];
            for step in 0..60 {
                let mut ends = [random.below(40), random.below(40)];
                ends.sort_unstable();
                let as_of = 1 + random.below(8);
                let range = SetRange { first: position(ends[0]), last: position(ends[1]) };
                let wanted: Vec<bool> = (ends[0]..=ends[1])
                    .map(|k| plain[k as usize].is_none_or(|version| version < as_of))
                    .collect();
                let gaps = parts.gaps(range, as_of);
                for (k, wanted) in (ends[0]..=ends[1]).zip(wanted) {
                    assert_eq!(gaps.iter().any(|gap| gap.contains(position(k))), wanted, "{seed} {step}");
                }
                parts.record(range, as_of);
                for k in ends[0]..=ends[1] {
                    plain[k as usize] = plain[k as usize].max(Some(as_of));
                }
                if random.chance(0.1) {
                    let sequence = random.below(6);
                    parts.forget_up_to(sequence);
                    plain
                        .iter_mut()
                        .for_each(|version| *version = version.filter(|&version| version > sequence));
                }
                for (k, version) in plain.iter().enumerate() {
                    let is_as_of = |sequence| {
                        parts.is_as_of(position(k as u64), sequence) == (*version >= Some(sequence))
                    };
                    assert!((1..10).all(is_as_of), "{seed} {step} {k}: {parts:?}");
                }
                assert_eq!(parts.oldest(), parts.parts.values().map(|part| part.1).min());
            }
        }
    }

    #[test]
    fn adjacent_ranges_of_one_version_are_merged() {
        let mut parts = RangeVersions::default();
        for k in (0..10).rev().chain(12..19).chain(10..12).chain(20..30) {
            parts.record(SetRange { first: position(k), last: position(k) }, 7);
        }
        // Three ranges: the codes between positions 9 and 10, and position 19, have no version.
        assert_eq!(parts.len(), 3);
        parts.record(SetRange::ALL, 7);
        parts.record(SetRange::ALL, 8);
        assert_eq!(parts.len(), 1);
    }
}
