//! Does the mapper keep up on a small board: one core, 64 MiB, a slow disk or a memory card?

use crate::build::{Build, Built, Flushes};
use crate::case::Limit;
use crate::findings::Findings;
use crate::metered_disk::{Card, DiskSpeed};
use crate::promise::{Promise, Wanted};
use crate::setting::{RAYS, Setting, mib, synthetic};
use crate::task::ChildTask;
use anyhow::Result;
use report::{Cell, Table};
use voxtile::Storage;
use workload::SurveyName;

const LIMIT_MIB: usize = 64;
const DISK: DiskSpeed = DiskSpeed::BytesPerSecond(20e6);
/// A memory card: 100 accesses a second.
const CARD: DiskSpeed = DiskSpeed::Card(Card { bytes_per_s: 20e6, sync_s: 5e-3, access_s: 10e-3 });
/// Interval between scans at the pace of a sensor, in seconds.
const PERIOD_S: f64 = 0.1;
/// Number of scans between background flushes at that pace.
const FLUSH_EVERY: usize = 100;
/// Maximum of the 99th percentile of a scan at that pace, in milliseconds: the time until the next scan.
const MAX_P99_MS: f64 = 1e3 * PERIOD_S;
/// Maximum peak of memory beyond the limit, as in the other questions.
const MAX_BEYOND_MIB: f64 = 48.0;

struct Run {
    disk: &'static str,
    storage: Storage,
    is_paced: bool,
    built: Built,
}

pub fn answer(setting: &Setting) -> Result<Findings> {
    let case = synthetic("drive", (SurveyName::Drive, RAYS, setting.size(1_000, 40)), [0.2, 10.0, 60.0]);
    let disks: &[(&str, DiskSpeed)] =
        setting.size(&[("20 MB/s", DISK), ("card", CARD)], &[("not synced", DiskSpeed::Unsynced)]);
    let mut findings = Findings::default();
    let mut runs = Vec::new();
    for &(disk, speed) in disks {
        for storage in [Storage::Compact, Storage::OctoMap] {
            for is_paced in [false, true] {
                let period_s = setting.size(PERIOD_S, 0.0);
                let flushes = Flushes { every_scans: FLUSH_EVERY, period_s, is_background: true };
                let build = Build {
                    disk: speed,
                    storage,
                    is_on_one_core: true,
                    flushes: is_paced.then_some(flushes),
                    ..setting.build(&case, Limit::Bytes(LIMIT_MIB << 20))
                };
                let built = build.clone().run_in_child()?;
                findings.keep_build(&build, &built)?;
                runs.push(Run { disk, storage, is_paced, built });
            }
        }
    }
    findings.promises = runs.iter().flat_map(Run::promises).collect();
    let differ = runs.iter().filter(|run| run.built.digest != runs[0].built.digest).count();
    findings.promises.push(Promise::new("digests that differ", differ as f64, Wanted::AtMost(0.0), ""));
    findings.answer.tables = vec![table(&case.description(), &runs)];
    Ok(findings)
}

impl Run {
    fn pace(&self) -> &'static str {
        if self.is_paced { "10 a second" } else { "at once" }
    }

    fn promises(&self) -> Vec<Promise> {
        let what = format!("{}, `{}`, {}", self.disk, self.storage, self.pace());
        let beyond_mib = mib(self.built.peak_resident_bytes as f64) - LIMIT_MIB as f64;
        let most = Wanted::AtMost(MAX_BEYOND_MIB);
        let memory =
            Promise::new(format!("{what}: peak of memory beyond the limit"), beyond_mib, most, "MiB");
        let p99 = self.is_paced.then(|| {
            let (p99_ms, most) = (self.built.insert_ms(0.99), Wanted::AtMost(MAX_P99_MS));
            Promise::about_time(format!("{what}: p99 of a scan"), p99_ms, most, "ms")
        });
        [memory].into_iter().chain(p99).collect()
    }
}

fn table(case: &str, runs: &[Run]) -> Table {
    let caption = format!(
        "One core, limit {LIMIT_MIB} MiB. `card`: 20 MB/s, 5 ms a sync, 100 accesses a second. Scans come at once, or \
         ten a second with a background flush every ten seconds; seconds are those of the calls and of the last flush. \
         {case}."
    );
    let columns = [
        "disk",
        "storage",
        "scans",
        "seconds",
        "of the last flush",
        "CPU s",
        "scan: median ms",
        "p99",
        "worst",
        "flush: worst ms",
        "peak MiB",
        "written MB",
        "accesses",
        "syncs",
    ];
    let mut table = Table::new("board", caption, columns);
    for run in runs {
        let Run { disk, storage, built, .. } = run;
        table.push([
            (*disk).into(),
            Cell::Text(storage.to_string()),
            run.pace().into(),
            Cell::Number(built.wall_s(), 1),
            Cell::Number(built.flush_wall_s, 1),
            Cell::Number(built.cpu_s(), 1),
            Cell::Number(built.insert_ms(0.5), 1),
            Cell::Number(built.insert_ms(0.99), 1),
            Cell::Number(built.insert_ms(1.0), 1),
            Cell::Number(built.flush_ms(), 1),
            Cell::Number(mib(built.peak_resident_bytes as f64), 0),
            Cell::Number(built.bytes_written as f64 / 1e6, 1),
            Cell::Count(built.accesses),
            Cell::Count(built.syncs),
        ]);
    }
    table
}
