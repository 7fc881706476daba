use std::ops::Range;

/// A prime, so that no pass takes rays of only some of a sensor's beams.
const STRIDE: usize = 17;

/// The points of each pass, by their remainder modulo the stride. The first two passes are spread over the scan.
const PLACES: [&[u8]; 3] = [&[0], &[7, 14, 4], &[1, 2, 3, 5, 6, 8, 9, 10, 11, 12, 13, 15, 16]];

/// The edges of the squares of cones by which prefixes are extended before each pass.
const SQUARES: [&[usize]; 3] = [&[], &[8, 4, 2], &[4, 2, 1]];

/// The same for fewer than [`MANY_POINTS`]: examining the smallest squares costs more than such rays have in common.
const SQUARES_OF_FEW: [&[usize]; 3] = [&[], &[8, 4], &[4, 2]];

/// About three rays for each of the smallest squares.
const MANY_POINTS: usize = 1 << 14;

/// With fewer points, rays have too little in common.
const MIN_POINTS: usize = 2048;

/// Points of a scan whose rays are walked together.
#[derive(Clone, Debug)]
pub(crate) struct SamplingPass {
    all: Range<usize>,
    stride: usize,
    places: &'static [u8],
    /// The edges of the squares of cones by which the prefixes are extended before this pass; empty for the first.
    pub(crate) squares: &'static [usize],
}

/// Divides the points into passes. The first passes are small; what they mark shortens the rays of the others.
pub(crate) fn sampling_passes(points: Range<usize>) -> Vec<SamplingPass> {
    if points.len() < MIN_POINTS {
        return single_pass(points);
    }
    let squares = if points.len() < MANY_POINTS { &SQUARES_OF_FEW } else { &SQUARES };
    let pass = |(&places, &squares)| SamplingPass { all: points.clone(), stride: STRIDE, places, squares };
    PLACES.iter().zip(squares).map(pass).collect()
}

/// One pass with all points, in order.
pub(crate) fn single_pass(points: Range<usize>) -> Vec<SamplingPass> {
    vec![SamplingPass { all: points, stride: 1, places: &[0], squares: &[] }]
}

impl SamplingPass {
    /// The indices of the pass' points.
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
    fn every_point_is_in_one_pass() {
        for points in [0..0, 5..6, 0..2047, 100..2148, 3..5000] {
            let mut taken: Vec<usize> =
                sampling_passes(points.clone()).iter().flat_map(SamplingPass::points).collect();
            taken.sort_unstable();
            assert_eq!(taken, points.collect::<Vec<_>>());
        }
    }
}
