use crate::scan::pages::Local;
use crate::scan::ray::{RayOrigin, SlabRay, voxel};
use crate::space::{Point, VoxelIndex};

/// Number of sides of a cube around the sensor: two per axis, the lower first.
pub(crate) const SIDES: usize = 6;

/// Cells along the edge of a side. At 16 voxels from the sensor a cell is one voxel wide.
pub(crate) const CELLS: usize = 32;

pub(crate) const CELLS_PER_SIDE: usize = CELLS * CELLS;

/// Width of a cell at distance 1.
const CELL: f64 = 2.0 / CELLS as f64;

/// Tolerance in voxels, far above the rounding error of a ray.
const MARGIN: f64 = 1e-6;

/// Cone of directions from a sensor through a square of cells on one side of a cube around it.
pub(crate) struct Cone {
    /// Position of the sensor relative to the lowest voxel of the window, along `B` and `C`.
    origin: [f64; 2],
    /// Smallest slope along `B` and `C` per voxel along `A`. The largest is this plus `width`.
    slope: [f64; 2],
    width: f64,
    /// Distance along `A` from the sensor to the border at which rays leave its slab, in voxels.
    first_slab: f64,
    slab: u32,
    is_up: bool,
}

/// Returns the index of the cell through which a ray passes, over all sides; `None` for a ray too short to have a
/// direction.
#[inline]
pub(crate) fn cell_of(ray: &SlabRay) -> Option<usize> {
    let [x, y, z] = ray.direction;
    let [a, b, c] = match ray.axis {
        0 => [x, y, z],
        1 => [y, x, z],
        _ => [z, x, y],
    };
    // Position on the side, from 0 to `CELLS`.
    let place = |slope: f64| (slope * ray.per_slab + 1.0) * (CELLS / 2) as f64;
    let cell = |slope: f64| (place(slope) as i32 as usize).min(CELLS - 1);
    let side = 2 * ray.axis + usize::from(a > 0.0);
    ray.per_slab.is_finite().then(|| (side * CELLS + cell(b)) * CELLS + cell(c))
}

impl Cone {
    /// Creates the cone of a square of cells on a side across axis `A`. The square is defined by its lowest cell along
    /// `B` and `C` and its edge in cells; `base` is the lowest voxel of the window.
    pub(crate) fn new<const A: usize, const B: usize, const C: usize>(
        origin: &RayOrigin,
        base: VoxelIndex,
        side: usize,
        corner: [usize; 2],
        edge: usize,
    ) -> Self {
        let local: Point = std::array::from_fn(|k| origin.point[k] - f64::from(base[k]));
        let slab = (origin.voxel[A] - base[A]) as u32;
        let is_up = side % 2 == 1;
        let within = local[A] - f64::from(slab);
        Self {
            origin: [local[B], local[C]],
            slope: corner.map(|cell| cell as f64 * CELL - 1.0),
            width: edge as f64 * CELL,
            first_slab: if is_up { 1.0 - within } else { within },
            slab,
            is_up,
        }
    }

    /// Returns the lowest and highest voxel that rays of the cone can cross in a slab, numbered from the sensor's slab.
    #[inline]
    pub(crate) fn in_slab<const A: usize, const B: usize, const C: usize>(
        &self,
        slab: u32,
    ) -> (Local, Local) {
        let far = self.first_slab + f64::from(slab);
        let near = (far - 1.0).max(0.0);
        let span = |k: usize| {
            let (least, most) = (self.slope[k], self.slope[k] + self.width);
            let low = least * if least < 0.0 { far } else { near };
            let high = most * if most < 0.0 { near } else { far };
            // Clamped to 0 below the window, where no ray that ends in the window can pass.
            let index = |at: f64| at as i32 as u32;
            (index(self.origin[k] + low - MARGIN), index(self.origin[k] + high + MARGIN))
        };
        let a = if self.is_up { self.slab.wrapping_add(slab) } else { self.slab.wrapping_sub(slab) };
        let ((low_b, high_b), (low_c, high_c)) = (span(0), span(1));
        (voxel::<A, B, C>(a, low_b, low_c), voxel::<A, B, C>(a, high_b, high_c))
    }
}
