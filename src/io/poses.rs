use crate::error::{Error, FormatError, Result};
use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion};
use std::path::Path;

/// Reads poses, sensor to world, one a line; empty lines and those that begin with `#` are skipped.
///
/// A line of 8 numbers is TUM's `t tx ty tz qx qy qz qw`, one of 12 is KITTI's row-major 3x4 matrix.
///
/// # Errors
///
/// A line of another kind, numbers that are not finite, a quaternion of no length, a matrix that is no rotation.
pub fn read_poses(path: &Path) -> Result<Vec<Isometry3<f64>>> {
    let text = std::fs::read(path).map_err(|error| Error::io(path, "read", error))?;
    parse_poses(&String::from_utf8_lossy(&text)).map_err(|error| error.in_input(path))
}

/// The poses of a text, as [`read_poses`] reads them from a file.
///
/// # Errors
///
/// Those of [`read_poses`] that are about a line.
pub fn parse_poses(text: &str) -> std::result::Result<Vec<Isometry3<f64>>, FormatError> {
    let lines =
        (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.trim().starts_with('#'));
    lines.map(|(number, line)| parse(line).map_err(|reason| FormatError::at_line(number, reason))).collect()
}

fn parse(line: &str) -> std::result::Result<Isometry3<f64>, String> {
    let numbers: Vec<f64> = line
        .split([' ', '\t', ',', '\r'])
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().map_err(|_| format!("`{word}` is not a number")))
        .collect::<std::result::Result<_, _>>()?;
    // The time is not used; everything else must be finite.
    let pose = if numbers.len() == 8 { &numbers[1..] } else { &numbers[..] };
    if let Some(number) = pose.iter().find(|number| !number.is_finite()) {
        return Err(format!("{number} in a pose"));
    }
    match *pose {
        [x, y, z, qx, qy, qz, qw] => {
            let rotation = unit_quaternion(Quaternion::new(qw, qx, qy, qz))?;
            Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
        }
        [a, b, c, x, d, e, f, y, g, h, i, z] => {
            let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
            let deviation = (matrix * matrix.transpose() - Matrix3::identity()).abs().max();
            if deviation > 1e-3 || matrix.determinant() < 0.0 {
                return Err("the 3x3 part of the matrix is not a rotation".into());
            }
            let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
            // The matrix is a rotation only to a few digits; a pose must not scale.
            let rotation = UnitQuaternion::new_normalize(rotation.into_inner());
            Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
        }
        _ => Err(format!("{} numbers; a pose has 8 (TUM) or 12 (KITTI)", numbers.len())),
    }
}

/// The rotation of a quaternion of any length but 0, as far as its square is a number.
pub(super) fn unit_quaternion(
    quaternion: Quaternion<f64>,
) -> std::result::Result<UnitQuaternion<f64>, String> {
    if !quaternion.norm_squared().is_finite() {
        return Err("a quaternion too long to be a rotation".to_owned());
    }
    UnitQuaternion::try_new(quaternion, 1e-9).ok_or_else(|| "a quaternion of no length".to_owned())
}
