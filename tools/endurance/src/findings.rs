use crate::build::{Build, Built};
use crate::promise::{self, Promise};
use crate::setting::mib;
use anyhow::Result;
use report::Answer;
use serde::Serialize;
use serde_json::{Value, json};

/// Result of a question.
#[derive(Default)]
pub struct Findings {
    /// Tables and plots for the page.
    pub answer: Answer,
    /// Promises of voxtile with measured values.
    pub promises: Vec<Promise>,
    /// All measurements, one per run.
    pub runs: Vec<Value>,
}

impl Findings {
    /// Records a run and its settings.
    ///
    /// # Errors
    ///
    /// Fails if they cannot be written as JSON.
    pub fn keep(&mut self, what: &impl Serialize, found: &impl Serialize) -> Result<()> {
        self.runs.push(json!({ "what": serde_json::to_value(what)?, "found": serde_json::to_value(found)? }));
        Ok(())
    }

    /// Records a build and prints a line about it.
    ///
    /// # Errors
    ///
    /// As for [`Findings::keep`].
    pub fn keep_build(&mut self, build: &Build, built: &Built) -> Result<()> {
        let Build { case, limit, disk, storage, .. } = build;
        let (wall_s, peak_mib) = (built.wall_s(), mib(built.peak_resident_bytes as f64));
        eprintln!("  {}, {limit:?}, {disk:?}, {storage}: {wall_s:.1} s, peak {peak_mib:.0} MiB", case.name);
        self.keep(build, built)
    }

    /// Describes the broken promises that do not depend on time.
    pub fn complaints(&self) -> Vec<String> {
        let broken = self.promises.iter().filter(|promise| !promise.is_about_time && !promise.is_kept());
        broken.map(Promise::complaint).collect()
    }

    /// Content of the page, promises first. A short run omits promises about time.
    pub fn into_answer(mut self, file: &'static str, is_short: bool) -> (Answer, Vec<Promise>) {
        self.promises.retain(|promise| !(is_short && promise.is_about_time));
        if !self.promises.is_empty() {
            self.answer.tables.insert(0, promise::table(file, "Promises.", &self.promises));
        }
        (self.answer, self.promises)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::promise::Wanted;

    #[test]
    fn only_broken_promises_that_do_not_depend_on_time_are_reported() {
        let broken = [1.0, 3.0].map(|found| Promise::new("bytes", found, Wanted::AtMost(2.0), ""));
        let slow = Promise::about_time("time", 3.0, Wanted::AtMost(2.0), "s");
        let findings = Findings { promises: [&broken[..], &[slow]].concat(), ..Findings::default() };
        assert_eq!(findings.complaints(), ["bytes: 3, wanted <= 2"]);
        let (answer, promises) = findings.into_answer("promises", true);
        assert_eq!((answer.tables.len(), promises.len()), (1, 2));
    }
}
