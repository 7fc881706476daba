//! One look of a sensor, and what it says about voxels.

mod scan;

pub use scan::Scan;
