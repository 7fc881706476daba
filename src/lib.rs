//! voxtile
mod config;
mod error;
pub mod io;
pub mod mapper;
pub mod maths;
pub mod octree;
pub mod query;
pub mod scan;
pub mod sensor;
pub mod simulation;
pub mod space;
pub mod store;
pub mod tile;

pub use config::{InsertMode, MapConfig, RayConfig, VoxelCacheConfig};
pub use error::{DecodeError, Error, FormatError, Place, Result};
pub use mapper::{InMemoryMapper, MapReader, MapView, Mapper, OutOfCoreTileMapper};
pub use query::{Occupancy, Questions};
pub use scan::Scan;
