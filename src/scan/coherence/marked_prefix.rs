use super::cone::{ALL_CELLS, CELLS, CELLS_PER_SIDE, Cone};
use crate::scan::pages::{MarkedPage, PageMap};
use crate::scan::ray::{RayCut, RayOrigin};

/// For each cone of directions, the number of slabs at the start of its rays in which all voxels are already marked.
///
/// Slabs are layers, one voxel thick, across the main axis of a ray. The marked prefix of a cone is the longest run of
/// slabs, from the sensor on, in which each voxel that rays of the cone can reach is marked. A ray of the cone starts
/// after the prefix, or is skipped if it ends within. Where rays are dense, most rays are skipped or almost skipped.
/// The marks are the same as without prefixes.
#[derive(Clone, Debug, Default)]
pub(crate) struct MarkedPrefixes {
    /// Indexed by [`cell_of`](super::cell_of). The last one, for rays without a direction, remains empty.
    cones: Vec<MarkedPrefix>,
}

#[derive(Clone, Copy, Debug, Default)]
struct MarkedPrefix {
    /// Number of slabs in which each voxel that rays of the cone can reach is marked.
    slabs: u16,
    /// The last slab of the longest ray so far, numbered from 0; later slabs are not examined.
    farthest: u16,
}

impl MarkedPrefix {
    /// Returns whether the prefix was queried by a ray longer than the sensor's slab.
    fn is_used(&self) -> bool {
        self.farthest > 0
    }
}

impl MarkedPrefixes {
    /// Clears the prefixes; the memory is kept.
    pub(crate) fn clear(&mut self) {
        self.cones.clear();
        self.cones.resize(ALL_CELLS + 1, MarkedPrefix::default());
    }

    pub(crate) fn bytes(&self) -> usize {
        self.cones.capacity() * size_of::<MarkedPrefix>()
    }

    /// Number of slabs from the sensor in which all voxels along the ray are marked; `None` if these are all slabs of
    /// the ray. `cell` is the ray's [`cell_of`](super::cell_of), and `last_slab` is numbered from that of the sensor.
    #[inline]
    pub(crate) fn of(&mut self, cell: u32, last_slab: u32) -> Option<u32> {
        let cone = &mut self.cones[cell as usize];
        let last = last_slab.min(u16::MAX.into()) as u16;
        cone.farthest = cone.farthest.max(last);
        (last >= cone.slabs).then_some(cone.slabs.into())
    }

    /// Extends the prefixes by the current marks, in squares of cells with the given edges (powers of two). Large
    /// squares are few and quickly cover the area close to the sensor; small ones extend it. Voxels that `cut` does not
    /// select need not be marked.
    pub(crate) fn extend(
        &mut self,
        pages: &PageMap<MarkedPage>,
        origin: &RayOrigin,
        edges: &[usize],
        cut: Option<&RayCut<'_>>,
    ) {
        for (side, cones) in self.cones[..ALL_CELLS].chunks_mut(CELLS_PER_SIDE).enumerate() {
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
        // The minimum above ignores unused cones, so their first slabs may be unmarked.
        for cell in of_square {
            if cones[cell].is_used() {
                cones[cell].slabs = cones[cell].slabs.max(slabs);
            }
        }
    }
}
