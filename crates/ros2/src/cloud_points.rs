use crate::point_limits::PointLimits;
use voxtile::{Pose, ScanRef};
use voxtile_formats::RigidPose;
use voxtile_formats::ros::messages::PointCloud2;

#[derive(Debug)]
pub struct CloudPoints {
    positions_m: Vec<[f64; 3]>,
    intensities: Option<Vec<f32>>,
}

const BYTES_OF_POINT: usize = size_of::<[f64; 3]>() + size_of::<f32>();

impl CloudPoints {
    /// Returns the memory of the decoded points of a message, in addition to the message itself.
    pub fn bytes_of(message: &PointCloud2<'_>) -> usize {
        usize::try_from(message.points_claimed()).unwrap_or(usize::MAX).saturating_mul(BYTES_OF_POINT)
    }

    /// Decodes a message that is known to contain as many points as it claims.
    pub fn of(message: &PointCloud2<'_>) -> Self {
        let count = message.points_claimed() as usize;
        let mut positions_m = Vec::with_capacity(count);
        let mut intensities = message.has_intensities().then(|| Vec::with_capacity(count));
        for point in message.points() {
            // Store points without a return at the origin.
            positions_m.push(if point.is_return { point.position_m } else { [0.0; 3] });
            if let Some(intensities) = &mut intensities {
                intensities.push(point.intensity);
            }
        }
        Self { positions_m, intensities }
    }

    /// Ignores points outside of the limits.
    pub fn limit(&mut self, limits: &PointLimits, world_from_sensor: &RigidPose) {
        limits.apply(&mut self.positions_m, world_from_sensor);
    }

    /// Returns the points as a scan.
    ///
    /// # Errors
    ///
    /// An invalid pose.
    pub fn scan(&self, world_from_sensor: &RigidPose, stamp_ns: i64) -> voxtile::Result<ScanRef<'_>> {
        let pose = Pose::from_quaternion(world_from_sensor.position_m, world_from_sensor.quaternion)?;
        let scan = ScanRef::in_sensor(pose, &self.positions_m).with_stamp_ns(stamp_ns);
        match &self.intensities {
            Some(intensities) => scan.with_intensities(intensities),
            None => Ok(scan),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{self, Header};
    use voxtile_formats::ros::Wire;

    #[test]
    fn decoded_points_fit_the_estimated_memory() {
        for cdr in [
            messages::PointCloud2::of_bytes(Header::default(), 1100).cdr(),
            messages::PointCloud2::of_points(Header::default(), (0..1101).map(|x| [f64::from(x); 3])).cdr(),
        ] {
            let message = PointCloud2::decode(Wire::Cdr, &cdr).unwrap();
            let points = CloudPoints::of(&message);
            let intensities_bytes = points.intensities.map_or(0, |intensities| 4 * intensities.capacity());
            let bytes = 24 * points.positions_m.capacity() + intensities_bytes;
            assert!(bytes <= CloudPoints::bytes_of(&message), "{bytes}");
            assert!(points.positions_m.len() >= 1100);
        }
    }
}
