use super::ray::brick_of;
use crate::error::Result;
use crate::mapper::{MapView, TileRef};
use crate::space::{BrickCode, TileIndex, VoxelBox, VoxelIndex};
use crate::tile::{BrickLook, Tile};

/// Keeps the last tile, so that neighbouring voxels load it once.
pub(super) struct TileCursor<'a, V: ?Sized> {
    view: &'a V,
    tile: Option<CurrentTile<'a>>,
    /// So many absent tiles are passed one by one before the map is asked how far the empty space around one reaches.
    one_by_one: u32,
}

/// Absent tiles between others are few, and looking one up is cheap.
const FEW_ABSENT: u32 = 8;

struct CurrentTile<'a> {
    /// Its voxels; those of more tiles if nothing was observed in any of them.
    voxels: VoxelBox,
    /// `None` if nothing was observed in it.
    tile: Option<TileRef<'a>>,
}

/// What there is around a voxel.
pub(super) enum Around<'a> {
    /// Nothing was observed in this box around it.
    Nothing(VoxelBox),
    /// Something was observed in its brick, of which these voxels are of its tile.
    Brick(BrickLook<'a>, VoxelBox),
}

impl<'a, V: MapView + ?Sized> TileCursor<'a, V> {
    pub(super) fn new(view: &'a V) -> Self {
        Self { view, tile: None, one_by_one: FEW_ABSENT }
    }

    /// The tile that holds a voxel; `None` if nothing was observed in it.
    pub(super) fn tile_of(&mut self, voxel: VoxelIndex) -> Result<Option<&Tile>> {
        Ok(self.current(voxel)?.tile.as_deref())
    }

    /// A box around a voxel in which all log-odds, if there are any, are less than a threshold; `None` if unknown.
    #[inline]
    pub(super) fn below_around(&mut self, voxel: VoxelIndex, threshold: f64) -> Result<Option<VoxelBox>> {
        let CurrentTile { voxels, tile } = self.current(voxel)?;
        Ok(match tile {
            Some(tile) => tile.table().below_around(voxel, threshold).map(|below| below.intersection(voxels)),
            None => Some(*voxels),
        })
    }

    /// What is known around a voxel.
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

    /// The voxels of a box without tiles around an absent one, if it is worth asking for.
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
