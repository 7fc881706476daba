//! The command `workload`: writes scans of a synthetic survey to a file or pipe, or a recording with labels to a
//! folder.

use anyhow::{Context, Result, bail};
use clap::{Args, Parser, Subcommand};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use voxtile::Scan;
use voxtile_formats::ScanStreamWriter;
use workload::{Length, RecordingFolder, ScanWriter, SensorName, SurveyName};

/// Writes the scans of a synthetic survey, as a scan stream that `voxtile build` reads. `workload movers` writes a
/// recording with moving objects and labels.
///
/// Memory holds one scan at a time, whatever the length of the survey. The same arguments give the same bytes on every
/// platform.
///
///     workload drive --length 5km | voxtile build - -o MAP
#[derive(Debug, Parser)]
#[command(name = "workload", version, verbatim_doc_comment)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    stream: Option<StreamArguments>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Movers(MoversArguments),
}

/// Writes a recording of a city with moving objects, with a label for each point
///
/// Ten scans per second. FOLDER/scans/NNNNNN.pcd has x, y, z (metres, sensor frame: x ahead, y left, z up), intensity
/// (0 to 255) and label: 0 static, 1 parked car, 2 moving object, 3 parked car that leaves. Cars leave in the first
/// third of the recording, so that the sensor sees the empty places later.
/// FOLDER/poses_kitti.txt has the pose of each scan: sensor to world, 3 x 4 numbers, metres. The same arguments give
/// the same bytes on every platform.
///
///     workload movers --sensor spinning --scans 200 -o FOLDER
///     voxtile build FOLDER/scans --poses FOLDER/poses_kitti.txt -o MAP
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
struct MoversArguments {
    /// Sensor and its vehicle
    #[arg(long, value_name = "SENSOR", default_value = "spinning")]
    sensor: SensorName,
    /// Number of scans, ten per second
    #[arg(long, value_name = "N", default_value_t = 200)]
    scans: usize,
    /// Seed of the city, the movers and the noise
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Output folder; must be empty or not exist
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
}

#[derive(Debug, Args)]
struct StreamArguments {
    /// Survey to generate
    survey: SurveyName,
    /// Number of scans to write
    #[arg(long, value_name = "N", required_unless_present = "length")]
    scans: Option<usize>,
    /// Length of the trajectory, in km or m (5km, 800m)
    #[arg(long, value_name = "LENGTH", conflicts_with = "scans")]
    length: Option<Length>,
    /// Approximate number of rays of a scan; fixed for street and indoor
    #[arg(long, value_name = "N", default_value_t = SurveyName::RAYS)]
    rays: u32,
    /// Number of the first scan, counted from 0
    #[arg(long, value_name = "K", default_value_t = 0)]
    first: usize,
    /// Seed of the world, the trajectory and the noise
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Output file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write the plain stream of world points for other mappers instead: per scan, little-endian, count u32, origin 3 x
    /// f32, points 3 x f32 each, in metres
    #[arg(long)]
    plain: bool,
    /// Also write the intensities (0 to 255) to this file: one f32 per point, little-endian
    #[arg(long, value_name = "FILE", requires = "plain")]
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
    match (&arguments.command, &arguments.stream) {
        (Some(Command::Movers(movers)), _) => write_movers(movers),
        (None, Some(stream)) => write_survey(stream),
        (None, None) => bail!("a survey or a command is missing"),
    }
}

fn write_movers(arguments: &MoversArguments) -> Result<()> {
    let &MoversArguments { sensor, scans, seed, .. } = arguments;
    let mut folder = RecordingFolder::create(&arguments.output)?;
    let departures_s = scans as f64 / SensorName::RATE_HZ / 3.0;
    for scan in sensor.scans(seed, departures_s).take(scans) {
        folder.write(&scan)?;
    }
    folder.finish()
}

fn write_survey(arguments: &StreamArguments) -> Result<()> {
    let &StreamArguments { survey, seed, first, rays, .. } = arguments;
    let count = scan_count(arguments)?;
    let out: Box<dyn Write> = match &arguments.output {
        Some(path) => Box::new(created(path)?),
        None => Box::new(io::stdout().lock()),
    };
    let scans = survey.scans(seed, first, rays).take(count);
    let written = if arguments.plain {
        write_plain(scans, out, arguments.intensities.as_deref())?
    } else {
        write_stream(scans, out, &survey.label(seed, first, rays))
    };
    written.context("cannot write the scans")
}

fn scan_count(arguments: &StreamArguments) -> Result<usize> {
    match (arguments.scans, arguments.length, arguments.survey.spacing_m()) {
        (Some(scans), ..) => Ok(scans),
        (None, Some(length), Some(spacing_m)) => Ok((length.metres / spacing_m).ceil() as usize),
        _ => bail!("--length: the scans of this survey have no spacing; use --scans"),
    }
}

fn write_stream(mut scans: impl Iterator<Item = Scan>, out: Box<dyn Write>, label: &str) -> io::Result<()> {
    let mut writer = ScanStreamWriter::new(buffered(out), label, true)?;
    scans.try_for_each(|scan| writer.write_world(&scan))?;
    writer.flush()
}

fn write_plain(
    mut scans: impl Iterator<Item = Scan>,
    out: Box<dyn Write>,
    intensities: Option<&Path>,
) -> Result<io::Result<()>> {
    let intensities = intensities.map(created).transpose()?.map(|file| buffered(Box::new(file)));
    let mut writer = ScanWriter::new(buffered(out), intensities);
    Ok(scans.try_for_each(|scan| writer.write(&scan)).and_then(|()| writer.flush()))
}

fn buffered(out: Box<dyn Write>) -> BufWriter<Box<dyn Write>> {
    BufWriter::with_capacity(1 << 18, out)
}

fn created(path: &Path) -> Result<File> {
    File::create(path).with_context(|| format!("{}: cannot create the file", path.display()))
}

/// Closing the pipe, as in `workload ... | head`, is not an error.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    let cause = error.root_cause().downcast_ref::<io::Error>();
    cause.is_some_and(|cause| cause.kind() == io::ErrorKind::BrokenPipe)
}
