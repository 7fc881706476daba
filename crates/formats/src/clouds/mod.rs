//! What people record, as clouds of points with poses. Knows no map.
//!
//! ```text
//! file or folder -> CloudSource -> CloudHead, then CloudPoint after CloudPoint
//! file of poses  -> Trajectory  -> RigidPose at a time
//! ```
//!
//! Formats that need many crates stand behind features: `las`, `e57`, `ros`, `sqlite`.

mod cloud;
mod deskew;
mod error;
#[cfg(any(feature = "las", feature = "e57"))]
mod guard;
mod inside;
mod lines;
mod pose;
pub mod poses;
pub mod read;
#[cfg(feature = "ros")]
pub mod ros;
mod spill;
mod stamp;

pub use cloud::{CloudHead, CloudPoint, CloudSource, PoseAt};
pub use deskew::Deskew;
pub use pose::RigidPose;
pub use spill::Budget;
pub use stamp::in_name as stamp_of_name;
