//! What the tests, benchmarks, examples and tools of voxtile share.
//!
//! - what a clever part must equal: [`reference_map`], [`reference_local`];
//! - what goes wrong: [`faulty_disk`], [`lossy_link`];
//! - what they work on: [`random_scans`], [`unsynced_disk`], [`memory_folder`];
//! - where files are, and what errors say: [`support`].

#[allow(missing_docs)]
pub mod faulty_disk;
#[allow(missing_docs)]
pub mod lossy_link;
#[allow(missing_docs)]
pub mod memory_folder;
#[allow(missing_docs)]
pub mod random_scans;
#[allow(missing_docs)]
pub mod reference_local;
#[allow(missing_docs)]
pub mod reference_map;
pub mod support;
#[allow(missing_docs)]
pub mod unsynced_disk;

/// The Rust code of the README, which compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
mod readme {}
