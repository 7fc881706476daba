//! Figures 20 and 21: time to build a map by resolution, with every form of octree.

use crate::contender::Contender;
use crate::dataset::{Dataset, map_config};
use crate::setting::Setting;
use anyhow::Result;
use report::Answer;
use report::Samples;
use report::plot::{Content, Line, Panel, Plot, Scale};
use report::{Cell, Table};
use voxtile::{InsertMode, VoxelCacheConfig};

/// One of the paper's two workflows.
struct Workflow {
    insert_mode: InsertMode,
    /// Multiple of each data set's `some_scans`.
    scans: usize,
    files: [&'static str; 4],
    caption: &'static str,
}

/// Times of a contender to build a map, run by run, in seconds.
#[derive(Default)]
struct Times {
    wall_s: Samples,
    /// CPU time of the mapping thread.
    own_s: Samples,
    /// CPU time of the thread that writes trees.
    others_s: Samples,
    /// Wall time of updating the trees after the last scan.
    draining_s: Samples,
}

/// A data set at a resolution, and the times of each contender.
struct Measured {
    set: &'static str,
    resolution_m: f64,
    scans: usize,
    times: [Times; 4],
}

/// Measures builds in which every ray counts, as in OctoMap's `insertPointCloudRays`. The paper calls this OctoMap.
pub fn every_ray(setting: &Setting) -> Result<Answer> {
    let files = ["every_ray_wall", "every_ray_cpu", "every_ray_seconds", "every_ray"];
    let caption = "Time to build a map where every ray counts, by resolution";
    answer(setting, &Workflow { insert_mode: InsertMode::PerRay, scans: 1, files, caption })
}

/// Measures builds in which duplicates are removed before the octree is updated. The paper calls this OctoMap-RT.
pub fn once_a_scan(setting: &Setting) -> Result<Answer> {
    let files = ["once_a_scan_wall", "once_a_scan_cpu", "once_a_scan_seconds", "once_a_scan"];
    let caption = "Time to build a map where a voxel counts once a scan, by resolution";
    answer(setting, &Workflow { insert_mode: InsertMode::PerScan, scans: 2, files, caption })
}

fn answer(setting: &Setting, workflow: &Workflow) -> Result<Answer> {
    let tenths: &[u32] = setting.size(&[1, 2, 3, 4, 5, 6, 7, 8, 9], &[4, 8]);
    let resolutions_m: Vec<f64> = tenths.iter().map(|&tenths| f64::from(tenths) / 10.0).collect();
    let mut measured = Vec::new();
    for dataset in &setting.datasets {
        for &resolution_m in &resolutions_m {
            measured.push(measure(setting, workflow, dataset, resolution_m)?);
        }
    }
    let wall = "How many times as fast as *off*, by resolution in metres; wall time from the first scan until everything is \
                in the trees, median of the runs.";
    let cpu = "The same in CPU time of the mapping thread: a second core reduces it, and other load of the machine does not affect it.";
    let tables = vec![
        ratios(workflow.files[0], wall, &measured, &resolutions_m, |times| &times.wall_s),
        ratios(workflow.files[1], cpu, &measured, &resolutions_m, |times| &times.own_s),
        seconds(workflow, &measured),
    ];
    let plot =
        Plot { file: workflow.files[3], caption: workflow.caption.to_owned(), panels: panels(&measured) };
    Ok(Answer { tables, plots: vec![plot] })
}

/// Runs the contenders in turn.
fn measure(setting: &Setting, workflow: &Workflow, dataset: &Dataset, resolution_m: f64) -> Result<Measured> {
    let scans = dataset.scans(setting.size(dataset.some_scans * workflow.scans, 1))?;
    let config = map_config(resolution_m)?.with_insert_mode(workflow.insert_mode);
    let mut times: [Times; 4] = Default::default();
    for _ in 0..setting.runs {
        for (contender, times) in Contender::ALL.into_iter().zip(&mut times) {
            let build = contender.build(&config, VoxelCacheConfig::default(), &scans)?;
            let took = build.elapsed();
            times.wall_s.push(took.wall_s);
            times.own_s.push(took.own_s);
            times.others_s.push(took.others_s);
            times.draining_s.push(build.draining.wall_s);
        }
    }
    Ok(Measured { set: dataset.name, resolution_m, scans: scans.len(), times })
}

/// Speed relative to that without a cache, one row per set and contender.
fn ratios(
    file: &'static str,
    caption: &str,
    measured: &[Measured],
    resolutions_m: &[f64],
    time_of: impl Fn(&Times) -> &Samples,
) -> Table {
    let columns = ["set", "contender"].map(str::to_owned).into_iter();
    let columns = columns.chain(resolutions_m.iter().map(|resolution_m| format!("{resolution_m}")));
    let mut table = Table::new(file, caption, columns);
    for of_set in measured.chunks(resolutions_m.len()) {
        for (number, contender) in Contender::ALL.into_iter().enumerate().skip(1) {
            let mut row: Vec<Cell> = vec![of_set[0].set.into(), contender.name().into()];
            row.extend(of_set.iter().map(|measured| {
                let [off, other] = [0, number].map(|number| time_of(&measured.times[number]).median());
                Cell::Number(off / other, 2)
            }));
            table.push(row);
        }
    }
    table
}

fn seconds(workflow: &Workflow, measured: &[Measured]) -> Table {
    let caption =
        "The times in seconds, and the spread of the runs (largest less smallest by median), are in a file.";
    let columns = [
        "set",
        "scans",
        "resolution m",
        "contender",
        "wall s",
        "of that after the last scan s",
        "CPU s of the mapping thread",
        "CPU s of the thread that writes trees",
        "spread of wall",
        "spread of CPU",
    ];
    let mut table = Table::new(workflow.files[2], caption, columns).only_csv();
    for Measured { set, resolution_m, scans, times } in measured {
        for (contender, times) in Contender::ALL.into_iter().zip(times) {
            table.push([
                (*set).into(),
                (*scans as u64).into(),
                Cell::Number(*resolution_m, 1),
                contender.name().into(),
                Cell::Number(times.wall_s.median(), 3),
                Cell::Number(times.draining_s.median(), 3),
                Cell::Number(times.own_s.median(), 3),
                Cell::Number(times.others_s.median(), 3),
                Cell::Share(times.wall_s.spread()),
                Cell::Share(times.own_s.spread()),
            ]);
        }
    }
    table
}

fn panels(measured: &[Measured]) -> Vec<Panel> {
    let of_sets = measured.chunk_by(|a, b| a.set == b.set);
    let panels = of_sets.map(|of_set| {
        let lines = Contender::ALL.into_iter().enumerate().map(|(number, contender)| {
            let points = of_set.iter().map(|measured| {
                let ms = measured.times[number].wall_s.median() * 1e3 / measured.scans as f64;
                [measured.resolution_m, ms]
            });
            Line { name: contender.name().to_owned(), points: points.collect() }
        });
        Panel {
            title: of_set[0].set.to_owned(),
            x_label: "resolution, m".to_owned(),
            y_label: "wall ms a scan".to_owned(),
            content: Content::Lines { x_scale: Scale::Linear, y_scale: Scale::Log, lines: lines.collect() },
        }
    });
    panels.collect()
}
