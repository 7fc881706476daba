use crate::outcome::{json_of, number};
use crate::scans::{self, RECORDED, ScanSet};
use crate::setting::Setting;
use anyhow::{Result, ensure};
use report::{Answer, Cell, Table};
use std::cell::RefCell;
use std::ffi::OsString;

/// The queries: key in the program's output, and name in the table.
const QUERIES: [(&str, &str); 8] = [
    ("ray", "ray of 60 m"),
    ("ray_unknown_stops", "ray that the unknown stops"),
    ("point", "point"),
    ("point_of_array", "point of an array"),
    ("nearest_within_10_m", "nearest within 10 m"),
    ("nearest_where_one_is_near", "the same, one within 1 m"),
    ("collision_of_a_sphere", "sphere of 0.5 m"),
    ("occupied_voxels_of_the_map", "occupied voxels of the map"),
];

/// Measures queries of a map in memory.
pub fn answer(setting: &Setting) -> Result<Answer> {
    let head = ["scans".to_owned()].into_iter().chain(QUERIES.map(|(_, what)| what.to_owned()));
    let mut table = Table::new(
        "questions",
        "Microseconds of CPU a question, maps in memory, one thread: before, now, and how many times as fast. Both give \
         the same answers.",
        head,
    );
    for set in scans::all(setting.is_short) {
        let Some(source) = source_of(&set, setting) else { continue };
        let hits = RefCell::new(Vec::new());
        let pairs = setting.versions.measure(|programs| {
            let mut command = programs.command("questions", 1);
            command.arg(&source).arg(set.resolution_m.to_string()).arg(set.scans.to_string());
            let json = json_of(&mut command)?;
            hits.borrow_mut().push(QUERIES.map(|(name, _)| number(&json, &format!("/{name}/hits")).ok()));
            // An earlier version may lack some queries.
            Ok(QUERIES.map(|(name, _)| number(&json, &format!("/{name}/us")).unwrap_or(f64::NAN)))
        })?;
        check_answers(&set, &hits.into_inner())?;
        let cells = pairs.map(|pair| Cell::Text(pair.text(if pair.now < 1.0 { 3 } else { 1 })));
        table.push([Cell::Text(set.title())].into_iter().chain(cells));
    }
    Ok(Answer { tables: vec![table], plots: Vec::new() })
}

/// Checks that all runs of both versions have the same number of hits.
fn check_answers(set: &ScanSet, runs: &[[Option<f64>; QUERIES.len()]]) -> Result<()> {
    for (place, (name, _)) in QUERIES.iter().enumerate() {
        let hits: Vec<f64> = runs.iter().filter_map(|hits| hits[place]).collect();
        ensure!(hits.windows(2).all(|two| two[0] == two[1]), "{}: {name}: {hits:?} hits", set.title());
    }
    Ok(())
}

/// Argument of the program for the scans: name of a survey, or a folder. `None` if the folder is missing.
fn source_of(set: &ScanSet, setting: &Setting) -> Option<OsString> {
    if !RECORDED.contains(&set.name) {
        return Some(set.name.into());
    }
    report::recorded_set(&setting.data, set.name).map(Into::into)
}
