//! Octree of a tile, derived from the table, in the form selected by `OctreeConfig`.
//!
//! [`BrickOctree`], the default, is a view of the table's bricks. The other form, a tree of pointers with or without
//! OctoCache's voxel cache, is in `tile/octocache/`.

mod brick_octree;
mod octree_factory;
mod tile_octree;

pub(crate) use brick_octree::{BrickOctree, max_in_table};
pub use octree_factory::OctreeFactory;
pub(crate) use tile_octree::TileOctree;
