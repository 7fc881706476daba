use crate::scan::PackedUpdates;
use crate::scan::updates::{BrickRuns, Run, TileRuns, TileUpdates, brick_code};
use crate::space::{BRICK_EDGE, Grid, TileIndex, VoxelIndex, place_of_voxel};

/// Updates outside the window in insertion per ray. The updates of each ray in each tile are packed separately.
#[derive(Clone, Debug)]
pub(crate) struct FarRuns {
    grid: Grid,
    /// Tile of the current ray, and its updates there.
    tile: Option<TileIndex>,
    bricks: Vec<BrickOfRay>,
    /// Number of updates in `bricks`; these do not count as bytes.
    pending: usize,
    hits: u64,
    misses: u64,
    done: Vec<Done>,
    bytes: usize,
}

/// Maximum number of updates that are not packed yet: at most half a megabyte.
const MAX_PENDING: usize = 4096;

#[derive(Clone, Debug)]
struct BrickOfRay {
    index: VoxelIndex,
    runs: Vec<Run>,
}

/// Updates of a ray in one tile, with the numbers of hits and misses.
type Done = (TileIndex, PackedUpdates, (u64, u64));

impl FarRuns {
    pub(crate) fn new(grid: Grid) -> Self {
        let (bricks, done) = Default::default();
        Self { grid, tile: None, bricks, pending: 0, hits: 0, misses: 0, done, bytes: 0 }
    }

    /// Records a ray that passes a voxel.
    #[inline]
    pub(crate) fn pass(&mut self, voxel: VoxelIndex) {
        self.push(voxel, Run { place: place_of_voxel(voxel) as u16, misses: 1, hit: None });
        self.misses += 1;
    }

    /// Records a ray that ends in a voxel.
    pub(crate) fn hit(&mut self, voxel: VoxelIndex, intensity: f32) {
        self.push(voxel, Run { place: place_of_voxel(voxel) as u16, misses: 0, hit: Some(intensity) });
        self.hits += 1;
        // Packed separately from those of the next ray, which may cross the same voxels again.
        self.end_tile();
    }

    fn push(&mut self, voxel: VoxelIndex, run: Run) {
        let tile = self.grid.tile_of_voxel(voxel);
        // A limit on pending updates is needed, because clipped rays may all be in one tile.
        if self.tile != Some(tile) || self.pending == MAX_PENDING {
            self.end_tile();
            self.tile = Some(tile);
        }
        self.pending += 1;
        let index = voxel.map(|k| k.div_euclid(BRICK_EDGE));
        match self.bricks.last_mut() {
            Some(brick) if brick.index == index => brick.runs.push(run),
            _ => self.bricks.push(BrickOfRay { index, runs: vec![run] }),
        }
    }

    fn end_tile(&mut self) {
        let Some(tile) = self.tile.take() else { return };
        self.pending = 0;
        // The sort is stable, so that the runs of a voxel remain in order.
        self.bricks.sort_by_key(|brick| brick_code(brick.index));
        let mut all = TileRuns::default();
        for BrickOfRay { index, mut runs } in self.bricks.drain(..) {
            runs.sort_by_key(|run| run.place);
            all.push(BrickRuns { brick: brick_code(index), runs: &runs, misses: &[] });
        }
        let mut packed = PackedUpdates::of(&TileUpdates::Runs(all));
        packed.shrink();
        self.bytes += packed.bytes() + 2 * size_of::<Done>();
        let counts = (std::mem::take(&mut self.hits), std::mem::take(&mut self.misses));
        self.done.push((tile, packed, counts));
    }

    /// Removes and returns all updates.
    pub(crate) fn take(&mut self) -> impl Iterator<Item = (TileIndex, TileUpdates, (u64, u64))> + use<> {
        self.end_tile();
        self.bytes = 0;
        let done = std::mem::take(&mut self.done).into_iter();
        done.map(|(tile, packed, counts)| (tile, TileUpdates::Packed(packed), counts))
    }

    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipped_rays_in_one_tile_are_packed_early() {
        let mut far = FarRuns::new(Grid::new(0.1, 10.0).unwrap());
        let rays = 40 * MAX_PENDING / 100;
        for _ in 0..rays {
            (0..100).for_each(|x| far.pass([x, 7, 7]));
            assert!(far.pending <= MAX_PENDING);
        }
        assert!(far.bytes() > 0);
        let parts: Vec<_> = far.take().collect();
        assert!(parts.len() > 30 && far.bytes() == 0);
        let misses: u64 = parts.iter().map(|(_, _, (_, misses))| misses).sum();
        assert_eq!(misses, 100 * rays as u64);
    }
}
