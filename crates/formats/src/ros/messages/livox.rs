use super::header::Header;
use crate::read::cloud::CloudPoint;
use crate::ros::wire::{Decoded, Wire, WireReader};

/// `CustomMsg` of `livox_ros_driver` and `livox_ros_driver2`.
#[derive(Clone, Debug)]
pub struct LivoxCustom<'a> {
    /// Stamp and frame.
    pub header: Header,
    /// Number of points.
    pub count: usize,
    /// Reference time of `offset_time`, in nanoseconds.
    timebase_ns: u64,
    points: WireReader<'a>,
}

/// Maximum time between time base and stamp. A larger difference shows that they are from different clocks.
const MAX_BASE_NS: u128 = 1_000_000_000;

/// `offset_time`, x, y, z, `reflectivity`, `tag`, `line`.
const POINT_BYTES: usize = 4 + 3 * 4 + 3;

impl<'a> LivoxCustom<'a> {
    /// Decodes a message.
    ///
    /// # Errors
    ///
    /// The message is truncated.
    pub fn decode(wire: Wire, bytes: &'a [u8]) -> Decoded<Self> {
        let mut reader = WireReader::new(wire, bytes)?;
        let header = Header::read(&mut reader)?;
        let timebase_ns = reader.u64()?;
        // `point_num` repeats the length of the sequence.
        reader.u32()?;
        // `lidar_id` and `rsvd`.
        reader.bytes(4)?;
        let count = reader.sequence(POINT_BYTES)?;
        Ok(Self { header, count, timebase_ns, points: reader })
    }

    /// Returns the time from the stamp to the time base. Usually they are equal; some drivers set the stamp when they
    /// send the cloud.
    fn base_after_stamp_s(&self) -> f64 {
        let base_ns = i128::from(self.timebase_ns) - i128::from(self.header.stamp_ns);
        if base_ns.unsigned_abs() <= MAX_BASE_NS { base_ns as f64 * 1e-9 } else { 0.0 }
    }

    /// Iterates over the points, in order. A truncated message ends with an error.
    pub fn points(&self) -> impl Iterator<Item = Decoded<CloudPoint>> + '_ {
        let (mut reader, base_s) = (self.points.clone(), self.base_after_stamp_s());
        (0..self.count).map(move |_| point(&mut reader, base_s))
    }
}

fn point(reader: &mut WireReader<'_>, base_s: f64) -> Decoded<CloudPoint> {
    let time_s = base_s + f64::from(reader.u32()?) * 1e-9;
    let position_m = [reader.f32()?, reader.f32()?, reader.f32()?].map(f64::from);
    let intensity = f32::from(reader.u8()?);
    reader.bytes(2)?;
    // Points without a return are all zeros.
    let is_return = position_m.iter().all(|m| m.is_finite()) && position_m != [0.0; 3];
    let position_m = if is_return { position_m } else { [f64::NAN; 3] };
    Ok(CloudPoint { intensity, time_s, is_return, ..CloudPoint::hit(position_m) })
}
