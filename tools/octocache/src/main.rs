//! The command `octocache`: puts the questions of the OctoCache paper to voxtile and writes tables and plots.

mod answer;
mod contender;
mod dataset;
mod machine;
mod page;
mod plot;
mod questions;
mod samples;
mod stopwatch;
mod table;
mod update_stream;

use answer::Setting;
use anyhow::{Context, Result, anyhow};
use clap::Parser;
use clap::builder::PossibleValuesParser;
use questions::QUESTIONS;
use std::fs;
use std::path::{Path, PathBuf};
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
    let output = arguments.output.as_ref().unwrap_or(&arguments.page);
    let folder = output.with_extension("");
    fs::create_dir_all(&folder).with_context(|| format!("{}: cannot make the folder", folder.display()))?;
    if *output != arguments.page {
        fs::write(output, read(&arguments.page)?).with_context(|| cannot_write(output))?;
    }
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
        answer.write(&folder)?;
        let section =
            answer.markdown(name_of(&folder)?, &command(arguments, question.name), &machine::description());
        // After every question, so that a long run that is stopped leaves what it found, and read anew, so that who edits
        // the page meanwhile loses nothing.
        let page = page::with_section(&read(output)?, question.name, &section);
        let page = page.with_context(|| output.display().to_string())?;
        fs::write(output, page).with_context(|| cannot_write(output))?;
        eprintln!("{:.0} s", begin.elapsed().as_secs_f64());
    }
    Ok(())
}

fn read(page: &Path) -> Result<String> {
    fs::read_to_string(page).with_context(|| format!("{}: cannot read the page", page.display()))
}

fn cannot_write(page: &Path) -> String {
    format!("{}: cannot write the page", page.display())
}

/// What to type to measure a question again.
fn command(arguments: &Arguments, question: &str) -> String {
    let short = if arguments.short { " --short" } else { "" };
    let runs = if arguments.short { String::new() } else { format!(" --runs {}", arguments.runs) };
    format!("tools/octocache/run.sh{short}{runs} --only {question}")
}

fn name_of(folder: &Path) -> Result<&str> {
    let name = folder.file_name().and_then(|name| name.to_str());
    name.ok_or_else(|| anyhow!("{}: a folder with a readable name is needed", folder.display()))
}
