//! Files of other programs, one format per file, and voxtile's scan stream. Knows no mapper.
//!
//! ```text
//! folder of PCD + poses ┐
//! OctoMap scan graph    ├ ScanSource -> SensorScan      VoxelRow -> VoxelSink -> .ply .las .npz ..
//! OctoMap scan log      │
//! voxtile's scan stream ┘
//! ```

pub mod clouds;
mod file_order;
mod find_poses;
mod fingerprint;
mod guess;
mod input_format;
mod open;
mod point_store;
mod points;
mod pose_source;
mod posed_clouds;
mod read_options;
#[cfg(feature = "ros")]
mod recording_clouds;
mod registry;
mod scan_chain;
mod scan_graph;
mod scan_log;
mod scan_reach;
mod scan_stream;
mod scan_stream_writer;
mod selected_scans;
mod sensor_scan;
mod source;
mod stored_scan;
mod stream_input;
pub mod write;

pub use clouds::read::read_pcd;
pub use input_format::{InputFormat, Mark, Open, OpenCloud, OpenClouds, OpenScans};
pub use open::{open_clouds, open_scans};
pub use point_store::{PointRoom, PointStore};
pub use points::read_points;
pub use pose_source::PoseSource;
pub use posed_clouds::CloudOptions;
pub use read_options::{ReadOptions, RecordingOptions};
pub use registry::Registry;
pub use scan_chain::{ScanChain, ScanMark};
pub use scan_graph::read_scan_graph;
pub use scan_log::read_scan_log;
pub use scan_reach::ScanReach;
pub use scan_stream::read_scan_stream;
pub use scan_stream_writer::ScanStreamWriter;
pub use selected_scans::Selection;
pub use sensor_scan::SensorScan;
pub use source::{ScanHead, ScanSource};
pub use stored_scan::StoredScan;
