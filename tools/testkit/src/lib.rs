//! Shared code of the tests, benchmarks, examples and tools of voxtile.
//!
//! - naive implementations to compare with: [`reference_map`], [`reference_layers`], [`reference_local`]
//! - faults: [`faulty_disk`], [`lossy_link`]
//! - inputs and folders: [`random_scans`], [`attributed_scan`], [`unsynced_disk`], [`memory_folder`]
//! - paths and error messages: [`support`]

#[allow(missing_docs)]
pub mod attributed_scan;
#[allow(missing_docs)]
pub mod faulty_disk;
#[allow(missing_docs)]
pub mod lossy_link;
#[allow(missing_docs)]
pub mod memory_folder;
#[allow(missing_docs)]
pub mod random_scans;
#[allow(missing_docs)]
pub mod reference_clearing;
#[allow(missing_docs)]
pub mod reference_layers;
#[allow(missing_docs)]
pub mod reference_local;
#[allow(missing_docs)]
pub mod reference_map;
pub mod support;
#[allow(missing_docs)]
pub mod unsynced_disk;

/// Compiles the Rust code of the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
mod readme {}
