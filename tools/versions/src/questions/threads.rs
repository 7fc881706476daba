use crate::outcome::{json_of, number};
use crate::programs::Programs;
use crate::scans::{self, MAX_RANGE_M, ScanSet, Stream};
use crate::setting::Setting;
use anyhow::Result;
use report::{Answer, Cell, Samples, Table};

/// Wall and CPU time of a build, in seconds.
struct Build {
    wall_s: f64,
    cpu_s: f64,
}

/// Measures the gain of a second thread.
pub fn answer(setting: &Setting) -> Result<Answer> {
    let mut table = Table::new(
        "threads",
        "Two threads by one: how many times as fast on the clock, and how much more CPU. Scans one by one, before and \
         now; now also scans handed in together (`Mapper::insert_all`), which the earlier version did one by one.",
        ["scans", "one thread now, ms a scan", "one by one, before", "one by one, now", "together, now"],
    );
    for set in scans::all(setting.is_short) {
        let Some(stream) = set.write(&setting.data, &setting.work)? else { continue };
        let versions = &setting.versions;
        let mut gains: [[Samples; 2]; 3] = Default::default();
        let mut one_thread_ms = Samples::default();
        for _ in 0..versions.runs {
            let modes = [(&versions.before, false), (&versions.now, false), (&versions.now, true)];
            for ((programs, is_together), gains) in modes.into_iter().zip(&mut gains) {
                let one = build(programs, &set, &stream, 1, false)?;
                let two = build(programs, &set, &stream, 2, is_together)?;
                gains[0].push(one.wall_s / two.wall_s);
                gains[1].push(two.cpu_s / one.cpu_s - 1.0);
                if is_together {
                    one_thread_ms.push(1e3 * one.wall_s / stream.scans as f64);
                }
            }
        }
        let cells = gains
            .map(|[faster, more]| format!("{:.2}x, {:+.0} %", faster.median(), 100.0 * more.median()))
            .map(Cell::Text);
        let first = [Cell::Text(set.title()), Cell::Number(one_thread_ms.median(), 1)];
        table.push(first.into_iter().chain(cells));
    }
    Ok(Answer { tables: vec![table], plots: Vec::new() })
}

fn build(
    programs: &Programs,
    set: &ScanSet,
    stream: &Stream,
    threads: usize,
    is_together: bool,
) -> Result<Build> {
    let mut command = programs.command("voxtile_contender", threads);
    command.arg("build").arg(&stream.path).arg("--resolution").arg(set.resolution_m.to_string());
    command.arg("--max-range").arg(MAX_RANGE_M.to_string()).args(["--least-seconds", "1"]);
    if is_together {
        command.arg("--together");
    }
    let outcome = json_of(&mut command)?;
    Ok(Build { wall_s: number(&outcome, "/wall_s")?, cpu_s: number(&outcome, "/cpu_s")? })
}
