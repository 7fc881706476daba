//! Measures distance fields of a recorded set: prints rows of Markdown tables. `tools/distance/run.sh` runs it.

mod bulk;
mod live;
mod npy;
mod points;
mod recorded;

use anyhow::Result;
use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Measures distance fields of a recorded set.
#[derive(Debug, Parser)]
#[command(name = "distance", version)]
struct Arguments {
    /// Folder of the recorded set
    set: PathBuf,
    /// Resolution in metres
    #[arg(long, default_value_t = 0.1)]
    resolution: f64,
    /// Cap in metres
    #[arg(long, default_value_t = 5.0)]
    cap: f64,
    /// Maximum range in metres
    #[arg(long, default_value_t = 60.0)]
    max_range: f64,
    #[command(subcommand)]
    what: What,
}

#[derive(Clone, Debug, Subcommand)]
enum What {
    /// A field in a folder and one in memory, with one thread; writes the obstacles and the field of a box as .npy
    Bulk {
        /// Folder for maps, fields and arrays
        work: PathBuf,
    },
    /// Updates of the field of a box of 40 x 40 x 8 m after each scan
    Live,
    /// Points of a field in memory
    Points,
}

fn main() -> ExitCode {
    report::exit_code("distance", run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<bool> {
    match &arguments.what {
        What::Bulk { work } => bulk::measure(arguments, work)?,
        What::Live => live::measure(arguments)?,
        What::Points => points::measure(arguments)?,
    }
    Ok(true)
}
