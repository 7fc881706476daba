use crate::outcome::{json_of, number};
use crate::pair::Pair;
use crate::programs::Programs;
use crate::scans::{self, MAX_RANGE_M, ScanSet, Stream};
use crate::setting::Setting;
use anyhow::Result;
use report::{Answer, Cell, Table};

/// Measures the time per ray on one thread, with per-scan and with per-ray updates.
pub fn answer(setting: &Setting) -> Result<Answer> {
    let mut table = Table::new(
        "insertion",
        "Nanoseconds of CPU a ray, insertion into memory on one thread, rays of at most 60 m: before, now, and how many \
         times as fast.",
        ["scans", "rays a scan", "once a voxel and scan", "every ray counts"],
    );
    for set in scans::all(setting.is_short) {
        let Some(stream) = set.write(&setting.data, &setting.work)? else { continue };
        let [once, every] = setting.versions.measure(|programs| {
            let once = cpu_ns(programs, &set, &stream, false)? / stream.rays as f64;
            let every = cpu_ns(programs, &set, &stream, true)? / stream.first_rays as f64;
            Ok([once, every])
        })?;
        let cell = |pair: Pair| Cell::Text(pair.text(0));
        let rays = (stream.rays / stream.scans) as u64;
        table.push([Cell::Text(set.title()), rays.into(), cell(once), cell(every)]);
    }
    Ok(Answer { tables: vec![table], plots: Vec::new() })
}

/// CPU time of a build on one thread, in nanoseconds.
fn cpu_ns(programs: &Programs, set: &ScanSet, stream: &Stream, is_every_ray: bool) -> Result<f64> {
    let mut command = programs.command("voxtile_contender", 1);
    command.arg("build").arg(&stream.path).arg("--resolution").arg(set.resolution_m.to_string());
    command.arg("--max-range").arg(MAX_RANGE_M.to_string()).args(["--least-seconds", "1"]);
    if is_every_ray {
        command.arg("--per-ray").arg("--scans").arg(set.ray_scans.to_string());
    }
    Ok(1e9 * number(&json_of(&mut command)?, "/cpu_s")?)
}
