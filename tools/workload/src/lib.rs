//! The scans of the synthetic surveys, the plain stream of scans for other mappers, and recordings with labels.
//!
//! Per scan, little-endian: count `u32`, origin 3 x `f32`, points 3 x `f32` each, in metres in the world frame. The
//! intensities are a separate stream with one `f32` per point, so that readers can skip them.

mod length;
mod recording_folder;
mod sensor_name;
mod stream;
mod survey;

pub use length::Length;
pub use recording_folder::RecordingFolder;
pub use sensor_name::SensorName;
pub use stream::{ScanReader, ScanWriter};
pub use survey::SurveyName;
