//! Probabilistic 3D occupancy mapping with maps that can exceed memory.
//!
//! Scans of a lidar, depth camera or sonar become a map of occupied, free and unknown voxels, with exact evidence for
//! each. Space is divided into tiles: recently used ones are in memory, the others on disk. Flushed scans survive a
//! crash, and the size of the cache does not change a bit of the map.
//!
//! ```
//! use voxtile::{MapConfig, MapReader, Mapper, OutOfCoreTileMapper, Pose, Queries, ScanRef};
//!
//! # fn main() -> voxtile::Result<()> {
//! # let folder = tempfile::tempdir().unwrap();
//! # let folder = folder.path().join("map_tiles");
//! let config = MapConfig::new(0.1, 10.0)?.with_range(0.5, 60.0);
//! let mut mapper = OutOfCoreTileMapper::create(&folder, config)?;
//! let pose = Pose::from_quaternion([0.0, 0.0, 1.8], [0.0, 0.0, 0.0, 1.0])?;
//! let points: Vec<[f32; 3]> = vec![[4.25, 1.05, -1.45]]; // In the sensor's frame.
//! mapper.insert_points(&ScanRef::in_sensor(pose, &points))?;
//! mapper.flush()?; // The scan now survives a crash.
//!
//! let map = MapReader::open(&folder, 64 << 20)?;
//! assert!(map.occupancy_at([4.25, 1.05, 0.35])?.is_occupied());
//! # Ok(())
//! # }
//! ```
//!
//! # Data flow
//!
//! ```text
//! Scan, ScanRef -> Mapper::insert_points                   scan, mapper
//!   -> rays -> updates by tile                             scan
//!      -> resident tiles: table, octree                    tile, octree, sensor
//!      -> pending updates for tiles on disk                mapper
//!      -> eviction and flush: bytes, one commit            tile::format, store
//! queries <- tile by tile <- memory or disk                query
//! ```
//!
//! # Terms
//!
//! - **voxel**: a cube with the map's resolution as its edge, identified by its index; **tile**: a cube of voxels with
//!   its own files; **brick**: 8 x 8 x 8 voxels, the unit of the tables.
//! - **evidence**: log-odds and number of updates of an observed voxel; *unknown* is the absence of evidence.
//! - **flush**: the only commit point; **digest**: a hash of the whole content, equal for equal maps.
//!
//! # Out of scope
//!
//! Localisation and SLAM (scans must have poses), meshes, databases of points, concurrent writers of one map.
//!
//! # Limits
//!
//! Tiles of 2 to 1024 voxels along an edge; 32-bit voxel indices; at most a million steps per ray. One writer per map,
//! and any number of readers.
//!
//! # Other crates
//!
//! This crate is the engine. `voxtile-formats` reads scans and writes voxels, `voxtile-local` is the local map around a
//! robot, `voxtile-distance` computes distances to obstacles, `voxtile-share` shares occupied voxels with other robots,
//! `voxtile-bucket` stores maps in an object store, `voxtile-render` creates pictures and levels of detail, and
//! `voxtile-cli` is the command `voxtile`.

mod config;
mod error;
pub mod integrity;
pub mod mapper;
#[doc(hidden)]
pub mod maths;
#[doc(hidden)]
pub mod octree;
mod one_heap;
pub mod operations;
#[doc(hidden)]
pub mod path_text;
mod persistence;
pub mod query;
pub mod scan;
#[doc(hidden)]
pub mod scratch;
pub mod sensor;
pub mod space;
#[doc(hidden)]
pub mod store;
#[doc(hidden)]
pub mod tile;

pub use config::{
    Clearing, Guard, InsertMode, Layers, MapConfig, MemoryLimit, OctreeConfig, RayConfig, Storage,
    VoxelCacheConfig, VoxelCacheMode,
};
#[doc(hidden)]
pub use error::beginning_or_difference;
pub use error::{DecodeError, Error, FormatError, Place, Result, Unanswered};
pub use mapper::{
    InMemoryMapper, LiveReader, LiveView, MapOptions, MapReader, MapView, Mapper, OutOfCoreTileMapper,
};
/// The crate of [`Pose::isometry`], in the version that voxtile uses.
pub use nalgebra;
pub use one_heap::begin_with_one_heap;
pub use query::{
    Digest, Hit, MapQueries, Occupancy, Queries, RayQuery, Shape, United, UnknownAs, VoxelOccupancy,
};
pub use scan::{PointAttributes, Pose, Scan, ScanPoints, ScanRef, ScanReport, Stop};
pub use sensor::{Evidence, SensorModel};
pub use space::{Aabb, Grid, Point, TileBox, TileIndex, TileSelection, VoxelIndex};
pub use store::{MapPath, SnapshotName};
pub use tile::{ClassVotes, ColourSums, IntensitySums, ShapeSums, TimeSpan, Voxel, VoxelLayers};
