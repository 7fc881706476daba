//! The command `voxtile`, one module per subcommand: parses options, calls the library and prints the result.
//!
//! It is a library so that other programs, such as the Python package, can embed the command.

mod args;
mod build;
mod clean;
mod clear;
mod compare;
mod completions;
mod convert;
mod counted;
mod coverage;
mod crop;
mod decay;
mod demo;
mod diff;
mod digest;
mod distance;
mod export;
mod failure;
mod html;
mod import;
mod info;
mod json;
mod local;
mod local_table;
mod logging;
mod man;
mod merge;
mod octree_choice;
mod octree_info;
mod option_names;
mod part;
mod picture;
mod progress;
#[cfg(feature = "bucket")]
mod pull;
#[cfg(feature = "bucket")]
mod push;
mod query;
mod quiet;
mod raycast;
mod read_options;
mod region_tiles;
mod remap;
mod remove_points;
mod remove_scans;
mod repair;
mod replay;
mod report;
mod revert;
mod run;
mod scans;
mod share;
mod snapshot;
mod snapshots;
mod stop_signal;
mod summary;
mod threads;
mod verify;
#[cfg(feature = "view")]
mod view;
mod volume;
mod written;

pub use run::{main, run};
