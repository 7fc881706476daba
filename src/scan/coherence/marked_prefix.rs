use super::cone::{CELLS, CELLS_PER_SIDE, Cone, SIDES, cell_of};
use crate::scan::pages::{MarkedPage, PageMap};
use crate::scan::ray::{RayCut, RayOrigin, SlabRay};

/// How many slabs at the start of a ray are marked already, by rays of nearly the same direction.
///
/// The directions from the sensor are divided into cones. For each cone, the first slabs in which every voxel that a
/// ray of the cone can reach is marked are its marked prefix. A ray of the cone starts behind the prefix, or is skipped
/// if it ends within. Where rays are dense, most rays are skipped or nearly so. The resulting marks are the same.
#[derive(Clone, Debug, Default)]
pub(crate) struct MarkedPrefixes {
    /// By cell, as [`cell_of`] counts them.
    cones: Vec<MarkedPrefix>,
}

#[derive(Clone, Copy, Debug, Default)]
struct MarkedPrefix {
    /// Slabs in which every voxel that a ray of the cone can reach is marked.
    slabs: u16,
    /// The last slab of the longest ray so far, counted from 0; no slab beyond it is examined.
    farthest: u16,
}

impl MarkedPrefix {
    /// Whether a ray longer than the sensor's slab has asked for the prefix.
    fn is_used(&self) -> bool {
        self.farthest > 0
    }
}

impl MarkedPrefixes {
    /// Forgets everything; the memory is kept.
    pub(crate) fn clear(&mut self) {
        self.cones.clear();
        self.cones.resize(SIDES * CELLS_PER_SIDE, MarkedPrefix::default());
    }

    /// Bytes of memory on the heap.
    pub(crate) fn bytes(&self) -> usize {
        self.cones.capacity() * size_of::<MarkedPrefix>()
    }

    /// Number of slabs from the sensor on whose voxels along the ray are all marked; `None` if that is the whole ray.
    #[inline]
    pub(crate) fn of(&mut self, ray: &SlabRay) -> Option<u32> {
        let Some(cell) = cell_of(ray) else { return Some(0) };
        let cone = &mut self.cones[cell];
        let last = ray.last_slab().min(u16::MAX.into()) as u16;
        cone.farthest = cone.farthest.max(last);
        (last >= cone.slabs).then_some(cone.slabs.into())
    }

    /// Extends the prefixes by the present marks, in squares of cells with these edges (powers of two). Large squares
    /// are few and quickly cover what is near the sensor; small ones go on from there. What `cut` does not select need
    /// not be marked.
    pub(crate) fn extend(
        &mut self,
        pages: &PageMap<MarkedPage>,
        origin: &RayOrigin,
        edges: &[usize],
        cut: Option<&RayCut<'_>>,
    ) {
        for (side, cones) in self.cones.chunks_mut(CELLS_PER_SIDE).enumerate() {
            for &edge in edges {
                match side / 2 {
                    0 => extend_side::<0, 1, 2>(cones, side, pages, origin, edge, cut),
                    1 => extend_side::<1, 0, 2>(cones, side, pages, origin, edge, cut),
                    _ => extend_side::<2, 0, 1>(cones, side, pages, origin, edge, cut),
                }
            }
        }
    }
}

fn extend_side<const A: usize, const B: usize, const C: usize>(
    cones: &mut [MarkedPrefix],
    side: usize,
    pages: &PageMap<MarkedPage>,
    origin: &RayOrigin,
    edge: usize,
    cut: Option<&RayCut<'_>>,
) {
    let window = pages.window();
    let corners = (0..CELLS).step_by(edge).flat_map(|b| (0..CELLS).step_by(edge).map(move |c| [b, c]));
    for corner in corners {
        let rows = (corner[0]..corner[0] + edge).map(|b| b * CELLS + corner[1]);
        let of_square = rows.flat_map(|first| first..first + edge);
        let (mut slabs, mut farthest) = (u16::MAX, 0);
        for cone in of_square.clone().map(|cell| cones[cell]).filter(MarkedPrefix::is_used) {
            slabs = slabs.min(cone.slabs);
            farthest = farthest.max(cone.farthest);
        }
        let cone = Cone::new::<A, B, C>(origin, window.base(), side, corner, edge);
        let is_marked = |slab: u16| {
            let (low, high) = cone.in_slab::<A, B, C>(slab.into());
            window.holds(low)
                && window.holds(high)
                && match cut {
                    None => pages.are_marked(low, high),
                    Some(cut) => {
                        cut.for_all_selected(window, low, high, |low, high| pages.are_marked(low, high))
                    }
                }
        };
        while slabs <= farthest && is_marked(slabs) {
            slabs += 1;
        }
        // For unused cones it is unknown whether the slabs before are marked.
        for cell in of_square {
            if cones[cell].is_used() {
                cones[cell].slabs = cones[cell].slabs.max(slabs);
            }
        }
    }
}
