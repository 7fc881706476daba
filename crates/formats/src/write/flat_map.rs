use super::Result;
use super::column_grid::{ColumnGrid, nothing_to_draw};
use super::height_range::HeightRange;
use super::row::{VoxelRow, VoxelsHead};

/// What is known of a column of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// No voxel of it was seen.
    Unknown,
    /// Voxels were seen, and none of them is occupied.
    Free,
    /// At least one voxel is occupied.
    Occupied,
}

/// A map seen from above, for robots that drive: a state for each column of voxels between two heights.
#[derive(Clone, Debug)]
pub(super) struct FlatMap {
    head: VoxelsHead,
    heights: HeightRange,
    grid: Option<ColumnGrid<Column>>,
}

impl FlatMap {
    /// A map of what will be announced, of the voxels that have a part at these heights.
    pub(super) fn new(head: &VoxelsHead, heights: HeightRange) -> Self {
        Self { head: head.clone(), heights, grid: None }
    }

    /// Adds a voxel.
    ///
    /// # Errors
    ///
    /// A box that has more columns than a flat map may have; a voxel outside of it.
    pub(super) fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let grid = match &mut self.grid {
            Some(grid) => grid,
            none => none.insert(ColumnGrid::new(&self.head, voxel, Column::Unknown)?),
        };
        let (column, _) = grid.column(voxel)?;
        if !self.heights.meets(voxel, self.head.resolution_m) {
            return Ok(());
        }
        if voxel.log_odds >= self.head.occupied_log_odds {
            *column = Column::Occupied;
        } else if *column == Column::Unknown {
            *column = Column::Free;
        }
        Ok(())
    }

    /// Columns and rows.
    ///
    /// # Errors
    ///
    /// No voxel came.
    pub(super) fn size(&self) -> Result<[usize; 2]> {
        self.grid().map(ColumnGrid::size)
    }

    /// The lower corner of the box around all voxels, in metres.
    ///
    /// # Errors
    ///
    /// No voxel came.
    pub(super) fn corner_m(&self) -> Result<[f64; 3]> {
        self.grid().map(ColumnGrid::corner_m)
    }

    /// Row by row from the largest y down, each from the smallest x.
    ///
    /// # Errors
    ///
    /// No voxel came.
    pub(super) fn columns(&self) -> Result<&[Column]> {
        self.grid().map(ColumnGrid::cells)
    }

    fn grid(&self) -> Result<&ColumnGrid<Column>> {
        self.grid.as_ref().ok_or_else(nothing_to_draw)
    }
}
