//! The benchmark `endurance`: memory, speed and files of the out-of-core mapper over distance, as tables and plots.

mod bucket;
mod build;
mod case;
mod day;
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
use questions::QUESTIONS;
use report::{Bench, Options};
use serde_json::{Value, json};
use setting::Setting;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Measures memory, speed and files of the out-of-core mapper over distance, and writes tables and plots.
///
/// Exits with 1 if a promise that does not depend on time is broken.
#[derive(Debug, Parser)]
#[command(name = "endurance", version)]
struct Arguments {
    #[command(flatten)]
    options: Options,
    /// File for all measurements, scan by scan, as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

fn main() -> ExitCode {
    let is_task = std::env::args().nth(1).as_deref() == Some(task::TASK_ARGUMENT);
    let outcome = if is_task { task::do_task().map(|()| true) } else { run(&Arguments::parse()) };
    report::exit_code("endurance", outcome)
}

/// Returns whether all promises that do not depend on time hold.
fn run(Arguments { options, json }: &Arguments) -> Result<bool> {
    let wanted = options.wanted(&QUESTIONS, |question| question.name.to_owned())?;
    let bench = Bench::open("endurance", options)?;
    let work = options.work("endurance")?;
    let setting = Setting {
        data: options.data.clone(),
        work: work.path().to_owned(),
        is_short: options.short,
        runs: options.runs_or(1) as usize,
    };
    let mut complaints = Vec::new();
    let mut measured: Vec<Value> = Vec::new();
    for question in wanted {
        let mut findings = bench.ask(question.name, || (question.answer)(&setting))?;
        complaints.extend(findings.complaints());
        let runs = std::mem::take(&mut findings.runs);
        let (answer, promises) = findings.into_answer(question.promises, options.short);
        bench.put(question.name, &answer)?;
        measured.push(json!({ "question": question.name, "promises": promises, "runs": runs }));
        if let Some(path) = json {
            write_json(path, &json!({ "machine": report::machine(), "questions": measured }))?;
        }
    }
    for complaint in &complaints {
        eprintln!("endurance: broken promise: {complaint}");
    }
    Ok(complaints.is_empty())
}

fn write_json(path: &Path, value: &Value) -> Result<()> {
    fs::write(path, serde_json::to_vec(value)?).with_context(|| format!("{}: cannot write", path.display()))
}
