//! Files of other programs, one format per file, and voxtile's scan stream. Knows no mapper.
//!
//! ```text
//! path -> registry.rs, guess.rs: which format
//!      -> read/, ros/: CloudSource -> CloudHead, then CloudPoint after CloudPoint
//!      -> poses/: a pose for each cloud
//!      -> scans/: ScanSource -> SensorScan, StoredScan
//! VoxelRow after VoxelRow -> write/: VoxelSink -> .ply .las .npz ..
//! ```
//!
//! `spill/` has what exceeds the memory of a reader. Formats that need many crates stand behind features: `las`, `e57`,
//! `ros`, `sqlite`.

mod guess;
mod input_format;
mod open;
pub mod poses;
pub mod read;
mod read_options;
mod registry;
#[cfg(feature = "ros")]
pub mod ros;
mod scans;
mod spill;
pub mod write;

pub use input_format::{InputFormat, Mark, Open, OpenCloud, OpenClouds, OpenScans};
pub use open::{open_clouds, open_scans};
pub use poses::{CloudOptions, Deskew, PoseSource, RigidPose};
pub use read::{
    CloudHead, CloudPoint, CloudSource, PoseAt, read_pcd, read_points, read_scan_graph, read_scan_log,
    read_scan_stream, stamp_of_name,
};
pub use read_options::{ReadOptions, RecordingOptions};
pub use registry::Registry;
pub use scans::{
    PointRoom, PointStore, ScanChain, ScanHead, ScanMark, ScanReach, ScanSource, ScanStreamWriter, Selection,
    SensorScan, StoredScan,
};
pub use spill::Budget;
