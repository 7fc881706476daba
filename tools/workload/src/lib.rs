//! The scans of the made-up surveys, and the plain stream of bytes in which tools hand scans to other mappers.
//!
//! Per scan, little-endian: count `u32`, origin 3 x `f32`, points 3 x `f32` each, in metres in the world frame. The
//! intensities, one `f32` a point, are a stream of their own beside it, so that who needs none reads none.

mod length;
mod stream;
mod survey;

pub use length::Length;
pub use stream::{ScanReader, ScanWriter};
pub use survey::SurveyName;
