//! Figure 22 and table 3: times of the stages.

use crate::contender::{Build, Contender};
use crate::dataset::map_config;
use crate::setting::Setting;
use anyhow::Result;
use report::Answer;
use report::Samples;
use report::plot::{Bars, Content, Panel, Plot};
use report::{Cell, Table};
use voxtile::{InsertMode, VoxelCacheConfig};

const OCTREE_UPDATE: &str = "octree update";
/// Stages of the mapping thread, in the order of the stack.
const STAGES: [&str; 8] = [
    "ray tracing",
    "table",
    "cache insertion",
    "cache eviction",
    "into the queue",
    "waiting for room",
    OCTREE_UPDATE,
    "after the last scan",
];
/// Stages of the thread that writes trees.
const WORKER_STAGES: [&str; 3] = ["octree update, thread 2", "out of the queue, thread 2", "idle, thread 2"];

/// Milliseconds per scan in each stage, run by run.
#[derive(Default)]
struct Stages {
    own_ms: [Samples; 8],
    worker_ms: [Samples; 3],
    /// Voxels written to the trees per scan, and the part after the last scan.
    written: [f64; 2],
}

pub fn answer(setting: &Setting) -> Result<Answer> {
    let resolution_m = setting.size(0.2, 0.4);
    let mut tables = Vec::new();
    let mut plots = Vec::new();
    let workflows = [
        (InsertMode::PerRay, 3, "every ray counts", "stages_every_ray"),
        (InsertMode::PerScan, 6, "once a scan", "stages_once_a_scan"),
    ];
    for (insert_mode, times_scans, what, file) in workflows {
        let columns = ["set", "contender"]
            .into_iter()
            .chain(STAGES)
            .chain(WORKER_STAGES)
            .chain(["voxels written", "of these after the last scan"]);
        let caption = format!("Milliseconds a scan in each stage, voxels of {resolution_m} m, {what}.");
        let mut panels = Vec::new();
        let mut table = Table::new(file, caption, columns);
        for dataset in &setting.datasets {
            let scans = dataset.scans(setting.size(dataset.some_scans * times_scans, 1))?;
            let config = map_config(resolution_m)?.with_insert_mode(insert_mode);
            let contenders = [Contender::Off, Contender::Serial, Contender::Parallel];
            let mut stages: [Stages; 3] = Default::default();
            for _ in 0..setting.runs.min(2) {
                for (contender, stages) in contenders.into_iter().zip(&mut stages) {
                    let build = contender.build(&config, VoxelCacheConfig::default(), &scans)?;
                    stages.push(&build, scans.len() as f64);
                }
            }
            for (contender, stages) in contenders.into_iter().zip(&stages) {
                let medians = stages.own_ms.iter().chain(&stages.worker_ms).map(Samples::median);
                let mut row: Vec<Cell> = vec![dataset.name.into(), contender.name().into()];
                row.extend(medians.map(|ms| Cell::Number(ms, 2)));
                row.extend(stages.written.map(|voxels| Cell::Count(voxels.round() as u64)));
                table.push(row);
            }
            panels.push(panel(dataset.name, &contenders, &stages));
        }
        tables.push(table);
        let caption = format!(
            "Where the time of a scan goes, {what}: the mapping thread, and for the last contender the thread that writes trees"
        );
        plots.push(Plot { file, caption, panels });
    }
    Ok(Answer { tables, plots })
}

/// One bar for each contender, and one for the second thread of the last.
fn panel(title: &str, contenders: &[Contender], stages: &[Stages]) -> Panel {
    let mut categories: Vec<String> =
        contenders.iter().map(|contender| contender.name().to_owned()).collect();
    categories.push("thread 2".to_owned());
    let own = STAGES.iter().enumerate().map(|(stage, name)| {
        let mut values: Vec<f64> = stages.iter().map(|stages| stages.own_ms[stage].median()).collect();
        // The update has the same color in both threads.
        let is_octree_update = *name == OCTREE_UPDATE;
        let of_worker = stages.last().map_or(0.0, |last| last.worker_ms[0].median());
        values.push(if is_octree_update { of_worker } else { 0.0 });
        ((*name).to_owned(), values)
    });
    Panel {
        title: title.to_owned(),
        x_label: String::new(),
        y_label: "ms a scan".to_owned(),
        content: Content::Bars(Bars { categories, series: own.collect(), are_stacked: true }),
    }
}

impl Stages {
    /// Adds a run over `scans` scans.
    fn push(&mut self, build: &Build, scans: f64) {
        let octrees = &build.inserted.octrees;
        let times = &octrees.times;
        let known = [
            times.table_update_ns,
            times.cache_insertion_ns,
            times.eviction_ns,
            times.enqueue_ns - times.enqueue_wait_ns,
            times.enqueue_wait_ns,
            times.octree_update_ns - times.worker_update_ns,
        ]
        .map(|ns| ns as f64 / 1e6);
        // The remaining time is ray tracing and passing the updates to the tiles.
        let rays_ms = (build.inserting.wall_s * 1e3 - known.iter().sum::<f64>()).max(0.0);
        let own = [rays_ms].into_iter().chain(known).chain([build.draining.wall_s * 1e3]);
        self.own_ms.iter_mut().zip(own).for_each(|(samples, ms)| samples.push(ms / scans));
        let worker_update_ms = times.worker_update_ns as f64 / 1e6;
        let dequeue_ms = (build.inserting.others_s * 1e3 - worker_update_ms).max(0.0);
        let worker = [worker_update_ms, dequeue_ms, times.worker_wait_ns as f64 / 1e6];
        self.worker_ms.iter_mut().zip(worker).for_each(|(samples, ms)| samples.push(ms / scans));
        let written = build.statistics.octrees.voxels_written;
        self.written = [written, written - octrees.voxels_written].map(|voxels| voxels as f64 / scans);
    }
}
