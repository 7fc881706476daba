use crate::build::{Build, Built};
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
enum Task {
    Build(Build),
    WorkingSet(WorkingSet),
    Export(Export),
    Idle(Idle),
}

/// What tells the program to do a task that comes from standard input.
pub const TASK_ARGUMENT: &str = "--task";

impl Build {
    /// Builds, in a process of its own.
    ///
    /// # Errors
    ///
    /// A process that cannot be begun or fails.
    pub fn apart(self) -> Result<Built> {
        apart(&Task::Build(self))
    }
}

impl WorkingSet {
    /// Finds it, in a process of its own.
    ///
    /// # Errors
    ///
    /// As for [`Build::apart`].
    pub fn apart(self) -> Result<WorkingSetFound> {
        apart(&Task::WorkingSet(self))
    }
}

impl Export {
    /// Exports, in a process of its own.
    ///
    /// # Errors
    ///
    /// As for [`Build::apart`].
    pub fn apart(self) -> Result<Exported> {
        apart(&Task::Export(self))
    }
}

impl Idle {
    /// Does nothing, in a process of its own.
    ///
    /// # Errors
    ///
    /// As for [`Build::apart`].
    pub fn apart(self) -> Result<Idled> {
        apart(&Task::Idle(self))
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
