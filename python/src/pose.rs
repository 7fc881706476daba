//! Poses in the forms that Python programs use.

use crate::arrays::doubles;
use crate::errors::{exception, wrong};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use voxtile::{Point, Pose};

/// Parses `world_from_sensor`: a matrix of 4 x 4 or 3 x 4, seven numbers x y z qx qy qz qw, or a tuple of position and
/// quaternion (x, y, z, w).
pub fn pose_of(pose: &Bound<'_, PyAny>) -> PyResult<Pose> {
    let py = pose.py();
    let made = if let Ok(pair) = pose.cast::<PyTuple>()
        && pair.len() == 2
    {
        let position = point_of("pose", &pair.get_item(0)?)?;
        let (_, quaternion) = doubles("pose", &pair.get_item(1)?)?;
        let Ok(quaternion) = <[f64; 4]>::try_from(quaternion) else {
            return Err(wrong(py, "pose", "the quaternion must have four numbers x, y, z, w"));
        };
        Pose::from_quaternion(position, quaternion)
    } else {
        let (shape, numbers) = doubles("pose", pose)?;
        match (&shape[..], &numbers[..]) {
            ([4, 4] | [3, 4], rows) => Pose::from_matrix(rows.as_chunks().0),
            ([7], &[x, y, z, qx, qy, qz, qw]) => Pose::from_quaternion([x, y, z], [qx, qy, qz, qw]),
            _ => {
                let reason =
                    "must be a matrix of 4 x 4, seven numbers x y z qx qy qz qw, or (position, quaternion)";
                return Err(wrong(py, "pose", format!("{reason}, not of the shape {shape:?}")));
            }
        }
    };
    made.map_err(|error| exception(py, &error))
}

/// Parses a point: three numbers.
pub fn point_of(argument: &str, point: &Bound<'_, PyAny>) -> PyResult<Point> {
    let (shape, numbers) = doubles(argument, point)?;
    <Point>::try_from(numbers).map_err(|_| {
        wrong(point.py(), argument, format!("must have three numbers x, y, z, not the shape {shape:?}"))
    })
}

/// Returns a pose as a matrix of 4 x 4, row by row.
pub fn matrix_of(pose: &Pose) -> Vec<[f64; 4]> {
    let matrix = pose.isometry().to_homogeneous();
    (0..4).map(|row| std::array::from_fn(|column| matrix[(row, column)])).collect()
}
