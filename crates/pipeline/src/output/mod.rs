//! Files and folders that are written atomically.

mod output_file;
mod staged_output;
mod target;

pub use output_file::{OutputFile, scratch_for};
pub use staged_output::StagedOutput;
pub use target::is_standard_output;
