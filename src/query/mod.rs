//! Queries of maps.
//!
//! | trait | implemented by | queries |
//! |---|---|---|
//! | [`Queries`] | all maps and sets, also as `dyn` | occupancy, rays, collisions, nearest voxels |
//! | [`MapQueries`] | maps of tiles ([`MapView`](crate::mapper::MapView)) | exact evidence, digests, octrees |
//!
//! | query | result |
//! |---|---|
//! | a point, many points | [`Occupancy`]: unknown, free or occupied, with the probability |
//! | a point at a coarse depth | the same, for the largest log-odds under that octree node |
//! | a region, the whole map | its voxels, streamed |
//! | a region from above | [`Columns`]: unknown, free or occupied, for each column of voxels |
//! | a ray, many rays, a segment | [`Hit`]: the first occupied voxel, as if every voxel on the ray were examined |
//! | a sphere, a box, a swept sphere | [`Hit`]: an occupied voxel that it touches |
//! | nearest occupied | [`Hit`]: the occupied voxel with the nearest center |
//! | digest | a hash of the whole content |
//! | merged octree | OctoMap's tree of a region, or a `.bt` or `.ot` file of the whole map, streamed |
//!
//! `of_map` implements the queries for maps of tiles, `occupied_set` for local maps and layers, [`United`] for several
//! of both.

mod coarse;
mod collision;
mod columns;
mod digest;
mod filtered_tiles;
mod hit;
mod map_queries;
mod merged;
mod nearest;
mod nearest_in_brick;
mod occupancy;
pub mod occupied_set;
mod octree_blocks;
mod octree_reach;
mod octree_shift;
mod of_live_reader;
mod of_map;
mod point;
mod points_by_tile;
mod queries;
mod ray;
mod region;
mod shape;
mod tile_cursor;
mod united;

pub use columns::{Column, Columns};
pub use digest::Digest;
pub use hit::Hit;
pub use map_queries::MapQueries;
pub use occupancy::{Occupancy, UnknownAs};
pub use octree_blocks::OctreeExport;
pub use queries::{Queries, VoxelOccupancy, Voxels};
pub use ray::RayQuery;
pub use ray::brick_of;
pub use region::voxels_around;
pub use shape::Shape;
pub use united::United;
