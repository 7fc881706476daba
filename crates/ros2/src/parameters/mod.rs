//! Options from launch files and ROS 2 parameter files. The command line has precedence.
//!
//! ```text
//! --ros-args -> options, parameters
//! file -> parameters of this node -> known: fields of Args
//!                                    octomap_server: without effect, refused
//! ```

mod known;
mod octomap_server;
mod parameter_file;
mod parse;
mod remark;
mod ros_args;
mod value;

pub use parse::{Parsed, parse};
pub use remark::Remark;
