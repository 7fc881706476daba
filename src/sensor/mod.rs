//! Sensor models: the change of a voxel's evidence by one observation, independent of space; and the motion of a sensor
//! during a scan (`sweep`).
//!
//! | model | for | hit | miss |
//! |---|---|---|---|
//! | [`LogOdds`] (OctoMap's) | lidar, depth cameras | a constant | a constant |
//! | [`Iwlo`] | sonar, radar, lidar with intensity | weighted by intensity and age | weighted by age |

mod evidence;
mod iwlo;
mod log_odds;
mod model;
mod probabilities;
mod sweep;

pub use evidence::Evidence;
pub use iwlo::Iwlo;
pub use log_odds::LogOdds;
pub use model::{Observation, SensorModel};
pub use probabilities::probability_of;
pub use sweep::{NO_TIME, Sweep, ToStamp};
