use super::{LabelledScan, World};
use voxtile::scan::Pose;

/// Simulated range sensor.
pub trait Sensor {
    /// Returns the scan from a pose, with the label of each point. All rays of a scan have the same time.
    ///
    /// The noise depends on `seed` and `scan_number` alone.
    fn labelled_scan(
        &self,
        world: &impl World,
        world_from_sensor: &Pose,
        seed: u64,
        scan_number: u64,
    ) -> LabelledScan;
}
