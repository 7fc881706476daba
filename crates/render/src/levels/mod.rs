//! Levels of detail: a map of any size as nodes of a bounded number of voxels, coarser and coarser, for viewers that
//! load only what is near.
//!
//! ```text
//! Scheme        which nodes there are, and which voxels each covers          scheme, node_key
//! Cells         the voxels of a node; eight nodes become one of coarser      cells
//!               voxels, each the maximum of those in it (OctoMap's rule)
//! node_bytes    cells as bytes, and back                                     node_bytes
//! NodeStore     coarse nodes that were made once, in a file                  node_store
//! Levels        the nodes of one state of a map, by the versions of          levels
//!               its tiles: what has not changed is not made again
//! Difference    two states node by node                                      difference
//! tileset       nodes as 3D Tiles                                            tileset
//! ```
//!
//! The finest nodes are the map's tiles, or parts of them where a tile has more than 128 voxels along an edge. They are
//! made when they are asked for; coarser nodes are kept in the store.

mod cells;
mod difference;
mod levels_of_map;
mod node_bytes;
mod node_key;
mod node_store;
mod scheme;
mod tileset;

#[cfg(test)]
mod tests;

pub use cells::Kind;
pub use difference::Difference;
pub use levels_of_map::Levels;
pub use node_key::NodeKey;
pub use node_store::NodeStore;
pub use tileset::{LevelsOf, TilesetContent, TilesetNodes, subtree, tileset};
