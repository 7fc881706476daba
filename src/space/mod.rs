//! Conversions between metres and integer indices; all of them are in this module.
//!
//! ```text
//! point (f64 metres) -> voxel index (i32) -> tile index (i32)      grid
//!                                         -> key (u16) -> Morton   key, morton
//! ```
//!
//! The voxel of a point is computed from its coordinates, the tile of a voxel by integer division of its index.
//! Therefore each voxel belongs to exactly one tile.

mod aabb;
mod area;
mod brick;
mod grid;
mod hash_table;
mod key;
mod morton;
mod tile_box;
mod tile_index;
mod tile_selection;
mod tile_space;
mod tile_table;
mod torus;

pub use aabb::{Aabb, VoxelBox};
pub use area::{Area, AreaError, AreaRing, ColumnMask};
pub use brick::ones;
pub use brick::{
    BRICK_EDGE, BRICK_VOXELS, BrickCode, BrickMask, add_to_mask, is_in_mask, mask_of_box, place_of_voxel,
    places,
};
pub use grid::{Grid, GridError, LAST_VOXEL_INDEX, MAX_VOXELS_PER_TILE_EDGE};
#[doc(hidden)]
pub use hash_table::hash_table_bytes;
pub use key::VoxelKey;
pub use morton::MortonCode;
pub use tile_box::TileBox;
pub use tile_index::TileIndex;
pub use tile_selection::TileSelection;
#[doc(hidden)]
pub use tile_space::TileSpace;
pub use tile_table::{TileTable, TileValue, put_number, take_number};
pub(crate) use tile_table::{skip_numbers, take_u32};
pub use torus::Torus;

/// Index of a voxel along x, y and z: `floor(coordinate / resolution)`.
pub type VoxelIndex = [i32; 3];

/// Point in metres, in the world frame unless a name states another one.
pub type Point = [f64; 3];
