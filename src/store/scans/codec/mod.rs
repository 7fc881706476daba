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
mod point_decoder;
mod point_encoder;
#[cfg(test)]
mod tests;
mod words;

pub(in crate::store) use point_decoder::PointDecoder;
pub(in crate::store) use point_encoder::PointEncoder;

/// Most points of a block.
pub(in crate::store) const MAX_POINTS: usize = 1 << 16;

/// The first byte of a block.
const VERSION: u8 = 1;
