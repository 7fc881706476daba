use voxtile::mapper::MapView;
use voxtile::space::BrickMask;
use voxtile::{Result, TileIndex, VoxelIndex};

/// Log-odds that divide the voxels of a map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Thresholds {
    /// Least log-odds of an occupied voxel.
    pub(crate) occupied: f64,
    /// Least log-odds of a surely occupied voxel.
    pub(crate) surely_occupied: f64,
    /// Least log-odds of a voxel that is not surely free.
    pub(crate) not_surely_free: f64,
}

impl Thresholds {
    /// Creates the thresholds of a map, from the least log-odds of a surely occupied voxel.
    pub(crate) fn of(map: &impl MapView, certain: f64) -> Self {
        let occupied = map.config().occupied_log_odds();
        let not_surely_free = (-certain).next_up().min(occupied);
        Self { occupied, surely_occupied: certain.max(occupied), not_surely_free }
    }
}

/// The observed voxels of a tile, as masks of bricks.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileMasks {
    pub(crate) bricks: Vec<BrickMasks>,
}

/// The observed voxels of a brick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BrickMasks {
    pub(crate) lowest: VoxelIndex,
    pub(crate) known: BrickMask,
    pub(crate) occupied: BrickMask,
    pub(crate) surely_occupied: BrickMask,
    pub(crate) surely_free: BrickMask,
}

impl TileMasks {
    /// Reads a tile without caching it in the map.
    ///
    /// # Errors
    ///
    /// Fails if the tile cannot be read.
    pub(crate) fn read(map: &impl MapView, index: TileIndex, thresholds: Thresholds) -> Result<Self> {
        let Some(tile) = map.tile_uncached(index)? else { return Ok(Self::default()) };
        let voxels = tile.voxel_box();
        let mut bricks = Vec::new();
        tile.for_each_brick_in(&voxels, thresholds.occupied, |lowest, known, occupied| {
            let [surely_occupied, surely_free] = [[0; 8]; 2];
            bricks.push(BrickMasks {
                lowest,
                known: *known,
                occupied: *occupied,
                surely_occupied,
                surely_free,
            });
        });
        // The tile does not change, so its bricks have the same order.
        let mut rest = bricks.iter_mut();
        tile.for_each_brick_in(&voxels, thresholds.surely_occupied, |_, _, sure| {
            rest.next().into_iter().for_each(|brick| brick.surely_occupied = *sure);
        });
        let mut rest = bricks.iter_mut();
        tile.for_each_brick_in(&voxels, thresholds.not_surely_free, |_, known, unsure| {
            let free = std::array::from_fn(|k| known[k] & !unsure[k]);
            rest.next().into_iter().for_each(|brick| brick.surely_free = free);
        });
        Ok(Self { bricks })
    }

    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + self.bricks.capacity() * size_of::<BrickMasks>()
    }
}
