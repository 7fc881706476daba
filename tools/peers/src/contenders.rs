use crate::workloads::{Files, MAX_RANGE_M, Workload};
use anyhow::{Context, Result, ensure};
use peers::{BuildOutcome, MemoryOutcome, OctomapOutcome, QuestionsOutcome};
use serde::de::{DeserializeOwned, IgnoredAny};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The programs that are compared: each does one thing and prints one line of JSON.
pub struct Contenders {
    /// OctoMap as its users compile it.
    pub octomap: PathBuf,
    /// OctoMap compiled for this machine.
    pub octomap_native: Option<PathBuf>,
    /// voxtile.
    pub voxtile: PathBuf,
    /// Short work is repeated until so many seconds were timed.
    pub least_seconds: f64,
    /// Queries of a kind.
    pub points: usize,
}

/// How the rays of a scan count.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Counting {
    /// Once a voxel a scan, cut at the max range.
    PerScan,
    /// Every one, uncut: OctoMap's `insertPointCloudRays` ignores the max range.
    PerRay,
    /// Once a voxel a scan, weighted by intensity; voxtile's alone.
    Iwlo,
}

/// How a build of voxtile takes the scans.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// One by one.
    OneByOne,
    /// Handed in together.
    Together,
    /// Octrees up to date after every scan.
    Sync,
    /// Handed in together, out of core, and a flush in the end.
    Flush,
}

/// Scans of a workload and how they count.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    pub workload: &'a Workload,
    pub files: &'a Files,
    /// Take no more than so many scans.
    pub scans: usize,
    pub counting: Counting,
}

impl Contenders {
    /// One run of OctoMap: insertions, and the questions and `writeBinary` if `with_all`.
    pub fn octomap(&self, program: &Path, job: &Job<'_>, with_all: bool) -> Result<OctomapOutcome> {
        let mut command = octomap_command(program, job);
        if with_all {
            let files = job.files;
            command.arg("--anywhere").arg(files.anywhere()).arg("--known").arg(files.known());
            command.arg("--least-seconds").arg(self.least_seconds.to_string());
            command.arg("--bt").arg(files.folder.join("map.bt"));
        }
        outcome(command)
    }

    /// Has OctoMap write its finest voxels.
    pub fn dump_octomap(&self, job: &Job<'_>, file: &Path) -> Result<()> {
        let mut command = octomap_command(&self.octomap, job);
        command.arg("--dump").arg(file);
        outcome::<OctomapOutcome>(command).map(drop)
    }

    /// Times a build of voxtile.
    pub fn build(&self, job: &Job<'_>, threads: u32, way: Way) -> Result<BuildOutcome> {
        let mut command = self.voxtile_command("build", job);
        command.env("RAYON_NUM_THREADS", threads.to_string());
        command.arg("--least-seconds").arg(self.least_seconds.to_string());
        match way {
            Way::OneByOne => {}
            Way::Together => drop(command.arg("--together")),
            Way::Sync => drop(command.arg("--sync")),
            Way::Flush => drop(command.arg("--together").arg("--folder").arg(&job.files.folder)),
        }
        outcome(command)
    }

    /// Weighs a map of voxtile.
    pub fn memory(&self, job: &Job<'_>) -> Result<MemoryOutcome> {
        outcome(self.voxtile_command("memory", job))
    }

    /// Writes the points of the questions.
    pub fn write_points(&self, job: &Job<'_>) -> Result<()> {
        let mut command = self.voxtile_command("write-points", job);
        command.arg("--anywhere").arg(job.files.anywhere()).arg("--known").arg(job.files.known());
        command.arg("--count").arg(self.points.to_string());
        outcome::<IgnoredAny>(command).map(drop)
    }

    /// Times the questions to voxtile.
    pub fn questions(&self, job: &Job<'_>) -> Result<QuestionsOutcome> {
        let mut command = self.voxtile_command("questions", job);
        command.arg("--anywhere").arg(job.files.anywhere()).arg("--known").arg(job.files.known());
        command.arg("--least-seconds").arg(self.least_seconds.to_string());
        outcome(command)
    }

    /// Has voxtile write its voxels.
    pub fn dump_voxtile(&self, job: &Job<'_>, file: &Path) -> Result<()> {
        let mut command = self.voxtile_command("dump", job);
        command.arg("--output").arg(file);
        outcome::<IgnoredAny>(command).map(drop)
    }

    fn voxtile_command(&self, task: &str, job: &Job<'_>) -> Command {
        let mut command = Command::new(&self.voxtile);
        command.arg(task).arg(&job.files.stream).arg("--scans").arg(job.scans.to_string());
        command.arg("--resolution").arg(job.workload.resolution_m.to_string());
        match job.max_range_m() {
            Some(max_range_m) => drop(command.arg("--max-range").arg(max_range_m.to_string())),
            None => drop(command.arg("--per-ray")),
        }
        if let (Counting::Iwlo, Some(intensities)) = (job.counting, &job.files.intensities) {
            command.arg("--intensities").arg(intensities);
        }
        command
    }
}

impl Job<'_> {
    /// Where rays are cut.
    pub fn max_range_m(&self) -> Option<f64> {
        (self.counting != Counting::PerRay).then_some(MAX_RANGE_M)
    }
}

impl Files {
    fn anywhere(&self) -> PathBuf {
        self.folder.join("points_anywhere")
    }

    fn known(&self) -> PathBuf {
        self.folder.join("points_known")
    }
}

fn octomap_command(program: &Path, job: &Job<'_>) -> Command {
    let mut command = Command::new(program);
    command.arg(&job.files.stream).arg(job.workload.resolution_m.to_string());
    command.arg("--scans").arg(job.scans.to_string());
    match job.max_range_m() {
        Some(max_range_m) => drop(command.arg("--max-range").arg(max_range_m.to_string())),
        None => drop(command.arg("--rays")),
    }
    command
}

/// Runs a contender to its end and reads its line. What it says beside is shown if it fails.
fn outcome<T: DeserializeOwned>(mut command: Command) -> Result<T> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command
        .output()
        .with_context(|| format!("{program}: cannot start it; tools/bench.sh peers builds it"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} ({}; {command:?})", said.trim(), output.status);
    serde_json::from_slice(&output.stdout)
        .with_context(|| format!("{program}: printed another line than it should; {command:?}"))
}
