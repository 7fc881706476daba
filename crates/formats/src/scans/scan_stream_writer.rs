use super::sensor_scan::SensorScan;
use nalgebra::Isometry3;
use std::io::{self, ErrorKind, Write};
use voxtile::scan::{Pose, Scan};
use voxtile::space::Point;

pub(crate) const MAGIC: &[u8; 8] = b"VXSCANS\n";
pub(crate) const VERSION: u32 = 1;
pub(crate) const FLAG_INTENSITIES: u32 = 1;
/// Maximum length of a label, in bytes.
pub(crate) const MAX_LABEL_BYTES: u32 = 4096;

/// Writer of voxtile's scan stream, for a file (`.scans`) or for `voxtile build -`. The format is described in
/// `docs/format.md`.
///
/// Points are stored in the sensor frame as `f32`, so their precision does not depend on the distance from the world
/// origin.
#[derive(Debug)]
pub struct ScanStreamWriter<W> {
    out: W,
    has_intensities: bool,
    /// Encoded scan.
    scan: Vec<u8>,
}

impl<W: Write> ScanStreamWriter<W> {
    /// Starts a stream, with or without an intensity per point.
    ///
    /// The label identifies the scans: two streams with the same label must contain the same scans from the start, so
    /// that the build of one can be resumed with the other. A stream with an empty label cannot be resumed.
    ///
    /// # Errors
    ///
    /// The label has more than 4096 bytes, or the output fails.
    pub fn new(mut out: W, label: &str, has_intensities: bool) -> io::Result<Self> {
        let length = u32::try_from(label.len()).ok().filter(|&length| length <= MAX_LABEL_BYTES);
        let length = length.ok_or_else(|| invalid("the label has more than 4096 bytes"))?;
        out.write_all(MAGIC)?;
        for number in [VERSION, if has_intensities { FLAG_INTENSITIES } else { 0 }, length] {
            out.write_all(&number.to_le_bytes())?;
        }
        out.write_all(label.as_bytes())?;
        Ok(Self { out, has_intensities, scan: Vec::new() })
    }

    /// Writes a scan.
    ///
    /// # Errors
    ///
    /// The scan has more than 2^32 - 1 points or a wrong number of intensities, or the output fails.
    pub fn write(&mut self, scan: &SensorScan) -> io::Result<()> {
        let SensorScan { points_in_sensor, intensities, world_from_sensor, .. } = scan;
        let intensities = intensities.as_deref();
        self.write_points(world_from_sensor, points_in_sensor.iter().copied(), intensities)
    }

    /// Writes a scan whose points are in the world frame. Its pose is a translation to the ray origin.
    ///
    /// # Errors
    ///
    /// As for [`ScanStreamWriter::write`].
    pub fn write_world(&mut self, scan: &Scan) -> io::Result<()> {
        let [x, y, z] = scan.origin;
        let pose = Isometry3::translation(x, y, z).into();
        let points = scan.points.iter().map(|point| std::array::from_fn(|k| point[k] - scan.origin[k]));
        self.write_points(&pose, points, scan.intensities.as_deref())
    }

    fn write_points(
        &mut self,
        pose: &Pose,
        points: impl ExactSizeIterator<Item = Point>,
        intensities: Option<&[f32]>,
    ) -> io::Result<()> {
        let count = u32::try_from(points.len()).map_err(|_| invalid("more than 2^32 - 1 points"))?;
        if self.has_intensities && intensities.is_none_or(|all| all.len() != points.len()) {
            return Err(invalid("the scan does not have one intensity per point"));
        }
        self.scan.clear();
        self.scan.extend(count.to_le_bytes());
        for number in pose.position_m().into_iter().chain(pose.quaternion()) {
            self.scan.extend(number.to_le_bytes());
        }
        let mut intensities = intensities.filter(|_| self.has_intensities).unwrap_or_default().iter();
        for point in points {
            point.iter().for_each(|&coordinate| self.scan.extend((coordinate as f32).to_le_bytes()));
            self.scan.extend(intensities.next().map(|i| i.to_le_bytes()).into_iter().flatten());
        }
        self.out.write_all(&self.scan)
    }

    /// Flushes the output.
    ///
    /// # Errors
    ///
    /// The output fails.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

fn invalid(what: &'static str) -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, what)
}
