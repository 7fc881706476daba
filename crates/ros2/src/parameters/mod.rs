//! Options from what launch files pass and from parameter files of ROS 2. What stands on the command line wins.
//!
//! ```text
//! --ros-args -> options, parameters
//! file -> parameters of this node -> Known: a field, one without effect, one that is not there -> Args
//! ```

mod known;
mod parameter_file;
mod parse;
mod ros_args;
mod value;

pub use parse::parse;
