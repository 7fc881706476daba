use super::view::View;
use voxtile::space::{Point, VoxelBox, VoxelIndex};

/// Division of a box of voxels into square cells of whole voxels, for a view. Uses integers only, so it is exact at any
/// distance from the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub view: View,
    /// Voxels to draw.
    pub voxels: VoxelBox,
    /// Voxels along a cell's edge.
    pub voxels_a_cell: i64,
    /// Number of cells to the right and up.
    pub cells: [usize; 2],
}

impl Frame {
    /// Returns the frame of a non-empty box with at most `most` cells to the right and up.
    pub fn new(view: View, voxels: VoxelBox, most: [usize; 2]) -> Self {
        let size = view.axes().map(|axis| i64::from(voxels.end[axis]) - i64::from(voxels.min[axis]));
        let needed = |k: usize| size[k].max(1).unsigned_abs().div_ceil(most[k].max(1) as u64);
        let voxels_a_cell = needed(0).max(needed(1));
        let cells = size.map(|size| size.max(1).unsigned_abs().div_ceil(voxels_a_cell) as usize);
        Self { view, voxels, voxels_a_cell: voxels_a_cell as i64, cells }
    }

    /// Returns the index of the cell of a voxel in the box.
    #[inline]
    pub fn place_of(&self, voxel: VoxelIndex) -> usize {
        let [across, up] = self.view.axes().map(|axis| {
            ((i64::from(voxel[axis]) - i64::from(self.voxels.min[axis])) / self.voxels_a_cell) as usize
        });
        across + up * self.cells[0]
    }

    /// Returns the position of a point in cells from the lower left corner.
    pub fn position_of(&self, point_m: Point, resolution_m: f64) -> [f64; 2] {
        self.view.axes().map(|axis| {
            (point_m[axis] / resolution_m - f64::from(self.voxels.min[axis])) / self.voxels_a_cell as f64
        })
    }

    /// Returns the voxels of a range of cells.
    pub fn voxels_of(&self, first: [usize; 2], cells: [usize; 2]) -> VoxelBox {
        let mut voxels = self.voxels;
        for (k, axis) in self.view.axes().into_iter().enumerate() {
            let from = i64::from(self.voxels.min[axis]) + first[k] as i64 * self.voxels_a_cell;
            let end = from + cells[k] as i64 * self.voxels_a_cell;
            // The bounds are inside a box with 32-bit indices.
            voxels.min[axis] = from.min(i64::from(i32::MAX)) as i32;
            voxels.end[axis] = end.min(i64::from(self.voxels.end[axis])) as i32;
        }
        voxels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SideAxis;

    #[test]
    fn a_small_box_has_a_cell_a_voxel() {
        let frame = Frame::new(View::Above, VoxelBox { min: [-10, 20, 0], end: [290, 120, 9] }, [2048; 2]);
        assert_eq!((frame.cells, frame.voxels_a_cell), ([300, 100], 1));
        assert_eq!(frame.place_of([-10, 20, 3]), 0);
        assert_eq!(frame.place_of([289, 119, 3]), 300 * 100 - 1);
        assert_eq!(frame.position_of([-0.95, 2.05, 0.0], 0.1).map(|at| (at * 100.0).round()), [50.0, 50.0]);
    }

    #[test]
    fn a_huge_box_has_cells_of_whole_voxels_and_stays_bounded() {
        let all = VoxelBox { min: [i32::MIN; 3], end: [i32::MAX; 3] };
        let frame = Frame::new(View::Side(SideAxis::Y), all, [1000, 100]);
        assert!(frame.cells[0] <= 1000 && frame.cells[1] <= 100, "{:?}", frame.cells);
        assert_eq!(frame.place_of([i32::MIN; 3]), 0);
        assert!(frame.place_of([0, i32::MAX - 1, i32::MAX - 1]) < frame.cells[0] * frame.cells[1]);
        let part = frame.voxels_of([1, 0], [1, 1]);
        assert_eq!(i64::from(part.min[1]), i64::from(i32::MIN) + frame.voxels_a_cell);
        assert_eq!(part.min[2], i32::MIN);
    }
}
