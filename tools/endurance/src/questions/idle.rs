//! Does an idle mapper use the processor?

use crate::findings::Findings;
use crate::idle::Idle;
use crate::promise::{Promise, Wanted};
use crate::setting::{RAYS, Setting, synthetic};
use crate::task::ChildTask;
use anyhow::Result;
use report::{Cell, Table};
use workload::SurveyName;

/// Share of a core, in percent: the resolution of the clock.
const MAX_PERCENT: f64 = 0.1;

pub fn answer(setting: &Setting) -> Result<Findings> {
    let case = synthetic("drive", (SurveyName::Drive, RAYS, 60), [0.1, 5.0, 60.0]);
    let idle = Idle {
        case: case.clone(),
        memory_bytes: 24 << 20,
        idle_s: setting.size(10.0, 3.0),
        folder: setting.work.join("idle"),
    };
    let idled = idle.clone().run_in_child()?;
    let mut findings = Findings::default();
    findings.keep(&idle, &idled)?;
    let percent = 100.0 * idled.cpu_s / idled.wall_s;
    let what = "share of a core that a mapper with nothing to do takes";
    findings.promises = vec![Promise::new(what, percent, Wanted::AtMost(MAX_PERCENT), "%")];
    let caption = format!(
        "CPU time of all threads of a mapper that has taken scans, is not flushed, and then waits; {}, limit {} MiB.",
        case.description(),
        idle.memory_bytes >> 20
    );
    let mut table = Table::new("idle", caption, ["seconds", "CPU ms", "tiles written before"]);
    table.push([Cell::Number(idled.wall_s, 1), Cell::Number(1e3 * idled.cpu_s, 3), Cell::Count(idled.saves)]);
    findings.answer.tables = vec![table];
    Ok(findings)
}
