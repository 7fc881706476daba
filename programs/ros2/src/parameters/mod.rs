//! Options from a parameter file of ROS 2: they are as if they stood on the command line, before what stands there.
//!
//! ```text
//! file -> parameters of this node -> Known: an option, one without effect, one that is not there -> Args
//! ```

mod known;
mod parameter_file;
mod parse;
mod value;

pub use parse::parse;
