use voxtile::space::{LAST_VOXEL_INDEX, TileIndex, VoxelBox};
use voxtile::{Error, Grid, Result, VoxelIndex};

/// Box of voxels with its size. Unlike a [`VoxelBox`], it may exceed the range of indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Extent {
    pub(crate) min: [i64; 3],
    pub(crate) size: [usize; 3],
}

impl Extent {
    pub(crate) fn of(voxels: &VoxelBox) -> Self {
        let size = |k: usize| (i64::from(voxels.end[k]) - i64::from(voxels.min[k])).max(0) as usize;
        Self { min: voxels.min.map(i64::from), size: std::array::from_fn(size) }
    }

    /// The voxels of the box that have indices.
    pub(crate) fn voxels(&self) -> VoxelBox {
        let clamp = |k: i64| k.clamp(i64::from(i32::MIN), i64::from(LAST_VOXEL_INDEX) + 1) as i32;
        VoxelBox {
            min: self.min.map(clamp),
            end: std::array::from_fn(|k| clamp(self.min[k] + self.size[k] as i64)),
        }
    }

    /// Number of voxels; saturates.
    pub(crate) fn count(&self) -> u64 {
        self.size.iter().fold(1, |count: u64, &edge| count.saturating_mul(edge as u64))
    }

    /// Returns the box enlarged on all sides.
    pub(crate) fn grown(&self, voxels: usize) -> Self {
        Self { min: self.min.map(|k| k - voxels as i64), size: self.size.map(|edge| edge + 2 * voxels) }
    }

    /// Position of a voxel in the box; `None` if it is outside.
    #[inline]
    pub(crate) fn place_of(&self, voxel: VoxelIndex) -> Option<[usize; 3]> {
        let mut place = [0; 3];
        for k in 0..3 {
            // A negative difference wraps to a number beyond any size.
            place[k] = (i64::from(voxel[k]) - self.min[k]) as usize;
            if place[k] >= self.size[k] {
                return None;
            }
        }
        Some(place)
    }

    /// Fails if the box has more voxels than a field in memory may have.
    pub(crate) fn check_size(&self) -> Result<()> {
        const MAX_VOXELS: u64 = 1 << 31;
        let size = self.count();
        if size <= MAX_VOXELS && self.size.iter().all(|&edge| edge < 1 << 24) {
            return Ok(());
        }
        let hint = "use a smaller box, or a field in a folder";
        Err(Error::TooLarge {
            what: "the number of voxels of the distance field",
            size,
            limit: MAX_VOXELS,
            hint,
        })
    }

    /// Lowest and highest tile that overlap the box; `None` if the box is empty.
    pub(crate) fn tiles(&self, grid: &Grid) -> Option<[TileIndex; 2]> {
        let VoxelBox { min, end } = self.voxels();
        let is_empty = (0..3).any(|k| min[k] >= end[k]);
        (!is_empty).then(|| [grid.tile_of_voxel(min), grid.tile_of_voxel(end.map(|k| k - 1))])
    }
}
