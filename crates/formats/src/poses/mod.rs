//! Poses of clouds. [`Trajectory`] reads pose files and returns the pose at a time, `find_poses.rs` finds the poses of
//! an input, and `posed_clouds.rs` combines clouds and poses to scans.

mod binary;
mod calib;
mod cells;
mod direction;
mod find_poses;
mod g2o;
mod gap;
mod header;
mod matrix;
mod npy;
mod pose_input;
mod pose_rows;
mod pose_source;
mod posed_clouds;
mod quaternion_order;
mod rigid_pose;
mod sweep_periods;
mod text;
mod time_unit;
mod trajectory;

pub(crate) use find_poses::{find_poses, pose_file_for};
pub(crate) use gap::SAME_TIME_NS;
pub use gap::most_gap_ns;
pub(crate) use matrix::matrix_of;
pub use pose_source::PoseSource;
pub use posed_clouds::CloudOptions;
pub(crate) use posed_clouds::{CloudPoses, PosedClouds};
pub use rigid_pose::RigidPose;
pub use sweep_periods::SweepPeriods;
pub(crate) use text::{Rules, looks_like_poses};
pub use trajectory::{Found, Trajectory};
