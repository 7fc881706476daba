use crate::cpu_time::cpu_seconds;
use crate::outcome::{json_of, number};
use crate::programs::Programs;
use crate::scans::{self, MAX_RANGE_M, RECORDED};
use crate::setting::Setting;
use anyhow::{Context, Result, ensure};
use report::{Answer, Cell, Table};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Number of exports of a map that are timed together.
const EXPORTS: usize = 20;

/// Measures flushes and exports of maps on disk.
pub fn answer(setting: &Setting) -> Result<Answer> {
    Ok(Answer { tables: vec![flush(setting)?, export(setting)?], plots: Vec::new() })
}

/// Compares scans to flushed files with the same scans into memory.
fn flush(setting: &Setting) -> Result<Table> {
    let mut table = Table::new(
        "flush",
        "Scans into memory by scans to a flushed map on disk (`octomap` storage, tiles that all fit), wall time on two \
         threads: before, now. 1 is a flush that costs nothing.",
        ["scans", "before", "now"],
    );
    for set in scans::all(setting.is_short) {
        let Some(stream) = set.write(&setting.data, &setting.work)? else { continue };
        let [share] = setting.versions.measure(|programs| {
            let build = |folder: Option<&Path>| {
                let mut command = programs.command("voxtile_contender", 2);
                command.arg("build").arg(&stream.path).arg("--resolution").arg(set.resolution_m.to_string());
                command.arg("--max-range").arg(MAX_RANGE_M.to_string()).args(["--least-seconds", "1"]);
                if let Some(folder) = folder {
                    command.arg("--folder").arg(folder);
                }
                number(&json_of(&mut command)?, "/wall_s")
            };
            let maps = setting.work.join("maps");
            fs::create_dir_all(&maps)?;
            let share = build(None)? / build(Some(&maps))?;
            fs::remove_dir_all(&maps)?;
            Ok([share])
        })?;
        table.push([Cell::Text(set.title()), Cell::Number(share.before, 2), Cell::Number(share.now, 2)]);
        fs::remove_file(&stream.path)?;
    }
    Ok(table)
}

/// Compares an export of the occupied voxels with `cat` of the tiles' files.
fn export(setting: &Setting) -> Result<Table> {
    let mut table = Table::new(
        "export",
        "CPU milliseconds of `voxtile export MAP -o FILE.ply` (occupied voxels), of `cat` of the tiles' tables, and the \
         one by the other: before and now.",
        ["map, 0.1 m", "storage", "export", "cat", "before by cat", "now by cat"],
    );
    for set in RECORDED.into_iter().skip(if setting.is_short { 2 } else { 0 }) {
        let Some(folder) = report::recorded_set(&setting.data, set) else { continue };
        for (storage, file) in [("octomap", "iwlo_meta.bin"), ("compact", "tile.vxt")] {
            let [export, cat] = setting.versions.measure(|programs| {
                let (map, out) = (setting.work.join("map"), setting.work.join("occupied.ply"));
                build_map(programs, &folder, &map, storage)?;
                let tables = files_named(&map, file)?;
                let times = if setting.is_short { 1 } else { EXPORTS };
                let export = cpu_seconds(times, || {
                    let mut command = programs.command("voxtile", 1);
                    command.arg("export").arg(&map).arg("-o").arg(&out);
                    command
                })?;
                let cat = cpu_seconds(times, || {
                    let mut command = Command::new("sh");
                    command.args(["-c", "exec cat \"$@\" >/dev/null", "sh"]).args(&tables);
                    command
                })?;
                fs::remove_dir_all(&map)?;
                fs::remove_file(&out)?;
                Ok([1e3 * export, 1e3 * cat])
            })?;
            table.push([
                set.into(),
                storage.into(),
                Cell::Text(export.text(1)),
                Cell::Number(cat.now, 1),
                Cell::Number(export.before / cat.before, 1),
                Cell::Number(export.now / cat.now, 1),
            ]);
        }
    }
    Ok(table)
}

/// Builds a map of a recorded set with the version's own command, as an earlier version may not read newer maps.
fn build_map(programs: &Programs, scans: &Path, map: &Path, storage: &str) -> Result<()> {
    let mut command = programs.command("voxtile", 2);
    command.arg("build").arg(scans).arg("-o").arg(map).args(["--resolution", "0.1"]);
    command.args(["--max-range", "60", "--storage", storage]);
    let output = command.output().with_context(|| format!("{command:?}: cannot start"))?;
    ensure!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    Ok(())
}

/// Files with this name in the subfolders.
fn files_named(folder: &Path, name: &str) -> Result<Vec<PathBuf>> {
    let cannot_list = || format!("{}: cannot list", folder.display());
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).with_context(cannot_list)? {
        let file = entry.with_context(cannot_list)?.path().join(name);
        if file.is_file() {
            files.push(file);
        }
    }
    ensure!(!files.is_empty(), "{}: no {name} in it", folder.display());
    Ok(files)
}
