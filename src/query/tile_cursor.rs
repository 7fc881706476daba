use super::ray::brick_of;
use crate::error::Result;
use crate::mapper::{MapView, TileRef};
use crate::space::{BrickCode, TileIndex, VoxelBox, VoxelIndex};
use crate::tile::{BrickView, Tile};

/// Looks up tiles and keeps the last one, so that consecutive voxels of one tile load it once.
pub(super) struct TileCursor<'a, V: ?Sized> {
    view: &'a V,
    tile: Option<CurrentTile<'a>>,
    /// Number of absent tiles that are still looked up one by one, before the empty space around one is determined.
    one_by_one: u32,
}

/// Number of absent tiles in a row that are looked up individually. Short gaps are common, and a look-up is cheap.
const FEW_ABSENT: u32 = 8;

struct CurrentTile<'a> {
    /// Voxels of the tile, or of a box of several tiles without observations.
    voxels: VoxelBox,
    /// `None` if there are no observations.
    tile: Option<TileRef<'a>>,
}

/// Content around a voxel.
pub(super) enum Around<'a> {
    /// No observations in this box around the voxel.
    Nothing(VoxelBox),
    /// The brick of the voxel, which has observations, and the brick's voxels that belong to the tile.
    Brick(BrickView<'a>, VoxelBox),
}

impl<'a, V: MapView + ?Sized> TileCursor<'a, V> {
    pub(super) fn new(view: &'a V) -> Self {
        Self { view, tile: None, one_by_one: FEW_ABSENT }
    }

    /// The tile that contains a voxel; `None` if the tile has no observations.
    pub(super) fn tile_of(&mut self, voxel: VoxelIndex) -> Result<Option<&Tile>> {
        Ok(self.current(voxel)?.tile.as_deref())
    }

    /// A box around a voxel in which all log-odds are below a threshold; `None` if none is known.
    #[inline]
    pub(super) fn below_around(&mut self, voxel: VoxelIndex, threshold: f64) -> Result<Option<VoxelBox>> {
        let CurrentTile { voxels, tile } = self.current(voxel)?;
        Ok(match tile {
            Some(tile) => tile.table().below_around(voxel, threshold).map(|below| below.intersection(voxels)),
            None => Some(*voxels),
        })
    }

    /// Returns the content around a voxel.
    #[inline]
    pub(super) fn around(&mut self, voxel: VoxelIndex) -> Result<Around<'_>> {
        let CurrentTile { voxels, tile } = self.current(voxel)?;
        let Some(tile) = tile else { return Ok(Around::Nothing(*voxels)) };
        let of_brick = brick_of(voxel).intersection(voxels);
        let table = tile.table();
        let number = table.number_of_brick(BrickCode::of_voxel(voxel));
        Ok(match number.and_then(|number| table.numbered(number)) {
            Some(brick) => Around::Brick(brick, of_brick),
            None => Around::Nothing(of_brick),
        })
    }

    #[inline]
    fn current(&mut self, voxel: VoxelIndex) -> Result<&CurrentTile<'a>> {
        // Release the previous tile first, so that it can be evicted.
        let current = match self.tile.take().filter(|current| current.voxels.contains(voxel)) {
            Some(current) => current,
            None => {
                let grid = self.view.config().grid;
                let index = grid.tile_of_voxel(voxel);
                let tile = self.view.tile(index)?;
                let voxels = match tile.is_some() {
                    true => {
                        self.one_by_one = FEW_ABSENT;
                        None
                    }
                    false => self.empty_around(index),
                };
                CurrentTile { voxels: voxels.unwrap_or_else(|| grid.voxels_of_tile(index)), tile }
            }
        };
        Ok(self.tile.insert(current))
    }

    /// The voxels of a box without tiles around an absent one, if the look-up is worthwhile.
    fn empty_around(&mut self, absent: TileIndex) -> Option<VoxelBox> {
        if self.one_by_one > 0 {
            self.one_by_one -= 1;
            return None;
        }
        let empty = self.view.empty_around(absent);
        if empty.is_none() {
            self.one_by_one = FEW_ABSENT;
        }
        empty.map(|tiles| self.view.config().grid.voxels_of_tiles(tiles))
    }
}
