use crate::table::Target::{self, AtLeast, AtMost};
use anyhow::{Context, Result, ensure};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::Command;
use workload::{ScanWriter, SurveyName};

/// Scans, and the resolution of their map.
pub struct Workload {
    /// Name in the table.
    pub name: String,
    source: Source,
    /// Number of scans in the stream.
    pub scans: usize,
    /// Number of scans in measurements where every ray counts.
    pub ray_scans: usize,
    /// Number of scans for the naive map.
    pub exact_scans: usize,
    pub resolution_m: f64,
    pub targets: Targets,
}

enum Source {
    Synthetic(SurveyName),
    /// A folder of scans and poses.
    Real(PathBuf),
}

/// Targets of a workload; ratios are OctoMap's time divided by voxtile's.
#[derive(Clone, Copy, Default)]
pub struct Targets {
    /// Insertion, CPU time of one thread.
    pub one_thread: Option<Target>,
    /// Insertion, wall time of two threads.
    pub two_threads: Option<Target>,
    /// Insertion, wall time of two threads, with the octrees updated after every scan.
    pub synced: Option<Target>,
    /// Scans to a flushed map on disk.
    pub flushed: Option<Target>,
    /// Bytes of memory per voxel.
    pub bytes: Option<Target>,
    /// Nanoseconds per query.
    pub question: Option<Target>,
    /// Insertion if every ray counts, CPU time of one thread.
    pub per_ray: Option<Target>,
}

pub struct Files {
    /// Folder of the files, which may hold others.
    pub folder: PathBuf,
    pub stream: PathBuf,
    /// File of the intensities, if any.
    pub intensities: Option<PathBuf>,
}

/// Maximum range in all workloads, in metres.
pub const MAX_RANGE_M: f64 = 60.0;
const SEED: u64 = 1;

/// The four workloads with targets.
pub fn synthetic() -> Vec<Workload> {
    use SurveyName::{Indoor, Street};
    vec![
        workload(Street, 0.2, 20, [21.0, 42.0, 36.0, 75.0, 25.0, 15.0, 50.0]),
        workload(Street, 0.1, 5, [27.0, 54.0, 46.0, 95.0, 30.0, 15.0, 90.0]),
        workload(Indoor, 0.1, 20, [16.0, 32.0, 27.0, 55.0, 20.0, 10.0, 45.0]),
        workload(Indoor, 0.05, 10, [19.0, 38.0, 32.0, 65.0, 22.0, 10.0, 65.0]),
    ]
}

/// Two of the workloads of [`synthetic`], with few scans.
pub fn short() -> Vec<Workload> {
    let mut workloads = synthetic();
    workloads.retain(|workload| [0.2, 0.1].contains(&workload.resolution_m));
    workloads.retain(|workload| workload.scans == 20);
    for workload in &mut workloads {
        (workload.scans, workload.ray_scans, workload.exact_scans) = (3, 1, 1);
    }
    workloads
}

/// `numbers`: floor and goal for one thread and for two threads, floors for synced and flushed, maximum nanoseconds per
/// query.
fn workload(survey: SurveyName, resolution_m: f64, scans: usize, numbers: [f64; 7]) -> Workload {
    let [one, one_goal, two, two_goal, synced, flushed, question_ns] = numbers;
    let name = survey.name();
    Workload {
        name: format!("{name} {resolution_m} m"),
        source: Source::Synthetic(survey),
        scans,
        ray_scans: 2,
        exact_scans: 2,
        resolution_m,
        targets: Targets {
            one_thread: Some(AtLeast(one, Some(one_goal))),
            two_threads: Some(AtLeast(two, Some(two_goal))),
            synced: Some(AtLeast(synced, None)),
            flushed: Some(AtLeast(flushed, None)),
            bytes: Some(AtMost(16.0, Some(8.0))),
            question: Some(AtMost(question_ns, None)),
            per_ray: Some(AtLeast(15.0, None)),
        },
    }
}

/// The recorded data sets that are present.
pub fn real(data: &Path) -> Vec<Workload> {
    let sets = [("mulran_riverside02_a", 0.2, 60), ("fastlio_hku_1", 0.2, 200), ("balm_os0_hall", 0.1, 20)];
    let mut workloads = Vec::new();
    for (set, resolution_m, scans) in sets {
        let Some(folder) = report::recorded_set(data, set) else { continue };
        workloads.push(Workload {
            name: format!("`{set}` {resolution_m} m"),
            source: Source::Real(folder),
            scans,
            ray_scans: 2,
            exact_scans: 2,
            resolution_m,
            targets: Targets::default(),
        });
    }
    workloads
}

impl Workload {
    /// Name for `--only`, such as `street-0.2`.
    pub fn part(&self) -> String {
        self.name.trim_end_matches(" m").replace('`', "").replace(' ', "-")
    }

    /// Writes the scans into a folder.
    pub fn write(&self, folder: &Path) -> Result<Files> {
        eprintln!("{}: writing {} scans", self.name, self.scans);
        let stream = folder.join("scans");
        let intensities = match &self.source {
            Source::Synthetic(survey) => {
                let intensities = folder.join("intensities");
                write_synthetic(*survey, self.scans, &stream, &intensities).with_context(|| {
                    format!("{}: cannot write the scans; check the free disk space", folder.display())
                })?;
                Some(intensities)
            }
            Source::Real(data) => {
                write_real(data, self.scans, &stream)?;
                None
            }
        };
        Ok(Files { folder: folder.to_owned(), stream, intensities })
    }
}

fn write_synthetic(
    survey: SurveyName,
    scans: usize,
    stream: &Path,
    intensities: &Path,
) -> std::io::Result<()> {
    let created = |path| File::create(path).map(BufWriter::new);
    let mut writer = ScanWriter::new(created(stream)?, Some(created(intensities)?));
    survey.scans(SEED, 0, SurveyName::RAYS).take(scans).try_for_each(|scan| writer.write(&scan))?;
    writer.flush()
}

/// Writes the points of a recorded data set, rounded to `f32` for OctoMap.
fn write_real(data: &Path, scans: usize, stream: &Path) -> Result<()> {
    let out = File::create(stream).with_context(|| format!("{}: cannot create", stream.display()))?;
    let status = Command::new("python3")
        .arg("tools/octomap_compat/points.py")
        .arg(data)
        .arg(scans.to_string())
        .stdout(out)
        .status()
        .context("cannot start python3, which --real needs; install it")?;
    ensure!(status.success(), "{}: points.py cannot read it, see above", data.display());
    Ok(())
}
