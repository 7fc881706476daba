//! The command `octocache`: puts the questions of the OctoCache paper to voxtile and writes tables and plots.

mod contender;
mod dataset;
mod questions;
mod setting;
mod update_stream;

use anyhow::{Context, Result};
use clap::Parser;
use clap::builder::PossibleValuesParser;
use questions::QUESTIONS;
use report::Page;
use setting::Setting;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Puts the questions of the OctoCache paper to voxtile and writes tables and plots.
#[derive(Debug, Parser)]
#[command(name = "octocache", version)]
struct Arguments {
    /// Look only whether everything works: few scans, one run
    #[arg(long)]
    short: bool,
    /// One question only
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(QUESTIONS.map(|question| question.name)))]
    only: Option<String>,
    /// Medians of so many runs
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Folder of the recorded data sets; one that is absent is skipped
    #[arg(long, value_name = "FOLDER")]
    data: PathBuf,
    /// Page into which the figures go
    #[arg(long, value_name = "FILE")]
    page: PathBuf,
    /// Where the page is written to, and beside it the folder of tables and plots [default: the page itself]
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("octocache: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let page = Page::open(&arguments.page, arguments.output.as_deref())?;
    let setting = Setting {
        datasets: dataset::datasets(&arguments.data),
        is_short: arguments.short,
        runs: if arguments.short { 1 } else { arguments.runs as usize },
    };
    // What other threads there are belongs to the engine: rays and tiles are worked on by this one.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build()?;
    let is_wanted = |name| arguments.only.as_ref().is_none_or(|only| only == name);
    for question in QUESTIONS.iter().filter(|question| is_wanted(question.name)) {
        eprint!("{}: ", question.name);
        let begin = Instant::now();
        let answer = pool.install(|| (question.answer)(&setting));
        let answer = answer.with_context(|| question.name.to_owned())?;
        // After every question, so that a long run that is stopped leaves what it found.
        page.put(question.name, &answer, &command(arguments, question.name))?;
        eprintln!("{:.0} s", begin.elapsed().as_secs_f64());
    }
    Ok(())
}

/// What to type to measure a question again.
fn command(arguments: &Arguments, question: &str) -> String {
    let short = if arguments.short { " --short" } else { "" };
    let runs = if arguments.short { String::new() } else { format!(" --runs {}", arguments.runs) };
    format!("tools/octocache/run.sh{short}{runs} --only {question}")
}
