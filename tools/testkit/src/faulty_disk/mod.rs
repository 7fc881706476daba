//! A disk in memory that fails or loses power at the operation it is told to.
//!
//! - [`FaultyDisk`] (`disk.rs`): what tests set up, break and look at;
//! - `fault.rs`: what goes wrong, and what a crash leaves;
//! - `state.rs`: what is on the disk, beside what is on the medium (`content.rs` of files, `names.rs` of folders), and
//!   whether an operation goes (`operation.rs`);
//! - `operations.rs` is the mapper's side, with the files that it has open in `handles.rs`.

mod content;
mod disk;
mod fault;
mod handles;
mod names;
mod operation;
mod operations;
mod state;

pub use disk::FaultyDisk;
pub use fault::{Fault, Unsynced};
