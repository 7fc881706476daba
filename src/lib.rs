//! voxtile
mod config;
mod error;
pub mod io;
pub mod mapper;
pub mod query;
pub mod maths;
pub mod octree;
pub mod scan;
pub mod sensor;
pub mod simulation;
pub mod space;
pub mod store;
pub mod tile;

pub use config::{InsertMode, MapConfig, RayConfig, VoxelCacheConfig};
pub use error::{DecodeError, Error, FormatError, Place, Result};
