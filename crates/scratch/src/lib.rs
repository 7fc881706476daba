//! Temporary files without a name, for what has no room in memory for a while. What was appended is read back in order as
//! memory ([`Window`]), or at any place.

mod mapping;
mod scratch_file;
mod window;

pub use scratch_file::ScratchFile;
pub use window::Window;
