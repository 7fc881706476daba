use crate::contenders::{Contenders, Counting, Insertion, Job};
use crate::table::{Pairs, Row, Target};
use crate::workloads::{Files, Workload};
use anyhow::{Context, Result};

/// Maximum share of voxels and of answers that may differ between the contenders: rays may graze the edge of a voxel.
const MAX_DIFFERENT: f64 = 1e-3;

#[derive(Default)]
struct Samples {
    one_thread: Pairs,
    native: Pairs,
    two_threads: Pairs,
    together: Pairs,
    synced: Pairs,
    flushed: Pairs,
    iwlo: Pairs,
    per_ray: Pairs,
    bytes: Pairs,
    synced_bytes: Pairs,
    resident: Pairs,
    synced_resident: Pairs,
    anywhere: Pairs,
    known: Pairs,
    voxels: Pairs,
    known_answers: Pairs,
}

/// Measures speed and memory of both contenders on a workload. Each run starts OctoMap, then voxtile's tasks.
pub fn rows(
    workload: &Workload,
    files: &Files,
    contenders: &Contenders,
    runs: u32,
    faults: &mut Vec<String>,
) -> Result<Vec<Row>> {
    let job = Job { workload, files, scans: workload.scans, counting: Counting::PerScan };
    contenders.write_points(&job)?;
    let mut samples = Samples::default();
    for run in 1..=runs {
        eprintln!("{}: run {run} of {runs}", workload.name);
        samples.add(contenders, &job)?;
    }
    for (what, pairs) in [("voxels", &samples.voxels), ("answers \"known\"", &samples.known_answers)] {
        let (octomap, voxtile) = (pairs.octomap(), pairs.voxtile());
        if (octomap - voxtile).abs() > MAX_DIFFERENT * octomap.max(voxtile) {
            faults.push(format!("{}: {octomap} {what} of OctoMap, {voxtile} of voxtile", workload.name));
        }
    }
    Ok(samples.rows(workload))
}

impl Samples {
    /// Adds one run of all tasks.
    fn add(&mut self, contenders: &Contenders, job: &Job<'_>) -> Result<()> {
        let octomap = contenders.octomap(&contenders.octomap, job, true)?;
        let one = contenders.build(job, 1, Insertion::OneByOne)?;
        let two = contenders.build(job, 2, Insertion::OneByOne)?;
        let together = contenders.build(job, 2, Insertion::Together)?;
        let synced = contenders.build(job, 2, Insertion::Sync)?;
        let flushed = contenders.build(job, 2, Insertion::Flush)?;
        let memory = contenders.memory(job)?;
        let questions = contenders.questions(job)?;
        let answers = octomap.questions.context("OctoMap's contender ran no queries")?;
        let write_s = octomap.write_s.context("OctoMap's contender wrote no file")?;

        let scans = octomap.scans as f64;
        let a_scan = |seconds: f64| seconds / scans;
        self.one_thread.push(a_scan(octomap.cpu_s), a_scan(one.cpu_s));
        self.two_threads.push(a_scan(octomap.wall_s), a_scan(two.wall_s));
        self.together.push(a_scan(octomap.wall_s), a_scan(together.wall_s));
        self.synced.push(a_scan(octomap.wall_s), a_scan(synced.wall_s));
        self.flushed.push(a_scan(octomap.wall_s + write_s), a_scan(flushed.wall_s));
        if job.files.intensities.is_some() {
            let iwlo = contenders.build(&Job { counting: Counting::Iwlo, ..*job }, 1, Insertion::OneByOne)?;
            self.iwlo.push(a_scan(octomap.cpu_s), a_scan(iwlo.cpu_s));
        }
        if let Some(program) = &contenders.octomap_native {
            let native = contenders.octomap(program, job, false)?;
            self.native.push(a_scan(native.cpu_s), a_scan(one.cpu_s));
        }
        let rays = Job { scans: job.workload.ray_scans, counting: Counting::PerRay, ..*job };
        let octomap_rays = contenders.octomap(&contenders.octomap, &rays, false)?;
        let voxtile_rays = contenders.build(&rays, 1, Insertion::OneByOne)?;
        let ray_scans = octomap_rays.scans as f64;
        self.per_ray.push(octomap_rays.cpu_s / ray_scans, voxtile_rays.cpu_s / ray_scans);

        let theirs = |bytes: u64| bytes as f64 / octomap.voxels as f64;
        let ours = |bytes: u64| bytes as f64 / memory.voxels as f64;
        self.bytes.push(theirs(octomap.bytes), ours(memory.bytes));
        self.synced_bytes.push(theirs(octomap.bytes), ours(memory.synced_bytes));
        self.resident.push(theirs(octomap.resident_bytes), ours(memory.resident_bytes));
        self.synced_resident.push(theirs(octomap.resident_bytes), ours(memory.synced_resident_bytes));
        self.voxels.push(octomap.voxels as f64, memory.voxels as f64);
        self.anywhere.push(answers.anywhere.ns, questions.anywhere.ns);
        self.known.push(answers.known.ns, questions.known.ns);
        self.known_answers.push(
            (answers.anywhere.known + answers.known.known) as f64,
            (questions.anywhere.known + questions.known.known) as f64,
        );
        Ok(())
    }

    fn rows(&self, workload: &Workload) -> Vec<Row> {
        let targets = &workload.targets;
        let times = [
            ("insert, CPU of 1 thread", &self.one_thread, targets.one_thread),
            ("the same, OctoMap -O3 -march=native", &self.native, None),
            ("insert, wall, 2 threads", &self.two_threads, targets.two_threads),
            ("insert, several scans concurrently, wall, 2 threads", &self.together, None),
            ("insert, octrees up to date after every scan, wall, 2 threads", &self.synced, targets.synced),
            ("scans to flushed files, wall, 2 threads", &self.flushed, targets.flushed),
            ("insert every ray, CPU of 1 thread", &self.per_ray, targets.per_ray),
        ];
        let bytes = [
            ("memory, as counted", &self.bytes, targets.bytes),
            ("memory, as counted, octrees up to date", &self.synced_bytes, targets.bytes),
            ("memory, growth of the process", &self.resident, None),
            ("memory, growth of the process, octrees up to date", &self.synced_resident, None),
        ];
        let questions = [
            ("point query, anywhere, CPU", &self.anywhere, targets.question),
            ("point query, known voxels, CPU", &self.known, None),
        ];
        let mut rows: Vec<Row> =
            times.map(|(what, pairs, target)| row(what, workload, pairs, target, milliseconds)).into();
        if !self.iwlo.is_empty() {
            let mut iwlo =
                row("insert, voxtile with IWLO, CPU of 1 thread", workload, &self.iwlo, None, milliseconds);
            let factor = self.iwlo.voxtile() / self.one_thread.voxtile();
            iwlo.voxtile.push_str(&format!(" ({factor:.2} of its log-odds)"));
            rows.push(iwlo);
        }
        rows.extend(bytes.map(|(what, pairs, target)| row(what, workload, pairs, target, bytes_a_voxel)));
        rows.extend(questions.map(|(what, pairs, target)| row(what, workload, pairs, target, nanoseconds)));
        if self.native.is_empty() {
            rows.retain(|row| !row.what.contains("native"));
        }
        rows
    }
}

fn row(
    what: &str,
    workload: &Workload,
    pairs: &Pairs,
    target: Option<Target>,
    text: fn(f64) -> String,
) -> Row {
    let ratio = pairs.ratio();
    let compared = |target| match target {
        Target::AtLeast(..) => ratio.of_medians,
        Target::AtMost(..) => pairs.voxtile(),
    };
    Row {
        what: what.to_owned(),
        workload: workload.name.clone(),
        octomap: text(pairs.octomap()),
        voxtile: text(pairs.voxtile()),
        ratio: Some(ratio),
        target: target.map(|target| (target, compared(target))),
    }
}

/// Formats seconds per scan as milliseconds.
fn milliseconds(seconds: f64) -> String {
    format!("{:.1} ms a scan", 1e3 * seconds)
}

fn bytes_a_voxel(bytes: f64) -> String {
    format!("{bytes:.1} B a voxel")
}

fn nanoseconds(ns: f64) -> String {
    format!("{ns:.0} ns")
}
