//! Probabilistic 3D occupancy mapping whose map is bounded by the disk, never by memory.
//!
//! Scans of a lidar, depth camera or sonar become a map of voxels that are occupied, free or unknown, with the exact
//! evidence of each. Space is cut into tiles; an LRU keeps the active ones in memory, the others are on disk. What was
//! flushed survives a crash, and the map is the same to the bit whatever the cache.
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
//! mapper.flush()?; // From here on it survives a crash.
//!
//! let map = MapReader::open(&folder, 64 << 20)?;
//! assert!(map.occupancy_at([4.25, 1.05, 0.35])?.is_occupied());
//! # Ok(())
//! # }
//! ```
//!
//! # The flow
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
//! # Words
//!
//! - **voxel**: a cube of the map's resolution, named by its index; **tile**: a cube of voxels with its own files;
//!   **brick**: 8 x 8 x 8 voxels, the unit of the tables.
//! - **evidence**: log-odds and number of updates of an observed voxel; *unknown* is the absence of evidence.
//! - **flush**: the one commit point; **digest**: a number for the whole content, equal for equal maps.
//!
//! # It is not
//!
//! A localisation or SLAM system (poses come with the scans), a mesh or distance field, a database for points, or a
//! map that several processes write to at once.
//!
//! # Limits
//!
//! Tiles of 2 to 1024 voxels along an edge; voxel indices of 32 bits; rays of at most a million steps. One writer a
//! map, any number of readers.
//!
//! # Other crates
//!
//! This is the engine. Above it: `voxtile-formats` reads scans from files and writes voxels to them, `voxtile-local` is
//! the map around the robot, `voxtile-share` sends what is occupied to other robots, `voxtile-bucket` has maps in an
//! object store, `voxtile-render` makes pictures and levels of detail, and `voxtile-cli` is the command `voxtile`.

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
    InsertMode, MapConfig, MemoryLimit, OctreeConfig, RayConfig, Storage, VoxelCacheConfig, VoxelCacheMode,
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
pub use scan::{Pose, Scan, ScanPoints, ScanRef, ScanReport, Stop};
pub use sensor::{Evidence, SensorModel};
pub use space::{Aabb, Grid, Point, TileBox, TileIndex, TileSelection, VoxelIndex};
pub use store::{MapPath, SnapshotName};
pub use tile::Voxel;
