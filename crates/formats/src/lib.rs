//! Readers and writers of the file formats of other programs, one format per file, and of voxtile's scan stream. This
//! crate does not depend on the mapper.
//!
//! ```text
//! path -> registry.rs, guess.rs: format detection
//!      -> read/, ros/: CloudSource -> CloudHead, then a sequence of CloudPoint
//!      -> poses/: one pose per cloud
//!      -> scans/: ScanSource -> SensorScan, StoredScan
//! sequence of VoxelRow -> write/: VoxelSink -> .ply .las .npz ..
//! ```
//!
//! `spill/` holds temporary files for data that exceeds the memory budget. The features `las`, `e57`, `ros` and
//! `sqlite` enable formats with many dependencies.

mod class_selection;
mod crs_codes;
mod guess;
mod input_format;
mod open;
mod open_files;
pub mod poses;
pub mod read;
mod read_options;
mod registry;
#[cfg(feature = "ros")]
pub mod ros;
mod scans;
mod spill;
pub mod write;

pub use class_selection::{ClassSelection, Returns};
pub use crs_codes::epsg_code;
pub use input_format::{Detection, InputFormat, Open, OpenCloud, OpenClouds, OpenScans};
pub use open::{open_clouds, open_scans};
pub use open_files::{DividedInputs, divide_inputs, open_scan_files};
pub use poses::{CloudOptions, PoseSource, RigidPose, SweepPeriods};
pub use read::{
    CloudHead, CloudPoint, CloudSource, PoseAt, read_pcd, read_points, read_scan_graph, read_scan_log,
    read_scan_stream, read_scan_stream_with, stamp_of_name,
};
pub use read_options::{ReadOptions, RecordingOptions};
pub use registry::Registry;
pub use scans::{
    PointBudget, PointStore, ScanChain, ScanFingerprint, ScanHead, ScanReach, ScanSource, ScanStreamWriter,
    Selection, SensorScan, StoredScan,
};
pub use spill::Budget;
