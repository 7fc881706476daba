//! Does the memory stay within the limit for any trajectory?

use crate::build::{Build, Built};
use crate::case::{Case, Limit};
use crate::findings::Findings;
use crate::metered_disk::DiskSpeed;
use crate::promise::{Promise, Wanted};
use crate::setting::{RAYS, Setting, mib, synthetic};
use crate::task::ChildTask;
use anyhow::Result;
use report::plot::{Content, Line, Panel, Plot, Scale};
use report::{Cell, Table};
use workload::SurveyName;

/// Memory that a process may use in addition to its limit, in MiB: the program, the scan, the samples of the
/// measurement.
pub const OVERHEAD_MIB: f64 = 48.0;
/// Inputs that are also mapped on a slow disk, where writes accumulate.
const ON_SLOW_DISK: [&str; 1] = ["teleports"];
/// Speed of the slow disk; a short run uses the faster one.
const SLOW: DiskSpeed = DiskSpeed::BytesPerSecond(40e6);
const LESS_SLOW: DiskSpeed = DiskSpeed::BytesPerSecond(100e6);

/// A map built in memory and with several limits.
struct Measured {
    case: Case,
    in_memory: Built,
    limited: Vec<Limited>,
}

/// A map built with a limit.
struct Limited {
    limit_mib: usize,
    /// Whether the disk was slow, so that writes could accumulate.
    is_slow: bool,
    built: Built,
}

pub fn answer(setting: &Setting) -> Result<Findings> {
    let mut findings = Findings::default();
    let mut measured = Vec::new();
    let limits_mib: &[usize] = setting.size(&[64, 128, 256], &[24]);
    for case in cases(setting) {
        let mut build = |limit, disk| {
            let build = Build { disk, ..setting.build(&case, limit) };
            let built = build.clone().run_in_child()?;
            findings.keep_build(&build, &built)?;
            anyhow::Ok(built)
        };
        let in_memory = build(Limit::InMemory, DiskSpeed::Unsynced)?;
        let slow = ON_SLOW_DISK.contains(&case.name.as_str()).then_some((limits_mib[0], true));
        let mut limited = Vec::new();
        for (limit_mib, is_slow) in limits_mib.iter().map(|&limit_mib| (limit_mib, false)).chain(slow) {
            let disk = if is_slow { setting.size(SLOW, LESS_SLOW) } else { DiskSpeed::Unsynced };
            let built = build(Limit::Bytes(limit_mib << 20), disk)?;
            limited.push(Limited { limit_mib, is_slow, built });
        }
        measured.push(Measured { case, in_memory, limited });
    }
    findings.promises = measured.iter().flat_map(Measured::promises).collect();
    findings.answer.tables = vec![table(&measured)];
    let caption = "Resident memory of the process while the map grows, by its limit".to_owned();
    let panels = measured.iter().map(Measured::panel).collect();
    findings.answer.plots = vec![Plot { file: "memory", caption, panels }];
    Ok(findings)
}

/// Trajectories that need much memory, each for its own reason.
fn cases(setting: &Setting) -> Vec<Case> {
    let made = |survey, rays, scans: [usize; 2]| (survey, rays, setting.size(scans[0], scans[1]));
    let mut cases: Vec<Case> =
        if setting.is_short { Vec::new() } else { setting.riverside(10.0).into_iter().collect() };
    let fine = setting.size([0.2, 10.0, 60.0], [0.1, 5.0, 60.0]);
    cases.extend([
        synthetic("drive", made(SurveyName::Drive, RAYS, [5_000, 60]), fine),
        synthetic("teleports", made(SurveyName::Teleport, RAYS, [100, 25]), [0.2, 10.0, 60.0]),
        synthetic("dense", made(SurveyName::Drive, RAYS, [100, 30]), [0.05, 2.5, 20.0]),
        synthetic("masts", made(SurveyName::Mast, RAYS, [8, 2]), [0.4, 10.0, 100.0]),
    ]);
    cases
}

impl Measured {
    /// Number of digests that differ from that of the map in memory.
    fn wrong_digests(&self) -> usize {
        self.limited.iter().filter(|limited| limited.built.digest != self.in_memory.digest).count()
    }

    fn promises(&self) -> Vec<Promise> {
        let name = &self.case.name;
        let beyond = self.limited.iter().map(Limited::beyond_mib);
        let least_limit_mib =
            self.limited.iter().map(|limited| limited.limit_mib as f64).fold(f64::NAN, f64::min);
        vec![
            Promise::new(
                format!("{name}: peak of memory beyond the limit, largest"),
                beyond.fold(f64::NAN, f64::max),
                Wanted::AtMost(OVERHEAD_MIB),
                "MiB",
            ),
            Promise::new(
                format!("{name}: digests that are not that of the map in memory"),
                self.wrong_digests() as f64,
                Wanted::AtMost(0.0),
                "",
            ),
            // Ensures that the limit is well below the memory that the map needs.
            Promise::new(
                format!("{name}: peak of the map in memory, beyond the least limit"),
                mib(self.in_memory.peak_resident_bytes as f64) - least_limit_mib,
                Wanted::AtLeast(OVERHEAD_MIB),
                "MiB",
            ),
        ]
    }

    fn panel(&self) -> Panel {
        let follows_trajectory = self.case.follows_trajectory();
        let limited = self.limited.iter().map(|limited| (limited.name(), &limited.built));
        let lines = limited.chain([("in memory".to_owned(), &self.in_memory)]).map(|(name, built)| {
            let every = built.scans.len().div_ceil(400).max(1);
            let points = built.scans.iter().enumerate().step_by(every).map(|(number, scan)| {
                let x = if follows_trajectory { scan.distance_m / 1e3 } else { (number + 1) as f64 };
                [x, mib(scan.resident_bytes as f64)]
            });
            Line { name, points: points.collect() }
        });
        Panel {
            title: self.case.name.clone(),
            x_label: if follows_trajectory { "distance, km" } else { "scans" }.to_owned(),
            y_label: "resident memory, MiB".to_owned(),
            content: Content::Lines { x_scale: Scale::Linear, y_scale: Scale::Log, lines: lines.collect() },
        }
    }
}

impl Limited {
    fn name(&self) -> String {
        format!("{} MiB{}", self.limit_mib, if self.is_slow { ", slow disk" } else { "" })
    }

    /// Peak of the process beyond the limit, in MiB.
    fn beyond_mib(&self) -> f64 {
        mib(self.built.peak_resident_bytes as f64) - self.limit_mib as f64
    }
}

fn table(measured: &[Measured]) -> Table {
    let caption = "Peaks of the resident memory of processes that only build the map, and numbers of tiles written and read. *beyond*: peak less limit.";
    let columns = [
        "map",
        "what",
        "limit",
        "scans",
        "tiles",
        "peak MiB",
        "beyond MiB",
        "tiles written",
        "tiles read",
        "digest",
    ];
    let mut table = Table::new("memory", caption, columns);
    for Measured { case, in_memory, limited } in measured {
        let limits = limited.iter().map(|limited| (limited.name(), limited.beyond_mib(), &limited.built));
        let all = [("in memory".to_owned(), f64::NAN, in_memory)].into_iter().chain(limits);
        for (limit, beyond_mib, built) in all {
            table.push([
                Cell::Text(case.name.clone()),
                Cell::Text(case.description()),
                Cell::Text(limit),
                Cell::Count(built.scans.len() as u64),
                Cell::Count(built.tiles),
                Cell::Number(mib(built.peak_resident_bytes as f64), 1),
                Cell::Number(beyond_mib, 1),
                Cell::Count(built.saves),
                Cell::Count(built.loads),
                Cell::Text(built.digest.chars().take(8).collect()),
            ]);
        }
    }
    table
}
