use std::ops::Range;

/// A prime, so that no round has rays of some of a sensor's beams only.
const STRIDE: usize = 17;

/// The points of a round, by their place among 17; those of the first two rounds are spread over all.
const PLACES: [&[u8]; 3] = [&[0], &[7, 14, 4], &[1, 2, 3, 5, 6, 8, 9, 10, 11, 12, 13, 15, 16]];

/// The squares of cones by which it is found out, before each round, what earlier ones have marked.
const SHARED_SQUARES: [&[usize]; 3] = [&[], &[8, 4, 2], &[4, 2, 1]];

/// The rays of fewer points share too little.
const LEAST_POINTS: usize = 2048;

/// Points of a scan whose rays are walked together.
#[derive(Clone, Debug)]
pub(crate) struct Round {
    all: Range<usize>,
    stride: usize,
    places: &'static [u8],
    /// The edges of the squares of cones by which the rays of earlier rounds shall spare these; none for the first round.
    pub(crate) shared_squares: &'static [usize],
}

/// The rounds in which the rays to these points are walked: some of them first, which may spare others much.
pub(crate) fn rounds(points: Range<usize>) -> Vec<Round> {
    if points.len() < LEAST_POINTS {
        return one_round(points);
    }
    let round =
        |(&places, &shared_squares)| Round { all: points.clone(), stride: STRIDE, places, shared_squares };
    PLACES.iter().zip(&SHARED_SQUARES).map(round).collect()
}

/// All at once, in order.
pub(crate) fn one_round(points: Range<usize>) -> Vec<Round> {
    vec![Round { all: points, stride: 1, places: &[0], shared_squares: &[] }]
}

impl Round {
    /// The numbers of the round's points.
    pub(crate) fn points(&self) -> impl Iterator<Item = usize> {
        let firsts = self.all.clone().step_by(self.stride);
        let points =
            firsts.flat_map(|first| self.places.iter().map(move |&place| first + usize::from(place)));
        points.filter(|&point| point < self.all.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_in_one_round() {
        for points in [0..0, 5..6, 0..2047, 100..2148, 3..5000] {
            let mut taken: Vec<usize> = rounds(points.clone()).iter().flat_map(Round::points).collect();
            taken.sort_unstable();
            assert_eq!(taken, points.collect::<Vec<_>>());
        }
    }
}
