use crate::ground_filter::GroundFilter;
use crate::point_limits::PointLimits;
use voxtile::scan::MovingMarks;
use voxtile::{PointAttributes, Pose, ScanRef};
use voxtile_formats::RigidPose;
use voxtile_formats::ros::messages::PointCloud2;

#[derive(Debug)]
pub struct CloudPoints {
    positions_m: Vec<[f64; 3]>,
    intensities: Option<Vec<f32>>,
    attributes: PointAttributes,
    /// Points that clear, but do not hit: those of the ground.
    ground: Option<MovingMarks>,
}

const BYTES_OF_POINT: usize = size_of::<[f64; 3]>() + size_of::<f32>();
const BYTES_OF_COLOUR: usize = size_of::<Option<[u8; 3]>>();
const BYTES_OF_CLASS: usize = size_of::<Option<u8>>();

impl CloudPoints {
    /// Returns the memory of the decoded points of a message, in addition to the message itself.
    pub fn bytes_of(message: &PointCloud2<'_>) -> usize {
        let attributes = message.attributes();
        let bytes = BYTES_OF_POINT
            + if attributes.colours { BYTES_OF_COLOUR } else { 0 }
            + if attributes.classes { BYTES_OF_CLASS } else { 0 };
        usize::try_from(message.points_claimed()).unwrap_or(usize::MAX).saturating_mul(bytes)
    }

    /// Decodes a message that is known to contain as many points as it claims.
    pub fn of(message: &PointCloud2<'_>) -> Self {
        let count = message.points_claimed() as usize;
        let mut positions_m = Vec::with_capacity(count);
        let mut intensities = message.has_intensities().then(|| Vec::with_capacity(count));
        let mut attributes = PointAttributes::default();
        let has = message.attributes();
        attributes.colours.reserve_exact(if has.colours { count } else { 0 });
        attributes.classes.reserve_exact(if has.classes { count } else { 0 });
        for point in message.points() {
            // Store points without a return at the origin.
            positions_m.push(if point.is_return { point.position_m } else { [0.0; 3] });
            if let Some(intensities) = &mut intensities {
                intensities.push(point.intensity);
            }
            attributes.colours.extend(has.colours.then_some(point.colour));
            attributes.classes.extend(has.classes.then_some(point.class));
        }
        Self { positions_m, intensities, attributes, ground: None }
    }

    /// Ignores points outside of the limits, which are in the frame of the pose.
    pub fn limit(&mut self, limits: &PointLimits, frame_from_sensor: &RigidPose) {
        limits.apply(&mut self.positions_m, frame_from_sensor);
    }

    /// Marks the points of the ground: their rays pass free voxels, but they are no hits.
    pub fn mark_ground(&mut self, filter: &GroundFilter, base_from_sensor: &RigidPose) {
        self.ground = Some(MovingMarks::new(filter.ground(&self.positions_m, base_from_sensor)));
    }

    /// Removes the points of the ground.
    pub fn remove_ground(&mut self) {
        let Some(ground) = self.ground.take() else { return };
        let positions_m = self.positions_m.iter_mut().zip(ground.iter());
        positions_m.filter(|(_, is_ground)| *is_ground).for_each(|(position_m, _)| *position_m = [0.0; 3]);
    }

    /// Returns the points as a scan.
    ///
    /// # Errors
    ///
    /// An invalid pose.
    pub fn scan(&self, world_from_sensor: &RigidPose, stamp_ns: i64) -> voxtile::Result<ScanRef<'_>> {
        let pose = Pose::from_quaternion(world_from_sensor.position_m, world_from_sensor.quaternion)?;
        let scan = ScanRef::in_sensor(pose, &self.positions_m).with_stamp_ns(stamp_ns);
        let scan = match &self.intensities {
            Some(intensities) => scan.with_intensities(intensities)?,
            None => scan,
        };
        let scan = scan.with_attributes(&self.attributes)?;
        match &self.ground {
            Some(ground) => scan.with_moving(ground),
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
