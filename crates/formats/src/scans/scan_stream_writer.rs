use super::sensor_scan::SensorScan;
use nalgebra::Isometry3;
use std::io::{self, ErrorKind, Write};
use voxtile::scan::{Pose, Scan};
use voxtile::space::Point;

pub(crate) const MAGIC: &[u8; 8] = b"VXSCANS\n";
pub(crate) const VERSION: u32 = 1;
pub(crate) const FLAG_INTENSITIES: u32 = 1;
/// The longest label, in bytes.
pub(crate) const MAX_LABEL_BYTES: u32 = 4096;

/// Writes scans as voxtile's scan stream, to a file (`.scans`) or to `voxtile build -`. `docs/format.md` has the bytes.
///
/// Points are in the sensor's frame as `f32`, so they are equally exact far from the world's origin.
#[derive(Debug)]
pub struct ScanStreamWriter<W> {
    out: W,
    has_intensities: bool,
    /// The bytes of one scan.
    scan: Vec<u8>,
}

impl<W: Write> ScanStreamWriter<W> {
    /// Starts a stream, with or without an intensity per point.
    ///
    /// The label identifies the scans: two streams with one label must be equal from the first scan on, so that a build
    /// of one can be resumed with the other. An empty label promises nothing.
    ///
    /// # Errors
    ///
    /// A label of more than 4096 bytes; errors of the stream.
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

    /// Adds a scan.
    ///
    /// # Errors
    ///
    /// More than 2^32 - 1 points, a wrong number of intensities; errors of the stream.
    pub fn write(&mut self, scan: &SensorScan) -> io::Result<()> {
        let SensorScan { points_in_sensor, intensities, world_from_sensor, .. } = scan;
        let intensities = intensities.as_deref();
        self.write_points(world_from_sensor, points_in_sensor.iter().copied(), intensities)
    }

    /// Adds a scan in the world frame: its pose is its origin.
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
            return Err(invalid("the scan has not one intensity a point"));
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

    /// Flushes the stream.
    ///
    /// # Errors
    ///
    /// Errors of the stream.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

fn invalid(what: &'static str) -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, what)
}
