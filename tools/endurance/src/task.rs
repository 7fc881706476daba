use crate::build::{Build, Built};
use crate::day::{Day, DayFound};
use crate::export::{Export, Exported};
use crate::idle::{Idle, Idled};
use crate::working_set::{WorkingSet, WorkingSetFound};
use anyhow::{Context, Result, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{self, Write};
use std::process::{Command, Stdio};

/// A task that runs in its own process, so that the peak of memory includes nothing else.
#[derive(Debug, Serialize, Deserialize)]
pub enum Task {
    /// Build a map.
    Build(Build),
    /// Measure the size of the working set.
    WorkingSet(WorkingSet),
    /// Export a map.
    Export(Export),
    /// Stay idle.
    Idle(Idle),
    /// Map the same place all day.
    Day(Day),
}

/// Argument that makes the program do a task from standard input.
pub const TASK_ARGUMENT: &str = "--task";

/// A task that can run in a child process.
pub trait ChildTask: Sized {
    /// Result of the task.
    type Found: DeserializeOwned;

    /// Converts it into a [`Task`].
    fn into_task(self) -> Task;

    /// Runs the task in a new process and waits for it.
    ///
    /// # Errors
    ///
    /// Fails if the process cannot be started or fails.
    fn run_in_child(self) -> Result<Self::Found> {
        run_in_child(&self.into_task())
    }
}

impl ChildTask for Build {
    type Found = Built;

    fn into_task(self) -> Task {
        Task::Build(self)
    }
}

impl ChildTask for WorkingSet {
    type Found = WorkingSetFound;

    fn into_task(self) -> Task {
        Task::WorkingSet(self)
    }
}

impl ChildTask for Export {
    type Found = Exported;

    fn into_task(self) -> Task {
        Task::Export(self)
    }
}

impl ChildTask for Idle {
    type Found = Idled;

    fn into_task(self) -> Task {
        Task::Idle(self)
    }
}

impl ChildTask for Day {
    type Found = DayFound;

    fn into_task(self) -> Task {
        Task::Day(self)
    }
}

/// Reads a task from standard input, runs it and writes its result to standard output.
///
/// # Errors
///
/// Fails if the input is not a task or the task fails.
pub fn do_task() -> Result<()> {
    let task = serde_json::from_reader(io::stdin().lock()).context("standard input has no valid task")?;
    let outcome = match task {
        Task::Build(build) => serde_json::to_value(build.run()?),
        Task::WorkingSet(working_set) => serde_json::to_value(working_set.run()?),
        Task::Export(export) => serde_json::to_value(export.run()?),
        Task::Idle(idle) => serde_json::to_value(idle.run()?),
        Task::Day(day) => serde_json::to_value(day.run()?),
    };
    serde_json::to_writer(io::stdout().lock(), &outcome?)?;
    Ok(())
}

/// Runs a task in a new process. One malloc arena serves all threads, as in the command `voxtile`.
fn run_in_child<T: DeserializeOwned>(task: &Task) -> Result<T> {
    let program = std::env::current_exe().context("cannot find this program")?;
    let mut command = match task {
        Task::Build(build) if build.is_on_one_core => {
            let mut command = Command::new("taskset");
            command.args(["--cpu-list", "0"]).arg(program);
            command
        }
        _ => Command::new(program),
    };
    command.arg(TASK_ARGUMENT).env("MALLOC_ARENA_MAX", "1");
    let cannot = || format!("cannot start {}", command.get_program().display());
    let cannot = cannot();
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().context(cannot)?;
    if let Some(mut stdin) = child.stdin.take() {
        // A child that has already ended prints the reason itself.
        let _ = stdin.write_all(&serde_json::to_vec(task)?);
    }
    let output = child.wait_with_output().context("cannot wait for a process")?;
    ensure!(output.status.success(), "the process failed ({}); its output is above", output.status);
    serde_json::from_slice(&output.stdout).context("the process returned an unreadable result")
}
