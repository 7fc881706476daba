//! Options from launch files and ROS 2 parameter files. The command line has precedence.
//!
//! ```text
//! --ros-args -> options, parameters
//! file -> parameters of this node -> Known: a field, without effect, or unknown -> Args
//! ```

mod known;
mod parameter_file;
mod parse;
mod ros_args;
mod value;

pub use parse::parse;
