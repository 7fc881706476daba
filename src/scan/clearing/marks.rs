use super::around::{Step, moved};
use super::guard::BrickCells;
use crate::scan::pages::MarkedBrick;
use crate::space::{BrickMask, VoxelIndex};
use rustc_hash::FxHashMap;

/// Marks of a whole scan by brick. The index of a brick is that of its voxels divided by 8.
pub(crate) trait Marks {
    /// Returns the marks of a brick and of the 26 bricks around it.
    fn around(&self, brick: VoxelIndex) -> impl MarksAround;
}

/// Marks of a brick and of the 26 bricks around it, by the step to the brick.
pub(crate) trait MarksAround {
    fn hits(&self, step: Step) -> BrickMask;

    /// Voxels that are passed and not hit.
    fn misses(&self, step: Step) -> BrickMask;

    fn cells(&self, step: Step) -> BrickCells;

    /// Cells with a hit.
    fn hit_cells(&self, step: Step) -> u64;

    /// Returns whether any of the 27 bricks may have hits.
    fn may_have_hits(&self) -> bool;
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
    fn around(&self, brick: VoxelIndex) -> impl MarksAround {
        BrickMarksAround { marks: self, brick }
    }
}

struct BrickMarksAround<'a> {
    marks: &'a BrickMarks,
    brick: VoxelIndex,
}

impl BrickMarksAround<'_> {
    fn get(&self, step: Step) -> Option<&MarkedBrick> {
        self.marks.bricks.get(&moved(self.brick, step))
    }
}

impl MarksAround for BrickMarksAround<'_> {
    fn hits(&self, step: Step) -> BrickMask {
        self.get(step).map_or([0; 8], |marked| marked.hits)
    }

    fn misses(&self, step: Step) -> BrickMask {
        self.get(step).map_or([0; 8], MarkedBrick::misses)
    }

    fn cells(&self, step: Step) -> BrickCells {
        self.get(step).map_or_else(BrickCells::default, BrickCells::of)
    }

    fn hit_cells(&self, step: Step) -> u64 {
        self.cells(step).hit
    }

    fn may_have_hits(&self) -> bool {
        true
    }
}
