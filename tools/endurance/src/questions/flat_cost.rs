//! Is the cost of a scan independent of the distance travelled and of the number of tiles?

use crate::build::{Build, Built, ScanCost};
use crate::case::{Case, Limit};
use crate::findings::Findings;
use crate::promise::{Promise, Wanted};
use crate::setting::{RAYS, Setting, synthetic};
use crate::task::ChildTask;
use anyhow::Result;
use report::plot::{Content, Line, Panel, Plot, Scale};
use report::{Cell, Samples, Table};
use workload::SurveyName;

/// Number of scans generated before they are inserted one after another.
const SCANS_AT_A_TIME: usize = 50;
/// Maximum ratio of the cost of a scan in the last stretch of the trajectory to that in the second stretch.
const MAX_GROWTH: f64 = 1.15;
/// Maximum ratio of the 99th percentile to the median.
const MAX_SLOW: f64 = 3.0;
const WINDOWS: usize = 40;

/// Name of a clock, and the time that it measured for a scan.
type Clock = (&'static str, fn(&ScanCost) -> f64);
const CLOCKS: [Clock; 2] = [("CPU", |scan| scan.cpu_ms), ("wall", |scan| scan.wall_ms)];

/// A trajectory and its evaluation.
struct Trajectory {
    case: Case,
    stretch_m: f64,
    /// Names of the table of stretches, the table of latencies and the plot.
    files: [&'static str; 3],
}

pub fn answer(setting: &Setting) -> Result<Findings> {
    let way = |metres| (SurveyName::Drive, RAYS, metres);
    let long = Trajectory {
        case: synthetic("drive", way(setting.size(20_000, 300)), [0.2, 10.0, 60.0]),
        stretch_m: setting.size(1_000.0, 50.0),
        files: ["flat_cost", "latency", "flat_cost"],
    };
    let small_tiles = Trajectory {
        case: synthetic("small tiles", way(setting.size(3_000, 60)), [0.1, 2.5, 60.0]),
        stretch_m: setting.size(500.0, 20.0),
        files: ["flat_cost_small_tiles", "latency_small_tiles", "flat_cost_small_tiles"],
    };
    let limit_mib = setting.size(64, 24);
    let mut findings = Findings::default();
    for Trajectory { case, stretch_m, files: [of_stretches, of_latencies, of_plot] } in [long, small_tiles] {
        let build = Build {
            scans_at_a_time: SCANS_AT_A_TIME,
            has_digest: false,
            ..setting.build(&case, Limit::Bytes(limit_mib << 20))
        };
        let built = build.clone().run_in_child()?;
        findings.keep_build(&build, &built)?;
        findings.promises.extend(promises(&case.name, &built, stretch_m));
        let tiles = built.tiles;
        let what = format!("{}, limit {limit_mib} MiB, {tiles} tiles", case.description());
        let tables =
            [stretches(of_stretches, &built, stretch_m, &what), latencies(of_latencies, &built, &what)];
        findings.answer.tables.extend(tables);
        findings.answer.plots.push(plot(of_plot, &built, &case.name));
    }
    Ok(findings)
}

fn promises(case: &str, built: &Built, stretch_m: f64) -> Vec<Promise> {
    let growth = CLOCKS.map(|(clock, time_of)| {
        let [second, last] = [stretch(built, stretch_m, 1), last_stretch(built, stretch_m)];
        let growth = mean(last, time_of) / mean(second, time_of);
        let what = format!("{case}: {clock} of a scan, last stretch by second");
        Promise::about_time(what, growth, Wanted::AtMost(MAX_GROWTH), "")
    });
    let wall_ms = samples(evicting(built), |scan| scan.wall_ms);
    let slow = wall_ms.quantile(0.99) / wall_ms.median();
    let what = format!("{case}: wall of the 99th percentile by the median, while tiles are evicted");
    growth.into_iter().chain([Promise::about_time(what, slow, Wanted::AtMost(MAX_SLOW), "")]).collect()
}

/// The scans of a stretch of the trajectory, counted from 0.
fn stretch(built: &Built, stretch_m: f64, number: usize) -> &[ScanCost] {
    let from = |metres: f64| built.scans.partition_point(|scan| scan.distance_m < metres);
    let begin_m = number as f64 * stretch_m;
    &built.scans[from(begin_m)..from(begin_m + stretch_m)]
}

/// The scans of the last complete stretch.
fn last_stretch(built: &Built, stretch_m: f64) -> &[ScanCost] {
    let end_m = built.scans.last().map_or(0.0, |scan| scan.distance_m);
    let first = built.scans.partition_point(|scan| scan.distance_m <= end_m - stretch_m);
    &built.scans[first..]
}

/// The scans during which tiles are evicted: those after the first write.
fn evicting(built: &Built) -> &[ScanCost] {
    // Before the first eviction, only the metadata and the log of the new map are written.
    let begin = built.scans.first().map_or(0, |scan| scan.bytes_written);
    &built.scans[built.scans.partition_point(|scan| scan.bytes_written <= begin)..]
}

fn samples(scans: &[ScanCost], time_of: impl Fn(&ScanCost) -> f64) -> Samples {
    scans.iter().map(time_of).collect()
}

fn mean(scans: &[ScanCost], time_of: impl Fn(&ScanCost) -> f64) -> f64 {
    scans.iter().map(time_of).sum::<f64>() / scans.len() as f64
}

fn stretches(file: &'static str, built: &Built, stretch_m: f64, what: &str) -> Table {
    let caption = format!("Mean milliseconds a scan, by stretches of {} km; {what}.", stretch_m / 1e3);
    let columns = ["from km", "CPU ms", "wall ms", "scans"];
    let mut table = Table::new(file, caption, columns);
    let end_m = built.scans.last().map_or(0.0, |scan| scan.distance_m);
    for number in 0..(end_m / stretch_m).ceil() as usize {
        let scans = stretch(built, stretch_m, number);
        let [cpu_ms, wall_ms] = CLOCKS.map(|(_, time_of)| Cell::Number(mean(scans, time_of), 2));
        let from_km = Cell::Number(number as f64 * stretch_m / 1e3, 2);
        table.push([from_km, cpu_ms, wall_ms, Cell::Count(scans.len() as u64)]);
    }
    table
}

fn latencies(file: &'static str, built: &Built, what: &str) -> Table {
    let caption = format!(
        "Wall milliseconds of `insert_scan`: of all scans, and of those while tiles are evicted; {what}."
    );
    let columns = ["scans", "how many", "median", "p90", "p99", "worst", "p99 by median"];
    let mut table = Table::new(file, caption, columns);
    for (name, scans) in [("all", &built.scans[..]), ("while tiles are evicted", evicting(built))] {
        let wall_ms = samples(scans, |scan| scan.wall_ms);
        let of = |share| Cell::Number(wall_ms.quantile(share), 2);
        table.push([
            name.into(),
            Cell::Count(scans.len() as u64),
            of(0.5),
            of(0.9),
            of(0.99),
            of(1.0),
            Cell::Number(wall_ms.quantile(0.99) / wall_ms.median(), 2),
        ]);
    }
    table
}

fn plot(file: &'static str, built: &Built, case: &str) -> Plot {
    let window = built.scans.len().div_ceil(WINDOWS).max(1);
    let panels = CLOCKS.map(|(clock, time_of)| {
        let lines = [("median", 0.5), ("p99", 0.99)].map(|(name, share)| {
            let points = built
                .scans
                .chunks(window)
                .map(|scans| [scans[0].distance_m / 1e3, samples(scans, time_of).quantile(share)]);
            Line { name: name.to_owned(), points: points.collect() }
        });
        Panel {
            title: clock.to_owned(),
            x_label: "distance, km".to_owned(),
            y_label: "ms a scan".to_owned(),
            content: Content::Lines { x_scale: Scale::Linear, y_scale: Scale::Linear, lines: lines.into() },
        }
    });
    let caption = format!("Milliseconds a scan over distance, {case}, in windows of {window} scans");
    Plot { file, caption, panels: panels.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scan every metre, without eviction before the hundredth.
    fn built(metres: usize) -> Built {
        let scans = (0..metres).map(|k| ScanCost {
            distance_m: k as f64,
            wall_ms: if k >= 100 && k % 20 == 0 { 50.0 } else { 10.0 },
            cpu_ms: 5.0 + (k / 100) as f64,
            resident_bytes: 0,
            flush_ms: 0.0,
            bytes_written: 700 + k.saturating_sub(99) as u64,
        });
        Built { scans: scans.collect(), ..Built::default() }
    }

    #[test]
    fn stretches_are_by_distance_and_the_last_is_whole() {
        let built = built(450);
        let second: Vec<f64> = stretch(&built, 100.0, 1).iter().map(|scan| scan.distance_m).collect();
        assert_eq!((second.len(), second[0]), (100, 100.0));
        let last = last_stretch(&built, 100.0);
        assert_eq!((last.len(), last[0].distance_m), (100, 350.0));
        assert_eq!(evicting(&built)[0].distance_m, 100.0);
    }

    #[test]
    fn growth_and_slow_scans_are_found() {
        let promises = promises("way", &built(400), 100.0);
        let found: Vec<f64> = promises.iter().map(|promise| promise.found).collect();
        assert!((found[0] - 8.0 / 6.0).abs() < 1e-9 && !promises[0].is_kept(), "{found:?}");
        assert!((found[1] - 1.0).abs() < 1e-9 && promises[1].is_kept(), "{found:?}");
        assert!((found[2] - 5.0).abs() < 1e-9 && !promises[2].is_kept(), "{found:?}");
    }
}
