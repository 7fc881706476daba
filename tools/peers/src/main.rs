//! Compares voxtile with OctoMap on the same scans and prints one table. `tools/peers/run.sh` builds and starts it.

mod contenders;
mod exactness;
mod machine;
mod measure;
mod table;
mod workloads;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use contenders::Contenders;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Compares voxtile with OctoMap and prints a table in Markdown; exits with 1 if one of them maps wrongly.
#[derive(Debug, Parser)]
#[command(name = "peers", version)]
struct Arguments {
    /// A minute at most: few scans, one run, two workloads
    #[arg(long)]
    short: bool,
    /// Runs of each contender; the table has medians [default: 3, or 1 with --short]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    runs: Option<u32>,
    /// Take the real data sets too
    #[arg(long)]
    real: bool,
    /// Folder of the real data sets
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    data: PathBuf,
    /// The contender of OctoMap
    #[arg(long, value_name = "PROGRAM")]
    octomap: PathBuf,
    /// The contender of OctoMap, compiled for this very machine
    #[arg(long, value_name = "PROGRAM")]
    octomap_native: Option<PathBuf>,
    /// Which OctoMap that is, for the table's head
    #[arg(long, value_name = "WORDS", default_value = "of unknown version")]
    octomap_version: String,
    /// The contender of voxtile
    #[arg(long, value_name = "PROGRAM")]
    voxtile: PathBuf,
    /// Folder for streams and maps, on the disk that is to be compared on; emptied before and after
    #[arg(long, value_name = "FOLDER")]
    work: PathBuf,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("peers: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// Whether both contenders map as they should.
fn run(arguments: &Arguments) -> Result<bool> {
    let mut workloads = if arguments.short { workloads::short() } else { workloads::made_up() };
    if arguments.real {
        workloads.extend(workloads::real(&arguments.data));
    }
    let runs = arguments.runs.unwrap_or(if arguments.short { 1 } else { 3 });
    let contenders = Contenders {
        octomap: arguments.octomap.clone(),
        octomap_native: arguments.octomap_native.clone(),
        voxtile: arguments.voxtile.clone(),
        least_seconds: if arguments.short { 0.2 } else { 0.5 },
        points: if arguments.short { 100_000 } else { 1_000_000 },
    };
    let work = WorkFolder::create(&arguments.work)?;
    let (mut rows, mut faults) = (Vec::new(), Vec::new());
    for workload in &workloads {
        let files = workload.write(work.path())?;
        rows.extend(measure::rows(workload, &files, &contenders, runs, &mut faults)?);
        rows.extend(exactness::rows(workload, &files, &contenders, &mut faults)?);
        work.clear()?;
    }
    println!("{}", machine::description(&arguments.octomap_version)?);
    println!("Command: `{}`. {runs} run(s).\n", command(arguments));
    print!("{}", table::markdown(&rows));
    for fault in &faults {
        eprintln!("peers: {fault}");
    }
    Ok(faults.is_empty())
}

/// The command line that a user gave, as far as it decides what is compared.
fn command(arguments: &Arguments) -> String {
    let mut command = "tools/peers/run.sh".to_owned();
    for (given, option) in [(arguments.short, " --short"), (arguments.real, " --real")] {
        if given {
            command.push_str(option);
        }
    }
    if let Some(runs) = arguments.runs {
        command.push_str(&format!(" --runs {runs}"));
    }
    command
}

/// A folder that is removed in the end.
struct WorkFolder(PathBuf);

impl WorkFolder {
    /// Takes a folder that does not exist yet or that an earlier run left.
    fn create(path: &Path) -> Result<Self> {
        let marker = path.join(".peers");
        ensure!(
            !path.exists() || marker.exists(),
            "{}: there is something else already; name another folder with --work",
            path.display()
        );
        let folder = Self(path.to_owned());
        folder.clear()?;
        Ok(folder)
    }

    fn path(&self) -> &Path {
        &self.0
    }

    fn clear(&self) -> Result<()> {
        let path = &self.0;
        let emptied = || {
            if path.exists() {
                fs::remove_dir_all(path)?;
            }
            fs::create_dir_all(path)?;
            fs::write(path.join(".peers"), "")
        };
        emptied().with_context(|| format!("{}: cannot empty the folder", path.display()))
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        if let Err(error) = fs::remove_dir_all(&self.0) {
            eprintln!("peers: {}: cannot remove the folder: {error}", self.0.display());
        }
    }
}
