use super::point_store::{PointBudget, PointStore};
use super::sensor_scan::SensorScan;
use super::stored_scan::StoredScan;
use crate::poses::PoseSource;
use voxtile::Result;
use voxtile::scan::Pose;

/// Name and pose of a scan.
#[derive(Clone, Debug)]
pub struct ScanHead {
    /// Name in its source: a file name or a number.
    pub name: String,
    /// Time stamp, in nanoseconds since the epoch of the source, if known.
    pub stamp_ns: Option<i64>,
    /// Pose of the sensor: `world = R * p + t`.
    pub world_from_sensor: Pose,
}

/// Source of scans, read one at a time in order.
pub trait ScanSource {
    /// Returns the number of scans, if known in advance.
    fn len_hint(&self) -> Option<usize>;

    /// Reads the next scan; its points replace those in `points`. Returns `None` after the last scan.
    ///
    /// # Errors
    ///
    /// A file cannot be read or is invalid. The error gives its path and the offset or line.
    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>>;

    /// Returns the next scan in memory, whatever its size.
    ///
    /// # Errors
    ///
    /// As for [`ScanSource::read_scan`].
    fn next_scan(&mut self) -> Result<Option<SensorScan>> {
        let mut points = PointStore::default();
        let head = self.read_scan(&mut points)?;
        Ok(head.map(|ScanHead { name, world_from_sensor, .. }| {
            let (points_in_sensor, intensities, attributes) = points.into_parts();
            SensorScan { name, points_in_sensor, intensities, attributes, world_from_sensor }
        }))
    }

    /// Returns the next scan, with as many of its points in memory as `budget` allows.
    ///
    /// # Errors
    ///
    /// As for [`ScanSource::read_scan`].
    fn next_stored(&mut self, budget: &PointBudget) -> Result<Option<StoredScan>> {
        let mut points_in_sensor = PointStore::new(budget.clone());
        let head = self.read_scan(&mut points_in_sensor)?;
        Ok(head.map(|ScanHead { name, stamp_ns, world_from_sensor }| StoredScan {
            name,
            stamp_ns,
            points_in_sensor,
            world_from_sensor,
        }))
    }

    /// Skips scans. Returns the number skipped, which is smaller at the end.
    ///
    /// # Errors
    ///
    /// As for [`ScanSource::next_scan`].
    fn skip(&mut self, scans: usize) -> Result<usize> {
        for skipped in 0..scans {
            if self.next_scan()?.is_none() {
                return Ok(skipped);
            }
        }
        Ok(scans)
    }

    /// After an error of [`ScanSource::next_scan`], skips the bad scan so that the next call returns the following one.
    /// Returns `false` if that is impossible.
    fn pass_unread(&mut self) -> bool {
        false
    }

    /// Returns the display name of the input's format.
    fn format(&self) -> String {
        "scans".to_owned()
    }

    /// Returns the names of the point fields in the last scan, if known.
    fn fields(&self) -> Vec<String> {
        Vec::new()
    }

    /// Returns remarks for the user about the input so far, for instance on truncated parts or scans without poses.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// Returns the coordinate reference system of the world frame, if the input has named one so far.
    fn crs(&self) -> Option<String> {
        None
    }

    /// Returns the origin of the poses.
    fn pose_source(&self) -> PoseSource {
        PoseSource::Scans
    }

    /// Returns a fingerprint of this input that does not depend on its location: number and size of its files, and a
    /// BLAKE3 hash of their names, sizes and contents and of the poses. Reads every file once. For a pipe, it is the
    /// label.
    ///
    /// Maps created by older versions identify their input by this. A [`ScanChain`](super::ScanChain) identifies it
    /// scan by scan.
    ///
    /// # Errors
    ///
    /// A file cannot be read, or a stream has no label.
    fn fingerprint(&self) -> Result<String>;
}
