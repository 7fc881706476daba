//! voxtile
mod error;
pub mod io;
pub mod maths;
pub mod octree;
pub mod scan;
pub mod sensor;
pub mod simulation;
pub mod space;

pub use error::{DecodeError, Error, FormatError, Place, Result};
