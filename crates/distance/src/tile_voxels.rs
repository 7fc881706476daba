use crate::observed::Observed;
use voxtile::mapper::MapView;
use voxtile::space::{BRICK_EDGE, BrickMask, add_to_mask, place_of_voxel};
use voxtile::{Result, TileIndex, VoxelIndex};

/// The observed and the occupied voxels of a tile, as masks of bricks.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileVoxels {
    bricks: Vec<BrickVoxels>,
}

#[derive(Clone, Copy, Debug)]
struct BrickVoxels {
    lowest: VoxelIndex,
    known: BrickMask,
    occupied: BrickMask,
}

impl TileVoxels {
    /// Reads a tile without caching it in the map.
    ///
    /// # Errors
    ///
    /// Fails if the tile cannot be read.
    pub(crate) fn read(map: &impl MapView, tile: TileIndex, needs_known: bool) -> Result<Self> {
        let threshold = map.config().occupied_log_odds();
        let mut bricks: Vec<BrickVoxels> = Vec::new();
        if needs_known {
            if let Some(tile) = map.tile_uncached(tile)? {
                tile.for_each_brick_in(&tile.voxel_box(), threshold, |lowest, known, occupied| {
                    bricks.push(BrickVoxels { lowest, known: *known, occupied: *occupied });
                });
            }
            return Ok(Self { bricks });
        }
        // In Morton order, so the voxels of a brick are consecutive.
        for voxel in map.voxels_from(tile, threshold)? {
            let lowest = voxel.index.map(|k| k & !(BRICK_EDGE - 1));
            if bricks.last().is_none_or(|brick| brick.lowest != lowest) {
                bricks.push(BrickVoxels { lowest, known: [0; 8], occupied: [0; 8] });
            }
            if let Some(brick) = bricks.last_mut() {
                add_to_mask(&mut brick.occupied, place_of_voxel(voxel.index));
            }
        }
        Ok(Self { bricks })
    }

    /// Marks the voxels in a box. Each tile must be added only once.
    pub(crate) fn add_to(&self, observed: &mut Observed) {
        for brick in &self.bricks {
            observed.occupied.toggle_brick(brick.lowest, &brick.occupied, |_, _| {});
            if let Some(known) = &mut observed.known {
                known.toggle_brick(brick.lowest, &brick.known, |_, _| {});
            }
        }
    }

    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + self.bricks.capacity() * size_of::<BrickVoxels>()
    }
}
