use std::collections::BTreeMap;
use std::sync::Arc;
use testkit::attributed_scan::{random_attributes, random_stamp_ns, retain_attributes, retain_marked};
use testkit::random_scans::{Random, random_scan};
use voxtile::mapper::NewPose;
use voxtile::scan::{NO_TIME, Sweep};
use voxtile::{Aabb, Mapper, OutOfCoreTileMapper, PointAttributes, Pose, Result, Scan, ScanRef};

/// A scan in the sensor's frame, at the times of its points if it has a sweep, with its pose.
#[derive(Clone, Debug)]
pub struct Taken {
    pub points: Vec<[f64; 3]>,
    pub intensities: Vec<f32>,
    pub attributes: PointAttributes,
    pub stamp_ns: Option<i64>,
    /// Whether each point is marked as moving.
    pub is_moving: Vec<bool>,
    pub pose: Pose,
    pub sweep: Option<Arc<Sweep>>,
}

impl Taken {
    /// A scan of five points, some of which are not finite, and a point at the sensor.
    pub fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let scan = random_scan(&mut random, [0.0; 3], 5);
        let mut points = scan.points;
        points.push([0.0; 3]);
        let mut intensities = scan.intensities.unwrap();
        intensities.push(-0.0);
        let is_moving = vec![false; points.len()];
        let pose = random_pose(&mut random, seed);
        let mut attributes = random_attributes(&mut random, points.len());
        let stamp_ns = random_stamp_ns(&mut random);
        let sweep = (random.below(2) > 0).then(|| Arc::new(random_sweep(&mut random)));
        if sweep.is_some() {
            let times_ns = [NO_TIME, i64::MAX, 0, -3_000_000, 1_000_000, 7_500_000, 10_000_000, 16_000_000];
            attributes.times_ns = points.iter().map(|_| times_ns[random.below(8) as usize]).collect();
        }
        Self { points, intensities, attributes, stamp_ns, is_moving, pose, sweep }
    }

    pub fn in_world(&self) -> Scan {
        let mut points = self.points.clone();
        if let Some(sweep) = &self.sweep {
            for (point, time_ns) in points.iter_mut().zip(&self.attributes.times_ns) {
                *point = sweep.to_stamp().apply(*point, *time_ns);
            }
        }
        Scan::from_sensor_frame(&points, Some(self.intensities.clone()), self.pose)
    }

    pub fn move_to(&mut self, new: NewPose) {
        self.pose = new.world_from_sensor;
        if self.sweep.is_some() && new.sweep.is_some() {
            self.sweep = new.sweep;
        }
    }

    pub fn insert_into(&self, mapper: &mut OutOfCoreTileMapper) -> Result<()> {
        let points = ScanRef::in_sensor(self.pose, &self.points).with_intensities(&self.intensities)?;
        let points = points.with_attributes(&self.attributes)?;
        let points = self.stamp_ns.map_or(points, |stamp_ns| points.with_stamp_ns(stamp_ns));
        let points = match &self.sweep {
            Some(sweep) => points.with_sweep(sweep)?,
            None => points,
        };
        mapper.insert_points(&points).map(drop)
    }

    /// Removes the points whose world coordinates are in a box.
    pub fn remove_points(&mut self, region: &Aabb) {
        let is_outside =
            |point: &[f64; 3]| !(0..3).all(|k| region.min[k] <= point[k] && point[k] < region.max[k]);
        let keeps: Vec<bool> = self.in_world().points.iter().map(is_outside).collect();
        retain_marked(&mut self.points, &keeps);
        retain_marked(&mut self.intensities, &keeps);
        retain_attributes(&mut self.attributes, &keeps);
        retain_marked(&mut self.is_moving, &keeps);
    }
}

/// Compares bits, because some points are NaN.
impl PartialEq for Taken {
    fn eq(&self, other: &Self) -> bool {
        let bits = |scan: &Self| {
            let points: Vec<_> = scan.points.iter().map(|point| point.map(f64::to_bits)).collect();
            let intensities: Vec<_> = scan.intensities.iter().map(|value| value.to_bits()).collect();
            let ([x, y, z], [a, b, c, d]) = (scan.pose.position_m(), scan.pose.quaternion());
            (points, intensities, [x, y, z, a, b, c, d].map(f64::to_bits))
        };
        let others = |scan: &Self| {
            (scan.is_moving.clone(), scan.attributes.clone(), scan.stamp_ns, scan.sweep.clone())
        };
        bits(self) == bits(other) && others(self) == others(other)
    }
}

/// A random pose along a short drive; consecutive scans overlap.
fn random_pose(random: &mut Random, number: u64) -> Pose {
    let along = [0.0, 3.0, 6.0, 9.0, 6.0, 3.0][number as usize % 6];
    let turn = random.between(-3.0, 3.0);
    let position = random.point([along, 0.0, 0.5], 0.3);
    Pose::from_quaternion(position, [0.1, 0.0, (turn / 2.0_f64).sin(), (turn / 2.0_f64).cos()]).unwrap()
}

/// Poses in two periods of the motion; the last is unknown now and then.
fn random_sweep(random: &mut Random) -> Sweep {
    let poses = [0, 5_000_000, 10_000_000, 15_000_000, 20_000_000].map(|time_ns| {
        let turn = random.between(-0.5, 0.5);
        let position = random.point([0.0; 3], 1.0);
        let pose = Pose::from_quaternion(position, [0.0, turn, -0.1, 1.0]).unwrap();
        (time_ns, (time_ns == 0 || random.below(6) > 0).then(|| *pose.isometry()))
    });
    Sweep::new(poses).unwrap()
}

/// Returns new marks for the scans whose number modulo 4 is `rest`, or for all. Every fourth has no marked point.
pub fn new_marks(scans: &BTreeMap<u64, Taken>, seed: u64, rest: Option<u64>) -> BTreeMap<u64, Vec<bool>> {
    let chosen = scans.iter().filter(|(number, _)| rest.is_none_or(|rest| *number % 4 == rest));
    let marks = chosen.map(|(&number, scan)| {
        let mut random = Random(seed ^ number);
        let share = [0.0, 0.3, 0.5, 1.0][random.below(4) as usize];
        (number, scan.points.iter().map(|_| random.between(0.0, 1.0) < share).collect())
    });
    marks.collect()
}

/// Returns new poses for the scans whose number modulo 4 is `rest`, or for all.
/// Half of them have another motion too.
pub fn new_poses(scans: &BTreeMap<u64, Taken>, seed: u64, rest: Option<u64>) -> Vec<(u64, NewPose)> {
    let numbers = scans.keys().copied().filter(|number| rest.is_none_or(|rest| number % 4 == rest));
    let pose = |number: u64| {
        let mut random = Random(seed ^ number);
        let world_from_sensor = random_pose(&mut random, number);
        let sweep = (random.below(2) > 0).then(|| Arc::new(random_sweep(&mut random)));
        NewPose { world_from_sensor, sweep }
    };
    numbers.map(|number| (number, pose(number))).collect()
}
