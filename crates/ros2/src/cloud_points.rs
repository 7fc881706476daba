use crate::ground_filter::GroundFilter;
use crate::point_limits::PointLimits;
use std::borrow::Cow;
use std::sync::Arc;
use voxtile::scan::{MovingMarks, Sweep};
use voxtile::{PointAttributes, Pose, ScanRef};
use voxtile_formats::RigidPose;
use voxtile_formats::ros::messages::PointCloud2;

#[derive(Debug)]
pub struct CloudPoints {
    positions_m: Vec<[f64; 3]>,
    intensities: Option<Vec<f32>>,
    attributes: PointAttributes,
    /// Motion by which points with times are moved to the stamp.
    sweep: Option<Arc<Sweep>>,
    /// Points that clear, but do not hit: those of the ground.
    ground: Option<MovingMarks>,
}

const BYTES_OF_POINT: usize = size_of::<[f64; 3]>() + size_of::<f32>();
const BYTES_OF_COLOUR: usize = size_of::<Option<[u8; 3]>>();
const BYTES_OF_CLASS: usize = size_of::<Option<u8>>();
/// A time, and for limits the position at the stamp.
const BYTES_OF_DESKEWED: usize = size_of::<i64>() + size_of::<[f64; 3]>() + size_of::<bool>();

impl CloudPoints {
    /// Returns the memory of the decoded points of a message, in addition to the message itself.
    pub fn bytes_of(message: &PointCloud2<'_>, is_deskewed: bool) -> usize {
        let attributes = message.attributes();
        let bytes = BYTES_OF_POINT
            + if attributes.colours { BYTES_OF_COLOUR } else { 0 }
            + if attributes.classes { BYTES_OF_CLASS } else { 0 }
            + if is_deskewed { BYTES_OF_DESKEWED } else { 0 };
        usize::try_from(message.points_claimed()).unwrap_or(usize::MAX).saturating_mul(bytes)
    }

    /// Decodes a message that is known to contain as many points as it claims. With a motion, points keep their times.
    pub fn of(message: &PointCloud2<'_>, sweep: Option<Arc<Sweep>>) -> Self {
        let count = message.points_claimed() as usize;
        let mut positions_m = Vec::with_capacity(count);
        let mut intensities = message.has_intensities().then(|| Vec::with_capacity(count));
        let mut attributes = PointAttributes::default();
        let has = message.attributes();
        attributes.colours.reserve_exact(if has.colours { count } else { 0 });
        attributes.classes.reserve_exact(if has.classes { count } else { 0 });
        attributes.times_ns.reserve_exact(if sweep.is_some() { count } else { 0 });
        for point in message.points() {
            // Store points without a return at the origin.
            positions_m.push(if point.is_return { point.position_m } else { [0.0; 3] });
            if let Some(intensities) = &mut intensities {
                intensities.push(point.intensity);
            }
            attributes.colours.extend(has.colours.then_some(point.colour));
            attributes.classes.extend(has.classes.then_some(point.class));
            attributes.times_ns.extend(sweep.is_some().then(|| point.after_stamp_ns()));
        }
        Self { positions_m, intensities, attributes, sweep, ground: None }
    }

    /// Ignores points outside of the limits, which are in the frame of the pose.
    pub fn limit(&mut self, limits: &PointLimits, frame_from_sensor: &RigidPose) {
        if limits.is_none() {
            return;
        }
        let is_inside: Vec<bool> = {
            let at_stamp_m = self.at_stamp_m();
            at_stamp_m.iter().map(|m| limits.contain(frame_from_sensor.apply(*m))).collect()
        };
        let outside = self.positions_m.iter_mut().zip(is_inside).filter(|(_, is_inside)| !is_inside);
        outside.for_each(|(position_m, _)| *position_m = [0.0; 3]);
    }

    /// Marks the points of the ground: their rays pass free voxels, but they are no hits.
    pub fn mark_ground(&mut self, filter: &GroundFilter, base_from_sensor: &RigidPose) {
        let ground = filter.ground(&self.at_stamp_m(), base_from_sensor);
        self.ground = Some(MovingMarks::new(ground));
    }

    /// Returns the positions in the frame of the sensor at the stamp.
    fn at_stamp_m(&self) -> Cow<'_, [[f64; 3]]> {
        match &self.sweep {
            None => Cow::Borrowed(&self.positions_m),
            Some(sweep) => {
                let mut to_stamp = sweep.to_stamp();
                let timed = self.positions_m.iter().zip(&self.attributes.times_ns);
                Cow::Owned(
                    timed.map(|(position_m, after_ns)| to_stamp.apply(*position_m, *after_ns)).collect(),
                )
            }
        }
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
        let scan = match &self.sweep {
            Some(sweep) => scan.with_sweep(sweep)?,
            None => scan,
        };
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
    fn limits_and_ground_are_of_deskewed_points() {
        let points = (0..10).map(|x| [f64::from(x), 1.0, 1.0]);
        let cdr = messages::PointCloud2::of_points(Header::default(), points).cdr();
        let message = PointCloud2::decode(Wire::Cdr, &cdr).unwrap();
        // All points are measured at the stamp, where the sensor is 100 m ahead.
        let ahead = Pose::from_quaternion([100.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let sweep =
            Arc::new(Sweep::new([(0, Some(*ahead.isometry())), (1, Some(*ahead.isometry()))]).unwrap());
        let mut points = CloudPoints::of(&message, Some(sweep));
        points.attributes.times_ns.fill(1);
        let mut limits = PointLimits([[f64::NEG_INFINITY, f64::INFINITY]; 3]);
        limits.0[0] = [f64::NEG_INFINITY, 104.5];
        points.limit(&limits, &RigidPose::IDENTITY);
        let kept = points.positions_m.iter().filter(|position_m| **position_m != [0.0; 3]);
        assert_eq!(kept.map(|position_m| position_m[0]).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn decoded_points_fit_the_estimated_memory() {
        for cdr in [
            messages::PointCloud2::of_bytes(Header::default(), 1100).cdr(),
            messages::PointCloud2::of_points(Header::default(), (0..1101).map(|x| [f64::from(x); 3])).cdr(),
        ] {
            let message = PointCloud2::decode(Wire::Cdr, &cdr).unwrap();
            let points = CloudPoints::of(&message, None);
            let intensities_bytes = points.intensities.map_or(0, |intensities| 4 * intensities.capacity());
            let bytes = 24 * points.positions_m.capacity() + intensities_bytes;
            assert!(bytes <= CloudPoints::bytes_of(&message, false), "{bytes}");
            assert!(points.positions_m.len() >= 1100);
        }
    }
}
