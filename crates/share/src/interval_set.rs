use super::set_range::{SetPosition, SetRange};
use std::collections::BTreeMap;

/// Disjoint ranges that are still to be requested. Their number is limited: at the limit, ranges are merged or not
/// removed, which only costs bandwidth.
#[derive(Clone, Debug, Default)]
pub(super) struct IntervalSet {
    /// Last position of each range, by its first position.
    ranges: BTreeMap<SetPosition, SetPosition>,
}

const MAX_RANGES: usize = 2048;

impl IntervalSet {
    /// Upper bound on the memory, in bytes: a B-tree node has space for 11 ranges and holds at least five.
    pub(super) const MAX_BYTES: usize = MAX_RANGES / 5 * 11 * size_of::<SetRange>() * 5 / 4;

    pub(super) fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    pub(super) fn is_half_full(&self) -> bool {
        self.ranges.len() >= MAX_RANGES / 2
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = SetRange> {
        self.ranges.iter().map(|(&first, &last)| SetRange { first, last })
    }

    /// Adds a range; adjacent ranges are not merged.
    pub(super) fn put(&mut self, part: SetRange) {
        self.remove(part);
        // If the limit prevented a split, the existing range still covers the new one.
        if self.overlapping(part).next().is_some() {
            return;
        }
        if self.ranges.len() >= MAX_RANGES
            && let Some((_, last)) = self.ranges.range_mut(..part.first).next_back()
        {
            *last = part.last;
            return;
        }
        if self.ranges.len() < MAX_RANGES {
            self.ranges.insert(part.first, part.last);
        } else if let Some((_, last)) = self.ranges.pop_first() {
            // The new range is before all others: extend the first of them backwards, so that it contains the new one.
            self.ranges.insert(part.first, last);
        }
    }

    /// Removes a range. Returns whether any part of it was in the set.
    pub(super) fn remove(&mut self, part: SetRange) -> bool {
        let overlapping: Vec<SetRange> = self.overlapping(part).collect();
        for &range in &overlapping {
            let is_split = range.first < part.first && part.last < range.last;
            if is_split && self.ranges.len() >= MAX_RANGES {
                continue;
            }
            self.ranges.remove(&range.first);
            if range.first < part.first {
                self.ranges.insert(range.first, part.first.before());
            }
            if part.last < range.last {
                self.ranges.insert(part.last.next(), range.last);
            }
        }
        !overlapping.is_empty()
    }

    /// Returns the ranges that overlap a range, in order.
    fn overlapping(&self, range: SetRange) -> impl Iterator<Item = SetRange> {
        let begin = match self.ranges.range(..=range.first).next_back() {
            Some((&first, &last)) if last >= range.first => first,
            _ => range.first,
        };
        self.ranges.range(begin..=range.last).map(|(&first, &last)| SetRange { first, last })
    }
}

impl FromIterator<SetRange> for IntervalSet {
    fn from_iter<T: IntoIterator<Item = SetRange>>(ranges: T) -> Self {
        let mut all = Self::default();
        ranges.into_iter().for_each(|part| all.put(part));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::space::TileIndex;
    use voxtile_simulation::Random;

    fn range(first: u64, last: u64) -> SetRange {
        let position = |code| SetPosition { tile: TileIndex::new(0, 0, 0), code };
        SetRange { first: position(first), last: position(last) }
    }

    #[test]
    fn put_and_remove_match_a_plain_list() {
        for seed in 0..100 {
            let mut random = Random::of(seed, &[]);
            let (mut ranges, mut plain) = (IntervalSet::default(), [false; 50]);
            for _ in 0..60 {
                let mut ends = [random.below(50), random.below(50)];
                ends.sort_unstable();
                let is_in = random.chance(0.5);
                let touched = &mut plain[ends[0] as usize..=ends[1] as usize];
                let part = range(ends[0], ends[1]);
                if is_in {
                    ranges.put(part);
                } else {
                    assert_eq!(ranges.remove(part), touched.contains(&true));
                }
                touched.fill(is_in);
                for (k, is_in) in plain.iter().enumerate() {
                    let position = range(k as u64, k as u64).first;
                    let holders = ranges.iter().filter(|part| part.contains(position)).count();
                    assert_eq!(holders, usize::from(*is_in), "{seed} {k}");
                }
            }
        }
    }

    #[test]
    fn the_number_of_ranges_is_limited_and_no_position_is_lost() {
        let mut ranges = IntervalSet::default();
        ranges.put(range(0, 1 << 40));
        // Without the limit, there would be three times as many ranges after these removals.
        (0..3 * MAX_RANGES as u64).for_each(|k| {
            assert!(ranges.remove(range(2 * k, 2 * k)));
        });
        assert_eq!(ranges.ranges.len(), MAX_RANGES);
        let is_wanted =
            |ranges: &IntervalSet, code| ranges.iter().any(|part| part.contains(range(code, code).first));
        (0..3 * MAX_RANGES as u64).for_each(|k| assert!(is_wanted(&ranges, 2 * k + 1)));
        let mut ranges = IntervalSet::default();
        (0..3 * MAX_RANGES as u64).rev().for_each(|k| ranges.put(range(2 * k + 10, 2 * k + 10)));
        assert_eq!(ranges.ranges.len(), MAX_RANGES);
        (0..3 * MAX_RANGES as u64).for_each(|k| assert!(is_wanted(&ranges, 2 * k + 10)));
        assert!(ranges.remove(range(0, 1 << 41)) && ranges.is_empty());
    }
}
