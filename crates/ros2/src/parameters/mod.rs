//! Options from what launch files pass and from parameter files of ROS 2: they are as if they stood on the command
//! line, before what stands there.
//!
//! ```text
//! --ros-args -> options, parameters
//! file -> parameters of this node -> Known: an option, one without effect, one that is not there -> Args
//! ```

mod known;
mod parameter_file;
mod parse;
mod ros_args;
mod value;

pub use parse::parse;
