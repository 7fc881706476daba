use anyhow::{Context, Result, ensure};
use report::Samples;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The programs of one version.
pub struct Programs {
    folder: PathBuf,
}

/// Two versions that are compared.
pub struct Versions {
    /// The earlier one.
    pub before: Programs,
    /// The present one.
    pub now: Programs,
    /// How often each measurement is taken, the two in turn.
    pub runs: usize,
}

/// What one measurement of both came to: medians.
#[derive(Clone, Copy)]
pub struct Pair {
    /// Of the earlier version.
    pub before: f64,
    /// Of the present one.
    pub now: f64,
}

impl Programs {
    /// The programs in a folder.
    ///
    /// # Errors
    ///
    /// A program that is missing.
    pub fn in_folder(folder: &Path) -> Result<Self> {
        for name in ["voxtile", "voxtile_contender", "questions"] {
            let program = folder.join(name);
            ensure!(program.is_file(), "{}: missing; tools/bench.sh versions builds it", program.display());
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// A program of this version with its arguments, on so many threads.
    pub fn command(&self, name: &str, threads: usize) -> Command {
        let mut command = Command::new(self.folder.join(name));
        command.env("RAYON_NUM_THREADS", threads.to_string());
        command
    }
}

impl Versions {
    /// Measures both in turn; medians of several figures. A measurement that names no figure counts as NaN.
    ///
    /// # Errors
    ///
    /// Those of a measurement.
    pub fn measure<const N: usize>(
        &self,
        measure: impl Fn(&Programs) -> Result<[f64; N]>,
    ) -> Result<[Pair; N]> {
        let mut samples: [[Samples; 2]; N] = std::array::from_fn(|_| Default::default());
        for _ in 0..self.runs {
            for (version, programs) in [&self.before, &self.now].into_iter().enumerate() {
                let figures = measure(programs)?;
                samples.iter_mut().zip(figures).for_each(|(samples, figure)| samples[version].push(figure));
            }
        }
        Ok(samples.map(|[before, now]| Pair { before: before.median(), now: now.median() }))
    }
}

impl Pair {
    /// How many times less the present version takes.
    pub fn ratio(&self) -> f64 {
        self.before / self.now
    }

    /// Both and their ratio, for reading.
    pub fn text(&self, digits: usize) -> String {
        format!("{:.digits$} -> {:.digits$} ({:.2}x)", self.before, self.now, self.ratio())
    }
}

/// Runs a program to its end and reads the JSON that it prints, a line each. What it says beside is shown if it fails.
///
/// # Errors
///
/// A program that cannot be started, that fails, or prints something else.
pub fn json_lines_of(command: &mut Command) -> Result<Vec<Value>> {
    let output = command.output().with_context(|| format!("{command:?}: cannot start it"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} ({}; {command:?})", said.trim(), output.status);
    let lines = String::from_utf8_lossy(&output.stdout);
    let values = lines.lines().map(serde_json::from_str).collect::<Result<_, _>>();
    values.with_context(|| format!("{command:?}: printed something else than JSON"))
}

/// The one line of JSON that a program prints; errors as for [`json_lines_of`].
///
/// # Errors
///
/// More lines than one, or none.
pub fn json_of(command: &mut Command) -> Result<Value> {
    let mut lines = json_lines_of(command)?;
    ensure!(lines.len() == 1, "{command:?}: {} lines instead of one", lines.len());
    Ok(lines.remove(0))
}

/// A number in JSON.
///
/// # Errors
///
/// There is none.
pub fn number(json: &Value, pointer: &str) -> Result<f64> {
    json.pointer(pointer).and_then(Value::as_f64).with_context(|| format!("{pointer}: no number in {json}"))
}

/// CPU seconds that running a command takes, the mean of so many times. Linux counts hundredths of a second.
///
/// # Errors
///
/// A program that cannot be started or fails; a system that does not tell.
pub fn cpu_seconds(times: usize, command: impl Fn() -> Command) -> Result<f64> {
    let before = cpu_of_children()?;
    for _ in 0..times {
        let mut command = command();
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let status = command.status().with_context(|| format!("{command:?}: cannot start it"))?;
        ensure!(status.success(), "{status}: {command:?}");
    }
    Ok((cpu_of_children()? - before) / times as f64)
}

/// CPU seconds of all processes that have ended and were waited for.
fn cpu_of_children() -> Result<f64> {
    const PATH: &str = "/proc/self/stat";
    /// Linux has told programs of hundredths for thirty years.
    const TICKS_PER_SECOND: f64 = 100.0;
    let text = fs::read_to_string(PATH).context("/proc/self/stat: cannot read; this needs Linux")?;
    // The name, in parentheses, may hold spaces; user and system time of children are the 14th and 15th fields after it.
    let fields: Vec<&str> =
        text.rsplit_once(')').map_or("", |(_, fields)| fields).split_whitespace().collect();
    let ticks = |field: usize| fields.get(field).and_then(|ticks| ticks.parse::<f64>().ok());
    let (user, system) = ticks(13).zip(ticks(14)).with_context(|| format!("{PATH}: unknown format"))?;
    Ok((user + system) / TICKS_PER_SECOND)
}
