//! Does the memory stay within the limit for any scan, tile size and file?

use super::memory::OVERHEAD_MIB;
use crate::findings::Findings;
use crate::hard_scan::{BuildCost, HardScan, Points};
use crate::promise::{Promise, Wanted};
use crate::setting::{Setting, mib};
use anyhow::{Context, Result};
use report::{Cell, Table};
use std::fs;
use workload::SurveyName;

/// Maximum ratio of the CPU time with a limit to that without one.
const MAX_TIMES_CPU: f64 = 4.0;

pub fn answer(setting: &Setting) -> Result<Findings> {
    let mut findings = Findings::default();
    let columns = [
        "input",
        "what",
        "limit MiB",
        "tiles",
        "peak MiB",
        "beyond MiB",
        "CPU s",
        "without a limit",
        "digest",
    ];
    let caption = "The command `voxtile build`, one process a map; CPU time with the limit and without one.";
    let mut table = Table::new("hard_scans", caption, columns);
    for hard in cases(setting) {
        let [limited, unlimited] = measured(setting, &hard).with_context(|| hard.description())?;
        findings.keep(&hard, &[&limited, &unlimited])?;
        let beyond_mib = mib(limited.peak_bytes as f64) - hard.limit_mib as f64;
        let times = limited.cpu_s / unlimited.cpu_s.max(0.1);
        eprintln!("  {}: {beyond_mib:.0} MiB beyond {}, CPU {times:.1} times", hard.name, hard.limit_mib);
        let promise = |what: &str, found, wanted, unit| {
            Promise::new(format!("{}: {what}", hard.name), found, wanted, unit)
        };
        findings.promises.extend([
            promise("peak of memory beyond the limit", beyond_mib, Wanted::AtMost(OVERHEAD_MIB), "MiB"),
            promise(
                "digests that are not that without a limit",
                f64::from(u8::from(limited.digest != unlimited.digest)),
                Wanted::AtMost(0.0),
                "",
            ),
            Promise::about_time(
                format!("{}: CPU time by that without a limit", hard.name),
                times,
                Wanted::AtMost(MAX_TIMES_CPU),
                "x",
            ),
        ]);
        table.push([
            Cell::Text(hard.name.clone()),
            Cell::Text(hard.description()),
            Cell::Count(hard.limit_mib as u64),
            Cell::Count(limited.tiles),
            Cell::Number(mib(limited.peak_bytes as f64), 1),
            Cell::Number(beyond_mib, 1),
            Cell::Number(limited.cpu_s, 1),
            Cell::Number(unlimited.cpu_s, 1),
            Cell::Text(limited.digest.chars().take(8).collect()),
        ]);
    }
    findings.answer.tables = vec![table];
    Ok(findings)
}

/// Cost with the limit and without one.
fn measured(setting: &Setting, hard: &HardScan) -> Result<[BuildCost; 2]> {
    let input = hard.write(&setting.work)?;
    let map = setting.work.join("hard");
    let taken = [hard.build(&input, &map, true)?, hard.build(&input, &map, false)?];
    fs::remove_file(input)?;
    Ok(taken)
}

/// Each of these inputs once exceeded the limit. A short run uses smaller ones of the same kinds.
fn cases(setting: &Setting) -> Vec<HardScan> {
    let fan = |rays: [u32; 2], reach_m: [f64; 2], opening, is_sky| Points::Fan {
        scans: 1,
        rays: setting.size(rays[0], rays[1]),
        reach_m: setting.size(reach_m[0], reach_m[1]),
        opening,
        is_sky,
    };
    let hard = |name: &str, points, resolution_m, tile_size_m, limit_mib| HardScan {
        name: name.to_owned(),
        points,
        resolution_m,
        tile_size_m,
        limit_mib,
        per_ray: false,
        is_flushed: false,
        is_octomap: false,
        options: Vec::new(),
    };
    let teleports = Points::Survey { survey: SurveyName::Teleport, scans: setting.size(4, 2) };
    let mut cases = vec![
        hard("long rays", fan([20_000, 1_500], [450.0, 300.0], 0.3, false), 0.1, 10.0, setting.size(512, 64)),
        hard(
            "longer rays",
            fan([3_000, 200], [1_000.0, 800.0], 0.02, false),
            0.1,
            10.0,
            setting.size(128, 64),
        ),
        hard("millions of points", fan([4_000_000, 1_000_000], [30.0, 8.0], 0.3, false), 0.1, 10.0, 64),
        hard("more millions", fan([10_000_000, 2_000_000], [12.0, 4.0], 0.3, false), 0.1, 10.0, 64),
        hard("packed file", Points::Packed { points: setting.size(20_000_000, 5_000_000) }, 0.1, 10.0, 64),
        hard("small tiles", teleports, 0.1, 0.4, 64),
        hard("dense tile", fan([200_000, 30_000], [1.4, 0.7], 1.0, false), 0.01, 1.28, 96),
        hard("sky", fan([100_000, 10_000], [60.0, 30.0], 1.0, true), 0.1, 10.0, 64),
    ];
    let every_ray = cases[0].clone();
    cases.push(HardScan { name: "every long ray".to_owned(), per_ray: true, ..every_ray });
    cases
}
