use super::header::Header;
use crate::read::cloud::CloudPoint;
use crate::ros::wire::{Decoded, Wire, WireReader};

/// `sensor_msgs/PointCloud`, the predecessor of `PointCloud2`, with point attributes in channels.
#[derive(Clone, Debug)]
pub struct PointCloud<'a> {
    /// Stamp and frame.
    pub header: Header,
    /// Number of points.
    pub count: usize,
    /// Channel names.
    pub channels: Vec<String>,
    points: WireReader<'a>,
    intensity: Option<WireReader<'a>>,
    /// Times in seconds after the stamp.
    time: Option<WireReader<'a>>,
}

const POINT_BYTES: usize = 3 * 4;
/// Minimum size of a channel: the lengths of its name and of its values.
const MIN_CHANNEL_BYTES: usize = 4 + 4;
/// Limit for the channels of a message.
const MAX_CHANNELS: usize = 1024;
const INTENSITY_NAMES: [&str; 4] = ["intensity", "intensities", "reflectivity", "i"];
const TIME_NAMES: [&str; 4] = ["stamps", "time", "times", "t"];

impl<'a> PointCloud<'a> {
    /// Decodes a message.
    ///
    /// # Errors
    ///
    /// The message is truncated.
    pub fn decode(wire: Wire, bytes: &'a [u8]) -> Decoded<Self> {
        let mut reader = WireReader::new(wire, bytes)?;
        let header = Header::read(&mut reader)?;
        let count = reader.sequence(POINT_BYTES)?;
        let points = reader.clone();
        reader.bytes(count * POINT_BYTES)?;
        let channels_count = reader.sequence(MIN_CHANNEL_BYTES)?;
        if channels_count > MAX_CHANNELS {
            return Err(
                reader.error(format!("{channels_count} channels; at most {MAX_CHANNELS} are supported"))
            );
        }
        let mut cloud = Self { header, count, channels: Vec::new(), points, intensity: None, time: None };
        for _ in 0..channels_count {
            let name = reader.string()?;
            let values_count = reader.sequence(4)?;
            let values = reader.clone();
            reader.bytes(values_count * 4)?;
            let is_one_each = values_count == count;
            let is_any = |names: &[&str]| names.iter().any(|known| name.eq_ignore_ascii_case(known));
            if is_one_each && is_any(&INTENSITY_NAMES) {
                cloud.intensity.get_or_insert(values);
            } else if is_one_each && is_any(&TIME_NAMES) {
                cloud.time.get_or_insert(values);
            }
            cloud.channels.push(name);
        }
        Ok(cloud)
    }

    /// Returns whether points have intensities.
    pub fn has_intensities(&self) -> bool {
        self.intensity.is_some()
    }

    /// Returns whether points have times.
    pub fn has_times(&self) -> bool {
        self.time.is_some()
    }

    /// Iterates over the points, in order.
    pub fn points(&self) -> impl Iterator<Item = Decoded<CloudPoint>> + '_ {
        let (mut points, mut intensity, mut time) =
            (self.points.clone(), self.intensity.clone(), self.time.clone());
        (0..self.count).map(move |_| {
            let position_m = [points.f32()?, points.f32()?, points.f32()?].map(f64::from);
            let value =
                |values: &mut Option<WireReader<'_>>| values.as_mut().map_or(Ok(0.0), WireReader::f32);
            let (intensity, time_s) = (value(&mut intensity)?, f64::from(value(&mut time)?));
            // As in `PointCloud2`, points without a return are NaN or all zeros.
            let is_return = position_m.iter().all(|m| m.is_finite()) && position_m != [0.0; 3];
            let position_m = if is_return { position_m } else { [f64::NAN; 3] };
            let time_s = if time_s.is_finite() { time_s } else { 0.0 };
            Ok(CloudPoint { intensity, time_s, is_return, ..CloudPoint::hit(position_m) })
        })
    }
}
