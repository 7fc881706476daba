use super::attribute_columns::AttributeValues;
use super::cloud::{CloudHead, CloudPoint, CloudSource};
use super::e57_packets::check_packets;
use super::e57_pages::{PAGE_BYTES, Pages};
use super::guard::guarded;
use super::one::{Visit, head_of};
use super::wkt::WktUnits;
use super::xml_check::XmlCheck;
use crate::poses::RigidPose;
use crate::read_options::ReadOptions;
use crate::spill::Budget;
use e57::{
    CartesianCoordinate, E57Reader, PointCloud, Record, RecordDataType, RecordName, SphericalCoordinate,
};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use voxtile::scan::AttributeSet;
use voxtile::{Error, FormatError, Result};

/// Source of the scans of an E57 file.
struct E57 {
    path: PathBuf,
    reader: E57Reader<BufReader<File>>,
    scans: Vec<PointCloud>,
    next: usize,
    is_read: bool,
    /// Whether the caller provides the sensor position of scans without a pose.
    has_origin: bool,
    crs: Option<String>,
    remarks: Vec<String>,
    budget: Budget,
    /// Whether colours are read.
    reads_colours: bool,
    /// Converts colours without limits.
    values: AttributeValues,
}

/// Opens an E57 file. Each scan is a cloud in the frame of its scanner, with its pose. A scan without a pose is in the
/// file's frame, with the sensor at its origin unless another position is given.
pub(crate) fn open(path: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    let (has_origin, budget) = (options.sensor_origin_m.is_some(), &options.budget());
    let mut file = File::open(path).map_err(|error| Error::io(path, "read", error))?;
    check_xml(path, &mut file, budget)?;
    let reader = guarded(|| E57Reader::new(BufReader::new(file)))
        .map_err(|reason| FormatError::at_offset(0, reason).in_input(path))?;
    let scans = reader.pointclouds();
    let mut remarks = Vec::new();
    let mut crs = reader.coordinate_metadata().map(str::to_owned).filter(|crs| !crs.trim().is_empty());
    // E57 coordinates are always in metres, even if the coordinate system names another unit.
    let units = crs.as_deref().map(WktUnits::of);
    if units.is_some_and(|units| [units.flat, units.high].iter().flatten().any(|unit| unit.metres != 1.0)) {
        crs = None;
        remarks
            .push("the coordinate system is not in metres, unlike the points, and is not passed on".into());
    }
    let bare = scans.iter().filter(|scan| scan.transform.is_none()).count();
    if bare > 0 && !has_origin {
        remarks.push(format!(
            "{bare} of {} scans have no pose: their points are in the frame of the file, and the sensor is assumed at \
             its origin unless `poses` or `sensor_origin` is given",
            scans.len()
        ));
    }
    let (next, is_read) = (0, true);
    let (path, budget) = (path.to_owned(), budget.clone());
    Ok(Box::new(E57 {
        path,
        reader,
        scans,
        next,
        is_read,
        has_origin,
        crs,
        remarks,
        budget,
        reads_colours: options.attributes.colours,
        values: AttributeValues::default(),
    }))
}

/// Checks that the XML section fits in memory and can be parsed quickly. The library holds all of it, as text and as a
/// tree.
fn check_xml(path: &Path, file: &mut File, budget: &Budget) -> Result<()> {
    let fail = |error| Error::io(path, "read", error);
    let mut header = Vec::new();
    file.take(HEADER_BYTES as u64).read_to_end(&mut header).map_err(fail)?;
    let number = |at: usize| {
        let bytes = header.get(at..).and_then(|bytes| bytes.first_chunk()).copied();
        bytes.map_or(0, u64::from_le_bytes)
    };
    let [start, bytes, page_bytes] = [24, 32, 40].map(number);
    let wrong = |at: u64, reason: String| Err(FormatError::at_offset(at, reason).in_input(path));
    if header.len() < HEADER_BYTES || !header.starts_with(SIGNATURE) {
        return wrong(0, "it is not an E57 file, or is truncated: copy it again".to_owned());
    }
    if page_bytes != PAGE_BYTES {
        return wrong(40, format!("the page size is {page_bytes} bytes; E57 files have {PAGE_BYTES}"));
    }
    let mut text = Pages::new(&mut *file, start).map_err(fail)?.take(bytes);
    let (mut check, mut buffer) = (XmlCheck::default(), vec![0; PAGE_BYTES as usize]);
    loop {
        let count = text.read(&mut buffer).map_err(fail)?;
        let read = buffer.get(..count).unwrap_or_default();
        if let Err(reason) = check.take(read) {
            return wrong(start, format!("{reason}; write the file again with another program"));
        }
        let needed = check.nodes.saturating_mul(NODE_BYTES).saturating_add(bytes.saturating_mul(3));
        if needed > budget.whole_bytes() {
            let reason = format!(
                "its XML section of {bytes} bytes would need more than {} bytes of memory: raise `memory`, or split \
                 the file",
                budget.whole_bytes()
            );
            return wrong(start, reason);
        }
        if count == 0 {
            break;
        }
    }
    file.seek(SeekFrom::Start(0)).map(drop).map_err(fail)
}

/// Signature and length of the file header.
const SIGNATURE: &[u8] = b"ASTM-E57";
const HEADER_BYTES: usize = 48;
/// Limit for fields per point. Every field costs time for each point, even if it takes no bytes in the file.
const MAX_FIELDS: usize = 256;
/// Approximate memory for a tag or an attribute in the library's tree.
const NODE_BYTES: u64 = 100;

/// Returns the name of a field as spelled by the library.
fn name_of(name: &RecordName) -> String {
    match name {
        RecordName::Unknown { name, .. } => name.clone(),
        known => format!("{known:?}"),
    }
}

/// Returns whether any field of a point takes bits in the file. The library counts points by these bits: without any, a
/// single packet would fill the memory with points.
fn has_bits(scan: &PointCloud) -> bool {
    scan.prototype.iter().any(|record| match record.data_type {
        RecordDataType::ScaledInteger { min, max, .. } | RecordDataType::Integer { min, max } => min < max,
        RecordDataType::Single { .. } | RecordDataType::Double { .. } => true,
    })
}

fn has_field(scan: &PointCloud, name: &RecordName) -> bool {
    scan.prototype.iter().any(|record| record.name == *name)
}

const COLOURS: [RecordName; 3] = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];

fn has_colours(scan: &PointCloud) -> bool {
    COLOURS.iter().all(|name| has_field(scan, name))
}

/// Returns whether the library knows the range of colours: from limits of the scan, or else of the fields.
fn has_colour_scale(scan: &PointCloud) -> bool {
    let has_limits = scan.color_limits.as_ref().is_some_and(|limits| {
        let all = [
            (&limits.red_min, &limits.red_max),
            (&limits.green_min, &limits.green_max),
            (&limits.blue_min, &limits.blue_max),
        ];
        all.iter().all(|(low, high)| low.is_some() && high.is_some())
    });
    let has_range = |record: &Record| match record.data_type {
        RecordDataType::Single { min, max } => min.is_some() && max.is_some(),
        RecordDataType::Double { min, max } => min.is_some() && max.is_some(),
        RecordDataType::ScaledInteger { .. } | RecordDataType::Integer { .. } => true,
    };
    has_limits || scan.prototype.iter().filter(|record| COLOURS.contains(&record.name)).all(has_range)
}

fn pose(scan: &PointCloud) -> Option<RigidPose> {
    let transform = scan.transform.as_ref()?;
    let (at, turn) = (&transform.translation, &transform.rotation);
    Some(RigidPose { position_m: [at.x, at.y, at.z], quaternion: [turn.x, turn.y, turn.z, turn.w] })
}

impl CloudSource for E57 {
    fn format(&self) -> &str {
        "E57"
    }

    fn len_hint(&self) -> Option<u64> {
        Some(self.scans.len() as u64)
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        let Some(scan) = self.scans.get(self.next) else {
            self.is_read = true;
            return Ok(None);
        };
        let number = self.next;
        self.next += 1;
        self.is_read = false;
        let pose = pose(scan).or_else(|| (!self.has_origin).then_some(RigidPose::IDENTITY));
        if pose.is_some_and(|pose| !pose.is_valid()) {
            self.is_read = true;
            let reason = "the pose of the scan is not a rotation and a translation";
            return Err(FormatError::at_record(number as u64, reason).in_input(&self.path));
        }
        let one = if self.scans.len() == 1 { head_of(&self.path) } else { CloudHead::default() };
        let name = scan.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| number.to_string());
        Ok(Some(CloudHead {
            name,
            world_from_sensor: pose,
            points: Some(scan.records),
            fields: scan.prototype.iter().map(|record| name_of(&record.name)).collect(),
            has_intensities: has_field(scan, &RecordName::Intensity),
            attributes: AttributeSet {
                colours: self.reads_colours && has_colours(scan),
                classes: false,
                ..AttributeSet::NONE
            },
            ..one
        }))
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        let Some(scan) = self.next.checked_sub(1).and_then(|number| self.scans.get(number)) else {
            return Ok(());
        };
        if std::mem::replace(&mut self.is_read, true) {
            return Ok(());
        }
        if scan.prototype.len() > MAX_FIELDS {
            let reason = format!(
                "a point has {} fields, but at most {MAX_FIELDS} are supported: export the scan with fewer fields",
                scan.prototype.len()
            );
            return Err(FormatError::at_record(0, reason).in_input(&self.path));
        }
        let (path, mut done) = (&self.path, 0);
        let wrong = |done: u64, reason: String| {
            let reason = format!("{reason} (after {done} of {} points)", scan.records);
            FormatError::at_record(done, reason).in_input(path)
        };
        if scan.records > 0 && !has_bits(scan) {
            let reason = "every field has equal minimum and maximum, so its points take no bytes and cannot be \
                          counted: write the scan again with a wider range of x, y or z";
            return Err(wrong(0, reason.into()));
        }
        check_packets(path, scan, &self.budget)?;
        let mut points =
            guarded(|| self.reader.pointcloud_simple(scan)).map_err(|reason| wrong(0, reason))?;
        points.apply_pose(false);
        points.normalize_intensity(false);
        points.intensity_to_color(false);
        let reads_colours = self.reads_colours && has_colours(scan);
        let is_scaled = reads_colours && has_colour_scale(scan);
        points.normalize_color(is_scaled);
        while let Some(point) = guarded(|| points.next().transpose()).map_err(|reason| wrong(done, reason))? {
            done += 1;
            let (position_m, is_return) = place(&point.cartesian, &point.spherical);
            let intensity = point.intensity.unwrap_or(0.0);
            let colour =
                point.color.filter(|_| reads_colours).map(|color| [color.red, color.green, color.blue]);
            let colour = match is_scaled {
                true => colour.map(|colour| colour.map(|share| (255.0 * share).round() as u8)),
                false => colour.and_then(|colour| self.values.colour(colour.map(f64::from))),
            };
            visit(CloudPoint { intensity, colour, is_return, ..CloudPoint::hit(position_m) })?;
        }
        Ok(())
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.iter().cloned().chain(self.values.remarks()).collect()
    }

    fn crs(&self) -> Option<&str> {
        self.crs.as_deref()
    }
}

/// Returns the position of a point and whether it is a return.
fn place(cartesian: &CartesianCoordinate, spherical: &SphericalCoordinate) -> ([f64; 3], bool) {
    match (cartesian, spherical) {
        (CartesianCoordinate::Valid { x, y, z }, _) => {
            let position_m = [*x, *y, *z];
            (position_m, position_m.iter().all(|axis| axis.is_finite()))
        }
        (CartesianCoordinate::Direction { x, y, z }, _) => ([*x, *y, *z], false),
        (CartesianCoordinate::Invalid, SphericalCoordinate::Direction { azimuth, elevation }) => {
            let flat = elevation.cos();
            ([flat * azimuth.cos(), flat * azimuth.sin(), elevation.sin()], false)
        }
        _ => ([f64::NAN; 3], false),
    }
}
