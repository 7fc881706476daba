//! Lossless compression of the points of a scan, in blocks that are encoded and decoded independently.
//!
//! ```text
//! points -> columns z, x, y, intensity, colour, class, time -> words (bits, differences, or integers of a grid) -> planes of bytes -> zstd
//! ```
//!
//! The low bytes of a measured coordinate are noise and are stored unchanged. Parts with less variation are compressed:
//! sign, exponent and high digits; differences from an earlier point; integers, if all values are on a grid such as
//! millimetres or the pixels of a depth image. `docs/format.md` specifies the bytes.

mod column;
mod grid;
mod pinhole;
mod planes;
mod point_blocks;
mod point_decoder;
mod point_encoder;
#[cfg(test)]
mod tests;
mod words;

pub use point_blocks::PointBlocks;
pub(crate) use point_decoder::PointDecoder;
use point_encoder::PointEncoder;
pub(crate) use words::{unzigzag, zigzag};

use crate::space::Point;

/// Maximum number of points per block.
const MAX_POINTS: usize = 1 << 16;
/// Upper bound on the size of a block: twice the size of its points in memory.
pub(crate) const MAX_BLOCK_BYTES: usize = 2 * MAX_POINTS * (size_of::<Point>() + size_of::<f32>());

/// First byte of a block. Version 1 has no grids in feet and no values off a grid.
const VERSION: u8 = 2;

// Columns of a block besides the coordinates.
const INTENSITIES: u8 = 1;
const COLOURS: u8 = 2;
const CLASSES: u8 = 4;
const TIMES: u8 = 8;

/// Bytes of a colour and of a class, with a bit above them that is set if the point has one.
const COLOUR_BYTES: usize = 4;
const CLASS_BYTES: usize = 2;
