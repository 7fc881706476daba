use crate::error::{Error, Result};
use crate::space::Point;
use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion};

/// Pose of a sensor, `world_from_sensor`: transforms points from the sensor frame to the world frame, `world = R * p +
/// t`.
///
/// ```
/// use voxtile::{Pose, nalgebra};
///
/// # fn main() -> voxtile::Result<()> {
/// // 1.8 m above the ground, rotated by 90 degrees to the left.
/// let half = 0.5_f64.sqrt();
/// let pose = Pose::from_quaternion([0.0, 0.0, 1.8], [0.0, 0.0, half, half])?;
/// let same = Pose::from_matrix(&[[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.8]])?;
/// let [x, y, z] = same.to_world()([2.0, 0.0, 0.5]);
/// assert!(x.abs() < 1e-12 && (y - 2.0).abs() < 1e-12 && z == 2.3);
/// assert!((pose.isometry().inv_mul(same.isometry()).rotation.angle()) < 1e-7);
///
/// let level = Pose::from(nalgebra::Isometry3::translation(0.0, 0.0, 1.8));
/// assert_eq!(level.position_m(), pose.position_m());
///
/// let error = Pose::from_quaternion([0.0; 3], [0.0; 4]).unwrap_err();
/// assert_eq!(error.to_string(), "pose: a quaternion of length 0");
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    world_from_sensor: Isometry3<f64>,
}

/// Maximum deviation of the entries of `M * transpose(M)` from the identity.
const ROTATION_TOLERANCE: f64 = 1e-3;
/// Maximum deviation of the last row of a 4x4 matrix from 0 0 0 1.
const LAST_ROW_TOLERANCE: f64 = 1e-6;

impl Pose {
    /// Returns the pose of a sensor whose frame is the world frame.
    pub fn identity() -> Self {
        Self { world_from_sensor: Isometry3::identity() }
    }

    /// Creates a pose from a position in metres and a rotation quaternion in the order x, y, z, w. The quaternion is
    /// normalized.
    ///
    /// # Errors
    ///
    /// Fails if a number is not finite or the quaternion is zero.
    pub fn from_quaternion(position_m: Point, xyzw: [f64; 4]) -> Result<Self> {
        Self::of_quaternion(position_m, xyzw).map_err(wrong)
    }

    /// Creates a pose from a row-major matrix of 3 or 4 rows, with the rotation on the left and the position in metres
    /// on the right. A rotation that is exact only to a few digits is normalized, so that the pose does not scale.
    ///
    /// For numbers in one list, use `Pose::from_matrix(numbers.as_chunks().0)`.
    ///
    /// # Errors
    ///
    /// Fails if a number is not finite, the 3x3 part is not a rotation, the fourth row is not 0 0 0 1, or the number of
    /// rows is not 3 or 4.
    pub fn from_matrix(rows: &[[f64; 4]]) -> Result<Self> {
        Self::of_matrix(rows).map_err(wrong)
    }

    /// Like [`Pose::from_quaternion`], but the error is the reason as text.
    ///
    /// # Errors
    ///
    /// Same errors as [`Pose::from_quaternion`].
    pub fn of_quaternion(position_m: Point, [x, y, z, w]: [f64; 4]) -> std::result::Result<Self, String> {
        check_finite(position_m.iter().chain(&[x, y, z, w]))?;
        let quaternion = Quaternion::new(w, x, y, z);
        if !quaternion.norm_squared().is_finite() {
            return Err("a quaternion too long to be a rotation".to_owned());
        }
        let rotation = UnitQuaternion::try_new(quaternion, 1e-9).ok_or("a quaternion of length 0")?;
        Ok(Self { world_from_sensor: Isometry3::from_parts(Translation3::from(position_m), rotation) })
    }

    /// Like [`Pose::from_matrix`], but the error is the reason as text.
    ///
    /// # Errors
    ///
    /// Same errors as [`Pose::from_matrix`].
    pub fn of_matrix(rows: &[[f64; 4]]) -> std::result::Result<Self, String> {
        check_finite(rows.iter().flatten())?;
        let ([[a, b, c, x], [d, e, f, y], [g, h, i, z]], last) = match *rows {
            [first, second, third] => ([first, second, third], None),
            [first, second, third, last] => ([first, second, third], Some(last)),
            _ => return Err(format!("a matrix of {} rows; a pose has 3 or 4", rows.len())),
        };
        let is_near = |(number, wanted): (&f64, f64)| (number - wanted).abs() <= LAST_ROW_TOLERANCE;
        if last.is_some_and(|last| !last.iter().zip([0.0, 0.0, 0.0, 1.0]).all(is_near)) {
            return Err("the last row of the matrix is not 0 0 0 1; use row-major order".to_owned());
        }
        let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
        let deviation = matrix * matrix.transpose() - Matrix3::identity();
        // For entries that overflow when squared, the deviation is infinite or NaN.
        let is_rotation = deviation.iter().all(|by| by.abs() <= ROTATION_TOLERANCE);
        if !is_rotation || matrix.determinant() < 0.0 {
            return Err("the 3x3 part of the matrix is not a rotation".to_owned());
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
        // The matrix is a rotation only to a few digits; normalize, because a pose must not scale.
        let rotation = UnitQuaternion::new_normalize(rotation.into_inner());
        Ok(Self { world_from_sensor: Isometry3::from_parts(Translation3::new(x, y, z), rotation) })
    }

    /// Position of the sensor in metres, world frame.
    pub fn position_m(&self) -> Point {
        self.world_from_sensor.translation.vector.into()
    }

    /// Rotation as a quaternion in the order x, y, z, w.
    pub fn quaternion(&self) -> [f64; 4] {
        self.world_from_sensor.rotation.coords.into()
    }

    /// The pose as an isometry of [`nalgebra`].
    pub fn isometry(&self) -> &Isometry3<f64> {
        &self.world_from_sensor
    }

    /// Returns a function that transforms points in metres from the sensor frame to the world frame.
    pub fn to_world(&self) -> impl Fn(Point) -> Point + Copy + use<> {
        let rotation = self.world_from_sensor.rotation.to_rotation_matrix();
        let r: [Point; 3] = std::array::from_fn(|i| std::array::from_fn(|k| rotation[(i, k)]));
        let t = self.position_m();
        // Written out, so that the order of operations, and thus the last bit, does not depend on a library.
        move |p: Point| std::array::from_fn(|i| r[i][0] * p[0] + r[i][1] * p[1] + r[i][2] * p[2] + t[i])
    }
}

impl From<Isometry3<f64>> for Pose {
    /// Converts without checks.
    fn from(world_from_sensor: Isometry3<f64>) -> Self {
        Self { world_from_sensor }
    }
}

impl From<Pose> for Isometry3<f64> {
    fn from(pose: Pose) -> Self {
        pose.world_from_sensor
    }
}

fn check_finite<'a>(mut numbers: impl Iterator<Item = &'a f64>) -> std::result::Result<(), String> {
    match numbers.find(|number| !number.is_finite()) {
        Some(number) => Err(format!("{number} in a pose")),
        None => Ok(()),
    }
}

fn wrong(reason: String) -> Error {
    Error::argument("pose", reason)
}
