use crate::error::{Error, Result};
use crate::space::Point;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion};

/// Motion of a sensor while it measured a scan: its poses at some times, in its own frame at the stamp of the scan.
///
/// Points are measured in the frame of the sensor at their own times. [`Sweep::to_stamp`] moves them to its frame at the
/// stamp (motion compensation, deskewing). Between two poses, positions and quaternions are interpolated linearly, and
/// quaternions are normalised; the arithmetic uses no function whose result differs between machines. Times are
/// nanoseconds after the stamp.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    knots: Vec<Knot>,
}

/// Pose at a time, if known. In single precision, a point at 100 m is off by 6 um.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    after_ns: i64,
    position_m: [f32; 3],
    /// x, y, z, w, on the side of the quaternion before; zeros if the pose is unknown.
    quaternion: [f32; 4],
}

/// Time of a point that has none: it is taken as measured at the stamp.
pub const NO_TIME: i64 = i64::MIN;

/// Size of a knot besides its time.
const KNOT_BYTES: usize = 7 * size_of::<f32>();

impl Sweep {
    /// Maximum number of times.
    pub const MAX_POSES: usize = 1 << 15;
    /// Longest time between two poses with an interpolated pose.
    pub const PERIOD_NS: i64 = 5_000_000;

    /// Creates the motion from poses of the sensor in its frame at the stamp, in the order of their times; `None` at a
    /// time whose pose is unknown.
    ///
    /// # Errors
    ///
    /// Too many times, or times that do not ascend; a pose that is not finite in single precision.
    pub fn new(
        at_stamp_from_sensor: impl IntoIterator<Item = (i64, Option<Isometry3<f64>>)>,
    ) -> Result<Self> {
        let mut knots: Vec<Knot> = Vec::new();
        let mut before = [0.0, 0.0, 0.0, 1.0];
        for (after_ns, pose) in at_stamp_from_sensor.into_iter().take(Self::MAX_POSES + 1) {
            let (mut position_m, mut quaternion) = Default::default();
            if let Some(pose) = pose {
                position_m = pose.translation.vector.map(|x| x as f32).into();
                quaternion = pose.rotation.coords.map(|x| x as f32).into();
                if dot(before, quaternion) < 0.0 {
                    quaternion = quaternion.map(|x| -x);
                }
                before = quaternion;
            }
            knots.push(Knot { after_ns, position_m, quaternion });
        }
        Self { knots }.checked().map_err(|reason| Error::argument("sweep", reason))
    }

    fn checked(self) -> std::result::Result<Self, &'static str> {
        let knots = &self.knots;
        let is_valid = |knot: &Knot| {
            knot.position_m.iter().chain(&knot.quaternion).all(|x| x.is_finite())
                && (!knot.is_known() || (0.5..2.0).contains(&dot(knot.quaternion, knot.quaternion)))
        };
        if knots.len() > Self::MAX_POSES {
            Err("has more than 32768 poses")
        } else if !knots.iter().all(is_valid) {
            Err("has a pose that is not finite")
        } else if !knots.is_sorted_by(|a, b| a.after_ns < b.after_ns) {
            Err("has times that do not ascend")
        } else {
            Ok(self)
        }
    }

    /// Times of all poses, known or not.
    pub fn times_ns(&self) -> impl Iterator<Item = i64> + '_ {
        self.knots.iter().map(|knot| knot.after_ns)
    }

    /// Returns whether points of this time are moved. Others stay where they are.
    pub fn covers(&self, after_ns: i64) -> bool {
        after_ns == 0 || self.to_stamp().at(after_ns).is_some()
    }

    /// Largest distance of the sensor from its position at the stamp, in metres.
    pub(crate) fn reach_m(&self) -> f64 {
        let norm_m = |knot: &Knot| knot.position_m.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
        self.knots.iter().map(norm_m).fold(0.0, f64::max)
    }

    /// Returns a cursor that moves points to the frame of the sensor at the stamp.
    pub fn to_stamp(&self) -> ToStamp<'_> {
        ToStamp { knots: &self.knots, first: 0, after_ns: NO_TIME, rows: None }
    }

    /// Replaces `moved` by points in the frame of the sensor at the stamp. Points beyond the list of times stay.
    pub(crate) fn move_all(&self, points: &[Point], times_ns: &[i64], moved: &mut Vec<Point>) {
        let mut to_stamp = self.to_stamp();
        let times_ns = times_ns.iter().copied().chain(std::iter::repeat(NO_TIME));
        moved.clear();
        moved.extend(points.iter().zip(times_ns).map(|(point, after_ns)| to_stamp.apply(*point, after_ns)));
    }

    /// Appends the sweep as `docs/format.md` specifies it.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend((self.knots.len() as u32).to_le_bytes());
        for knot in &self.knots {
            out.extend(knot.after_ns.to_le_bytes());
            knot.position_m.iter().chain(&knot.quaternion).for_each(|x| out.extend(x.to_le_bytes()));
        }
    }

    /// Reads a sweep and returns the bytes after it; `None` if it is invalid.
    pub(crate) fn read(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (count, rest) = bytes.split_first_chunk()?;
        let knot_bytes = size_of::<i64>() + KNOT_BYTES;
        let bytes = (u32::from_le_bytes(*count) as usize).checked_mul(knot_bytes)?;
        let (knots, rest) = rest.split_at_checked(bytes)?;
        let knots = knots.chunks_exact(knot_bytes).filter_map(|knot| {
            let (after_ns, floats) = knot.split_first_chunk()?;
            let (floats, _) = floats.as_chunks();
            let float = |k: usize| floats.get(k).map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes));
            Some(Knot {
                after_ns: i64::from_le_bytes(*after_ns),
                position_m: [0, 1, 2].map(float),
                quaternion: [3, 4, 5, 6].map(float),
            })
        });
        Some((Self { knots: knots.collect() }.checked().ok()?, rest))
    }

    /// Approximate heap memory in bytes.
    pub(crate) fn heap_bytes(&self) -> usize {
        self.knots.capacity() * size_of::<Knot>()
    }
}

/// Rows of a rotation matrix, each with the coordinate of the translation in metres.
type Rows = [[f64; 4]; 3];

impl Knot {
    fn is_known(&self) -> bool {
        self.quaternion != [0.0; 4]
    }
}

/// Moves points of a scan to the frame of the sensor at the stamp. Consecutive points of the same time are fast.
#[derive(Debug)]
pub struct ToStamp<'a> {
    knots: &'a [Knot],
    /// Index of the knot at or before the last point.
    first: usize,
    after_ns: i64,
    /// Transformation at that time; `None` for points that stay.
    rows: Option<Rows>,
}

impl ToStamp<'_> {
    /// Returns where a point measured at this time is in the frame of the sensor at the stamp, in metres. It stays where
    /// it is at a time without a pose, and if it is the origin, which means "no return".
    #[inline]
    pub fn apply(&mut self, point: Point, after_ns: i64) -> Point {
        if after_ns != self.after_ns {
            self.after_ns = after_ns;
            self.rows = if after_ns == 0 { None } else { self.at(after_ns) };
        }
        let [x, y, z] = point;
        match self.rows {
            Some(rows) if point != [0.0; 3] => rows.map(|[a, b, c, t]| a * x + b * y + c * z + t),
            _ => point,
        }
    }

    /// Returns the transformation at a time, if it is known.
    fn at(&mut self, after_ns: i64) -> Option<Rows> {
        let starts_here = |knots: &[Knot]| {
            knots[0].after_ns <= after_ns && knots.get(1).is_none_or(|next| after_ns < next.after_ns)
        };
        if !self.knots.get(self.first..).is_some_and(|knots| !knots.is_empty() && starts_here(knots)) {
            self.first = self.knots.partition_point(|knot| knot.after_ns <= after_ns).checked_sub(1)?;
        }
        let from = self.knots.get(self.first).filter(|knot| knot.is_known())?;
        if from.after_ns == after_ns {
            return Some(between(from, from, 0.0));
        }
        let to = self.knots.get(self.first + 1).filter(|knot| knot.is_known())?;
        let period_ns =
            to.after_ns.checked_sub(from.after_ns).filter(|period| *period <= Sweep::PERIOD_NS)?;
        Some(between(from, to, (after_ns - from.after_ns) as f64 / period_ns as f64))
    }
}

fn between(from: &Knot, to: &Knot, share: f64) -> Rows {
    let between = |from: f32, to: f32| f64::from(from) + share * (f64::from(to) - f64::from(from));
    let [x, y, z, w] = std::array::from_fn(|k| between(from.quaternion[k], to.quaternion[k]));
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix();
    std::array::from_fn(|row| {
        let of = |column: usize| rotation[(row, column)];
        [of(0), of(1), of(2), between(from.position_m[row], to.position_m[row])]
    })
}

fn dot(a: [f32; 4], b: [f32; 4]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn turning(after_ns: i64) -> Isometry3<f64> {
        let s = after_ns as f64 * 1e-9;
        Isometry3::new(Vector3::new(5.0 * s, 0.3 * s, -0.1 * s), Vector3::new(0.1 * s, -0.2 * s, 3.0 * s))
    }

    fn sweep(range: std::ops::RangeInclusive<i64>) -> Sweep {
        Sweep::new(range.step_by(5_000_000).map(|time| (time, Some(turning(time))))).unwrap()
    }

    #[test]
    fn points_move_as_the_sensor_did() {
        let sweep = sweep(-50_000_000..=50_000_000);
        let mut to_stamp = sweep.to_stamp();
        for after_ns in (-50_000_000..=50_000_000).step_by(1_234_567).chain([50_000_000, -50_000_000]) {
            assert!(sweep.covers(after_ns));
            for point in [[80.0, -3.0, 1.0], [0.5, 0.2, -60.0]] {
                let wanted = <[f64; 3]>::from(
                    turning(after_ns).rotation * Vector3::from(point) + turning(after_ns).translation.vector,
                );
                let found = to_stamp.apply(point, after_ns);
                let off_m = (0..3).map(|k| (found[k] - wanted[k]).powi(2)).sum::<f64>().sqrt();
                assert!(off_m < 2e-5, "{after_ns} ns: {off_m} m");
                assert_eq!(
                    found,
                    sweep.to_stamp().apply(point, after_ns),
                    "the order of points has no effect"
                );
            }
        }
    }

    #[test]
    fn points_without_a_pose_or_a_return_stay() {
        let all = sweep(0..=100_000_000);
        let mut to_stamp = all.to_stamp();
        let point = [3.0, 2.0, 1.0];
        for after_ns in [NO_TIME, -1, 0, 100_000_001, i64::MAX] {
            assert_eq!(to_stamp.apply(point, after_ns), point);
            assert_eq!(all.covers(after_ns), after_ns == 0);
        }
        assert_eq!(to_stamp.apply([0.0; 3], 50_000_000), [0.0; 3]);
        assert!(to_stamp.apply([f64::NAN; 3], 50_000_000).iter().all(|x| x.is_nan()));
        assert_ne!(to_stamp.apply(point, 100_000_000), point);
        // An unknown pose at 10 ms, and none between 20 and 30 ms.
        let some = [0, 5, 10, 15, 20, 30].map(|ms| ms * 1_000_000);
        let gaps = Sweep::new(some.map(|time| (time, (time != 10_000_000).then(|| turning(time))))).unwrap();
        let covered = [4, 5, 9, 10, 14, 15, 19, 20, 21, 29, 30, 31].map(|ms| gaps.covers(ms * 1_000_000));
        let [yes, no] = [true, false];
        assert_eq!(covered, [yes, yes, no, no, no, yes, yes, yes, no, no, yes, no]);
        assert!(!Sweep::new([]).unwrap().covers(1));
    }

    #[test]
    fn bytes_read_back_and_damage_is_refused() {
        let knots = [(-9, Some(turning(-9))), (0, None), (4_000_000, Some(turning(4_000_000)))];
        let sweep = Sweep::new(knots).unwrap();
        let mut bytes = Vec::new();
        sweep.write(&mut bytes);
        let length = bytes.len();
        bytes.push(7);
        assert_eq!(Sweep::read(&bytes), Some((sweep, &[7][..])));
        for end in 0..length {
            assert_eq!(Sweep::read(&bytes[..end]), None);
        }
        let with = |at: usize, value: &[u8]| {
            let mut bytes = bytes.clone();
            bytes[at..at + value.len()].copy_from_slice(value);
            Sweep::read(&bytes).map(|(_, rest)| rest.len())
        };
        assert_eq!(with(0, &u32::MAX.to_le_bytes()), None);
        assert_eq!(with(4, &i64::MAX.to_le_bytes()), None, "times must ascend");
        assert_eq!(with(12, &f32::NAN.to_le_bytes()), None);
        assert_eq!(with(36, &9_f32.to_le_bytes()), None, "not a rotation");
        assert!(Sweep::new([(1, Some(turning(0))), (1, Some(turning(0)))]).is_err());
        assert!(Sweep::new((0..40_000).map(|time| (time, None))).is_err());
    }

    #[test]
    fn quaternions_of_either_sign_are_one_rotation() {
        let flipped = |time: i64| {
            let mut pose = turning(time);
            if time / 5_000_000 % 2 > 0 {
                pose.rotation = UnitQuaternion::new_unchecked(-pose.rotation.into_inner());
            }
            pose
        };
        let times = (0..=20_i64).map(|k| 5_000_000 * k);
        assert_eq!(
            Sweep::new(times.map(|time| (time, Some(flipped(time))))).unwrap(),
            sweep(0..=100_000_000)
        );
    }
}
