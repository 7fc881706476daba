//! The command `endurance`: how the out-of-core mapper behaves over distance, as tables and plots.

mod bucket;
mod build;
mod case;
mod export;
mod findings;
mod hard_scan;
mod idle;
mod metered_disk;
mod process_memory;
mod promise;
mod questions;
mod setting;
mod task;
mod working_set;

use anyhow::{Context, Result};
use clap::Parser;
use clap::builder::PossibleValuesParser;
use findings::Findings;
use questions::{QUESTIONS, Question};
use report::Page;
use serde_json::{Value, json};
use setting::Setting;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Measures how the out-of-core mapper behaves over distance and writes tables and plots.
///
/// Exits with 1 if a promise is broken that does not depend on time.
#[derive(Debug, Parser)]
#[command(name = "endurance", version)]
struct Arguments {
    /// Look only at what does not depend on time: small maps, one run
    #[arg(long)]
    short: bool,
    /// One question only
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(QUESTIONS.map(|question| question.name)))]
    only: Option<String>,
    /// Medians of so many runs where speeds are compared
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Folder of the recorded data sets; one that is absent is skipped
    #[arg(long, value_name = "FOLDER")]
    data: PathBuf,
    /// Folder for maps, which come and go: on the disk that is meant
    #[arg(long, value_name = "FOLDER")]
    work: PathBuf,
    /// Page into which the figures go
    #[arg(long, value_name = "FILE")]
    page: PathBuf,
    /// Where the page is written to, and beside it the folder of tables and plots [default: the page itself]
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// File for all that was measured, scan by scan, as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

fn main() -> ExitCode {
    let is_task = std::env::args().nth(1).as_deref() == Some(task::TASK_ARGUMENT);
    let outcome = if is_task { task::do_task().map(|()| true) } else { run(&Arguments::parse()) };
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("endurance: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Answers whether all was kept that does not depend on time.
fn run(arguments: &Arguments) -> Result<bool> {
    let page = Page::open(&arguments.page, arguments.output.as_deref())?;
    let setting = Setting {
        data: arguments.data.clone(),
        work: arguments.work.clone(),
        is_short: arguments.short,
        runs: if arguments.short { 1 } else { arguments.runs as usize },
    };
    let mut complaints = Vec::new();
    let mut measured: Vec<Value> = Vec::new();
    let is_wanted = |name| arguments.only.as_ref().is_none_or(|only| only == name);
    for question in QUESTIONS.iter().filter(|question| is_wanted(question.name)) {
        eprintln!("{}", question.name);
        let begin = Instant::now();
        let mut findings = (question.answer)(&setting).with_context(|| question.name.to_owned())?;
        complaints.extend(findings.complaints());
        let runs = std::mem::take(&mut findings.runs);
        let promises = put(&page, arguments, question, findings)?;
        eprintln!("{}: {:.0} s", question.name, begin.elapsed().as_secs_f64());
        measured.push(json!({ "question": question.name, "promises": promises, "runs": runs }));
        if let Some(path) = &arguments.json {
            write_json(path, &json!({ "machine": report::machine(), "questions": measured }))?;
        }
    }
    for complaint in &complaints {
        eprintln!("endurance: not kept: {complaint}");
    }
    Ok(complaints.is_empty())
}

/// Puts what was found into the page, and answers with the promises.
fn put(page: &Page, arguments: &Arguments, question: &Question, findings: Findings) -> Result<Value> {
    let (answer, promises) = findings.into_answer(question.promises, arguments.short);
    // After every question, so that a long run that is stopped leaves what it found.
    page.put(question.name, &answer, &command(arguments, question.name))?;
    Ok(serde_json::to_value(promises)?)
}

fn write_json(path: &PathBuf, value: &Value) -> Result<()> {
    fs::write(path, serde_json::to_vec(value)?).with_context(|| format!("{}: cannot write", path.display()))
}

/// What to type to measure a question again.
fn command(arguments: &Arguments, question: &str) -> String {
    let short = if arguments.short { " --short" } else { "" };
    let runs = if arguments.runs == 1 { String::new() } else { format!(" --runs {}", arguments.runs) };
    format!("tools/endurance/run.sh{short}{runs} --only {question}")
}
