//! Unnamed temporary files for data that exceeds memory. Appended bytes can be read in order as a memory map
//! ([`Window`]), or at any offset.

mod mapping;
mod scratch_file;
mod window;

pub use scratch_file::ScratchFile;
pub use window::Window;
