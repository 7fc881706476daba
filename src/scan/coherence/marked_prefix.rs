use super::cone::{CELLS, CELLS_OF_SIDE, Cone, SIDES, cell_of};
use crate::scan::pages::{MarkedPage, PageMap};
use crate::scan::ray::{RayOrigin, SlabRay};

/// How much of a ray need not be walked, because rays of nearly the same direction have marked it already.
///
/// The directions from the sensor are cut into cones. Of each cone it is known how many slabs, counted from the
/// sensor's, are marked wherever a ray of the cone can get to; such a ray begins after them, or is marked altogether.
/// Where rays are dense, that is nearly all of most of them. What is marked in the end does not depend on it.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeadStarts {
    /// By cell, as [`cell_of`] counts them.
    cones: Vec<HeadStart>,
}

#[derive(Clone, Copy, Debug, Default)]
struct HeadStart {
    /// Slabs that are marked wherever a ray of the cone can get to.
    slabs: u16,
    /// The slab of the farthest end of a ray so far, counted from 0: what lies beyond is not asked for.
    farthest: u16,
}

impl HeadStart {
    /// Whether a ray has come that is longer than the sensor's slab.
    fn is_asked(&self) -> bool {
        self.farthest > 0
    }
}

impl HeadStarts {
    /// Forgets everything; the memory is kept.
    pub(crate) fn clear(&mut self) {
        self.cones.clear();
        self.cones.resize(SIDES * CELLS_OF_SIDE, HeadStart::default());
    }

    /// Bytes of memory on the heap.
    pub(crate) fn bytes(&self) -> usize {
        self.cones.capacity() * size_of::<HeadStart>()
    }

    /// In how many slabs from the sensor on all that the ray passes is marked; `None` if that is all of it.
    #[inline]
    pub(crate) fn of(&mut self, ray: &SlabRay) -> Option<u32> {
        let Some(cell) = cell_of(ray) else { return Some(0) };
        let cone = &mut self.cones[cell];
        let last = ray.slabs().min(u16::MAX.into()) as u16;
        cone.farthest = cone.farthest.max(last);
        (last >= cone.slabs).then_some(cone.slabs.into())
    }

    /// Learns from the marks that there are now, by squares of cells of these edges, powers of two: large ones are few and
    /// soon tell of what is near the sensor, small ones go on from there.
    pub(crate) fn extend(&mut self, pages: &PageMap<MarkedPage>, origin: &RayOrigin, edges: &[usize]) {
        for (side, cones) in self.cones.chunks_mut(CELLS_OF_SIDE).enumerate() {
            for &edge in edges {
                match side / 2 {
                    0 => extend_side::<0, 1, 2>(cones, side, pages, origin, edge),
                    1 => extend_side::<1, 0, 2>(cones, side, pages, origin, edge),
                    _ => extend_side::<2, 0, 1>(cones, side, pages, origin, edge),
                }
            }
        }
    }
}

fn extend_side<const A: usize, const B: usize, const C: usize>(
    cones: &mut [HeadStart],
    side: usize,
    pages: &PageMap<MarkedPage>,
    origin: &RayOrigin,
    edge: usize,
) {
    let window = pages.window();
    let corners = (0..CELLS).step_by(edge).flat_map(|b| (0..CELLS).step_by(edge).map(move |c| [b, c]));
    for corner in corners {
        let rows = (corner[0]..corner[0] + edge).map(|b| b * CELLS + corner[1]);
        let of_square = rows.flat_map(|first| first..first + edge);
        let (mut slabs, mut farthest) = (u16::MAX, 0);
        for cone in of_square.clone().map(|cell| cones[cell]).filter(HeadStart::is_asked) {
            slabs = slabs.min(cone.slabs);
            farthest = farthest.max(cone.farthest);
        }
        let cone = Cone::new::<A, B, C>(origin, window.base(), side, corner, edge);
        let is_marked = |slab: u16| {
            let (low, high) = cone.in_slab::<A, B, C>(slab.into());
            window.holds(low) && window.holds(high) && pages.are_marked(low, high)
        };
        while slabs <= farthest && is_marked(slabs) {
            slabs += 1;
        }
        // Of the others it is not known what is marked before.
        for cell in of_square {
            if cones[cell].is_asked() {
                cones[cell].slabs = cones[cell].slabs.max(slabs);
            }
        }
    }
}
