//! Detection of the order of quaternion components, w first or w last, where no column name states it.

/// Evidence for the order of the components. In both orders, the quaternions have unit length and the same angles
/// between poses. Only in the correct order does the sensor start upright and turn about the vertical.
#[derive(Clone, Debug, Default)]
pub(super) struct OrderEvidence {
    /// First quaternion, as stored in the file.
    first: Option<[f64; 4]>,
    count: u64,
    /// Sums of the squared axis components of the rotations since the first pose, for w last and for w first.
    turns: [[f64; 3]; 2],
    /// Largest rotation, as the sine of half its angle.
    max_turn: f64,
    /// Number of poses with z pointing up, for each order.
    upright: [u64; 2],
}

/// Tolerance for a first pose that is exactly upright; smaller differences are rounding.
const EXACT: f64 = 1e-6;
/// Sines of half of 1 degree and of 15 degrees.
const SOME_TURN: f64 = 0.0087;
const MUCH_TURN: f64 = 0.13;

impl OrderEvidence {
    /// Adds a quaternion, as stored in the file.
    pub(super) fn insert(&mut self, written: [f64; 4]) {
        let length = written.iter().map(|q| q * q).sum::<f64>().sqrt();
        let written = written.map(|q| q / length);
        if !written.iter().all(|q| q.is_finite()) {
            return;
        }
        let first = *self.first.get_or_insert(written);
        self.count += 1;
        let readings = [w_last as fn([f64; 4]) -> [f64; 4], w_first];
        for ((read, turns), upright) in readings.iter().zip(&mut self.turns).zip(&mut self.upright) {
            let axis = turn(read(first), read(written));
            turns.iter_mut().zip(axis).for_each(|(sum, part)| *sum += part * part);
            self.max_turn = self.max_turn.max(axis.iter().map(|part| part * part).sum::<f64>().sqrt());
            *upright += u64::from(up(read(written)) > 0.5);
        }
    }

    /// Returns whether w is first according to the evidence. The default is w last, as in TUM files.
    pub(super) fn is_w_first(&self) -> bool {
        let Some(first) = self.first else { return false };
        let (up_if_last, up_if_first) = (up(w_last(first)), up(w_first(first)));
        if up_if_last > 0.5 || up_if_first < 0.866 {
            return false;
        }
        let [last, first_w] = self.turns.map(|[x, y, z]| z / (x + y + z));
        let [upright_if_last, upright_if_first] = self.upright.map(|count| count as f64 / self.count as f64);
        let is_identity = first[0].abs() > 1.0 - EXACT;
        let turns_about_z = |least: f64| first_w > least && last < 0.4;
        (is_identity && self.max_turn > SOME_TURN && turns_about_z(0.6))
            || (self.max_turn > MUCH_TURN
                && turns_about_z(0.8)
                && upright_if_first > 0.95
                && upright_if_last < 0.5)
    }
}

fn w_last(written: [f64; 4]) -> [f64; 4] {
    written
}

/// Converts `w x y z` to `x y z w`.
pub(super) fn w_first([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [x, y, z, w]
}

/// Returns the vertical component of the rotated z axis: 1 is up, -1 is down.
pub(super) fn up([x, y, z, w]: [f64; 4]) -> f64 {
    (w * w + z * z - x * x - y * y) / (w * w + z * z + x * x + y * y)
}

/// Returns the rotation axis between two rotations in the world frame, scaled by the sine of half the angle.
fn turn([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 3] {
    [
        bx * aw - bw * ax - by * az + bz * ay,
        by * aw - bw * ay - bz * ax + bx * az,
        bz * aw - bw * az - bx * ay + by * ax,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    type Rotation = UnitQuaternion<f64>;

    /// Returns whether w first is detected: for rotations written with w first, and for the same written with w last.
    fn found(rotations: &[Rotation]) -> [bool; 2] {
        [true, false].map(|is_first| {
            let mut evidence = OrderEvidence::default();
            for rotation in rotations {
                let [x, y, z, w]: [f64; 4] = rotation.coords.into();
                evidence.insert(if is_first { [w, x, y, z] } else { [x, y, z, w] });
            }
            evidence.is_w_first()
        })
    }

    fn of(angles: impl Iterator<Item = [f64; 3]>) -> Vec<Rotation> {
        angles.map(|[roll, pitch, yaw]| Rotation::from_euler_angles(roll, pitch, yaw)).collect()
    }

    #[test]
    fn turns_of_an_upright_sensor_reveal_the_order() {
        let car = of((0..50).map(|k| [0.01, 0.02, 0.02 * f64::from(k)]));
        assert_eq!(found(&car), [true, false]);
        let from_rest = of((0..50).map(|k| [0.0, 0.0, 0.001 * f64::from(k)]));
        assert_eq!(found(&from_rest), [true, false]);
        let hand = of((0..200)
            .map(|k| f64::from(k) * 0.05)
            .map(|t| [0.1 * (3.0 * t).sin(), 0.15 * (2.0 * t).sin(), 0.6 * t.sin() + 0.1 * t]));
        assert_eq!(found(&hand), [true, false]);
        let other_way = of((0..30).map(|k| [0.0, 0.0, 1.0 + 0.03 * f64::from(k)]));
        assert_eq!(found(&other_way), [true, false]);
    }

    #[test]
    fn w_is_last_by_default() {
        let still = of((0..9).map(|_| [0.0; 3]));
        assert_eq!(found(&still), [false, false]);
        // Upside down, as a lidar below a drone.
        let below = of((0..50).map(|k| [std::f64::consts::PI, 0.0, 0.02 * f64::from(k)]));
        assert!(!found(&below)[1]);
        let below = of((0..50).map(|_| [std::f64::consts::PI, 0.0, 0.0]));
        assert!(!found(&below)[1]);
        // A camera, whose z axis points forward, with any heading.
        for start in 0..24 {
            let optical = Rotation::from_euler_angles(-std::f64::consts::FRAC_PI_2, 0.0, 0.0);
            for swing in [0.0, 0.02, 0.3, 1.5, 6.0] {
                let yaw = |k: u8| f64::from(start) * 0.2618 + swing * f64::from(k) / 60.0;
                let turns = (0..60).map(|k| Rotation::from_euler_angles(0.0, 0.03, yaw(k)) * optical);
                assert!(!found(&turns.collect::<Vec<_>>())[1], "{start} {swing}");
            }
        }
        // The first camera is the world frame: y points down.
        let nodding = of((0..60).map(|k| [0.02 * f64::from(k), 0.0, 0.0]));
        assert!(!found(&nodding)[1]);
    }
}
