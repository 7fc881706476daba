use crate::scan::pages::Local;
use crate::scan::ray::{RayOrigin, Slope, voxel};
use crate::space::{Grid, Point, VoxelIndex};

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

/// Number of cells over all sides.
pub(crate) const ALL_CELLS: usize = SIDES * CELLS_PER_SIDE;

/// In place of a cell: a ray too short to have a direction.
pub(crate) const NO_DIRECTION: u32 = ALL_CELLS as u32;

/// Returns the number of the cell through which a ray passes, over all sides, or [`NO_DIRECTION`]. Without branches, so
/// that a loop over many rays becomes vector instructions.
#[inline]
pub(crate) fn cell_of(slope: &Slope) -> u32 {
    // Position on the side, from 0 to `CELLS`, apart from rounding.
    let place = |across: f64| (across * slope.per_slab + 1.0) * (CELLS / 2) as f64;
    let cell = |across: f64| Grid::floor_of_fitting(place(across)).clamp(0, CELLS as i32 - 1) as u32;
    let side = 2 * slope.axis + u32::from(slope.along > 0.0);
    let [b, c] = slope.across.map(cell);
    let number = (side * CELLS as u32 + b) * CELLS as u32 + c;
    if slope.per_slab < f64::INFINITY { number } else { NO_DIRECTION }
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
