use super::header::Header;
use crate::read::cloud::CloudPoint;
use crate::ros::wire::{Decoded, Wire, WireReader};

/// `sensor_msgs/LaserScan`.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserScan {
    /// Stamp and frame.
    pub header: Header,
    /// Angle of the first beam about z, measured from x.
    pub angle_min_rad: f32,
    /// Angle between two beams.
    pub angle_increment_rad: f32,
    /// Time between two beams.
    pub time_increment_s: f32,
    /// Smallest valid range.
    pub range_min_m: f32,
    /// Largest valid range. Longer ranges are beams without a return.
    pub range_max_m: f32,
    /// One range per beam.
    pub ranges_m: Vec<f32>,
    /// One intensity per beam, or empty.
    pub intensities: Vec<f32>,
}

impl LaserScan {
    /// Decodes a message.
    ///
    /// # Errors
    ///
    /// The message is truncated.
    pub fn decode(wire: Wire, bytes: &[u8]) -> Decoded<Self> {
        let mut reader = WireReader::new(wire, bytes)?;
        let header = Header::read(&mut reader)?;
        let angle_min_rad = reader.f32()?;
        // `angle_max` follows from the number of ranges.
        reader.f32()?;
        let (angle_increment_rad, time_increment_s) = (reader.f32()?, reader.f32()?);
        // `scan_time`, the time between two scans.
        reader.f32()?;
        Ok(Self {
            header,
            angle_min_rad,
            angle_increment_rad,
            time_increment_s,
            range_min_m: reader.f32()?,
            range_max_m: reader.f32()?,
            ranges_m: reader.f32_sequence()?,
            intensities: reader.f32_sequence()?,
        })
    }

    /// Iterates over the beams. Invalid ranges (NaN or below the minimum) are skipped; ranges beyond the maximum are
    /// rays without a return.
    pub fn points(&self) -> impl Iterator<Item = CloudPoint> + '_ {
        self.ranges_m.iter().enumerate().filter_map(|(beam, &range_m)| self.point(beam, range_m))
    }

    fn point(&self, beam: usize, range_m: f32) -> Option<CloudPoint> {
        // REP 117: -inf is an object that is too close, +inf is no return, NaN is an error.
        if range_m.is_nan() || range_m < self.range_min_m || range_m < 0.0 {
            return None;
        }
        let is_return = range_m.is_finite() && range_m <= self.range_max_m;
        let longest_m =
            if self.range_max_m.is_finite() && self.range_max_m > 0.0 { self.range_max_m } else { 1.0 };
        let length_m = f64::from(if is_return { range_m } else { longest_m });
        let angle = f64::from(self.angle_min_rad) + beam as f64 * f64::from(self.angle_increment_rad);
        let (sin, cos) = angle.sin_cos();
        let time_s = beam as f64 * f64::from(self.time_increment_s);
        angle.is_finite().then(|| CloudPoint {
            intensity: self.intensities.get(beam).copied().unwrap_or_default(),
            time_s: if time_s.is_finite() { time_s } else { 0.0 },
            is_return,
            ..CloudPoint::hit([length_m * cos, length_m * sin, 0.0])
        })
    }
}
