//! Files of poses: [`Trajectory`] reads them and tells the pose at a time.

mod binary;
mod calib;
mod gap;
mod header;
mod matrix;
mod npy;
mod pose_input;
mod pose_rows;
mod text;
mod time_unit;
mod trajectory;

pub use gap::most_gap_ns;
pub(crate) use matrix::matrix_of;
pub(crate) use text::{Rules, looks_like_poses};
pub use trajectory::{Found, Trajectory};
