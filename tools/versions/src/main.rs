//! The benchmark `versions`: compares voxtile with an earlier version on the same scans. `tools/bench.sh` builds both.

mod cpu_time;
mod outcome;
mod pair;
mod programs;
mod questions;
mod scans;
mod setting;
mod versions;

use anyhow::Result;
use clap::Parser;
use programs::Programs;
use questions::QUESTIONS;
use report::{Bench, Options};
use setting::Setting;
use std::path::PathBuf;
use std::process::ExitCode;
use versions::Versions;

/// Compares voxtile with an earlier version of itself and writes tables.
#[derive(Debug, Parser)]
#[command(name = "versions", version)]
struct Arguments {
    #[command(flatten)]
    options: Options,
    /// Folder of the earlier version's programs
    #[arg(long, value_name = "FOLDER")]
    before: PathBuf,
    /// Folder of the current version's programs
    #[arg(long, value_name = "FOLDER")]
    now: PathBuf,
}

fn main() -> ExitCode {
    report::exit_code("versions", run(&Arguments::parse()).map(|()| true))
}

fn run(arguments: &Arguments) -> Result<()> {
    let options = &arguments.options;
    let wanted = options.wanted(&QUESTIONS, |question| question.name.to_owned())?;
    let bench = Bench::open("versions", options)?;
    let work = options.work("versions")?;
    let setting = Setting {
        versions: Versions {
            before: Programs::in_folder(&arguments.before)?,
            now: Programs::in_folder(&arguments.now)?,
            runs: options.runs_or(3) as usize,
        },
        data: options.data.clone(),
        work: work.path().to_owned(),
        is_short: options.short,
    };
    for question in wanted {
        let answer = bench.ask(question.name, || (question.answer)(&setting))?;
        bench.put(question.name, &answer)?;
        work.empty()?;
    }
    Ok(())
}
