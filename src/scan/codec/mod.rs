//! The points of a scan in few bytes, to the last bit: blocks that are encoded and decoded each by itself.
//!
//! ```text
//! points -> columns z, x, y, intensity -> words (bits, differences, or integers of a grid) -> planes of bytes -> zstd
//! ```
//!
//! The low bytes of a measured coordinate are noise and are stored as they are. What varies less is compressed: sign,
//! exponent and high digits; differences from a point before; integers, where all values lie on a grid, such as
//! millimetres or the pixels of a depth image. `docs/format.md` has the bytes.

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

use crate::space::Point;

/// Most points of a block.
const MAX_POINTS: usize = 1 << 16;
/// No block is longer: the points as they are in memory, and some.
pub(crate) const MAX_BLOCK_BYTES: usize = 2 * MAX_POINTS * (size_of::<Point>() + size_of::<f32>());

/// The first byte of a block.
const VERSION: u8 = 1;
