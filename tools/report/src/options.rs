use crate::{Page, WorkFolder};
use anyhow::{Result, anyhow};
use std::path::{Path, PathBuf};

/// Options of all benchmarks; `tools/bench.sh` sets the folders.
#[derive(Debug, clap::Args)]
pub struct Options {
    /// Only check that everything works: little data, one run; leaves docs/ unchanged
    #[arg(long)]
    pub short: bool,
    /// Only this part; an unknown name lists all parts
    #[arg(long, value_name = "NAME")]
    pub only: Option<String>,
    /// Runs of each measurement; figures are their medians
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub runs: Option<u32>,
    /// Folder for the results [default: docs/measurements; with --short, a folder of the benchmark below cargo's target
    /// folder]
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Folder of the recorded data sets; missing sets are skipped
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    pub data: PathBuf,
    /// Cargo's target folder, also used for temporary maps: its disk is measured
    #[arg(long, value_name = "FOLDER", default_value = "target")]
    pub target: PathBuf,
}

impl Options {
    /// Number of runs: one for a short benchmark, else that of the command line, else `default`.
    pub fn runs_or(&self, default: u32) -> u32 {
        if self.short { 1 } else { self.runs.unwrap_or(default) }
    }

    /// Creates a folder for the maps and streams of a benchmark.
    ///
    /// # Errors
    ///
    /// As for [`WorkFolder::create`].
    pub fn work(&self, benchmark: &str) -> Result<WorkFolder> {
        WorkFolder::create(self.target.join(benchmark).join("work"))
    }

    /// Opens the page `docs/measurements/BENCHMARK.md`, or its copy if the results are written to another folder.
    ///
    /// # Errors
    ///
    /// As for [`Page::open`].
    pub fn page(&self, benchmark: &str) -> Result<Page> {
        let name = format!("{benchmark}.md");
        let folder = self.out.clone().or_else(|| self.short.then(|| self.target.join(benchmark)));
        let copy = folder.map(|folder| folder.join(&name));
        Page::open(&Path::new("docs/measurements").join(name), copy.as_deref())
    }

    /// Returns the selected parts, in order.
    ///
    /// # Errors
    ///
    /// Fails if `--only` names an unknown part.
    pub fn wanted<T>(
        &self,
        parts: impl IntoIterator<Item = T>,
        name: impl Fn(&T) -> String,
    ) -> Result<Vec<T>> {
        let Some(only) = &self.only else { return Ok(parts.into_iter().collect()) };
        let (wanted, others): (Vec<T>, Vec<T>) = parts.into_iter().partition(|part| name(part) == *only);
        if wanted.is_empty() {
            let names: Vec<String> = others.iter().map(name).collect();
            return Err(anyhow!("--only {only}: unknown part; the parts are {}", names.join(", ")));
        }
        Ok(wanted)
    }

    /// The command that measures a part again.
    pub fn command(&self, benchmark: &str, part: Option<&str>) -> String {
        let mut command = format!("tools/bench.sh {benchmark}");
        if self.short {
            command += " --short";
        } else if let Some(runs) = self.runs {
            command += &format!(" --runs {runs}");
        }
        part.map_or(command.clone(), |part| format!("{command} --only {part}"))
    }
}

/// Folder of a recorded data set; prints a line and returns `None` if it is missing.
pub fn recorded_set(data: &Path, set: &str) -> Option<PathBuf> {
    let folder = data.join(set);
    let is_there = folder.join("scans").is_dir();
    if !is_there {
        eprintln!("{set}: skipped, not in {}", data.display());
    }
    is_there.then_some(folder)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Arguments {
        #[command(flatten)]
        options: Options,
    }

    fn options(line: &str) -> Options {
        Arguments::parse_from(line.split(' ')).options
    }

    #[test]
    fn one_part_or_all_and_an_unknown_name_lists_them() {
        let wanted = |line: &str| options(line).wanted(["a", "b"], |part| part.to_string());
        assert_eq!(wanted("it").unwrap(), ["a", "b"]);
        assert_eq!(wanted("it --only b").unwrap(), ["b"]);
        assert_eq!(
            wanted("it --only c").unwrap_err().to_string(),
            "--only c: unknown part; the parts are a, b"
        );
    }

    #[test]
    fn the_command_has_the_options_that_affect_the_figures() {
        let command = |line: &str| options(line).command("octocache", Some("stages"));
        assert_eq!(command("it --data x"), "tools/bench.sh octocache --only stages");
        assert_eq!(command("it --runs 3"), "tools/bench.sh octocache --runs 3 --only stages");
        assert_eq!(command("it --short --runs 3"), "tools/bench.sh octocache --short --only stages");
        assert_eq!((options("it --runs 2").runs_or(3), options("it --short").runs_or(3)), (2, 1));
    }
}
