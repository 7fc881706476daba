//! Scans for a build: points in memory or in a file, a pose, and hashes that identify scans.

mod fingerprint;
mod guarded_scans;
mod point_store;
mod scan_chain;
mod scan_reach;
mod scan_stream_writer;
mod selected_scans;
mod sensor_scan;
mod source;
mod stored_scan;

pub(crate) use fingerprint::Fingerprint;
pub(crate) use guarded_scans::GuardedScans;
pub use point_store::{PointBudget, PointStore};
pub use scan_chain::{ScanChain, ScanFingerprint};
pub use scan_reach::ScanReach;
pub use scan_stream_writer::ScanStreamWriter;
pub(crate) use scan_stream_writer::{
    FLAG_CLASSES, FLAG_COLOURS, FLAG_INTENSITIES, MAGIC, MAX_LABEL_BYTES, VERSION,
};
pub use selected_scans::Selection;
pub use sensor_scan::SensorScan;
pub use source::{ScanHead, ScanSource};
pub use stored_scan::StoredScan;
