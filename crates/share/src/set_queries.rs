use super::set::VoxelSet;
use voxtile::answer_as_occupied_set;
use voxtile::query::brick_of;
use voxtile::query::occupied_set::OccupiedSet;
use voxtile::space::{BrickCode, Grid, VoxelBox, VoxelIndex};

/// The voxels of a layer are occupied, and all others are unknown. [`United`](voxtile::query::United) answers queries
/// from a robot's own map and the layers of other robots.
impl OccupiedSet for VoxelSet {
    fn grid_of_set(&self) -> Grid {
        *self.grid()
    }

    fn holds(&self, voxel: VoxelIndex) -> bool {
        self.contains(voxel)
    }

    fn empty_around(&self, voxel: VoxelIndex) -> Option<VoxelBox> {
        let tile = self.grid().tile_of_voxel(voxel);
        let voxels = self.grid().voxels_of_tile(tile);
        if !self.has_tile(tile) {
            return Some(voxels);
        }
        let is_empty = self.brick(tile, BrickCode::of_voxel(voxel)) == [0; 8];
        is_empty.then(|| brick_of(voxel).intersection(&voxels))
    }

    fn cells(&self) -> impl Iterator<Item = VoxelBox> {
        self.tiles().map(|tile| self.grid().voxels_of_tile(tile))
    }

    fn visit_in(&self, voxels: &VoxelBox, visit: &mut dyn FnMut(VoxelIndex) -> bool) {
        let _ = self.in_box(voxels).all(visit);
    }
}

answer_as_occupied_set!(VoxelSet);
