//! The tables of the voxel mapping paper: local maps, and robots that plan with them.

mod high_speed;
mod planner;
mod sensorless;
mod setups;

use anyhow::Result;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Prints the tables of the voxel mapping paper.
#[derive(Debug, Parser)]
#[command(name = "voxel_mapping", version)]
struct Arguments {
    #[command(subcommand)]
    table: Table,
}

#[derive(Debug, Subcommand)]
enum Table {
    /// Table I: time and memory of a local map with the setups a to e
    Setups(SetupArgs),
    /// Table II: travellers without sensors fly with the maps of two spotters
    Sensorless(FlightArgs),
    /// Table III: fast flights with a local map and with a window around the robot
    HighSpeed(FlightArgs),
}

#[derive(Debug, Args)]
struct SetupArgs {
    /// Scans, as `voxtile local` reads them
    #[arg(value_name = "SCANS")]
    scans: PathBuf,
    /// Use about N points of each scan, evenly chosen [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    points: Option<u32>,
    /// Run the scans N times, and use the shortest time of each update
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    repeat: u32,
}

#[derive(Debug, Args)]
struct FlightArgs {
    /// Number of synthetic forests
    #[arg(value_name = "FORESTS", default_value_t = 10)]
    forests: u64,
    /// Picture to write, as SVG
    #[arg(value_name = "PICTURE", default_value = "flights.svg")]
    picture: PathBuf,
}

fn main() -> ExitCode {
    report::exit_code("voxel_mapping", run(&Arguments::parse().table).map(|()| true))
}

fn run(table: &Table) -> Result<()> {
    match table {
        Table::Setups(args) => setups::run(&args.scans, args.points, args.repeat),
        Table::Sensorless(args) => sensorless::run(args.forests, &args.picture),
        Table::HighSpeed(args) => high_speed::run(args.forests, &args.picture),
    }
}
