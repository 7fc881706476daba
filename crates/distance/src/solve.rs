//! From observed voxels to the stored distances of a box.

use crate::bits::bits_from;
use crate::cap::Cap;
use crate::extent::Extent;
use crate::line::{LANES, Line};
use crate::observed::Observed;
use crate::options::{DistanceOptions, UnknownRule};
use crate::transform::Transform;
use crate::voxel_distance::{BEYOND, UNKNOWN};
use rayon::prelude::*;

/// Transforms of a box: to obstacles, and inside of them if the field is signed.
#[derive(Debug)]
pub(crate) struct Solver {
    extent: Extent,
    cap: Cap,
    options: DistanceOptions,
    outside: Transform,
    inside: Option<Transform>,
}

impl Solver {
    pub(crate) fn new(extent: Extent, cap: Cap, options: DistanceOptions) -> Self {
        let transform = || Transform::new(extent, cap);
        Self { extent, cap, options, outside: transform(), inside: options.is_signed.then(transform) }
    }

    /// Bytes of memory to solve a box, with its bits.
    pub(crate) fn bytes_of(size: [usize; 3], cap: Cap, options: &DistanceOptions) -> usize {
        let around = size.map(|edge| edge + 2 * cap.reach);
        let transforms = if options.is_signed { 2 } else { 1 };
        transforms * Transform::bytes_of(size, cap) + Observed::bytes_of(around, options)
    }

    /// Computes all distances. `observed` has the box and its surroundings within the cap.
    pub(crate) fn compute(&mut self, observed: &Observed) {
        self.outside.compute(&observed.obstacles(self.options.unknown));
        if let Some(inside) = &mut self.inside {
            inside.compute(&observed.open());
        }
    }

    /// Computes again what depends on changed rows, as of [`Transform::update`].
    pub(crate) fn update(&mut self, observed: &Observed, is_changed: &[bool]) {
        self.outside.update(&observed.obstacles(self.options.unknown), is_changed);
        if let Some(inside) = &mut self.inside {
            inside.update(&observed.open(), is_changed);
        }
    }

    /// Replaces `lines` by the stored distances, by y, z and chunk.
    pub(crate) fn copy_distances(&self, observed: &Observed, lines: &mut Vec<Line>) {
        lines.clear();
        lines.extend_from_slice(self.outside.lines());
        self.finish(observed, lines);
    }

    /// The stored distances, by y, z and chunk.
    pub(crate) fn into_distances(mut self, observed: &Observed) -> Vec<Line> {
        let outside = std::mem::replace(
            &mut self.outside,
            Transform::new(Extent { min: [0; 3], size: [0; 3] }, self.cap),
        );
        let mut lines = outside.into_lines();
        self.finish(observed, &mut lines);
        lines
    }

    /// Turns squared distances into stored distances.
    fn finish(&self, observed: &Observed, lines: &mut [Line]) {
        let [x_edge, _, z_edge] = self.extent.size;
        let (reach, chunks) = (self.cap.reach, x_edge.div_ceil(LANES));
        let inside = self.inside.as_ref().map(Transform::lines);
        let known = observed.known.as_ref().filter(|_| self.options.unknown == UnknownRule::Unknown);
        let per_row = (chunks * z_edge).max(1);
        lines.par_chunks_mut(per_row).enumerate().for_each(|(y, lines)| {
            for z in 0..z_edge {
                let occupied = observed.occupied.row(y + reach, z + reach);
                let unknown_or_occupied =
                    observed.known.as_ref().map(|known| known.row(y + reach, z + reach));
                let known = known.map(|known| known.row(y + reach, z + reach));
                for chunk in 0..chunks {
                    let line = &mut lines[z * chunks + chunk];
                    line.iter_mut().for_each(|lane| *lane = (*lane).min(BEYOND));
                    let first = reach + chunk * LANES;
                    if let Some(inside) = inside {
                        let mut obstacles = bits_from(occupied, first);
                        if self.options.unknown == UnknownRule::Obstacle
                            && let Some(known) = unknown_or_occupied
                        {
                            obstacles |= !bits_from(known, first);
                        }
                        let inside = &inside[(y * z_edge + z) * chunks + chunk];
                        if obstacles != 0 {
                            let masks = expand(obstacles);
                            for lane in 0..LANES {
                                let depth = -inside[lane].min(BEYOND);
                                line[lane] = line[lane] & !masks[lane] | depth & masks[lane];
                            }
                        }
                    }
                    if let Some(known) = known {
                        let unknown = !bits_from(known, first);
                        if unknown != 0 {
                            let masks = expand(unknown);
                            // Never an obstacle, so the number is not negative, and all its bits set is `UNKNOWN`.
                            for lane in 0..LANES {
                                line[lane] |= masks[lane] & UNKNOWN;
                            }
                        }
                    }
                }
            }
        });
    }
}

/// Returns a lane of ones for each set bit.
#[inline]
fn expand(bits: u32) -> Line {
    let mut line = [0; LANES];
    for (eight, lanes) in bits.to_le_bytes().into_iter().zip(line.chunks_exact_mut(8)) {
        lanes.copy_from_slice(&EXPANDED[usize::from(eight)]);
    }
    line
}

/// For each byte, a lane of ones for each set bit.
static EXPANDED: [[i16; 8]; 256] = {
    let mut lanes = [[0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut bit = 0;
        while bit < 8 {
            lanes[byte][bit] = if byte >> bit & 1 == 1 { -1 } else { 0 };
            bit += 1;
        }
        byte += 1;
    }
    lanes
};
