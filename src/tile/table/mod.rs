//! Exact table of a tile: bricks of 8 x 8 x 8 voxels that contain state numbers of the tile's palette.
//!
//! ```text
//! BrickDirectory --brick number--> Brick: mask of observed voxels, Cells of state numbers --> Palette: evidence
//! ```
//!
//! A step (state, observation) -> state is computed once per palette; [`MissRuns`](miss_runs::MissRuns) caches long
//! runs of them. A brick has a [`Summary`](summary::Summary), from which the upper nodes of an octree are computed.

mod brick;
mod brick_directory;
mod brick_table;
mod brick_update;
mod brick_view;
mod cells;
mod marked_block;
mod miss_runs;
mod palette;
mod summary;
mod table_update;
mod unpadded_evidence;
mod voxel_batch;

pub(crate) use brick::{Brick, Storage};
pub use brick_table::Table;
pub(crate) use brick_view::BrickView;
pub(crate) use cells::{CELL_VOXELS, Cells};
pub(crate) use marked_block::MarkedBlock;
pub(crate) use palette::{Full, Palette, StateId, UNKNOWN};
pub(crate) use summary::larger;
pub(crate) use unpadded_evidence::UnpaddedEvidence;
pub(crate) use voxel_batch::VoxelBatch;
