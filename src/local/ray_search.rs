use super::page_table::PageTable;
use super::place::{cell_at, in_box, mirrored, place_of};
use super::sparse::Sparse64;
use super::tree::{Node, Page, Tree};
use crate::scan::RayWalk;
use crate::space::{Point, VoxelIndex};

/// Finds the voxels with occupancy that a ray visits, exactly those that [`RayWalk`] visits before its last voxel.
///
/// A ray crosses borders in the order of their times, of equal times the lowest axis first. So it visits a voxel if and only
/// if it crosses all borders into it before any border out of it, and so it is with larger cells, whose borders are borders
/// between voxels with the same times to the bit. Nobody has to walk there: of the cells that hold something and that are
/// near to the ray, each is asked for itself.
#[derive(Clone, Debug)]
pub(super) struct RaySearch {
    origin: Point,
    direction: Point,
    inv_direction: Point,
    step: [i32; 3],
    start: VoxelIndex,
    last: VoxelIndex,
    /// The highest place of a cell along the axes on which the ray goes down, else 0: with it places count in the order in
    /// which the ray comes to them.
    flip: usize,
}

/// From when to when a ray is in a cell.
#[derive(Clone, Copy, Debug)]
struct Stay {
    enter: f64,
    leave: f64,
}

/// Where the walk from page to page is.
struct Cursor {
    page: VoxelIndex,
    next: Point,
    enter: f64,
}

impl RaySearch {
    /// The ray from `origin` to `end`, both in units of voxels and inside `start` and `last`, their voxels.
    pub(super) fn new(origin: Point, start: VoxelIndex, end: Point, last: VoxelIndex) -> Self {
        let direction: Point = std::array::from_fn(|k| end[k] - origin[k]);
        Self {
            origin,
            direction,
            inv_direction: direction.map(|d| 1.0 / d),
            step: std::array::from_fn(|k| (last[k] - start[k]).signum()),
            start,
            last,
            flip: (0..3).map(|k| if last[k] < start[k] { 3 << (2 * k) } else { 0 }).sum(),
        }
    }

    /// Visits the number of each voxel with occupancy on the ray, from the first up to, not including, the last.
    #[inline]
    pub(super) fn for_each_stored(
        &self,
        tree: &Tree,
        pages: &PageTable,
        end: Point,
        mut visit: impl FnMut(u32),
    ) {
        // A ray that hardly moves along an axis has no number for the times there.
        let is_sound = |k: usize| self.step[k] == 0 || self.inv_direction[k].abs() < 1e30;
        if !(is_sound(0) && is_sound(1) && is_sound(2)) {
            return self.for_each_stored_by_steps(tree, end, visit);
        }
        let page = self.start.map(|k| k >> 6);
        let mut at =
            Cursor { page, next: std::array::from_fn(|k| self.leave_time::<6>(k, page[k])), enter: 0.0 };
        loop {
            let (axis, leave) = earliest(at.next);
            if let Some(page) = pages.get(tree, at.page) {
                self.search_page(tree, tree.pages.get(page), Stay { enter: at.enter, leave }, &mut visit);
            }
            if leave == f64::INFINITY {
                return;
            }
            at.page[axis] += self.step[axis];
            at.next[axis] = self.leave_time::<6>(axis, at.page[axis]);
            at.enter = leave;
        }
    }

    #[cold]
    fn for_each_stored_by_steps(&self, tree: &Tree, end: Point, mut visit: impl FnMut(u32)) {
        RayWalk::between(self.origin, self.start, end, self.last).for_each_before_end(|voxel| {
            let block = tree.block_at(voxel.map(|k| k >> 2)).map(|block| tree.blocks.get(block));
            if let Some(voxel) = block.and_then(|block| block.voxels.get(&tree.lists, place_of(voxel))) {
                visit(voxel);
            }
        });
    }

    fn search_page(&self, tree: &Tree, page: &Page, stay: Stay, visit: &mut impl FnMut(u32)) {
        self.search::<4>(page.index, page.stored, stay, |cell, place, stay| {
            if let Some(node) = page.nodes.get(&tree.lists, place) {
                self.search_node(tree, tree.nodes.get(node), cell, stay, visit);
            }
        });
    }

    #[inline]
    fn search_node(&self, tree: &Tree, node: &Node, at: VoxelIndex, stay: Stay, visit: &mut impl FnMut(u32)) {
        self.search::<2>(at, node.stored, stay, |cell, place, stay| {
            if let Some(block) = node.blocks.get(&tree.lists, place) {
                self.search_block(tree, &tree.blocks.get(block).voxels, cell, stay, visit);
            }
        });
    }

    #[inline]
    fn search_block(
        &self,
        tree: &Tree,
        stored: &Sparse64,
        at: VoxelIndex,
        stay: Stay,
        visit: &mut impl FnMut(u32),
    ) {
        self.search::<0>(at, stored.mask, stay, |cell, place, _| {
            if cell != self.last
                && let Some(voxel) = stored.get(&tree.lists, place)
            {
                visit(voxel);
            }
        });
    }

    /// Visits those cells of `2^SHIFT` voxels in a cell of four times that along an edge that are in the mask and that the ray
    /// visits, in the order in which it comes to them. `stay` is that of the larger cell.
    #[inline]
    fn search<const SHIFT: u32>(
        &self,
        parent: VoxelIndex,
        mask: u64,
        stay: Stay,
        mut visit: impl FnMut(VoxelIndex, usize, Stay),
    ) {
        let mut near = mask & self.near::<SHIFT>(parent, stay);
        if near & near.wrapping_sub(1) != 0 {
            near = mirrored(near, self.flip);
        } else if near == 0 {
            return;
        } else {
            near = 1 << (near.trailing_zeros() as usize ^ self.flip);
        }
        while near != 0 {
            let place = near.trailing_zeros() as usize ^ self.flip;
            near &= near - 1;
            let cell = cell_at(parent, place);
            if let Some(stay) = self.stay_in::<SHIFT>(cell) {
                visit(cell, place, stay);
            }
        }
    }

    /// The places in a cell, of cells of `2^SHIFT` voxels, that lie in a box around the ray's way through it, none outside the
    /// box of its two ends.
    #[inline]
    fn near<const SHIFT: u32>(&self, parent: VoxelIndex, stay: Stay) -> u64 {
        // In cells; the times' and sums' rounding is a thousandth of this or less.
        const MARGIN: f64 = 1e-3;
        let cells_per_voxel = 1.0 / f64::from(1 << SHIFT);
        let range = |k: usize| {
            let from_parent = self.origin[k] - f64::from(parent[k] << (SHIFT + 2));
            let a = (from_parent + self.direction[k] * stay.enter) * cells_per_voxel;
            let b = (from_parent + self.direction[k] * stay.leave.min(1.0)) * cells_per_voxel;
            let (low, high) = if a < b { (a, b) } else { (b, a) };
            let (first, last) = (self.start[k].min(self.last[k]), self.start[k].max(self.last[k]));
            let in_parent = |voxel: i32| ((voxel >> SHIFT) - (parent[k] << 2)).clamp(0, 3);
            // Conversions to integers round towards 0 and saturate.
            let low = ((low - MARGIN) as i32).max(in_parent(first));
            let high = ((high + MARGIN) as i32).min(in_parent(last));
            (low as usize & 3, high as usize & 3)
        };
        in_box(range(0), range(1), range(2))
    }

    /// From when to when the ray is in a cell of `2^SHIFT` voxels, if it visits it; the cell is in the box of the ray's ends.
    #[inline]
    fn stay_in<const SHIFT: u32>(&self, cell: VoxelIndex) -> Option<Stay> {
        let [ex, ey, ez]: Point = std::array::from_fn(|k| self.enter_time::<SHIFT>(k, cell[k]));
        let [lx, ly, lz]: Point = std::array::from_fn(|k| self.leave_time::<SHIFT>(k, cell[k]));
        // Of equal times the lowest axis goes first.
        let is_visited = (ex <= ly) & (ex <= lz) & (ey < lx) & (ey <= lz) & (ez < lx) & (ez < ly);
        is_visited.then(|| Stay { enter: ex.max(ey).max(ez).max(0.0), leave: lx.min(ly).min(lz) })
    }

    /// Time at which the ray enters a cell of `2^SHIFT` voxels along `axis`; minus infinity for the first.
    #[inline]
    fn enter_time<const SHIFT: u32>(&self, axis: usize, cell: i32) -> f64 {
        match cell == self.start[axis] >> SHIFT {
            true => f64::NEG_INFINITY,
            false => self.time(axis, (cell + i32::from(self.step[axis] < 0)) << SHIFT),
        }
    }

    /// Time at which the ray leaves a cell of `2^SHIFT` voxels along `axis`; infinite for the last.
    #[inline]
    fn leave_time<const SHIFT: u32>(&self, axis: usize, cell: i32) -> f64 {
        match cell == self.last[axis] >> SHIFT {
            true => f64::INFINITY,
            false => self.time(axis, (cell + i32::from(self.step[axis] > 0)) << SHIFT),
        }
    }

    /// Time at which the ray crosses a border between voxels, as [`RayWalk`] has it.
    #[inline]
    fn time(&self, axis: usize, border: i32) -> f64 {
        (f64::from(border) - self.origin[axis]) * self.inv_direction[axis]
    }
}

/// The axis with the least time, the lowest of equals, and that time.
#[inline]
fn earliest([x, y, z]: Point) -> (usize, f64) {
    if x <= y && x <= z {
        (0, x)
    } else if y <= z {
        (1, y)
    } else {
        (2, z)
    }
}
