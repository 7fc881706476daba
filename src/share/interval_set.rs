use super::set_range::{SetPosition, SetRange};
use std::collections::BTreeMap;

/// Disjoint parts of a set, to be ticked off. There never are more than so many: beyond that, some are taken together or
/// not ticked off, which costs bytes on the link and nothing else.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    /// Where each begins and ends.
    parts: BTreeMap<SetPosition, SetPosition>,
}

const MAX_PARTS: usize = 2048;

impl Parts {
    /// Bytes of memory, at most: 11 parts in a node, five at least.
    pub(super) const MOST_BYTES: usize = MAX_PARTS / 5 * 11 * size_of::<SetRange>() * 5 / 4;

    pub(super) fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    pub(super) fn is_half_full(&self) -> bool {
        self.parts.len() >= MAX_PARTS / 2
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = SetRange> {
        self.parts.iter().map(|(&first, &last)| SetRange { first, last })
    }

    /// Puts a part in, apart from those beside it.
    pub(super) fn put(&mut self, part: SetRange) {
        self.remove(part);
        // Some of it may still be there, where there was no room for what is left of another.
        if self.overlapping(part).next().is_some() {
            return;
        }
        if self.parts.len() >= MAX_PARTS
            && let Some((_, last)) = self.parts.range_mut(..part.first).next_back()
        {
            *last = part.last;
            return;
        }
        if self.parts.len() < MAX_PARTS {
            self.parts.insert(part.first, part.last);
        } else if let Some((_, last)) = self.parts.pop_first() {
            // It lies before all others.
            self.parts.insert(part.first, last);
        }
    }

    /// Takes a part away; whether there was any of it.
    pub(super) fn remove(&mut self, part: SetRange) -> bool {
        let there: Vec<SetRange> = self.overlapping(part).collect();
        for &range in &there {
            let is_split = range.first < part.first && part.last < range.last;
            if is_split && self.parts.len() >= MAX_PARTS {
                continue;
            }
            self.parts.remove(&range.first);
            if range.first < part.first {
                self.parts.insert(range.first, part.first.before());
            }
            if part.last < range.last {
                self.parts.insert(part.last.next(), range.last);
            }
        }
        !there.is_empty()
    }

    /// The parts that reach into a range, in order.
    fn overlapping(&self, range: SetRange) -> impl Iterator<Item = SetRange> {
        let begin = match self.parts.range(..=range.first).next_back() {
            Some((&first, &last)) if last >= range.first => first,
            _ => range.first,
        };
        self.parts.range(begin..=range.last).map(|(&first, &last)| SetRange { first, last })
    }
}

impl FromIterator<SetRange> for Parts {
    fn from_iter<T: IntoIterator<Item = SetRange>>(parts: T) -> Self {
        let mut all = Self::default();
        parts.into_iter().for_each(|part| all.put(part));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Random;
    use crate::space::TileIndex;

    fn range(first: u64, last: u64) -> SetRange {
        let position = |code| SetPosition { tile: TileIndex::new(0, 0, 0), code };
        SetRange { first: position(first), last: position(last) }
    }

    #[test]
    fn what_is_put_in_and_taken_away_is_as_in_a_plain_list() {
        for seed in 0..100 {
            let mut random = Random::of(seed, &[]);
            let (mut parts, mut plain) = (Parts::default(), [false; 50]);
            for _ in 0..60 {
                let mut ends = [random.below(50), random.below(50)];
                ends.sort_unstable();
                let is_in = random.chance(0.5);
                let touched = &mut plain[ends[0] as usize..=ends[1] as usize];
                let part = range(ends[0], ends[1]);
                if is_in {
                    parts.put(part);
                } else {
                    assert_eq!(parts.remove(part), touched.contains(&true));
                }
                touched.fill(is_in);
                for (k, is_in) in plain.iter().enumerate() {
                    let position = range(k as u64, k as u64).first;
                    let holders = parts.iter().filter(|part| part.contains(position)).count();
                    assert_eq!(holders, usize::from(*is_in), "{seed} {k}");
                }
            }
        }
    }

    #[test]
    fn there_never_are_too_many_and_none_is_lost() {
        let mut parts = Parts::default();
        parts.put(range(0, 1 << 40));
        // Every second place came: far more pieces than there may be.
        (0..3 * MAX_PARTS as u64).for_each(|k| {
            assert!(parts.remove(range(2 * k, 2 * k)));
        });
        assert_eq!(parts.parts.len(), MAX_PARTS);
        let is_wanted = |parts: &Parts, code| parts.iter().any(|part| part.contains(range(code, code).first));
        (0..3 * MAX_PARTS as u64).for_each(|k| assert!(is_wanted(&parts, 2 * k + 1)));
        let mut parts = Parts::default();
        (0..3 * MAX_PARTS as u64).rev().for_each(|k| parts.put(range(2 * k + 10, 2 * k + 10)));
        assert_eq!(parts.parts.len(), MAX_PARTS);
        (0..3 * MAX_PARTS as u64).for_each(|k| assert!(is_wanted(&parts, 2 * k + 10)));
        assert!(parts.remove(range(0, 1 << 41)) && parts.is_empty());
    }
}
