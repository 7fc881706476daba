use super::place::{cell_at, ones, place_of};
use super::view::{LocalState, LocalView, Obstacle};
use voxtile::answer_as_occupied_set;
use voxtile::query::occupied_set::OccupiedSet;
use voxtile::query::voxels_around;
use voxtile::space::{Aabb, Grid, Point, VoxelBox, VoxelIndex};

/// The voxels of a local map as obstacles. All others are unknown: a local map does not distinguish free from unknown.
/// Combine it with an archive ([`United`](voxtile::query::United)) to distinguish them.
#[derive(Clone, Copy, Debug)]
pub struct LocalObstacles<'a> {
    view: &'a LocalView,
    obstacle: Obstacle,
}

answer_as_occupied_set!(LocalObstacles<'_>);

impl OccupiedSet for LocalObstacles<'_> {
    fn grid_of_set(&self) -> Grid {
        self.view.grid
    }

    fn holds(&self, voxel: VoxelIndex) -> bool {
        self.obstacle.is(self.view.state(voxel))
    }

    fn empty_around(&self, voxel: VoxelIndex) -> Option<VoxelBox> {
        self.view.empty_around(voxel)
    }

    fn cells(&self) -> impl Iterator<Item = VoxelBox> {
        self.view.cells_of_pages()
    }

    fn visit_in(&self, voxels: &VoxelBox, visit: &mut dyn FnMut(VoxelIndex) -> bool) {
        self.view.for_each_obstacle_in(voxels, self.obstacle, visit);
    }
}

/// Queries see the occupied voxels; [`LocalView::obstacles`] can include inflated ones.
impl OccupiedSet for LocalView {
    fn grid_of_set(&self) -> Grid {
        self.grid
    }

    fn holds(&self, voxel: VoxelIndex) -> bool {
        self.state(voxel) == LocalState::Occupied
    }

    fn empty_around(&self, voxel: VoxelIndex) -> Option<VoxelBox> {
        self.empty_around(voxel)
    }

    fn cells(&self) -> impl Iterator<Item = VoxelBox> {
        self.cells_of_pages()
    }

    fn visit_in(&self, voxels: &VoxelBox, visit: &mut dyn FnMut(VoxelIndex) -> bool) {
        self.for_each_obstacle_in(voxels, Obstacle::Occupied, visit);
    }
}

answer_as_occupied_set!(LocalView);

impl LocalView {
    /// Returns the occupied voxels, and the inflated ones if requested, as obstacles for queries.
    pub fn obstacles(&self, obstacle: Obstacle) -> LocalObstacles<'_> {
        LocalObstacles { view: self, obstacle }
    }

    /// Returns the cell of the missing page, node or block that contains a voxel. `None` if the block of the voxel
    /// exists.
    fn empty_around(&self, voxel: VoxelIndex) -> Option<VoxelBox> {
        let cell = |shift: u32| {
            let min = voxel.map(|k| k >> shift << shift);
            Some(VoxelBox { min, end: min.map(|k| k.saturating_add(1 << shift)) })
        };
        let place = |shift: u32| place_of(voxel.map(|k| k >> shift));
        let Some(page) = self.pages.get(&voxel.map(|k| k >> 6)) else { return cell(6) };
        let Some(node) = page.node(place(4)) else { return cell(4) };
        if node.block(place(2)).is_none() { cell(2) } else { None }
    }

    /// Returns the box of voxels of each page.
    fn cells_of_pages(&self) -> impl Iterator<Item = VoxelBox> {
        self.pages.keys().map(|page| {
            let min = page.map(|k| k << 6);
            VoxelBox { min, end: min.map(|k| k.saturating_add(1 << 6)) }
        })
    }

    /// Returns the centers, in metres, of the obstacles whose center is in the half-open box, in no particular order.
    pub fn points_in(&self, window: &Aabb, obstacle: Obstacle) -> Vec<Point> {
        let mut points = Vec::new();
        self.for_each_obstacle_in(&voxels_around(&self.grid, window), obstacle, |voxel| {
            let center_m = self.grid.center_m(voxel);
            if window.contains(center_m) {
                points.push(center_m);
            }
            true
        });
        points
    }

    /// Visits the obstacles of a box until `visit` returns false.
    fn for_each_obstacle_in(
        &self,
        voxels: &VoxelBox,
        obstacle: Obstacle,
        mut visit: impl FnMut(VoxelIndex) -> bool,
    ) {
        if voxels.is_empty() {
            return;
        }
        let touches = |index: VoxelIndex, shift: u32| {
            (0..3).all(|k| {
                let (min, end) = (i64::from(index[k]) << shift, (i64::from(index[k]) + 1) << shift);
                i64::from(voxels.min[k]) < end && min < i64::from(voxels.end[k])
            })
        };
        let mut search_page = |index: VoxelIndex| {
            let Some(page) = self.pages.get(&index) else { return true };
            for place in ones(page.mask) {
                let node_index = cell_at(index, place);
                let Some(node) = page.node(place).filter(|_| touches(node_index, 4)) else { continue };
                for place in ones(node.mask) {
                    let block_index = cell_at(node_index, place);
                    let Some(block) = node.block(place).filter(|_| touches(block_index, 2)) else { continue };
                    let mut inside = ones(block.obstacles(obstacle)).map(|place| cell_at(block_index, place));
                    if !inside.all(|voxel| !voxels.contains(voxel) || visit(voxel)) {
                        return false;
                    }
                }
            }
            true
        };
        let (first, last) = (voxels.min.map(|k| k >> 6), voxels.end.map(|k| (k - 1) >> 6));
        let pages = (0..3).map(|k| last[k].abs_diff(first[k]) as usize + 1).fold(1, usize::saturating_mul);
        if pages > self.pages.len() {
            self.pages.keys().filter(|index| touches(**index, 6)).all(|index| search_page(*index));
            return;
        }
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                if !(first[2]..=last[2]).all(|z| search_page([x, y, z])) {
                    return;
                }
            }
        }
    }
}
