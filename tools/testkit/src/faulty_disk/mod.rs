//! A disk in memory that fails or loses power at a chosen operation.
//!
//! - [`FaultyDisk`] (`disk.rs`): the interface for tests
//! - `fault.rs`: faults, and what a crash leaves
//! - `state.rs`: the visible state and the state of the medium (`content.rs` for files, `names.rs` for folders), and
//!   the outcome of operations (`operation.rs`)
//! - `operations.rs`: the interface for mappers, with open files in `handles.rs`

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
