//! Queries of maps. They work on any [`MapView`](crate::mapper::MapView), tile by tile.
//!
//! | query | answer |
//! |---|---|
//! | a point, many points | [`Occupancy`]: unknown, free or occupied, with the probability |
//! | a point at a coarse depth | the same, for the largest log-odds under that octree node |
//! | a region, the whole map | its voxels, streamed |
//! | a ray, many rays | the first occupied voxel, exactly as single steps would find it |
//! | a sphere, a box | the first occupied voxel that it touches |
//! | nearest occupied | the occupied voxel with the nearest center |
//! | digest | one number for the whole content |
//! | merged octree | OctoMap's tree of a region, or a `.bt` or `.ot` file of the whole map, streamed |

mod coarse;
mod collision;
mod digest;
mod merged;
mod nearest;
mod occupancy;
mod octree_blocks;
mod octree_reach;
mod octree_shift;
mod point;
mod queries;
mod ray;
mod region;
mod tile_cursor;

pub use collision::Shape;
pub use nearest::Nearest;
pub use occupancy::{Occupancy, UnknownAs};
pub use octree_blocks::OctreeExport;
pub use queries::Queries;
pub use ray::{RayHit, RayQuery};
pub(crate) use region::voxels_around;
