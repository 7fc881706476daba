//! One look of a sensor, and what it says about voxels.
//!
//! ```text
//! Scan -> rays -> voxels -> updates, grouped by tile
//! ```
//!
//! The updates know nothing of what a tile holds: they can be kept and applied later.

mod batch;
mod grouping;
mod range;
mod ray;
mod report;
mod sensor_look;
mod trace;
mod updates;

pub use batch::PointBatch;
pub use ray::{MAX_RAY_STEPS, RayWalk};
pub use report::{ScanReport, SkippedPoints};
pub use sensor_look::Scan;
pub use trace::trace_scan;
pub use updates::{BrickUpdate, OrderedUpdates, ScanUpdates, TileUpdates};
