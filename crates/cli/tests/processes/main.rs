//! Real processes: killed, ended, reading beside a writer.
//!
//! The short form takes part in every test run. The long form:
//!
//! ```text
//! VOXTILE_KILLS=1000 VOXTILE_LIMITS=1000 VOXTILE_READER_SECONDS=60 VOXTILE_LIVES_SECONDS=3600 \
//!     cargo test --release --test processes
//! ```
#![cfg(unix)]

/// Less and less room for addresses, until a process cannot even start.
#[cfg(target_os = "linux")]
mod addresses;
/// Commands that are killed after a commit or a snapshot, and repeated.
mod completed;
/// Inputs that are added by one command, repeated until it succeeds.
mod exactly_once;
/// SIGKILL at random times, resumed until the end.
mod killed;
/// Random lives of maps: commands, kills and readers, against an expected state.
mod lives;
/// What a command takes of memory, told by itself.
mod memory;
/// Merges that are killed: no map, or the whole one.
mod merged;
/// The thread that writes octrees: one, asleep when idle, gone with its mapper.
#[cfg(target_os = "linux")]
mod octree_worker;
mod random;
/// Readers beside a writer see one flush whole.
mod readers;
/// What inputs of other programs take of memory, whatever they claim.
#[cfg(target_os = "linux")]
mod recordings;
/// A disk that is full or only for reading, and too many open files.
mod refused;
/// Snapshots and reverts that are killed.
mod snapshots;
/// SIGTERM and Ctrl-C: flushed and ended, whatever the input does.
mod stopped;
mod survey;
/// Maps that are verified while other processes change them.
mod verified;
