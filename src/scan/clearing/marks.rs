use super::guard::BrickCells;
use crate::scan::pages::MarkedBrick;
use crate::space::{BrickMask, VoxelIndex};
use rustc_hash::FxHashMap;

/// Marks of a whole scan by brick. The index of a brick is that of its voxels divided by 8.
pub(crate) trait Marks {
    /// Hits of a brick.
    fn hits(&self, brick: VoxelIndex) -> BrickMask;

    /// Voxels of a brick that are passed and not hit.
    fn misses(&self, brick: VoxelIndex) -> BrickMask;

    /// Cells of a brick.
    fn cells(&self, brick: VoxelIndex) -> BrickCells;

    /// Returns whether a brick or one of its 26 neighbors may have hits.
    fn may_be_near_hits(&self, brick: VoxelIndex) -> bool;
}

/// Marks in a hash map, for scans whose pages are not in memory.
#[derive(Debug, Default)]
pub(crate) struct BrickMarks {
    bricks: FxHashMap<VoxelIndex, MarkedBrick>,
}

impl FromIterator<MarkedBrick> for BrickMarks {
    fn from_iter<I: IntoIterator<Item = MarkedBrick>>(bricks: I) -> Self {
        Self { bricks: bricks.into_iter().map(|brick| (brick.index, brick)).collect() }
    }
}

impl Marks for BrickMarks {
    fn hits(&self, brick: VoxelIndex) -> BrickMask {
        self.bricks.get(&brick).map_or([0; 8], |marked| marked.hits)
    }

    fn misses(&self, brick: VoxelIndex) -> BrickMask {
        self.bricks.get(&brick).map_or([0; 8], MarkedBrick::misses)
    }

    fn cells(&self, brick: VoxelIndex) -> BrickCells {
        self.bricks.get(&brick).map_or_else(BrickCells::default, BrickCells::of)
    }

    fn may_be_near_hits(&self, _: VoxelIndex) -> bool {
        true
    }
}
