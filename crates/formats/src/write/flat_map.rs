use super::Result;
use super::column_grid::{ColumnGrid, nothing_to_draw};
use super::height_range::HeightRange;
use super::row::{VoxelRow, VoxelsHead};

/// State of a column of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// No voxel of the column was observed.
    Unknown,
    /// Voxels were observed, but none is occupied.
    Free,
    /// At least one voxel is occupied.
    Occupied,
}

/// 2D occupancy grid: a state for each column of voxels between two heights.
#[derive(Clone, Debug)]
pub(super) struct FlatMap {
    head: VoxelsHead,
    heights: HeightRange,
    grid: Option<ColumnGrid<Column>>,
}

impl FlatMap {
    /// Creates a grid for the announced voxels within a range of heights.
    pub(super) fn new(head: &VoxelsHead, heights: HeightRange) -> Self {
        Self { head: head.clone(), heights, grid: None }
    }

    /// Adds a voxel.
    ///
    /// # Errors
    ///
    /// The bounding box has more columns than the limit, or the voxel is outside of it.
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

    /// Returns the numbers of columns and rows.
    ///
    /// # Errors
    ///
    /// There are no voxels.
    pub(super) fn size(&self) -> Result<[usize; 2]> {
        self.grid().map(ColumnGrid::size)
    }

    /// Returns the lower corner of the bounding box, in metres.
    ///
    /// # Errors
    ///
    /// There are no voxels.
    pub(super) fn corner_m(&self) -> Result<[f64; 3]> {
        self.grid().map(ColumnGrid::corner_m)
    }

    /// Returns the columns row by row, from the largest y down, each row from the smallest x.
    ///
    /// # Errors
    ///
    /// There are no voxels.
    pub(super) fn columns(&self) -> Result<&[Column]> {
        self.grid().map(ColumnGrid::cells)
    }

    fn grid(&self) -> Result<&ColumnGrid<Column>> {
        self.grid.as_ref().ok_or_else(nothing_to_draw)
    }
}
