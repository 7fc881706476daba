use crate::outcome::{json_of, number};
use crate::scans::RECORDED;
use crate::setting::Setting;
use anyhow::Result;
use report::{Answer, Cell, Table};

const PRESETS: [&str; 3] = ["local", "autonomous", "passive"];

/// Measures updates of the local map.
pub fn answer(setting: &Setting) -> Result<Answer> {
    let mut table = Table::new(
        "local_map",
        "Mean CPU milliseconds of an update of the local map, 4000 points a scan at 0.1 m, each update the least of 4: \
         before, now, and how many times as fast.",
        ["scans"].into_iter().chain(PRESETS),
    );
    for set in RECORDED {
        let Some(folder) = report::recorded_set(&setting.data, set) else { continue };
        let picture = setting.work.join("local.png");
        let pairs = setting.versions.measure(|programs| {
            let mut means = [f64::NAN; PRESETS.len()];
            for (mean, preset) in means.iter_mut().zip(PRESETS) {
                let mut command = programs.command("voxtile", 1);
                command.arg("local").arg(&folder).args(["--preset", preset, "--points", "4000", "--json"]);
                command.args(["--repeat", if setting.is_short { "1" } else { "4" }]).arg("-o").arg(&picture);
                *mean = number(&json_of(&mut command)?, "/cpu_ms/mean")?;
            }
            Ok(means)
        })?;
        table.push([set.into()].into_iter().chain(pairs.map(|pair| Cell::Text(pair.text(2)))));
    }
    Ok(Answer { tables: vec![table], plots: Vec::new() })
}
