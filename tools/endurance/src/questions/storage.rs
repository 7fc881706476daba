//! What does compact storage save, and what does it cost?

use crate::build::{Build, Built};
use crate::case::{Case, Limit};
use crate::findings::Findings;
use crate::metered_disk::DiskSpeed;
use crate::promise::{Promise, Wanted};
use crate::setting::{RAYS, Setting, mib, synthetic};
use crate::task::ChildTask;
use anyhow::Result;
use report::{Cell, Samples, Table};
use voxtile::Storage;
use workload::SurveyName;

/// Speed of the slow disk, reads and writes together.
const SLOW_BYTES_PER_S: f64 = 40e6;
/// Minimum ratio of the map's bytes with octomap storage to those with compact storage.
const MIN_SMALLER: f64 = 8.0;
/// Memory limit of the second measurement of each map, in MiB: a fraction of the map. The first has no limit.
const LIMIT_MIB: usize = 64;
const SHORT_LIMIT_MIB: usize = 24;
/// Maximum ratio of the wall time with compact storage to that with octomap storage. It allows for the noise of
/// repeated runs.
const MAX_TIME: f64 = 1.05;

/// Builds of one map that differ in storage only, octomap storage first.
struct Measured {
    case: Case,
    disk: &'static str,
    limit: Limit,
    builds: [OfStorage; 2],
}

struct OfStorage {
    storage: Storage,
    wall_s: Samples,
    cpu_s: Samples,
    /// Result of the last run; the others differ in time only.
    built: Built,
}

pub fn answer(setting: &Setting) -> Result<Findings> {
    let mut findings = Findings::default();
    let disks: &[(&str, DiskSpeed)] = setting.size(
        &[("own speed", DiskSpeed::Own), ("40 MB/s", DiskSpeed::BytesPerSecond(SLOW_BYTES_PER_S))],
        &[("not synced", DiskSpeed::Unsynced)],
    );
    let limit_bytes = setting.size(LIMIT_MIB, SHORT_LIMIT_MIB) << 20;
    let mut measured = Vec::new();
    for case in cases(setting) {
        for &(disk, speed) in disks {
            for limit in [Limit::None, Limit::Bytes(limit_bytes)] {
                let builds = builds(setting, &case, limit, speed, &mut findings)?;
                measured.push(Measured { case: case.clone(), disk, limit, builds });
            }
        }
    }
    findings.promises = measured.iter().flat_map(Measured::promises).collect();
    findings.answer.tables = vec![table(&measured)];
    Ok(findings)
}

fn cases(setting: &Setting) -> Vec<Case> {
    if setting.is_short {
        return vec![synthetic("drive", (SurveyName::Drive, RAYS, 60), [0.1, 5.0, 60.0])];
    }
    let drive = synthetic("drive", (SurveyName::Drive, RAYS, 1_000), [0.2, 10.0, 60.0]);
    [drive].into_iter().chain(setting.riverside(10.0)).collect()
}

/// Builds the map with each storage in turn, `setting.runs` times.
fn builds(
    setting: &Setting,
    case: &Case,
    limit: Limit,
    disk: DiskSpeed,
    findings: &mut Findings,
) -> Result<[OfStorage; 2]> {
    let mut builds = [Storage::OctoMap, Storage::Compact].map(|storage| OfStorage {
        storage,
        wall_s: Samples::default(),
        cpu_s: Samples::default(),
        built: Built::default(),
    });
    for _ in 0..setting.runs {
        for of_storage in &mut builds {
            let storage = of_storage.storage;
            // All scans are generated before, so that nothing runs during the measured time.
            let build = Build { disk, storage, scans_at_a_time: usize::MAX, ..setting.build(case, limit) };
            of_storage.built = build.clone().run_in_child()?;
            of_storage.wall_s.push(of_storage.built.wall_s());
            of_storage.cpu_s.push(of_storage.built.cpu_s());
            findings.keep_build(&build, &of_storage.built)?;
        }
    }
    Ok(builds)
}

impl Measured {
    fn limit_name(&self) -> String {
        match self.limit {
            Limit::Bytes(bytes) => format!("{:.0} MiB", mib(bytes as f64)),
            Limit::None | Limit::InMemory => "no limit".to_owned(),
        }
    }

    fn promises(&self) -> Vec<Promise> {
        let [octomap, compact] = &self.builds;
        let what = format!("{}, {}, {}", self.case.name, self.disk, self.limit_name());
        let smaller = octomap.built.map_file_bytes as f64 / compact.built.map_file_bytes as f64;
        let time = compact.wall_s.median() / octomap.wall_s.median();
        let differ = f64::from(u8::from(octomap.built.digest != compact.built.digest));
        vec![
            Promise::new(
                format!("{what}: the map's files, octomap by compact"),
                smaller,
                Wanted::AtLeast(MIN_SMALLER),
                "",
            ),
            Promise::new(format!("{what}: digests that differ"), differ, Wanted::AtMost(0.0), ""),
            Promise::about_time(
                format!("{what}: wall time, compact by octomap"),
                time,
                Wanted::AtMost(MAX_TIME),
                "",
            ),
        ]
    }
}

fn table(measured: &[Measured]) -> Table {
    let caption = "Maps built with either storage in turn: time from the first scan until the flush at the end is done, all scans \
                   made beforehand; bytes of the map's files, and bytes written and read.";
    let columns = [
        "map",
        "what",
        "disk",
        "limit",
        "storage",
        "seconds",
        "of that flush",
        "CPU seconds",
        "map MB",
        "written MB",
        "read MB",
        "tiles written",
        "tiles read",
    ];
    let mut table = Table::new("storage", caption, columns);
    for of_case in measured {
        for OfStorage { storage, wall_s, cpu_s, built } in &of_case.builds {
            let mb = |bytes: u64| Cell::Number(bytes as f64 / 1e6, 1);
            table.push([
                Cell::Text(of_case.case.name.clone()),
                Cell::Text(of_case.case.description()),
                of_case.disk.into(),
                Cell::Text(of_case.limit_name()),
                Cell::Text(storage.to_string()),
                Cell::Number(wall_s.median(), 2),
                Cell::Number(built.flush_wall_s, 2),
                Cell::Number(cpu_s.median(), 2),
                mb(built.map_file_bytes),
                mb(built.bytes_written),
                mb(built.bytes_read),
                Cell::Count(built.saves),
                Cell::Count(built.loads),
            ]);
        }
    }
    table
}
