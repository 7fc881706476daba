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

/// What a process is begun for: its peak of memory is that of nothing else.
#[derive(Debug, Serialize, Deserialize)]
pub enum Task {
    /// Build a map.
    Build(Build),
    /// Find out how large the working set is.
    WorkingSet(WorkingSet),
    /// Export a map.
    Export(Export),
    /// Do nothing.
    Idle(Idle),
    /// Map the same place all day.
    Day(Day),
}

/// What tells the program to do a task that comes from standard input.
pub const TASK_ARGUMENT: &str = "--task";

/// What a process of its own can be begun for.
pub trait Apart: Sized {
    /// What comes of it.
    type Found: DeserializeOwned;

    /// The task of the process.
    fn into_task(self) -> Task;

    /// Has a new process do it, and waits.
    ///
    /// # Errors
    ///
    /// A process that cannot be begun or fails.
    fn apart(self) -> Result<Self::Found> {
        apart(&self.into_task())
    }
}

impl Apart for Build {
    type Found = Built;

    fn into_task(self) -> Task {
        Task::Build(self)
    }
}

impl Apart for WorkingSet {
    type Found = WorkingSetFound;

    fn into_task(self) -> Task {
        Task::WorkingSet(self)
    }
}

impl Apart for Export {
    type Found = Exported;

    fn into_task(self) -> Task {
        Task::Export(self)
    }
}

impl Apart for Idle {
    type Found = Idled;

    fn into_task(self) -> Task {
        Task::Idle(self)
    }
}

impl Apart for Day {
    type Found = DayFound;

    fn into_task(self) -> Task {
        Task::Day(self)
    }
}

/// Does the task that comes from standard input, and says to standard output what came of it.
///
/// # Errors
///
/// A task that is none, and what the task itself meets.
pub fn do_task() -> Result<()> {
    let task = serde_json::from_reader(io::stdin().lock()).context("standard input has no task")?;
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

/// Has a new process do a task. It has one heap for all threads, as the command `voxtile` has.
fn apart<T: DeserializeOwned>(task: &Task) -> Result<T> {
    let program = std::env::current_exe().context("cannot find the own program")?;
    let mut command = Command::new(program);
    command.arg(TASK_ARGUMENT).env("MALLOC_ARENA_MAX", "1");
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().context("cannot begin a process")?;
    if let Some(mut stdin) = child.stdin.take() {
        // A child that is gone already says why itself.
        let _ = stdin.write_all(&serde_json::to_vec(task)?);
    }
    let output = child.wait_with_output().context("cannot wait for a process")?;
    ensure!(output.status.success(), "the process failed ({}); what it said is above", output.status);
    serde_json::from_slice(&output.stdout).context("the process gave no answer that can be read")
}
