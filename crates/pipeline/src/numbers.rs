//! Conversion of lists of numbers from the front ends.

use voxtile::scan::Pose;
use voxtile::space::{Aabb, Point};
use voxtile::{Error, Result};
use voxtile_formats::ReadOptions;
use voxtile_formats::RigidPose;

/// Limit for tolerances and periods, in seconds.
const MAX_S: f64 = 1e9;

/// Converts six numbers in metres to a box: X0 Y0 Z0 X1 Y1 Z1.
///
/// # Errors
///
/// The count is wrong, or the corners are not in this order. The error names `argument`.
pub fn region_of(argument: &str, corners: &[f64]) -> Result<Aabb> {
    if let [x0, y0, z0, x1, y1, z1] = *corners
        && x0 < x1
        && y0 < y1
        && z0 < z1
    {
        return Ok(Aabb { min: [x0, y0, z0], max: [x1, y1, z1] });
    }
    Err(Error::argument(argument, "needs X0 < X1, Y0 < Y1 and Z0 < Z1"))
}

/// Converts three numbers in metres to a point.
///
/// # Errors
///
/// The count is wrong. The error names `argument`.
pub fn point_of(argument: &str, numbers: &[f64]) -> Result<Point> {
    let count = numbers.len();
    numbers.try_into().map_err(|_| Error::argument(argument, format!("{count} numbers; give 3 (x y z)")))
}

/// Converts a `pose_tolerance` to nanoseconds.
///
/// # Errors
///
/// The value is not a valid time.
pub fn tolerance_ns(seconds: f64) -> Result<i64> {
    match (0.0..=MAX_S).contains(&seconds) {
        true => Ok((seconds * 1e9).round() as i64),
        false => {
            let reason = format!("{seconds} is not a time in seconds from 0 to {MAX_S}");
            Err(Error::argument("pose_tolerance", reason))
        }
    }
}

/// Checks the step of `round_points`, in metres.
///
/// # Errors
///
/// The value is not a valid step.
pub fn step_of_points_m(step_m: f64) -> Result<f64> {
    match (1e-6..=1.0).contains(&step_m) {
        true => Ok(step_m),
        false => {
            Err(Error::argument("round_points", format!("{step_m} is not a step in metres from 1e-6 to 1")))
        }
    }
}

/// Pose of the sensor in the body.
#[derive(Clone, Copy, Debug)]
pub struct Mount {
    /// For composition with poses of the body. A quaternion is kept as given, to the last bit.
    pub rigid: RigidPose,
    /// The same pose as a matrix.
    pub body_from_sensor: Pose,
}

impl Mount {
    /// Parses a pose of 7 numbers (position in metres, quaternion x y z w), a 3x4 matrix in row-major order, or 9
    /// numbers of a rotation matrix.
    ///
    /// # Errors
    ///
    /// The count is wrong, or the rotation is invalid.
    pub fn of(numbers: &[f64]) -> Result<Self> {
        let body_from_sensor = match *numbers {
            [x, y, z, qx, qy, qz, qw] => {
                let body_from_sensor = Pose::from_quaternion([x, y, z], [qx, qy, qz, qw])?;
                let rigid = RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] };
                return Ok(Self { rigid, body_from_sensor });
            }
            [a, b, c, d, e, f, g, h, i] => {
                Pose::from_matrix(&[[a, b, c, 0.0], [d, e, f, 0.0], [g, h, i, 0.0]])?
            }
            _ if numbers.len() == 12 => Pose::from_matrix(numbers.as_chunks().0)?,
            _ => {
                let reason = format!(
                    "{} numbers; give 7 (tx ty tz qx qy qz qw), 9 (a 3x3 matrix) or 12 (a 3x4 matrix, row by row)",
                    numbers.len()
                );
                return Err(Error::argument("extrinsic", reason));
            }
        };
        let rigid = RigidPose {
            position_m: body_from_sensor.position_m(),
            quaternion: body_from_sensor.quaternion(),
        };
        Ok(Self { rigid, body_from_sensor })
    }
}

/// Sets the pose of the sensor, and the frame of the box of ignored points: the body's or the sensor's.
///
/// # Errors
///
/// The box is in the body frame, but the sensor's pose in the body is not given.
pub fn set_mount(options: &mut ReadOptions, mount: Option<Mount>, is_box_of_body: bool) -> Result<()> {
    options.clouds.body_from_sensor = mount.map_or(RigidPose::IDENTITY, |mount| mount.rigid);
    if is_box_of_body {
        let Some(mount) = mount else {
            let reason = "the body frame requires `extrinsic`: add it, or give the box in the sensor frame";
            return Err(Error::argument("ignore_frame", reason));
        };
        options.selection.body_from_sensor = Some(mount.body_from_sensor);
    }
    Ok(())
}
