//! How much of its speed does the mapper keep with memory for a quarter and a tenth of its working set?

use crate::build::{Build, Built};
use crate::case::{Case, Limit};
use crate::findings::Findings;
use crate::metered_disk::DiskSpeed;
use crate::promise::{Promise, Wanted};
use crate::setting::{RAYS, Setting, mib, synthetic};
use crate::task::ChildTask;
use crate::working_set::{WorkingSet, WorkingSetFound};
use anyhow::Result;
use report::plot::{Bars, Content, Panel, Plot};
use report::{Cell, Samples, Table};
use workload::SurveyName;

/// Divisors of the working set that give the limit, and the required share of the speed without a limit.
const PARTS: [(f64, f64); 2] = [(4.0, 0.60), (10.0, 0.35)];
/// Maximum ratio of bytes written to bytes of the map's files.
const MAX_WRITTEN: f64 = 4.0;
/// Speed of the slow disk, reads and writes together.
const SLOW_BYTES_PER_S: f64 = 40e6;

/// A map, and the costs of its builds on a disk.
struct Measured {
    case: Case,
    working_set: WorkingSetFound,
    disk: &'static str,
    /// The builds, first the one without a limit.
    builds: Vec<OfLimit>,
}

/// The builds with one limit.
struct OfLimit {
    limit: Limit,
    /// Required share of the speed without a limit; 0 for the build without a limit.
    wanted_share: f64,
    wall_s: Samples,
    /// Result of the last run; the others differ in time only.
    built: Built,
}

pub fn answer(setting: &Setting) -> Result<Findings> {
    let mut findings = Findings::default();
    let mut measured = Vec::new();
    let disks: &[(&str, DiskSpeed)] = setting.size(
        &[("own speed", DiskSpeed::Own), ("40 MB/s", DiskSpeed::BytesPerSecond(SLOW_BYTES_PER_S))],
        &[("not synced", DiskSpeed::Unsynced)],
    );
    for case in cases(setting) {
        let working_set = WorkingSet { case: case.clone() };
        let found = working_set.clone().run_in_child()?;
        findings.keep(&working_set, &found)?;
        for &(disk, speed) in disks {
            let mut builds = limits(&case, &found)?;
            for _ in 0..setting.runs {
                for of_limit in &mut builds {
                    let build = Build {
                        disk: speed,
                        // All scans are generated before, so that nothing runs during the measured time.
                        scans_at_a_time: usize::MAX,
                        ..setting.build(&case, of_limit.limit)
                    };
                    of_limit.built = build.clone().run_in_child()?;
                    of_limit.wall_s.push(of_limit.built.wall_s());
                    findings.keep_build(&build, &of_limit.built)?;
                }
            }
            measured.push(Measured { case: case.clone(), working_set: found.clone(), disk, builds });
        }
    }
    findings.promises = measured.iter().flat_map(Measured::promises).collect();
    findings.answer.tables = vec![table(&measured)];
    findings.answer.plots = vec![plot(&measured)];
    Ok(findings)
}

fn cases(setting: &Setting) -> Vec<Case> {
    if setting.is_short {
        return vec![synthetic("dense", (SurveyName::Drive, 4_000, 60), [0.05, 2.5, 20.0])];
    }
    let synthetic = [
        synthetic("drive", (SurveyName::Drive, RAYS, 1_000), [0.2, 10.0, 60.0]),
        synthetic("fine drive", (SurveyName::Drive, RAYS, 100), [0.0625, 2.5, 60.0]),
        synthetic("dense", (SurveyName::Drive, RAYS, 100), [0.05, 2.5, 20.0]),
    ];
    synthetic.into_iter().chain(setting.riverside(5.0)).collect()
}

/// No limit, and fractions of the working set, raised to the smallest limit that the mapper accepts.
fn limits(case: &Case, working_set: &WorkingSetFound) -> Result<Vec<OfLimit>> {
    let of_limit = |limit, wanted_share| OfLimit {
        limit,
        wanted_share,
        wall_s: Samples::default(),
        built: Built::default(),
    };
    let mut limits = vec![of_limit(Limit::None, 0.0)];
    let least = case.min_bytes()?;
    for (part, wanted_share) in PARTS {
        let bytes = ((working_set.bytes as f64 / part) as usize).max(least);
        let limit = Limit::Bytes(bytes);
        if limits.iter().all(|known| known.limit != limit) {
            limits.push(of_limit(limit, wanted_share));
        }
    }
    Ok(limits)
}

impl OfLimit {
    /// Name of the limit as a fraction of the working set.
    fn name(&self, working_set: &WorkingSetFound) -> String {
        match self.limit {
            Limit::Bytes(bytes) => format!("W/{:.1}", working_set.bytes as f64 / bytes as f64),
            Limit::None | Limit::InMemory => "no limit".to_owned(),
        }
    }
}

impl Measured {
    /// Speed divided by that without a limit.
    fn share(&self, of_limit: &OfLimit) -> f64 {
        self.builds[0].wall_s.median() / of_limit.wall_s.median()
    }

    fn promises(&self) -> Vec<Promise> {
        let Self { case, disk, working_set, .. } = self;
        let limited = self.builds.iter().skip(1).flat_map(|of_limit| {
            let what = format!("{}, {disk}, {}", case.name, of_limit.name(working_set));
            let share = 100.0 * self.share(of_limit);
            let wanted = Wanted::AtLeast(100.0 * of_limit.wanted_share);
            let written = of_limit.built.written_by_map();
            [
                Promise::about_time(format!("{what}: speed by that without a limit"), share, wanted, "%"),
                Promise::new(
                    format!("{what}: bytes written by bytes of the map"),
                    written,
                    Wanted::AtMost(MAX_WRITTEN),
                    "",
                ),
            ]
        });
        let is_wrong = |of_limit: &&OfLimit| of_limit.built.digest != working_set.digest;
        let wrong = self.builds.iter().filter(is_wrong).count();
        let what = format!("{}, {disk}: digests that are not that of the map in memory", case.name);
        limited.chain([Promise::new(what, wrong as f64, Wanted::AtMost(0.0), "")]).collect()
    }
}

fn table(measured: &[Measured]) -> Table {
    let caption = "Wall time from the first scan until the flush at the end is done, all scans made beforehand. *W*: bytes of the \
                   tiles that the last 50 scans touched, as a map in memory holds them, 95th percentile of the run. \
                   *speed*: by that without a limit.";
    let columns = [
        "map",
        "what",
        "W MiB",
        "disk",
        "limit",
        "limit MiB",
        "seconds",
        "of that flush",
        "CPU seconds",
        "speed",
        "map MB",
        "written by map",
        "read by map",
        "tiles written",
        "tiles read",
    ];
    let mut table = Table::new("throughput", caption, columns);
    for of_case in measured {
        for of_limit in &of_case.builds {
            let OfLimit { built, wall_s, limit, .. } = of_limit;
            let limit_bytes = if let Limit::Bytes(bytes) = limit { *bytes as f64 } else { f64::NAN };
            table.push([
                Cell::Text(of_case.case.name.clone()),
                Cell::Text(of_case.case.description()),
                Cell::Number(mib(of_case.working_set.bytes as f64), 0),
                of_case.disk.into(),
                Cell::Text(of_limit.name(&of_case.working_set)),
                Cell::Number(mib(limit_bytes), 1),
                Cell::Number(wall_s.median(), 1),
                Cell::Number(built.flush_wall_s, 1),
                Cell::Number(built.cpu_s(), 1),
                Cell::Share(of_case.share(of_limit)),
                Cell::Number(built.map_file_bytes as f64 / 1e6, 0),
                Cell::Number(built.written_by_map(), 2),
                Cell::Number(built.bytes_read as f64 / built.map_file_bytes as f64, 2),
                Cell::Count(built.saves),
                Cell::Count(built.loads),
            ]);
        }
    }
    table
}

fn plot(measured: &[Measured]) -> Plot {
    let panels = measured.chunk_by(|a, b| a.case.name == b.case.name).map(|of_case| {
        let limits = of_case[0].builds.iter().skip(1);
        let categories = limits.map(|of_limit| of_limit.name(&of_case[0].working_set)).collect();
        let series = of_case.iter().map(|on_disk| {
            let shares = on_disk.builds.iter().skip(1).map(|of_limit| 100.0 * on_disk.share(of_limit));
            (on_disk.disk.to_owned(), shares.collect())
        });
        Panel {
            title: of_case[0].case.name.clone(),
            x_label: "limit".to_owned(),
            y_label: "% of the speed without a limit".to_owned(),
            content: Content::Bars(Bars { categories, series: series.collect(), are_stacked: false }),
        }
    });
    let caption = "Speed with little memory, on the disk as it is and on one of 40 MB/s".to_owned();
    Plot { file: "throughput", caption, panels: panels.collect() }
}
