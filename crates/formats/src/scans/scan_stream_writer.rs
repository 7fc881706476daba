use super::sensor_scan::SensorScan;
use nalgebra::Isometry3;
use std::io::{self, ErrorKind, Write};
use voxtile::scan::{AttributeSet, AttributeSlices, Pose, Scan};
use voxtile::space::Point;

pub(crate) const MAGIC: &[u8; 8] = b"VXSCANS\n";
pub(crate) const VERSION: u32 = 1;
pub(crate) const FLAG_INTENSITIES: u32 = 1;
pub(crate) const FLAG_COLOURS: u32 = 2;
pub(crate) const FLAG_CLASSES: u32 = 4;
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
    attributes: AttributeSet,
    /// Encoded scan.
    scan: Vec<u8>,
}

impl<W: Write> ScanStreamWriter<W> {
    /// Starts a stream without attributes, with or without an intensity per point.
    ///
    /// The label identifies the scans: two streams with the same label must contain the same scans from the start, so
    /// that the build of one can be resumed with the other. A stream with an empty label cannot be resumed.
    ///
    /// # Errors
    ///
    /// The label has more than 4096 bytes, or the output fails.
    pub fn new(out: W, label: &str, has_intensities: bool) -> io::Result<Self> {
        Self::with_attributes(out, label, has_intensities, AttributeSet::NONE)
    }

    /// As [`ScanStreamWriter::new`], with attributes of points. Older versions of voxtile do not read such a stream.
    ///
    /// # Errors
    ///
    /// As for [`ScanStreamWriter::new`].
    pub fn with_attributes(
        mut out: W,
        label: &str,
        has_intensities: bool,
        attributes: AttributeSet,
    ) -> io::Result<Self> {
        let length = u32::try_from(label.len()).ok().filter(|&length| length <= MAX_LABEL_BYTES);
        let length = length.ok_or_else(|| invalid("the label has more than 4096 bytes"))?;
        out.write_all(MAGIC)?;
        let flags = [
            (has_intensities, FLAG_INTENSITIES),
            (attributes.colours, FLAG_COLOURS),
            (attributes.classes, FLAG_CLASSES),
        ];
        let flags = flags.iter().filter(|(is_set, _)| *is_set).fold(0, |flags, (_, flag)| flags | flag);
        for number in [VERSION, flags, length] {
            out.write_all(&number.to_le_bytes())?;
        }
        out.write_all(label.as_bytes())?;
        Ok(Self { out, has_intensities, attributes, scan: Vec::new() })
    }

    /// Writes a scan. A stream with attributes that the scan lacks states that its points have none.
    ///
    /// # Errors
    ///
    /// The scan has more than 2^32 - 1 points or a wrong number of intensities or attributes, or the output fails.
    pub fn write(&mut self, scan: &SensorScan) -> io::Result<()> {
        let SensorScan { points_in_sensor, intensities, attributes, world_from_sensor, .. } = scan;
        let count = points_in_sensor.len();
        attributes.check_count(count).map_err(|error| io::Error::new(ErrorKind::InvalidInput, error))?;
        let points = points_in_sensor.iter().copied();
        self.write_points(world_from_sensor, points, intensities.as_deref(), attributes.part(0..count))
    }

    /// Writes a scan whose points are in the world frame, without attributes. Its pose is a translation to the ray origin.
    ///
    /// # Errors
    ///
    /// As for [`ScanStreamWriter::write`].
    pub fn write_world(&mut self, scan: &Scan) -> io::Result<()> {
        let [x, y, z] = scan.origin;
        let pose = Isometry3::translation(x, y, z).into();
        let points = scan.points.iter().map(|point| std::array::from_fn(|k| point[k] - scan.origin[k]));
        self.write_points(&pose, points, scan.intensities.as_deref(), AttributeSlices::default())
    }

    fn write_points(
        &mut self,
        pose: &Pose,
        points: impl ExactSizeIterator<Item = Point>,
        intensities: Option<&[f32]>,
        attributes: AttributeSlices<'_>,
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
        for (number, point) in points.enumerate() {
            point.iter().for_each(|&coordinate| self.scan.extend((coordinate as f32).to_le_bytes()));
            self.scan.extend(intensities.next().map(|i| i.to_le_bytes()).into_iter().flatten());
            if self.attributes.colours {
                let colour = attributes.colour(number);
                let [red, green, blue] = colour.unwrap_or_default();
                self.scan.extend([u8::from(colour.is_some()), red, green, blue]);
            }
            if self.attributes.classes {
                let class = attributes.class(number);
                self.scan.extend([u8::from(class.is_some()), class.unwrap_or_default()]);
            }
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
