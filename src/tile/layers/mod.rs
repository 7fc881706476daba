//! Layers of a tile: sums over the points that hit a voxel, such as of their colours.
//!
//! ```text
//! LayerHits -> HitRun -> LayerTable -> LayeredBrick -> Row (the integers of one voxel) -> VoxelLayers (the answer)
//! ```
//!
//! Only bricks with a hit have layers. A brick stores the rows of its hit voxels with as few bits per integer as its
//! largest value needs, and repacks them when a sum outgrows its bits. Points are added to the packed integers, where that is possible.

mod hit_run;
mod layer_table;
mod layered_brick;
mod packed_rows;
mod row;
mod voxel_layers;

pub use layer_table::LayerTable;
pub(crate) use row::{COLUMNS, Row, columns_of};
pub use voxel_layers::{ClassVotes, ColourSums, IntensitySums, ShapeSums, TimeSpan, VoxelLayers};
