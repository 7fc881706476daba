use crate::error::Result;
use crate::mapper::{MapView, TileRef};
use crate::space::{TileIndex, VoxelIndex};
use crate::tile::Tile;

/// Keeps the last tile, so that neighbouring voxels load it once.
pub(super) struct TileCursor<'a, V: ?Sized> {
    view: &'a V,
    tile: Option<(TileIndex, Option<TileRef<'a>>)>,
}

impl<'a, V: MapView + ?Sized> TileCursor<'a, V> {
    pub(super) fn new(view: &'a V) -> Self {
        Self { view, tile: None }
    }

    /// The tile that holds a voxel; `None` if nothing was observed in it.
    pub(super) fn tile_of(&mut self, voxel: VoxelIndex) -> Result<Option<&Tile>> {
        let index = self.view.config().grid.tile_of_voxel(voxel);
        if self.tile.as_ref().is_none_or(|(current, _)| *current != index) {
            // Release the previous tile first, so that it can be evicted.
            self.tile = None;
            self.tile = Some((index, self.view.tile(index)?));
        }
        Ok(self.tile.as_ref().and_then(|(_, tile)| tile.as_deref()))
    }
}
