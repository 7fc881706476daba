use std::ops::Range;

/// Stride of the passes through the points. It is prime, so that each pass has rays of all beams of the sensor.
const STRIDE: usize = 17;

/// Remainders modulo the stride of the points in each pass. The first two passes are spread over the scan.
const PLACES: [&[u8]; 3] = [&[0], &[7, 14, 4], &[1, 2, 3, 5, 6, 8, 9, 10, 11, 12, 13, 15, 16]];

/// Edges of the squares of cones by which prefixes are extended before each pass.
const SQUARES: [&[usize]; 3] = [&[], &[8, 4, 2], &[4, 2, 1]];

/// Like `SQUARES`, for fewer than [`MANY_POINTS`]: such sparse rays share too little to justify the smallest squares.
const SQUARES_OF_FEW: [&[usize]; 3] = [&[], &[8, 4], &[4, 2]];

/// Number of points of a dense scan: about three rays per smallest square.
const MANY_POINTS: usize = 1 << 14;

/// Minimum number of points for several passes. With fewer points, rays share too few voxels.
const MIN_POINTS: usize = 2048;

/// Points of a scan whose rays are traced together.
#[derive(Clone, Debug)]
pub(crate) struct SamplingPass {
    all: Range<usize>,
    stride: usize,
    places: &'static [u8],
    /// Edges of the squares of cones by which the prefixes are extended before this pass; empty for the first.
    pub(crate) squares: &'static [usize],
}

/// Divides the points into passes. The first passes are small; their marks shorten the rays of the others.
pub(crate) fn sampling_passes(points: Range<usize>) -> Vec<SamplingPass> {
    if points.len() < MIN_POINTS {
        return single_pass(points);
    }
    let squares = if points.len() < MANY_POINTS { &SQUARES_OF_FEW } else { &SQUARES };
    let pass = |(&places, &squares)| SamplingPass { all: points.clone(), stride: STRIDE, places, squares };
    PLACES.iter().zip(squares).map(pass).collect()
}

/// Returns one pass with all points, in order.
pub(crate) fn single_pass(points: Range<usize>) -> Vec<SamplingPass> {
    vec![SamplingPass { all: points, stride: 1, places: &[0], squares: &[] }]
}

impl SamplingPass {
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
    fn each_point_is_in_one_pass() {
        for points in [0..0, 5..6, 0..2047, 100..2148, 3..5000] {
            let mut taken: Vec<usize> =
                sampling_passes(points.clone()).iter().flat_map(SamplingPass::points).collect();
            taken.sort_unstable();
            assert_eq!(taken, points.collect::<Vec<_>>());
        }
    }
}
