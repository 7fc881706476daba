use crate::sensor::Evidence;
use crate::space::{BrickCode, MortonCode};
use crate::tile::Table;

/// Consumer of a tile's observed voxels while its file is read.
pub(super) trait Gather {
    /// Type of the result.
    type Made;

    /// Returns whether a voxel with this evidence is selected.
    fn wants(&self, evidence: Evidence) -> bool;

    /// Takes the selected voxels of a brick in Morton order, as position and evidence. Bricks are also in Morton order.
    fn add(&mut self, brick: BrickCode, voxels: &[(usize, Evidence)]);

    /// Returns the result for all voxels.
    fn made(self) -> Self::Made;

    /// Returns the result for a table, which is built first if the entries of the file are in any order.
    fn of_table(self, table: Table) -> Self::Made;
}

impl Gather for Table {
    type Made = Self;

    #[inline]
    fn wants(&self, _: Evidence) -> bool {
        true
    }

    fn add(&mut self, brick: BrickCode, voxels: &[(usize, Evidence)]) {
        self.insert(brick, voxels);
    }

    fn made(self) -> Self {
        self
    }

    fn of_table(self, table: Self) -> Self {
        table
    }
}

/// Voxels selected while a file was read, in Morton order.
pub type FilteredVoxels = Vec<(MortonCode, Evidence)>;

/// Selects the voxels whose log-odds are at least a threshold.
pub(super) struct VoxelFilter {
    pub(super) from: f64,
    pub(super) found: FilteredVoxels,
}

impl From<f64> for VoxelFilter {
    fn from(from: f64) -> Self {
        Self { from, found: Vec::new() }
    }
}

impl Gather for VoxelFilter {
    type Made = FilteredVoxels;

    #[inline]
    fn wants(&self, evidence: Evidence) -> bool {
        evidence.log_odds >= self.from
    }

    fn add(&mut self, brick: BrickCode, voxels: &[(usize, Evidence)]) {
        self.found.extend(voxels.iter().map(|&(place, evidence)| (brick.voxel(place), evidence)));
    }

    fn made(self) -> FilteredVoxels {
        self.found
    }

    fn of_table(self, table: Table) -> FilteredVoxels {
        table.iter_from(self.from).collect()
    }
}
