use super::messages::{
    CameraInfo, CompressedDepth, Header, Image, LaserScan, LivoxCustom, MessageKind, PointCloud, PointCloud2,
};
use super::wire::{Decoded, Wire, WireError};
use crate::read::attribute_columns::AttributeValues;
use crate::read::cloud::CloudPoint;
use crate::spill::FilePart;
use voxtile::Result;
use voxtile::scan::AttributeSet;

/// A decoded message that is a cloud.
pub(super) enum CloudMessage<'a> {
    PointCloud2(PointCloud2<'a>),
    PointCloud(PointCloud<'a>),
    Livox(LivoxCustom<'a>),
    LaserScan(LaserScan),
    Depth(Image<'a>, &'a CameraInfo),
    CompressedDepth(CompressedDepth<'a>, &'a CameraInfo),
}

impl<'a> CloudMessage<'a> {
    pub(super) fn decode(
        kind: MessageKind,
        wire: Wire,
        data: &'a [u8],
        camera: Option<&'a CameraInfo>,
    ) -> std::result::Result<Self, WireError> {
        Ok(match (kind, camera) {
            (MessageKind::PointCloud2, _) => Self::PointCloud2(PointCloud2::decode(wire, data)?),
            (MessageKind::PointCloud, _) => Self::PointCloud(PointCloud::decode(wire, data)?),
            (MessageKind::LivoxCustom, _) => Self::Livox(LivoxCustom::decode(wire, data)?),
            (MessageKind::LaserScan, _) => Self::LaserScan(LaserScan::decode(wire, data)?),
            (MessageKind::Image, Some(camera)) => Self::Depth(Image::decode(wire, data)?, camera),
            (MessageKind::CompressedImage, Some(camera)) => {
                Self::CompressedDepth(CompressedDepth::decode(wire, data)?, camera)
            }
            _ => return Err(WireError { byte: 0, reason: "it is not a cloud".to_owned() }),
        })
    }

    /// Decodes a `PointCloud2` of `len` bytes from its first bytes.
    pub(super) fn decode_start(
        wire: Wire,
        start: &'a [u8],
        len: u64,
    ) -> std::result::Result<Self, WireError> {
        PointCloud2::decode_start(wire, start, len).map(Self::PointCloud2)
    }

    pub(super) fn header(&self) -> &Header {
        match self {
            Self::PointCloud2(cloud) => &cloud.header,
            Self::PointCloud(cloud) => &cloud.header,
            Self::Livox(cloud) => &cloud.header,
            Self::LaserScan(scan) => &scan.header,
            Self::Depth(image, _) => &image.header,
            Self::CompressedDepth(image, _) => &image.header,
        }
    }

    /// Sets the stamp that point times are relative to.
    pub(super) fn count_times_from(&mut self, stamp_ns: i64) {
        match self {
            Self::PointCloud2(cloud) => cloud.header.stamp_ns = stamp_ns,
            Self::Livox(cloud) => cloud.header.stamp_ns = stamp_ns,
            // Their point times are already relative to the stamp.
            Self::PointCloud(_) | Self::LaserScan(_) | Self::Depth(..) | Self::CompressedDepth(..) => {}
        }
    }

    pub(super) fn points_claimed(&self) -> u64 {
        match self {
            Self::PointCloud2(cloud) => cloud.points_claimed(),
            Self::PointCloud(cloud) => cloud.count as u64,
            Self::Livox(cloud) => cloud.count as u64,
            // Count only valid beams, because the others are skipped.
            Self::LaserScan(scan) => scan.points().count() as u64,
            Self::Depth(image, _) => image.pixels_claimed(),
            Self::CompressedDepth(image, _) => image.pixels_claimed(),
        }
    }

    pub(super) fn fields(&self) -> Vec<String> {
        let names: &[&str] = match self {
            Self::PointCloud2(cloud) => return cloud.fields.iter().map(|field| field.name.clone()).collect(),
            Self::PointCloud(cloud) => {
                let axes = ["x", "y", "z"].map(str::to_owned);
                return axes.into_iter().chain(cloud.channels.iter().cloned()).collect();
            }
            Self::Livox(_) => &["offset_time", "x", "y", "z", "reflectivity", "tag", "line"],
            Self::LaserScan(scan) if scan.intensities.is_empty() => &["ranges"],
            Self::LaserScan(_) => &["ranges", "intensities"],
            Self::Depth(..) | Self::CompressedDepth(..) => &["depth"],
        };
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    pub(super) fn has_intensities(&self) -> bool {
        match self {
            Self::PointCloud2(cloud) => cloud.has_intensities(),
            Self::PointCloud(cloud) => cloud.has_intensities(),
            Self::Livox(_) => true,
            Self::LaserScan(scan) => !scan.intensities.is_empty(),
            Self::Depth(..) | Self::CompressedDepth(..) => false,
        }
    }

    /// Sets the attributes to read. Only PointCloud2 has attributes. `values` are those of the previous message.
    pub(super) fn read_attributes(&mut self, wanted: AttributeSet, values: AttributeValues) {
        if let Self::PointCloud2(cloud) = self {
            cloud.read_attributes(wanted, values);
        }
    }

    /// Returns which of the attributes to read the points have.
    pub(super) fn attributes(&self) -> AttributeSet {
        match self {
            Self::PointCloud2(cloud) => cloud.attributes(),
            _ => AttributeSet::NONE,
        }
    }

    /// Returns the converter of attributes, if the message has some.
    pub(super) fn into_values(self) -> Option<AttributeValues> {
        match self {
            Self::PointCloud2(cloud) => Some(cloud.into_values()),
            _ => None,
        }
    }

    pub(super) fn has_times(&self) -> bool {
        match self {
            Self::PointCloud2(cloud) => cloud.has_times(),
            Self::PointCloud(cloud) => cloud.has_times(),
            Self::Livox(_) => true,
            Self::LaserScan(scan) => scan.time_increment_s != 0.0,
            Self::Depth(..) | Self::CompressedDepth(..) => false,
        }
    }

    /// Visits all available points, and returns the reason if some are missing. `part` is the complete message if only
    /// its first bytes were decoded.
    pub(super) fn visit(
        &self,
        part: Option<&FilePart>,
        visit: &mut dyn FnMut(CloudPoint) -> Result<()>,
    ) -> Result<Option<WireError>> {
        match self {
            Self::PointCloud2(cloud) => {
                if let Some(part) = part {
                    return cloud.visit_part(part, visit);
                }
                cloud.points().try_for_each(visit)?;
                Ok(cloud.shortage())
            }
            Self::PointCloud(cloud) => visit_decoded(cloud.points(), visit),
            Self::Livox(cloud) => visit_decoded(cloud.points(), visit),
            Self::LaserScan(scan) => scan.points().try_for_each(visit).map(|()| None),
            Self::Depth(image, camera) => {
                image.points(camera).try_for_each(visit)?;
                Ok(image.shortage())
            }
            Self::CompressedDepth(image, camera) => image.visit(camera, visit),
        }
    }

    /// Returns how inconsistent messages were corrected. Each text continues a sentence that begins with "clouds".
    pub(super) fn repairs(&self) -> &[&'static str] {
        match self {
            Self::PointCloud2(cloud) => cloud.repairs(),
            _ => &[],
        }
    }
}

/// Visits points until one cannot be decoded.
fn visit_decoded(
    points: impl Iterator<Item = Decoded<CloudPoint>>,
    visit: &mut dyn FnMut(CloudPoint) -> Result<()>,
) -> Result<Option<WireError>> {
    for point in points {
        match point {
            Ok(point) => visit(point)?,
            Err(error) => return Ok(Some(error)),
        }
    }
    Ok(None)
}
