use crate::bits::IN_BRICK;
use crate::blocks::BLOCK_EDGE;
use crate::mask_reader::TilesOfBatch;
use voxtile::TileIndex;
use voxtile::space::{VoxelBox, is_in_mask, place_of_voxel, places};

/// Columns along an edge of a block.
const EDGE: usize = BLOCK_EDGE as usize;

/// Highest occupied voxel of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Top {
    /// Index along z.
    pub(crate) z: i32,
    /// Whether the voxel above it was seen free, so that nothing is above it.
    pub(crate) is_seen: bool,
}

/// The highest occupied voxels of a block's columns.
pub(crate) struct Tops {
    /// Lowest indices along x and y.
    min: [i64; 2],
    tops: Vec<Option<Top>>,
}

impl Tops {
    /// Finds the highest occupied voxels in a box at most as wide as a block. The tiles must also contain the voxels
    /// above the box.
    pub(crate) fn of(voxels: &VoxelBox, tiles: &[TileIndex], masks: &TilesOfBatch) -> Self {
        let min = [voxels.min[0], voxels.min[1]].map(|k| i64::from(k).div_euclid(BLOCK_EDGE) * BLOCK_EDGE);
        let mut found = Self { min, tops: vec![None; EDGE * EDGE] };
        let bricks = || tiles.iter().filter_map(|tile| masks.get(tile)).flat_map(|tile| &tile.bricks);
        for brick in bricks().filter(|brick| brick.occupied != [0; 8]) {
            for place in places(brick.occupied) {
                let voxel = std::array::from_fn(|k| brick.lowest[k] + i32::from(IN_BRICK[place][k]));
                if voxels.contains(voxel)
                    && let Some(top) = found.at_mut([voxel[0], voxel[1]])
                    && top.is_none_or(|top| top.z < voxel[2])
                {
                    *top = Some(Top { z: voxel[2], is_seen: false });
                }
            }
        }
        for brick in bricks() {
            let [first_x, first_y, first_z] = brick.lowest;
            for (x, y) in (0..8).flat_map(|x| (0..8).map(move |y| (first_x + x, first_y + y))) {
                if let Some(Some(top)) = found.at_mut([x, y])
                    && let Some(above) = top.z.checked_add(1)
                    && (first_z..first_z.saturating_add(8)).contains(&above)
                {
                    let place = place_of_voxel([x, y, above]);
                    // A brick may be divided among tiles.
                    top.is_seen |= is_in_mask(&brick.known, place) && !is_in_mask(&brick.occupied, place);
                }
            }
        }
        found
    }

    /// The highest occupied voxel of a column of the block.
    pub(crate) fn at(&self, column: [i32; 2]) -> Option<Top> {
        self.tops[self.place(column)?]
    }

    fn at_mut(&mut self, column: [i32; 2]) -> Option<&mut Option<Top>> {
        let place = self.place(column)?;
        self.tops.get_mut(place)
    }

    fn place(&self, column: [i32; 2]) -> Option<usize> {
        let at = |k: usize| usize::try_from(i64::from(column[k]) - self.min[k]).ok().filter(|&at| at < EDGE);
        Some(at(1)? * EDGE + at(0)?)
    }
}
