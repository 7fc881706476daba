use crate::sensor::Evidence;
use crate::space::{BrickMask, places};

/// The evidence of the observed voxels of one brick, packed in Morton order: a mask says which voxels are there,
/// and a voxel's rank in the mask is its position in the arrays. Unobserved voxels cost one bit.
#[derive(Clone, Debug, Default)]
pub(super) struct Brick {
    observed: BrickMask,
    /// Number of observed voxels in the words before each word.
    before: [u16; 8],
    log_odds: Box<[f64]>,
    counts: Box<[i32]>,
}

impl Brick {
    pub(super) fn len(&self) -> usize {
        self.counts.len()
    }

    pub(super) fn heap_bytes(&self) -> usize {
        self.len() * (size_of::<f64>() + size_of::<i32>())
    }

    pub(super) fn get(&self, place: usize) -> Option<Evidence> {
        let (word, bit) = (place / 64, place % 64);
        if self.observed[word] >> bit & 1 == 0 {
            return None;
        }
        Some(self.at(self.rank(word, bit)))
    }

    /// Applies `update` to the voxels of `touched`, in Morton order; it gets the place and what was known.
    pub(super) fn update(
        &mut self,
        touched: BrickMask,
        mut update: impl FnMut(usize, Option<Evidence>) -> Evidence,
    ) {
        let known = self.observed;
        self.make_room(touched);
        for place in places(touched) {
            let (word, bit) = (place / 64, place % 64);
            let rank = self.rank(word, bit);
            let before = (known[word] >> bit & 1 == 1).then(|| self.at(rank));
            let after = update(place, before);
            self.log_odds[rank] = after.log_odds;
            self.counts[rank] = after.observation_count;
        }
    }

    /// The observed voxels in Morton order: place and evidence.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, Evidence)> {
        places(self.observed).enumerate().map(|(rank, place)| (place, self.at(rank)))
    }

    fn at(&self, rank: usize) -> Evidence {
        Evidence { log_odds: self.log_odds[rank], observation_count: self.counts[rank] }
    }

    #[inline]
    fn rank(&self, word: usize, bit: usize) -> usize {
        let below = self.observed[word] & ((1 << bit) - 1);
        usize::from(self.before[word]) + below.count_ones() as usize
    }

    /// Adds the voxels of `touched` that are not there yet, with zeros.
    fn make_room(&mut self, touched: BrickMask) {
        let union: BrickMask = std::array::from_fn(|word| self.observed[word] | touched[word]);
        if union == self.observed {
            return;
        }
        let mut log_odds = Vec::with_capacity(total(union));
        let mut counts = Vec::with_capacity(total(union));
        let mut rank = 0;
        for place in places(union) {
            let was_there = self.observed[place / 64] >> (place % 64) & 1 == 1;
            log_odds.push(if was_there { self.log_odds[rank] } else { 0.0 });
            counts.push(if was_there { self.counts[rank] } else { 0 });
            rank += usize::from(was_there);
        }
        *self =
            Self { observed: union, before: before(union), log_odds: log_odds.into(), counts: counts.into() };
    }
}

fn total(mask: BrickMask) -> usize {
    mask.iter().map(|word| word.count_ones() as usize).sum()
}

fn before(mask: BrickMask) -> [u16; 8] {
    let mut sum = 0;
    mask.map(|word| {
        let before = sum;
        sum += word.count_ones() as u16;
        before
    })
}
