use super::RigidPose;
use super::quaternion_order::up;

/// Statistics of the direction of travel in the sensor frame. They show poses that belong to another frame, such as a
/// camera's.
#[derive(Clone, Debug, Default)]
pub(super) struct Direction {
    first: Option<RigidPose>,
    last: Option<RigidPose>,
    /// Sums of the squared steps along the sensor's x, y and z, in m^2.
    squares: [f64; 3],
    /// Sums of the steps along the sensor's axes, in metres.
    steps_m: [f64; 3],
    path_m: f64,
}

/// Shorter steps are dominated by noise.
const MIN_STEP_M: f64 = 0.2;
/// Shortest path that gives a reliable direction.
const MIN_PATH_M: f64 = 1.5;
const Y: usize = 1;
const Z: usize = 2;

impl Direction {
    /// Number of poses to evaluate.
    pub(super) const MAX_POSES: usize = 10_000;

    pub(super) fn insert(&mut self, pose: &RigidPose) {
        self.first.get_or_insert(*pose);
        let Some(last) = &self.last else {
            self.last = Some(*pose);
            return;
        };
        let step = last.inverse().apply(pose.position_m);
        let square: f64 = step.iter().map(|part| part * part).sum();
        if square < MIN_STEP_M * MIN_STEP_M || !square.is_finite() {
            return;
        }
        for ((sum, steps), part) in self.squares.iter_mut().zip(&mut self.steps_m).zip(step) {
            *sum += part * part;
            *steps += part;
        }
        self.path_m += square.sqrt();
        self.last = Some(*pose);
    }

    /// Returns the fraction of the motion that is along an axis, if the path is long enough.
    fn share(&self, axis: usize) -> Option<f64> {
        let all: f64 = self.squares.iter().sum();
        (self.path_m >= MIN_PATH_M).then(|| self.squares.get(axis).map_or(0.0, |square| square / all))
    }

    /// Returns whether the trajectory may be a camera's, which looks along its z: false if it mostly moves along x or
    /// y.
    pub(super) fn may_be_of_camera(&self) -> bool {
        self.share(Z).is_none_or(|share| share > 0.5)
    }

    /// Returns whether the sensor moves along its z.
    pub(super) fn is_along_z(&self) -> bool {
        self.share(Z).is_some_and(|share| share > 0.9)
    }

    /// Returns warnings about a lidar trajectory. `names_calib`: another warning already names the `calib.txt` of a
    /// camera.
    pub(super) fn remarks(&self, has_calib: bool, names_calib: bool) -> Vec<String> {
        let mut remarks = Vec::new();
        let Some(first) = &self.first else { return remarks };
        let starts_level = up(first.quaternion) > 0.94;
        if up(first.quaternion) < -0.7 {
            remarks.push(
                "the first pose is upside down: is the sensor mounted upside down? If the quaternions start with w, \
                 add a header line (# t tx ty tz qw qx qy qz)"
                    .to_owned(),
            );
        } else if !has_calib && !names_calib && starts_level && self.is_along_z() {
            remarks.push(
                "the sensor moves along its z axis, like a camera and unlike a lidar on the ground: convert the poses \
                 with `calib` FILE or `extrinsic`"
                    .to_owned(),
            );
        } else if has_calib && self.share(Y).is_some_and(|share| share > 0.9) && self.steps_m[Y] < 0.0 {
            remarks.push(
                "with `calib` the sensor moves along its -y axis: if the poses are already those of the lidar, omit \
                 `calib`"
                    .to_owned(),
            );
        }
        remarks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    fn moving(step_m: [f64; 3], roll: f64) -> Direction {
        let mut direction = Direction::default();
        for k in 0..30 {
            let rotation = UnitQuaternion::from_euler_angles(roll, 0.0, 0.0);
            let position_m: [f64; 3] = (rotation * (Vector3::from(step_m) * f64::from(k))).into();
            let quaternion: [f64; 4] = rotation.coords.into();
            direction.insert(&RigidPose { position_m, quaternion });
        }
        direction
    }

    #[test]
    fn cameras_move_along_z() {
        let camera = moving([0.01, 0.0, 0.9], 0.0);
        assert!(camera.is_along_z() && camera.may_be_of_camera());
        assert!(camera.remarks(false, false).iter().any(|remark| remark.contains("along its z axis")));
        assert!(camera.remarks(true, false).is_empty() && camera.remarks(false, true).is_empty());
        let lidar = moving([0.9, 0.1, 0.05], 0.0);
        assert!(!lidar.is_along_z() && !lidar.may_be_of_camera());
        assert!(lidar.remarks(false, false).is_empty() && lidar.remarks(true, false).is_empty());
        let twice = moving([0.0, -0.9, 0.0], 0.0);
        assert!(twice.remarks(false, false).is_empty() && twice.remarks(true, false).len() == 1);
        assert!(moving([0.0, 0.9, 0.0], 0.0).remarks(true, false).is_empty());
        let still = moving([0.0, 0.0, 0.001], 0.0);
        assert!(!still.is_along_z() && still.may_be_of_camera() && still.remarks(false, false).is_empty());
    }

    #[test]
    fn first_pose_upside_down_is_remarked() {
        let remarks = moving([0.9, 0.0, 0.0], std::f64::consts::PI).remarks(false, true);
        assert!(remarks.len() == 1 && remarks[0].contains("upside down"), "{remarks:?}");
        assert!(moving([0.9, 0.0, 0.0], 1.0).remarks(false, false).is_empty());
    }
}
