//! Tests with real processes: kills, signals, and readers concurrent with a writer.
//!
//! The short form is part of every test run. The long form:
//!
//! ```text
//! VOXTILE_KILLS=1000 VOXTILE_LIMITS=1000 VOXTILE_READER_SECONDS=60 VOXTILE_LIVES_SECONDS=3600 \
//!     cargo test --release --test processes
//! ```
#![cfg(unix)]

/// Decreasing limits of address space, until no process can start.
#[cfg(target_os = "linux")]
mod addresses;
/// Commands killed after a commit or a snapshot, and repeated.
mod completed;
/// Inputs added by one command that is repeated until it succeeds.
mod exactly_once;
/// Builds killed with SIGKILL at random times and resumed to the end.
mod killed;
/// Random lifetimes of maps: commands, kills and readers, compared with an expected state.
mod lives;
/// Peak memory of commands, from their JSON.
mod memory;
/// Killed merges leave no map or a complete one.
mod merged;
/// One thread writes all octrees; it sleeps when idle and ends with its mapper.
#[cfg(target_os = "linux")]
mod octree_worker;
mod random;
/// Readers concurrent with a writer see consistent flushes.
mod readers;
/// Memory for inputs of other programs, whatever sizes their headers contain.
#[cfg(target_os = "linux")]
mod recordings;
/// Full disks, read-only disks and too many open files.
mod refused;
/// Killed snapshots and reverts.
mod snapshots;
/// SIGTERM and Ctrl-C flush and end a build, whatever the input does.
mod stopped;
mod survey;
/// Maps verified while other processes change them.
mod verified;
