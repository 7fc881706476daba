//! How long does a scan wait if the map is flushed every ten seconds?

use crate::build::{Build, Built, Flushes};
use crate::case::Limit;
use crate::findings::Findings;
use crate::metered_disk::DiskSpeed;
use crate::promise::{Promise, Wanted};
use crate::setting::{RAYS, Setting, mib, synthetic};
use crate::task::ChildTask;
use anyhow::Result;
use report::{Cell, Table};
use voxtile::Storage;
use workload::SurveyName;

/// Maximum ratio of the 99.9th percentile of the calls to their median.
const MAX_BY_MEDIAN: f64 = 4.0;
/// Maximum duration of a call, including flushes, in milliseconds.
const MAX_MS: f64 = 100.0;
/// Maximum ratio of the CPU time with background flushes to that with blocking ones.
const MAX_CPU: f64 = 1.1;
/// Speed of the slow disk, reads and writes together.
const SLOW: DiskSpeed = DiskSpeed::BytesPerSecond(40e6);
/// The default of the command.
const LIMIT: Limit = Limit::Bytes(512 << 20);

/// Result of a drive on one disk with one kind of flush.
struct Run {
    disk: &'static str,
    is_background: bool,
    built: Built,
}

pub fn answer(setting: &Setting) -> Result<Findings> {
    let scans = setting.size(5_000, 60);
    let case = synthetic("drive", (SurveyName::Drive, RAYS, scans), [0.1, 10.0, 60.0]);
    let disks: &[(&str, DiskSpeed, Storage)] = setting.size(
        &[
            ("own speed", DiskSpeed::Own, Storage::OctoMap),
            ("40 MB/s", SLOW, Storage::OctoMap),
            ("40 MB/s, `compact`", SLOW, Storage::Compact),
        ],
        &[("not synced", DiskSpeed::Unsynced, Storage::OctoMap)],
    );
    let mut findings = Findings::default();
    let mut runs = Vec::new();
    for &(disk, speed, storage) in disks {
        for is_background in [false, true] {
            let (every_scans, period_s) = setting.size((100, 0.1), (10, 0.0));
            let flushes = Some(Flushes { every_scans, period_s, is_background });
            let build = Build { disk: speed, storage, flushes, ..setting.build(&case, LIMIT) };
            let built = build.clone().run_in_child()?;
            findings.keep_build(&build, &built)?;
            runs.push(Run { disk, is_background, built });
        }
    }
    for pair in runs.chunks(2) {
        let [blocking, background] = pair else { continue };
        let disk = background.disk;
        let by_median = background.built.insert_ms(0.999) / background.built.insert_ms(0.5);
        let cpu = background.built.cpu_s() / blocking.built.cpu_s();
        let promise = |what: &str, found, wanted, unit| {
            Promise::about_time(format!("{disk}: {what}"), found, Wanted::AtMost(wanted), unit)
        };
        findings.promises.extend([
            promise("p99.9 of a scan by the median", by_median, MAX_BY_MEDIAN, ""),
            promise(
                "longest call",
                background.built.insert_ms(1.0).max(background.built.flush_ms()),
                MAX_MS,
                "ms",
            ),
            promise("CPU time, background flushes by blocking ones", cpu, MAX_CPU, ""),
        ]);
        let differ = f64::from(u8::from(blocking.built.digest != background.built.digest));
        let what = format!("{disk}: digests that differ from that with blocking flushes");
        findings.promises.push(Promise::new(what, differ, Wanted::AtMost(0.0), ""));
    }
    findings.answer.tables = vec![table(&case.description(), &runs)];
    Ok(findings)
}

fn table(case: &str, runs: &[Run]) -> Table {
    let caption = format!(
        "Wall time of calls at ten scans a second with a flush every ten seconds, limit 512 MiB, storage `octomap` unless noted; {case}. \
         A background flush returns once it has begun."
    );
    let columns = [
        "disk",
        "flush",
        "scan: median ms",
        "p99",
        "p99.9",
        "worst",
        "flush: worst ms",
        "CPU s",
        "peak MiB",
        "tiles",
    ];
    let mut table = Table::new("flushes", caption, columns);
    for of in runs {
        table.push([
            of.disk.into(),
            if of.is_background { "background" } else { "blocking" }.into(),
            Cell::Number(of.built.insert_ms(0.5), 1),
            Cell::Number(of.built.insert_ms(0.99), 1),
            Cell::Number(of.built.insert_ms(0.999), 1),
            Cell::Number(of.built.insert_ms(1.0), 1),
            Cell::Number(of.built.flush_ms(), 1),
            Cell::Number(of.built.cpu_s(), 1),
            Cell::Number(mib(of.built.peak_resident_bytes as f64), 0),
            Cell::Count(of.built.tiles),
        ]);
    }
    table
}
