use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use voxtile::maths;
use voxtile::scan::Pose;

/// Trajectory of a sensor: a pose for each step.
pub trait Route {
    /// Returns the pose of the sensor at a step: the transform from the sensor frame (x ahead, y left, z up, metres) to
    /// the world frame.
    ///
    /// It depends only on the index, not on earlier calls; ascending order is fastest.
    fn pose(&mut self, index: u64) -> Pose;
}

/// Returns the pose of a level sensor whose x axis is turned by `yaw_rad` from the world's x axis towards y.
pub(super) fn level_pose(position_m: [f64; 3], yaw_rad: f64) -> Pose {
    // The constructors of nalgebra call the platform's sine, which is not identical everywhere.
    let (sin, cos) = maths::sin_cos(0.5 * yaw_rad);
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(cos, 0.0, 0.0, sin));
    Isometry3::from_parts(Translation3::from(position_m), rotation).into()
}

/// Returns a spacing that is positive and finite, or else 1 m.
pub(super) fn sound_spacing(spacing_m: f64) -> f64 {
    if spacing_m > 0.0 && spacing_m.is_finite() { spacing_m } else { 1.0 }
}
