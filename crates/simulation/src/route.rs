use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use voxtile::maths;
use voxtile::scan::Pose;

/// Where a sensor is, step after step.
pub trait Route {
    /// Pose of the sensor at a step: takes the sensor frame (x ahead, y left, z up, metres) to the world's.
    ///
    /// The same for the same index, whatever was asked before; in rising order it is quickest.
    fn pose(&mut self, index: u64) -> Pose;
}

/// The pose of a level sensor whose x axis points to `yaw_rad`, counted from the world's x axis towards y.
pub(super) fn level_pose(position_m: [f64; 3], yaw_rad: f64) -> Pose {
    // nalgebra's own constructors from angles call the platform's sine.
    let (sin, cos) = maths::sin_cos(0.5 * yaw_rad);
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(cos, 0.0, 0.0, sin));
    Isometry3::from_parts(Translation3::from(position_m), rotation).into()
}

/// A spacing that can be driven: positive and finite, else 1 m.
pub(super) fn sound_spacing(spacing_m: f64) -> f64 {
    if spacing_m > 0.0 && spacing_m.is_finite() { spacing_m } else { 1.0 }
}
