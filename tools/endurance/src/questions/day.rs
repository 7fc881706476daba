//! Does anything grow while a robot repeats the same round all day?

use crate::case::{Case, Input};
use crate::day::{Day, DayFound, Part};
use crate::findings::Findings;
use crate::promise::{Promise, Wanted};
use crate::setting::{Setting, mib};
use crate::task::ChildTask;
use anyhow::{Context, Result};
use report::plot::{Content, Line, Panel, Plot, Scale};
use report::{Cell, Table};
use voxtile::Storage;
use workload::SurveyName;

/// Rays of a scan. The short day has more, to compensate for its few scans.
const RAYS: u32 = 1_000;
const RAYS_SHORT: u32 = 4_000;
/// Scans a second of the survey. The day uses every n-th of them (`EVERY`), so that it takes half an hour instead of
/// two hours.
const SURVEYED_PER_S: usize = 10;
const EVERY: usize = 4;
const EVERY_SHORT: usize = 96;
const HOURS: usize = 12;
const FLUSH_EVERY_S: usize = 10;
const FLUSH_EVERY_SCANS_SHORT: usize = 100;
/// Number of scans of the survey in one round of 2.4 km at 1 m/s.
const SCANS_PER_ROUND: usize = 24_000;
/// Maximum ratio of the last part to the middle one. By the middle, everything has been seen often.
const MAX_GROWTH: f64 = 1.05;
/// Maximum ratio for bytes on disk. It is larger, because observation counts still increase, so that voxels of a tile
/// have more different values.
const MAX_DISK_GROWTH: f64 = 1.25;
/// Maximum ratio for a short day, in which voxels are not seen often enough to be stable.
const MAX_GROWTH_SHORT: f64 = 1.5;
/// Maximum ratio for CPU times.
const MAX_SLOWER: f64 = 1.15;

pub fn answer(setting: &Setting) -> Result<Findings> {
    // The short day has as many rounds as fit: its robot is 96 times as fast.
    let of_day = HOURS * 3_600 * SURVEYED_PER_S / EVERY;
    let (scans, every) = setting.size((of_day, EVERY), (3_000, EVERY_SHORT));
    let rays = setting.size(RAYS, RAYS_SHORT);
    let case = Case {
        name: "warehouse".into(),
        input: Input::EveryNth { survey: SurveyName::Warehouse, rays, scans, every },
        resolution_m: setting.size(0.1, 0.2),
        tile_size_m: 10.0,
        max_range_m: 30.0,
    };
    let day = Day {
        case,
        memory_bytes: setting.size(64, 24) << 20,
        // `Storage::OctoMap` writes thirty times the bytes.
        storage: Storage::Compact,
        flush_every_scans: setting.size(FLUSH_EVERY_S * SURVEYED_PER_S / EVERY, FLUSH_EVERY_SCANS_SHORT),
        scans_per_part: setting.size(scans / HOURS, SCANS_PER_ROUND / EVERY_SHORT),
        folder: setting.work.join("day"),
    };
    let found = day.clone().run_in_child()?;
    let mut findings = Findings::default();
    findings.keep(&day, &found)?;
    let most_growth = setting.size([MAX_GROWTH, MAX_DISK_GROWTH], [MAX_GROWTH_SHORT; 2]);
    findings.promises.extend(promises(&found, scans, most_growth)?);
    findings.answer.tables = vec![table(&day, &found)];
    findings.answer.plots = vec![plot(&found)];
    Ok(findings)
}

fn promises(
    found: &DayFound,
    scans: usize,
    [most_growth, most_disk_growth]: [f64; 2],
) -> Result<Vec<Promise>> {
    let middle = found.parts.get(found.parts.len() / 2);
    let (middle, last) = middle.zip(found.parts.last()).context("a day has at least one part")?;
    let growth = |what: &str, most, of: fn(&Part) -> f64| {
        let what = format!("{what}, last part of the day by the middle one");
        Promise::new(what, of(last) / of(middle), Wanted::AtMost(most), "")
    };
    let slower = "CPU time of a scan, last part of the day by the middle one";
    let missing = scans as f64 - found.scan_number as f64;
    Ok(vec![
        growth("resident memory", most_growth, |part| part.resident_bytes as f64),
        growth("files", most_growth, |part| part.files as f64),
        growth("bytes on disk", most_disk_growth, |part| part.map_bytes as f64),
        growth("bytes of the log of commits", most_growth, |part| part.log_bytes as f64),
        Promise::new("scans that are not in the map", missing, Wanted::AtMost(0.0), ""),
        Promise::about_time(slower, last.cpu_ms / middle.cpu_ms, Wanted::AtMost(MAX_SLOWER), ""),
    ])
}

fn table(day: &Day, found: &DayFound) -> Table {
    let caption = format!(
        "A day by parts: {}; limit {} MiB, storage `{}`, a background flush every {} scans. Memory, files and \
         bytes are the most of each part.",
        day.case.description(),
        day.memory_bytes >> 20,
        day.storage,
        day.flush_every_scans,
    );
    let columns = [
        "scans",
        "flushes",
        "CPU ms a scan",
        "median ms",
        "p99.9",
        "worst",
        "begin flush: worst ms",
        "resident MiB",
        "files",
        "map MiB",
        "log KiB",
        "tiles",
    ];
    let mut table = Table::new("day", caption, columns);
    let mut scans = 0;
    for part in &found.parts {
        scans += part.scans;
        table.push([
            Cell::Count(scans),
            Cell::Count(part.flushes),
            Cell::Number(part.cpu_ms, 2),
            Cell::Number(part.median_ms, 2),
            Cell::Number(part.p999_ms, 1),
            Cell::Number(part.worst_ms, 1),
            Cell::Number(part.begin_flush_ms, 1),
            Cell::Number(mib(part.resident_bytes as f64), 1),
            Cell::Count(part.files),
            Cell::Number(mib(part.map_bytes as f64), 1),
            Cell::Number(part.log_bytes as f64 / 1024.0, 0),
            Cell::Count(part.tiles),
        ]);
    }
    table
}

fn plot(found: &DayFound) -> Plot {
    let panel = |title: &str, y_label: &str, of: fn(&Part) -> f64| {
        let points = found.parts.iter().enumerate().map(|(number, part)| [(number + 1) as f64, of(part)]);
        let lines = vec![Line { name: title.to_owned(), points: points.collect() }];
        Panel {
            title: title.to_owned(),
            x_label: "part of the day".to_owned(),
            y_label: y_label.to_owned(),
            content: Content::Lines { x_scale: Scale::Linear, y_scale: Scale::Linear, lines },
        }
    };
    let caption = "Memory, disk and cost of a scan over a day of the same rounds".to_owned();
    let panels = vec![
        panel("resident memory", "MiB", |part| mib(part.resident_bytes as f64)),
        panel("map on disk", "MiB", |part| mib(part.map_bytes as f64)),
        panel("CPU", "ms a scan", |part| part.cpu_ms),
    ];
    Plot { file: "day", caption, panels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_after_the_middle_of_the_day_is_found() {
        let part = |grown: f64| Part {
            scans: 10,
            cpu_ms: 2.0 * grown,
            resident_bytes: (1e6 * grown) as u64,
            files: 100,
            map_bytes: (1_000.0 * grown) as u64,
            log_bytes: (1_000.0 * grown) as u64,
            ..Part::default()
        };
        let parts = vec![part(0.1), part(1.0), part(1.2)];
        let found = DayFound { parts, peak_resident_bytes: 0, scan_number: 30 };
        let most = [MAX_GROWTH, MAX_DISK_GROWTH];
        let kept: Vec<bool> = promises(&found, 30, most).unwrap().iter().map(Promise::is_kept).collect();
        assert_eq!(kept, [false, true, true, false, true, false]);
        assert!(promises(&DayFound { parts: vec![], ..found }, 30, most).is_err());
    }
}
