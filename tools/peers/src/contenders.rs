use crate::workloads::{Files, MAX_RANGE_M, Workload};
use anyhow::{Context, Result, ensure};
use peers::{BuildOutcome, MemoryOutcome, OctomapOutcome, QuestionsOutcome};
use serde::de::{DeserializeOwned, IgnoredAny};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The programs to compare: each does one task and prints one line of JSON.
pub struct Contenders {
    /// OctoMap as its users compile it.
    pub octomap: PathBuf,
    /// OctoMap compiled for this machine.
    pub octomap_native: Option<PathBuf>,
    pub voxtile: PathBuf,
    /// Short tasks are repeated until this many seconds are measured.
    pub least_seconds: f64,
    /// Number of point queries of each kind.
    pub points: usize,
}

/// How rays update voxels.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Counting {
    /// Once per voxel and scan, cut at the max range.
    PerScan,
    /// Each ray at full length: OctoMap's `insertPointCloudRays` ignores the max range.
    PerRay,
    /// Once per voxel and scan, weighted by intensity; voxtile only.
    Iwlo,
}

/// How voxtile inserts the scans.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Insertion {
    /// One by one.
    OneByOne,
    /// All in one call.
    Together,
    /// One by one, with the octrees updated after every scan.
    Sync,
    /// All in one call, out of core, with a flush at the end.
    Flush,
}

/// Scans of a workload, and how they update voxels.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    pub workload: &'a Workload,
    pub files: &'a Files,
    /// Maximum number of scans.
    pub scans: usize,
    pub counting: Counting,
}

impl Contenders {
    /// Runs OctoMap once: insertions, and also queries and `writeBinary` if `with_all`.
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

    /// Writes OctoMap's finest voxels to a file.
    pub fn dump_octomap(&self, job: &Job<'_>, file: &Path) -> Result<()> {
        let mut command = octomap_command(&self.octomap, job);
        command.arg("--dump").arg(file);
        outcome::<OctomapOutcome>(command).map(drop)
    }

    /// Times a build of voxtile.
    pub fn build(&self, job: &Job<'_>, threads: u32, insertion: Insertion) -> Result<BuildOutcome> {
        let mut command = self.voxtile_command("build", job);
        command.env("RAYON_NUM_THREADS", threads.to_string());
        command.arg("--least-seconds").arg(self.least_seconds.to_string());
        match insertion {
            Insertion::OneByOne => {}
            Insertion::Together => drop(command.arg("--together")),
            Insertion::Sync => drop(command.arg("--sync")),
            Insertion::Flush => drop(command.arg("--together").arg("--folder").arg(&job.files.folder)),
        }
        outcome(command)
    }

    /// Measures the memory of a map of voxtile.
    pub fn memory(&self, job: &Job<'_>) -> Result<MemoryOutcome> {
        outcome(self.voxtile_command("memory", job))
    }

    /// Writes the points to query.
    pub fn write_points(&self, job: &Job<'_>) -> Result<()> {
        let mut command = self.voxtile_command("write-points", job);
        command.arg("--anywhere").arg(job.files.anywhere()).arg("--known").arg(job.files.known());
        command.arg("--count").arg(self.points.to_string());
        outcome::<IgnoredAny>(command).map(drop)
    }

    /// Times the queries of voxtile.
    pub fn questions(&self, job: &Job<'_>) -> Result<QuestionsOutcome> {
        let mut command = self.voxtile_command("questions", job);
        command.arg("--anywhere").arg(job.files.anywhere()).arg("--known").arg(job.files.known());
        command.arg("--least-seconds").arg(self.least_seconds.to_string());
        outcome(command)
    }

    /// Writes voxtile's voxels to a file.
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
    /// Maximum range of the rays, in metres.
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

/// Runs a contender and parses its line. Its standard error is shown if it fails.
fn outcome<T: DeserializeOwned>(mut command: Command) -> Result<T> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command
        .output()
        .with_context(|| format!("{program}: cannot start; build it with tools/bench.sh peers"))?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} ({}; {command:?})", errors.trim(), output.status);
    serde_json::from_slice(&output.stdout)
        .with_context(|| format!("{program}: unexpected output; {command:?}"))
}
