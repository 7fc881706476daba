use super::ray::brick_of;
use crate::error::Result;
use crate::mapper::{MapView, TileRef};
use crate::sensor::Evidence;
use crate::space::{BrickCode, TileIndex, VoxelBox, VoxelIndex, place_of_voxel};
use crate::tile::Tile;

/// Keeps the last tile, so that neighbouring voxels load it once, and finds its last brick once.
pub(super) struct TileCursor<'a, V: ?Sized> {
    view: &'a V,
    tile: Option<(TileIndex, Option<TileRef<'a>>)>,
    brick: Option<NearBrick>,
}

/// The brick that was found last.
#[derive(Clone, Copy)]
struct NearBrick {
    /// Its voxels in the tile.
    voxels: VoxelBox,
    /// Its number in the tile's table.
    number: u32,
}

/// What is found at a voxel.
pub(super) enum Found {
    /// Nothing was observed in this box around it.
    NothingIn(VoxelBox),
    /// Something was observed in its brick; this is its own evidence.
    InBrick(Option<Evidence>),
}

impl<'a, V: MapView + ?Sized> TileCursor<'a, V> {
    pub(super) fn new(view: &'a V) -> Self {
        Self { view, tile: None, brick: None }
    }

    /// The tile that holds a voxel; `None` if nothing was observed in it.
    pub(super) fn tile_of(&mut self, voxel: VoxelIndex) -> Result<Option<&Tile>> {
        let index = self.view.config().grid.tile_of_voxel(voxel);
        if self.tile.as_ref().is_none_or(|(current, _)| *current != index) {
            // Release the previous tile first, so that it can be evicted.
            (self.tile, self.brick) = (None, None);
            self.tile = Some((index, self.view.tile(index)?));
        }
        Ok(self.tile())
    }

    /// What is known of a voxel and around it.
    #[inline]
    pub(super) fn find(&mut self, voxel: VoxelIndex) -> Result<Found> {
        if let (Some(near), Some(tile)) = (self.brick, self.tile())
            && near.voxels.contains(voxel)
        {
            return Ok(Found::InBrick(tile.table().get_in(near.number, place_of_voxel(voxel))));
        }
        self.find_brick(voxel)
    }

    fn find_brick(&mut self, voxel: VoxelIndex) -> Result<Found> {
        let grid = self.view.config().grid;
        let Some(tile) = self.tile_of(voxel)? else {
            return Ok(Found::NothingIn(grid.voxels_of_tile(grid.tile_of_voxel(voxel))));
        };
        let voxels = brick_of(voxel).intersection(&tile.voxel_box());
        let Some(number) = tile.table().number_of_brick(BrickCode::of_voxel(voxel)) else {
            return Ok(Found::NothingIn(voxels));
        };
        let evidence = tile.table().get_in(number, place_of_voxel(voxel));
        self.brick = Some(NearBrick { voxels, number });
        Ok(Found::InBrick(evidence))
    }

    fn tile(&self) -> Option<&Tile> {
        self.tile.as_ref().and_then(|(_, tile)| tile.as_deref())
    }
}
