use super::point_store::{PointRoom, PointStore};
use super::sensor_scan::SensorScan;
use super::stored_scan::StoredScan;
use crate::poses::PoseSource;
use voxtile::Result;
use voxtile::scan::Pose;

/// Name and pose of a scan.
#[derive(Clone, Debug)]
pub struct ScanHead {
    /// Name of the scan in its source: a file name or a number.
    pub name: String,
    /// When it was taken, in nanoseconds since the epoch of its source, if that is known.
    pub stamp_ns: Option<i64>,
    /// Pose of the sensor: `world = R * p + t`.
    pub world_from_sensor: Pose,
}

/// Scans one at a time, in order.
pub trait ScanSource {
    /// Number of scans, if known before they are read.
    fn len_hint(&self) -> Option<usize>;

    /// Reads the next scan; its points replace those in `points`. `None` after the last scan.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is invalid, with its path and offset or line.
    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>>;

    /// The next scan in memory, however large it is.
    ///
    /// # Errors
    ///
    /// As for [`ScanSource::read_scan`].
    fn next_scan(&mut self) -> Result<Option<SensorScan>> {
        let mut points = PointStore::default();
        let head = self.read_scan(&mut points)?;
        Ok(head.map(|ScanHead { name, world_from_sensor, .. }| {
            let (points_in_sensor, intensities) = points.into_parts();
            SensorScan { name, points_in_sensor, intensities, world_from_sensor }
        }))
    }

    /// The next scan, with as many of its points in memory as `room` allows.
    ///
    /// # Errors
    ///
    /// As for [`ScanSource::read_scan`].
    fn next_stored(&mut self, room: &PointRoom) -> Result<Option<StoredScan>> {
        let mut points_in_sensor = PointStore::new(room.clone());
        let head = self.read_scan(&mut points_in_sensor)?;
        Ok(head.map(|ScanHead { name, stamp_ns, world_from_sensor }| StoredScan {
            name,
            stamp_ns,
            points_in_sensor,
            world_from_sensor,
        }))
    }

    /// Skips scans; returns how many there were.
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

    /// After an error of [`ScanSource::next_scan`], moves past the bad scan, so that the next call returns the one
    /// behind it; `false` if that is not possible.
    fn pass_unread(&mut self) -> bool {
        false
    }

    /// What the input is, for people.
    fn format(&self) -> String {
        "scans".to_owned()
    }

    /// Names of the fields of its points, as of the last scan, if they are known.
    fn fields(&self) -> Vec<String> {
        Vec::new()
    }

    /// What a person should know of this input beside its scans, so far: parts that were cut off, scans without poses.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// The coordinate reference system of the world frame, as far as the input names one by now.
    fn crs(&self) -> Option<String> {
        None
    }

    /// The source of the poses.
    fn pose_source(&self) -> PoseSource {
        PoseSource::Scans
    }

    /// Identifies this input, wherever it is stored: number and size of its files, and a BLAKE3 over their names, sizes
    /// and bytes and the poses. Reads every file once. For a pipe: its label.
    ///
    /// Maps of earlier versions identify their input by this; a [`ScanChain`](super::ScanChain) works scan by scan.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, a stream without a label.
    fn fingerprint(&self) -> Result<String>;
}
