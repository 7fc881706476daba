//! Compares voxtile with OctoMap on the same scans and prints one table. `tools/bench.sh peers` builds and runs it.

mod contenders;
mod exactness;
mod measure;
mod table;
mod workloads;

use anyhow::{Context, Result};
use clap::Parser;
use contenders::Contenders;
use report::Options;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use workloads::Workload;

/// Compares voxtile with OctoMap and prints a table in Markdown; exits with 1 if one of the maps is wrong.
#[derive(Debug, Parser)]
#[command(name = "peers", version)]
struct Arguments {
    #[command(flatten)]
    options: Options,
    /// Also use the recorded data sets
    #[arg(long)]
    real: bool,
    /// OctoMap's contender
    #[arg(long, value_name = "PROGRAM")]
    octomap: PathBuf,
    /// OctoMap's contender, compiled for this machine
    #[arg(long, value_name = "PROGRAM")]
    octomap_native: Option<PathBuf>,
    /// Version of OctoMap, for the head of the table
    #[arg(long, value_name = "WORDS", default_value = "of unknown version")]
    octomap_version: String,
    /// voxtile's contender
    #[arg(long, value_name = "PROGRAM")]
    voxtile: PathBuf,
}

fn main() -> ExitCode {
    report::exit_code("peers", run(&Arguments::parse()))
}

/// Returns whether both contenders build correct maps.
fn run(arguments: &Arguments) -> Result<bool> {
    let Arguments { options, .. } = arguments;
    let mut workloads = if options.short { workloads::short() } else { workloads::synthetic() };
    if arguments.real {
        workloads.extend(workloads::real(&options.data));
    }
    let workloads = options.wanted(workloads, Workload::part)?;
    let runs = options.runs_or(3);
    let contenders = Contenders {
        octomap: arguments.octomap.clone(),
        octomap_native: arguments.octomap_native.clone(),
        voxtile: arguments.voxtile.clone(),
        least_seconds: if options.short { 0.2 } else { 0.5 },
        points: if options.short { 100_000 } else { 1_000_000 },
    };
    let work = options.work("peers")?;
    let (mut rows, mut faults) = (Vec::new(), Vec::new());
    for workload in &workloads {
        let files = workload.write(work.path())?;
        rows.extend(measure::rows(workload, &files, &contenders, runs, &mut faults)?);
        rows.extend(exactness::rows(workload, &files, &contenders, &mut faults)?);
        work.empty()?;
    }
    let text = format!("{}\n{}", head(arguments), table::markdown(&rows));
    print!("{text}");
    if let Some(folder) = &options.out {
        write(folder, &text)?;
    }
    for fault in &faults {
        eprintln!("peers: {fault}");
    }
    Ok(faults.is_empty())
}

/// The machine, the compiler options, and the command that repeats the measurement.
fn head(arguments: &Arguments) -> String {
    let Arguments { options, octomap_version, .. } = arguments;
    let real = if arguments.real { " --real" } else { "" };
    format!(
        "Machine: {}. OctoMap {octomap_version}, g++ -O2 -DNDEBUG -ffp-contract=off; voxtile: cargo's release profile, \
         no target CPU.\nCommand: `{}{real}`. {} run(s).\n",
        report::processor(),
        options.command("peers", options.only.as_deref()),
        options.runs_or(3),
    )
}

fn write(folder: &Path, text: &str) -> Result<()> {
    let path = folder.join("peers.md");
    let written = fs::create_dir_all(folder).and_then(|()| fs::write(&path, text));
    written.with_context(|| format!("{}: cannot write", path.display()))
}
