//! Levels of detail: divides a map of any size into nodes of bounded size at several resolutions, so that viewers load
//! only what the view needs.
//!
//! ```text
//! Scheme        nodes, and the voxels that each covers                       scheme, node_key
//! Cells         voxels of a node; eight nodes become one of coarser          cells
//!               voxels, each the maximum of its children (OctoMap's rule)
//! node_bytes    encoding of cells                                            node_bytes
//! LayerSums     sums of the layers of a node's voxels; values for viewers    layer_sums, layer_totals, layer_planes
//! NodeStore     file of coarse nodes                                         node_store
//! Levels        nodes of one state of a map, identified by the versions      levels
//!               of their tiles, so that unchanged nodes are reused
//! Difference    two states compared node by node                             difference
//! compared      classes of the voxels of two maps
//! tileset       nodes as 3D Tiles, perhaps without the finest                tileset, from_level
//! ```
//!
//! The finest nodes are the map's tiles, or parts of them if a tile has more than 128 voxels along an edge. They are
//! computed on request; coarser nodes are stored.

mod cells;
mod compared;
mod difference;
mod from_level;
mod layer_planes;
mod layer_sums;
mod layer_totals;
mod levels_layers;
mod levels_of_map;
mod node_bytes;
mod node_key;
mod node_store;
mod scheme;
mod tileset;

#[cfg(test)]
mod layer_tests;
#[cfg(test)]
mod tests;

pub use cells::Kind;
pub use compared::{ComparedLevels, ComparedLevelsBuilder, class_bit};
pub use difference::Difference;
pub use from_level::FromLevel;
pub use layer_totals::LayerTotals;
pub use levels_layers::ColouredVoxel;
pub use levels_of_map::Levels;
pub use node_key::NodeKey;
pub use node_store::NodeStore;
pub use tileset::{LevelsOf, TilesetContent, TilesetNodes, for_each_subtree, subtree, tileset};
