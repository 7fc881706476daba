use super::page_table::PageTable;
use super::place::place_of;
use super::sparse::Sparse64;
use super::tree::{Node, Page, Tree};
use crate::scan::RayWalk;
use crate::space::{Point, VoxelIndex};

/// Finds the voxels with occupancy that a ray visits, exactly those that [`RayWalk`] visits before its last voxel.
///
/// The borders of larger cells are borders between voxels too, and their crossings have the same times to the bit. So the
/// walk over pages, nodes or blocks is the walk over voxels with the crossings in between left out, and where it comes
/// into a cell that holds something, the crossings in between that were before are counted.
#[derive(Clone, Debug)]
pub(super) struct RaySearch {
    origin: Point,
    inv_direction: Point,
    step: [i32; 3],
    start: VoxelIndex,
    last: VoxelIndex,
    /// Which way it goes: bit `k` is set where it goes down along axis `k`.
    octant: usize,
}

/// For each octant, as [`RaySearch`] counts them, and each place: the places that a ray can come to from there.
static AHEAD: [[u64; 64]; 8] = places_ahead();

const fn places_ahead() -> [[u64; 64]; 8] {
    let mut ahead = [[0; 64]; 8];
    let mut case = 0;
    while case < 8 * 64 * 64 {
        let (octant, from, to) = (case >> 12, case >> 6 & 63, case & 63);
        let (mut axis, mut is_ahead) = (0, true);
        while axis < 3 {
            let (a, b) = (from >> (2 * axis) & 3, to >> (2 * axis) & 3);
            is_ahead &= if octant >> axis & 1 != 0 { b <= a } else { b >= a };
            axis += 1;
        }
        ahead[octant][from] |= (is_ahead as u64) << to;
        case += 1;
    }
    ahead
}

/// The crossing by which a cell is entered: its time and its axis.
type Entry = Option<(f64, usize)>;

/// Where a walk among cells of `4^LEVEL` voxels is.
struct Cursor<const SHIFT: u32> {
    cell: VoxelIndex,
    next: Point,
    entry: Entry,
}

impl RaySearch {
    /// The ray from `origin` to `end`, both in units of voxels and inside `start` and `last`, their voxels.
    pub(super) fn new(origin: Point, start: VoxelIndex, end: Point, last: VoxelIndex) -> Self {
        Self {
            origin,
            inv_direction: std::array::from_fn(|k| 1.0 / (end[k] - origin[k])),
            step: std::array::from_fn(|k| (last[k] - start[k]).signum()),
            start,
            last,
            octant: (0..3).map(|k| usize::from(last[k] < start[k]) << k).sum(),
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
        let mut at = self.cursor::<6>(self.start.map(|k| k >> 6), None);
        loop {
            if let Some(page) = pages.get(tree, at.cell) {
                self.search_page(tree, tree.pages.get(page), &at, &mut visit);
            }
            if self.advance(&mut at).is_none() {
                return;
            }
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

    fn search_page(&self, tree: &Tree, page: &Page, at: &Cursor<6>, visit: &mut impl FnMut(u32)) {
        self.search::<6, 4>(at, page.stored, |nodes, place| {
            if let Some(node) = page.nodes.get(&tree.lists, place) {
                self.search_node(tree, tree.nodes.get(node), nodes, visit);
            }
        });
    }

    #[inline]
    fn search_node(&self, tree: &Tree, node: &Node, at: &Cursor<4>, visit: &mut impl FnMut(u32)) {
        self.search::<4, 2>(at, node.stored, |blocks, place| {
            if let Some(block) = node.blocks.get(&tree.lists, place) {
                self.search_block(tree, &tree.blocks.get(block).voxels, blocks, visit);
            }
        });
    }

    #[inline]
    fn search_block(&self, tree: &Tree, stored: &Sparse64, at: &Cursor<2>, visit: &mut impl FnMut(u32)) {
        self.search::<2, 0>(at, stored.mask, |voxels, place| {
            if voxels.cell != self.last
                && let Some(voxel) = stored.get(&tree.lists, place)
            {
                visit(voxel);
            }
        });
    }

    /// Visits those cells in a cell that the ray meets and that are in the mask.
    #[inline]
    fn search<const SHIFT: u32, const CHILD: u32>(
        &self,
        parent: &Cursor<SHIFT>,
        mut mask: u64,
        mut visit: impl FnMut(&Cursor<CHILD>, usize),
    ) {
        let mut at = self.descend::<SHIFT, CHILD>(parent);
        mask &= AHEAD[self.octant][place_of(at.cell)];
        while mask != 0 {
            let place = place_of(at.cell);
            if mask >> place & 1 != 0 {
                visit(&at, place);
                // Often nothing is left ahead of the ray.
                mask &= AHEAD[self.octant][place] & !(1 << place);
            }
            match self.advance(&mut at) {
                Some(axis) if at.cell[axis] >> 2 == parent.cell[axis] => {}
                _ => return,
            }
        }
    }

    #[inline]
    fn cursor<const SHIFT: u32>(&self, cell: VoxelIndex, entry: Entry) -> Cursor<SHIFT> {
        Cursor { cell, next: std::array::from_fn(|axis| self.crossing::<SHIFT>(axis, cell[axis])), entry }
    }

    /// Goes to the next cell, along the axis that is returned; `None` at the last.
    #[inline]
    fn advance<const SHIFT: u32>(&self, at: &mut Cursor<SHIFT>) -> Option<usize> {
        let [x, y, z] = at.next;
        // Spelled out by axis: an index would go through memory.
        let (axis, time) = if x <= y && x <= z {
            at.cell[0] += self.step[0];
            at.next[0] = self.crossing::<SHIFT>(0, at.cell[0]);
            (0, x)
        } else if y <= z {
            at.cell[1] += self.step[1];
            at.next[1] = self.crossing::<SHIFT>(1, at.cell[1]);
            (1, y)
        } else {
            at.cell[2] += self.step[2];
            at.next[2] = self.crossing::<SHIFT>(2, at.cell[2]);
            (2, z)
        };
        at.entry = Some((time, axis));
        (time < f64::INFINITY).then_some(axis)
    }

    /// Where the ray comes into a cell, as a walk among the cells in it.
    #[inline]
    fn descend<const SHIFT: u32, const CHILD: u32>(&self, at: &Cursor<SHIFT>) -> Cursor<CHILD> {
        let (mut cell, mut next) = ([0; 3], [0.0; 3]);
        for axis in 0..3 {
            let (start, is_up) = (self.start[axis] >> CHILD, self.step[axis] > 0);
            let low = at.cell[axis] << 2;
            // The first cell inside that the ray can be in.
            let first = match self.step[axis] {
                0 => start,
                _ if is_up => low.max(start),
                _ => (low + 3).min(start),
            };
            (cell[axis], next[axis]) = (first, self.crossing::<CHILD>(axis, first));
            let Some((entry, entry_axis)) = at.entry else { continue };
            if axis == entry_axis {
                continue;
            }
            while next[axis] < entry || (next[axis] == entry && axis < entry_axis) {
                cell[axis] += self.step[axis];
                next[axis] = self.crossing::<CHILD>(axis, cell[axis]);
            }
        }
        Cursor { cell, next, entry: at.entry }
    }

    /// Time at which the ray leaves a cell of `2^SHIFT` voxels along `axis`, as [`RayWalk`] has it; infinite from the last
    /// cell on.
    #[inline]
    fn crossing<const SHIFT: u32>(&self, axis: usize, cell: i32) -> f64 {
        if cell == self.last[axis] >> SHIFT {
            return f64::INFINITY;
        }
        let boundary = (cell + i32::from(self.step[axis] > 0)) << SHIFT;
        (f64::from(boundary) - self.origin[axis]) * self.inv_direction[axis]
    }
}
