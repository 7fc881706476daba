use super::lattice::Lattice;
use super::row::{VoxelRow, VoxelsHead};
use super::{Error, Result};

/// Limit for the cells of a 2D grid.
const MAX_CELLS: u64 = 1 << 31;

/// Grid of voxel columns as a top view. The first row has the largest y.
#[derive(Clone, Debug)]
pub(super) struct ColumnGrid<T> {
    lattice: Lattice,
    /// Lowest voxel of the bounding box.
    lowest: [i64; 3],
    layers: i64,
    width: usize,
    height: usize,
    cells: Vec<T>,
}

impl<T: Copy> ColumnGrid<T> {
    /// Creates a grid for the bounding box in `head`. The first voxel relates indices to coordinates.
    ///
    /// # Errors
    ///
    /// There are more cells than the limit.
    pub(super) fn new(head: &VoxelsHead, first: &VoxelRow, empty: T) -> Result<Self> {
        let lattice = Lattice::of(first, head.resolution_m);
        let [lowest, highest] = head.bounds_m.map(|corner| lattice.index_at(corner));
        let size: [u64; 3] =
            std::array::from_fn(|k| highest[k].saturating_sub(lowest[k]).saturating_add(1).max(0) as u64);
        let [width, height, layers] = size;
        let count = width.checked_mul(height).filter(|&count| count <= MAX_CELLS);
        let too_large = || {
            let reason = format!(
                "{width} x {height} cells of {} m; at most {MAX_CELLS} are supported: choose a region, or use coarser \
                 voxels",
                head.resolution_m
            );
            Error::argument("2D grid", reason)
        };
        let count = count.and_then(|count| usize::try_from(count).ok()).ok_or_else(too_large)?;
        let mut cells = Vec::new();
        cells.try_reserve_exact(count).map_err(|_| too_large())?;
        cells.resize(count, empty);
        // Neither exceeds their product, which was checked.
        let (width, height) = (width as usize, height as usize);
        Ok(Self { lattice, lowest, layers: i64::try_from(layers).unwrap_or(i64::MAX), width, height, cells })
    }

    /// Returns the column of a voxel, and its layer above the lowest one.
    ///
    /// # Errors
    ///
    /// The voxel is outside of the bounding box.
    pub(super) fn column(&mut self, voxel: &VoxelRow) -> Result<(&mut T, i64)> {
        let [x, y, z] = std::array::from_fn(|k| i64::from(voxel.index[k]) - self.lowest[k]);
        let inside = |at: i64, size: usize| usize::try_from(at).ok().filter(|&at| at < size);
        let row = inside(y, self.height).map(|y| self.height - 1 - y);
        let cell = inside(x, self.width).zip(row).filter(|_| (0..self.layers).contains(&z));
        let cell = cell.and_then(|(x, row)| self.cells.get_mut(row * self.width + x));
        let outside = || {
            let reason = format!("voxel {:?} is outside of the announced bounds", voxel.index);
            Error::argument("2D grid", reason)
        };
        cell.map(|cell| (cell, z)).ok_or_else(outside)
    }

    /// Returns the numbers of columns and rows.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Returns the number of layers of the bounding box.
    pub(super) fn layers(&self) -> i64 {
        self.layers
    }

    /// Returns the lower corner of the bounding box.
    pub(super) fn corner_m(&self) -> [f64; 3] {
        self.lattice.corner_m(self.lowest)
    }

    /// Returns the cells row by row, from the largest y down, each row from the smallest x.
    pub(super) fn cells(&self) -> &[T] {
        &self.cells
    }
}

/// Returns the error for a 2D grid without voxels.
pub(super) fn nothing_to_draw() -> Error {
    Error::argument("2D grid", "there are no voxels; an image needs at least one")
}
