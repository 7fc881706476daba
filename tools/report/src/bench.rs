use crate::{Answer, Options, Page};
use anyhow::{Context, Result};
use std::process::ExitCode;
use std::time::Instant;

/// A run of a benchmark, whose answers are written into the sections of a page.
#[derive(Debug)]
pub struct Bench<'a> {
    name: &'static str,
    options: &'a Options,
    page: Page,
}

impl<'a> Bench<'a> {
    /// Opens the page of the benchmark.
    ///
    /// # Errors
    ///
    /// Fails if the page cannot be read or copied.
    pub fn open(name: &'static str, options: &'a Options) -> Result<Self> {
        Ok(Self { name, options, page: options.page(name)? })
    }

    /// Answers a question and prints the duration to standard error.
    ///
    /// # Errors
    ///
    /// Returns the error of the answer, with the question's name.
    pub fn ask<T>(&self, question: &str, answer: impl FnOnce() -> Result<T>) -> Result<T> {
        eprintln!("{question}");
        let begin = Instant::now();
        let answer = answer().with_context(|| question.to_owned())?;
        eprintln!("{question}: {:.0} s", begin.elapsed().as_secs_f64());
        Ok(answer)
    }

    /// Writes an answer into its section. Call it after each question, so that an interrupted run keeps its results.
    ///
    /// # Errors
    ///
    /// As for [`Page::put`].
    pub fn put(&self, question: &str, answer: &Answer) -> Result<()> {
        self.page.put(question, answer, &self.options.command(self.name, Some(question)))
    }
}

/// Exit code of a benchmark: 0, 1 if a check fails, 2 after an error, which is printed.
pub fn exit_code(name: &str, outcome: Result<bool>) -> ExitCode {
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{name}: {error:#}");
            ExitCode::from(2)
        }
    }
}
