//! The benchmark `octocache`: repeats the measurements of the OctoCache paper with voxtile, as tables and plots.

mod contender;
mod dataset;
mod questions;
mod setting;
mod update_stream;

use anyhow::Result;
use clap::Parser;
use questions::QUESTIONS;
use report::{Bench, Options};
use setting::Setting;
use std::process::ExitCode;

/// Repeats the measurements of the OctoCache paper with voxtile, and writes tables and plots.
#[derive(Debug, Parser)]
#[command(name = "octocache", version)]
struct Arguments {
    #[command(flatten)]
    options: Options,
}

fn main() -> ExitCode {
    report::exit_code("octocache", run(&Arguments::parse().options).map(|()| true))
}

fn run(options: &Options) -> Result<()> {
    let wanted = options.wanted(&QUESTIONS, |question| question.name.to_owned())?;
    let bench = Bench::open("octocache", options)?;
    let setting = Setting {
        datasets: dataset::datasets(&options.data),
        is_short: options.short,
        runs: options.runs_or(3) as usize,
    };
    // Rays and tiles are processed by this thread; other threads belong to the octree engine.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build()?;
    for question in wanted {
        let answer = bench.ask(question.name, || pool.install(|| (question.answer)(&setting)))?;
        bench.put(question.name, &answer)?;
    }
    Ok(())
}
