use crate::bits::Bits;
use crate::blocks::Cube;
use crate::mask_reader::TilesOfBatch;
use voxtile::TileIndex;

/// What a map knows of a cube.
pub(crate) struct BlockBits {
    pub(crate) known: Bits,
    pub(crate) occupied: Bits,
    pub(crate) surely_occupied: Bits,
    pub(crate) surely_free: Bits,
}

impl BlockBits {
    /// Collects the voxels of the tiles that overlap the cube.
    pub(crate) fn of(cube: Cube, tiles: &[TileIndex], masks: &TilesOfBatch) -> Self {
        let [known, occupied, surely_occupied, surely_free] = [0; 4].map(|_| Bits::new(cube));
        let mut bits = Self { known, occupied, surely_occupied, surely_free };
        let end = cube.min.map(|k| k + cube.edge as i64);
        for brick in tiles.iter().filter_map(|tile| masks.get(tile)).flat_map(|tile| &tile.bricks) {
            let is_inside = (0..3).all(|k| {
                let lowest = i64::from(brick.lowest[k]);
                lowest < end[k] && lowest + 8 > cube.min[k]
            });
            if is_inside {
                bits.known.add_brick(brick.lowest, &brick.known);
                bits.occupied.add_brick(brick.lowest, &brick.occupied);
                bits.surely_occupied.add_brick(brick.lowest, &brick.surely_occupied);
                bits.surely_free.add_brick(brick.lowest, &brick.surely_free);
            }
        }
        bits
    }

    /// The surely free voxels whose six neighbors are observed. Rays that graze a surface far away mark its voxels as
    /// free, but not those below it.
    pub(crate) fn clearly_free(&self) -> Bits {
        let near: [Bits; 6] = std::array::from_fn(|k| self.known.moved(k / 2, k % 2 == 0));
        let [a, b, c, d, e, f] = &near;
        let bits = [&self.surely_free, a, b, c, d, e, f];
        Bits::combined(bits, |words| words.iter().fold(u64::MAX, |all, word| all & word))
    }
}
