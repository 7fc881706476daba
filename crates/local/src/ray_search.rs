use super::page_table::PageTable;
use super::place::{cell_at, in_box, mirrored, place_of};
use super::sparse::Sparse64;
use super::tree::{Node, Page, Tree};
use voxtile::scan::RayWalk;
use voxtile::space::{Point, VoxelIndex};

/// Finds the stored voxels on a ray: exactly those that [`RayWalk`] visits before its last voxel.
///
/// A ray crosses voxel borders in the order of their times, at equal times the lowest axis first. So it visits a voxel
/// if and only if it crosses all borders into it before any border out of it. The same holds for larger cells, whose
/// borders are voxel borders with bit-identical times. Each non-empty cell near the ray can therefore be tested by
/// itself, without a walk.
#[derive(Clone, Debug)]
pub(super) struct RaySearch {
    origin: Point,
    direction: Point,
    inv_direction: Point,
    step: [i32; 3],
    start: VoxelIndex,
    last: VoxelIndex,
    /// Bounds of the ray: the voxels of its two ends, shrunk by a quarter of a voxel at their outer borders.
    low: Point,
    high: Point,
    /// XOR mask that sorts positions in the order of the ray: all bits of the axes along which the ray descends.
    flip: usize,
}

/// Times at which a ray enters and leaves a cell.
#[derive(Clone, Copy, Debug)]
struct Stay {
    enter: f64,
    leave: f64,
}

/// Position of the walk from page to page.
struct Cursor {
    page: VoxelIndex,
    next: Point,
    enter: f64,
}

impl RaySearch {
    /// Creates the ray from `origin` to `end`, in units of voxels; `start` and `last` are the voxels that contain them.
    pub(super) fn new(origin: Point, start: VoxelIndex, end: Point, last: VoxelIndex) -> Self {
        let direction: Point = std::array::from_fn(|k| end[k] - origin[k]);
        Self {
            origin,
            direction,
            inv_direction: direction.map(|d| 1.0 / d),
            step: std::array::from_fn(|k| (last[k] - start[k]).signum()),
            start,
            last,
            low: std::array::from_fn(|k| f64::from(start[k].min(last[k])) + 0.25),
            high: std::array::from_fn(|k| f64::from(start[k].max(last[k])) + 0.75),
            flip: (0..3).map(|k| if last[k] < start[k] { 3 << (2 * k) } else { 0 }).sum(),
        }
    }

    /// Visits the number of each stored voxel on the ray in order, excluding the last voxel.
    #[inline]
    pub(super) fn for_each_stored(
        &self,
        tree: &Tree,
        pages: &PageTable,
        end: Point,
        mut visit: impl FnMut(u32),
    ) {
        // Times are not usable along an axis on which the ray hardly moves.
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
        let end = if at == self.last.map(|k| k >> 4) { self.block_of_end_alone(tree, node) } else { 0 };
        self.search::<2>(at, node.stored & !end, stay, |cell, place, stay| {
            if let Some(block) = node.blocks.get(&tree.lists, place) {
                self.search_block(tree, &tree.blocks.get(block).voxels, cell, stay, visit);
            }
        });
    }

    /// Returns the mask of the block that contains the ray's end, or 0 if the block has other stored voxels. Without
    /// other voxels the block need not be searched, because the end is not visited.
    #[inline]
    fn block_of_end_alone(&self, tree: &Tree, node: &Node) -> u64 {
        let place = place_of(self.last.map(|k| k >> 2));
        let block = node.blocks.get(&tree.lists, place).map(|block| tree.blocks.get(block));
        let is_alone = block.is_some_and(|block| block.voxels.mask == 1 << place_of(self.last));
        u64::from(is_alone) << place
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
        let is_end = at == self.last.map(|k| k >> 2);
        let before_end = stored.mask & !(u64::from(is_end) << place_of(self.last));
        self.search::<0>(at, before_end, stay, |_, place, _| {
            if let Some(voxel) = stored.get(&tree.lists, place) {
                visit(voxel);
            }
        });
    }

    /// Visits the cells of `2^SHIFT` voxels that are in the mask and on the ray, in the order of the ray. `stay` is the
    /// time span of the ray in their parent.
    #[inline]
    fn search<const SHIFT: u32>(
        &self,
        parent: VoxelIndex,
        mask: u64,
        stay: Stay,
        mut visit: impl FnMut(VoxelIndex, usize, Stay),
    ) {
        if mask == 0 {
            return;
        }
        // There is no branch per cell, because it would be unpredictable.
        let (mut near, mut visited) = (mask & self.near::<SHIFT>(parent, stay), 0_u64);
        while near != 0 {
            let place = near.trailing_zeros() as usize;
            near &= near - 1;
            visited |= u64::from(self.visits::<SHIFT>(cell_at(parent, place))) << place;
        }
        if visited == 0 {
            return;
        }
        let mut in_order = mirrored(visited, self.flip);
        while in_order != 0 {
            let place = in_order.trailing_zeros() as usize ^ self.flip;
            in_order &= in_order - 1;
            let cell = cell_at(parent, place);
            visit(cell, place, self.stay_in::<SHIFT>(cell));
        }
    }

    /// Returns the cells of `2^SHIFT` voxels of a parent that are in the box around the ray's part in it and in the box
    /// of the ray's ends.
    #[inline]
    fn near<const SHIFT: u32>(&self, parent: VoxelIndex, stay: Stay) -> u64 {
        // Margin in voxels. The rounding error of times and positions is at most a thousandth of it.
        const MARGIN: f64 = 1e-3;
        let cells_per_voxel = 1.0 / f64::from(1 << SHIFT);
        let leave = if stay.leave < 1.0 { stay.leave } else { 1.0 };
        let range = |k: usize| {
            let (a, b) =
                (self.origin[k] + self.direction[k] * stay.enter, self.origin[k] + self.direction[k] * leave);
            let (low, high) = (smaller(a, b) - MARGIN, larger(a, b) + MARGIN);
            let corner = f64::from(parent[k] << (SHIFT + 2));
            let (low, high) = (larger(low, self.low[k]) - corner, smaller(high, self.high[k]) - corner);
            (cell_of(low * cells_per_voxel), cell_of(high * cells_per_voxel))
        };
        in_box(range(0), range(1), range(2))
    }

    /// Returns whether the ray visits a cell of `2^SHIFT` voxels that is in the box of the ray's ends.
    #[inline]
    fn visits<const SHIFT: u32>(&self, cell: VoxelIndex) -> bool {
        let [ex, ey, ez]: Point = std::array::from_fn(|k| self.enter_time::<SHIFT>(k, cell[k]));
        let [lx, ly, lz]: Point = std::array::from_fn(|k| self.leave_time::<SHIFT>(k, cell[k]));
        // At equal times the lowest axis is first.
        (ex <= ly) & (ex <= lz) & (ey < lx) & (ey <= lz) & (ez < lx) & (ez < ly)
    }

    /// Returns the times at which the ray enters and leaves a cell of `2^SHIFT` voxels that it visits.
    #[inline]
    fn stay_in<const SHIFT: u32>(&self, cell: VoxelIndex) -> Stay {
        let [ex, ey, ez]: Point = std::array::from_fn(|k| self.enter_time::<SHIFT>(k, cell[k]));
        let [lx, ly, lz]: Point = std::array::from_fn(|k| self.leave_time::<SHIFT>(k, cell[k]));
        Stay { enter: larger(larger(ex, ey), larger(ez, 0.0)), leave: smaller(smaller(lx, ly), lz) }
    }

    /// Returns the time at which the ray enters a cell of `2^SHIFT` voxels along `axis`; minus infinity for the first.
    #[inline]
    fn enter_time<const SHIFT: u32>(&self, axis: usize, cell: i32) -> f64 {
        match cell == self.start[axis] >> SHIFT {
            true => f64::NEG_INFINITY,
            false => self.time(axis, (cell + i32::from(self.step[axis] < 0)) << SHIFT),
        }
    }

    /// Returns the time at which the ray leaves a cell of `2^SHIFT` voxels along `axis`; infinity for the last.
    #[inline]
    fn leave_time<const SHIFT: u32>(&self, axis: usize, cell: i32) -> f64 {
        match cell == self.last[axis] >> SHIFT {
            true => f64::INFINITY,
            false => self.time(axis, (cell + i32::from(self.step[axis] > 0)) << SHIFT),
        }
    }

    /// Returns the time at which the ray crosses a voxel border, as in [`RayWalk`].
    #[inline]
    fn time(&self, axis: usize, border: i32) -> f64 {
        (f64::from(border) - self.origin[axis]) * self.inv_direction[axis]
    }
}

/// Returns the axis with the smallest time, the lowest axis at equal times, and that time.
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

// Unlike `f64::min` and `f64::max`, these functions have no special case for NaN, so each is one instruction.
#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Returns which of the cells 0 to 3 holds a coordinate or is nearest to it; on a border either of the two.
#[inline]
fn cell_of(x: f64) -> usize {
    // Adding this to a number leaves the nearest integer in the lowest bits.
    const INTEGERS: f64 = 6_755_399_441_055_744.0;
    let x = smaller(larger(x, 0.25), 3.75);
    (x - 0.5 + INTEGERS).to_bits() as usize & 3
}
