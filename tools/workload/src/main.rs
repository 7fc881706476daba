//! The command `workload`: scans of a made-up survey to a file or to a pipe.

use anyhow::{Context, Result};
use clap::Parser;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use workload::{ScanWriter, SurveyName};

/// Writes the scans of a made-up survey as a stream of world points.
///
/// Per scan, little-endian: count u32, origin 3 x f32, points 3 x f32 each; metres in the world frame. The same
/// arguments give the same bytes on every platform.
#[derive(Debug, Parser)]
#[command(name = "workload", version)]
struct Arguments {
    /// Which survey
    survey: SurveyName,
    /// How many scans to write
    #[arg(long, value_name = "N")]
    scans: usize,
    /// Number of the first scan, counted from 0
    #[arg(long, value_name = "K", default_value_t = 0)]
    first: usize,
    /// Seed of the world, the way through it and the noise
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// File of the stream [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write the intensities (0 to 255) to this file too: one f32 a point, little-endian, scan after scan
    #[arg(long, value_name = "FILE")]
    intensities: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("workload: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let scans: Box<dyn Write> = match &arguments.output {
        Some(path) => Box::new(created(path)?),
        None => Box::new(io::stdout().lock()),
    };
    let intensities = match &arguments.intensities {
        Some(path) => Some(buffered(Box::new(created(path)?))),
        None => None,
    };
    let mut writer = ScanWriter::new(buffered(scans), intensities);
    for scan in arguments.survey.scans(arguments.seed, arguments.first).take(arguments.scans) {
        writer.write(&scan).context("cannot write the scans")?;
    }
    writer.flush().context("cannot write the scans")
}

fn buffered(out: Box<dyn Write>) -> BufWriter<Box<dyn Write>> {
    BufWriter::with_capacity(1 << 20, out)
}

fn created(path: &Path) -> Result<File> {
    File::create(path).with_context(|| format!("{}: cannot create the file", path.display()))
}

/// `workload ... | head` is no error.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    let cause = error.root_cause().downcast_ref::<io::Error>();
    cause.is_some_and(|cause| cause.kind() == io::ErrorKind::BrokenPipe)
}
