use super::RigidPose;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// Maximum deviation of a matrix from a rotation. Files often round to a few digits.
const MAX_ERROR: f64 = 1e-2;

/// Converts a row-major 3x4 or 4x4 matrix to a pose.
pub(crate) fn matrix_of(numbers: &[f64]) -> Result<RigidPose, String> {
    let (rows, last) = match numbers.len() {
        12 | 16 => numbers.split_at(12),
        other => return Err(format!("{other} numbers; a matrix has 12 (3x4) or 16 (4x4)")),
    };
    if !numbers.iter().all(|number| number.is_finite()) {
        return Err("the matrix contains a number that is not finite".into());
    }
    if !last.is_empty()
        && last.iter().zip([0.0, 0.0, 0.0, 1.0]).any(|(found, wanted)| (found - wanted).abs() > 1e-6)
    {
        return Err("the last row of the matrix is not 0 0 0 1".into());
    }
    let &[a, b, c, x, d, e, f, y, g, h, i, z] = rows else { return Err("the matrix is not 3x4".into()) };
    let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
    let error = (matrix * matrix.transpose() - Matrix3::identity()).abs().max();
    if !(error < MAX_ERROR && matrix.determinant() > 0.0) {
        return Err(format!(
            "the matrix is not a rotation (error {error:.3}, determinant {:.3})",
            matrix.determinant()
        ));
    }
    let rotation = Rotation3::from_matrix_unchecked(matrix);
    // Normalising the quaternion spreads the rounding error of the matrix evenly.
    let quaternion = UnitQuaternion::from_rotation_matrix(&rotation);
    let [qx, qy, qz, qw]: [f64; 4] = quaternion.coords.into();
    Ok(RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] })
}
