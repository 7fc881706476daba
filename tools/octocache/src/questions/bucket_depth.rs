//! Figure 24: the shape of the cache, few deep buckets or many shallow ones.

use crate::contender::Contender;
use crate::dataset::{Dataset, in_one_tile};
use crate::setting::Setting;
use anyhow::Result;
use report::Answer;
use report::Samples;
use report::plot::{Content, Line, Panel, Plot, Scale};
use report::{Cell, Table};
use voxtile::{InMemoryMapper, InsertMode, MapConfig, MapView, Mapper, Scan, VoxelCacheConfig};

const TAUS: [usize; 5] = [1, 2, 4, 8, 16];
/// The value of the paper, where both series meet.
const USUAL_TAU: usize = 4;

/// A shape of the cache, and its measurements.
struct Shape {
    is_constant_size: bool,
    cache: VoxelCacheConfig,
    buckets: usize,
    ns_per_update: Samples,
    hit_rate: f64,
}

pub fn answer(setting: &Setting) -> Result<Answer> {
    let resolution_m = setting.size(0.2, 0.8);
    let columns = ["set", "kept the same", "tau", "buckets", "hit rate", "CPU ns an update", "spread"];
    let caption = format!(
        "Hit rate and time by tau, at the same number of cells (w tau) and at the same number of buckets (w); voxels of \
         {resolution_m} m, every ray counts, serial, one tile; at tau = {USUAL_TAU} the cache has 3 to 6 cells for every \
         voxel of a scan. Time is of the whole construction, rays included, median of the runs."
    );
    let mut table = Table::new("bucket_depth", caption, columns);
    let mut panels: Vec<(bool, &str, Vec<Line>)> = Vec::new();
    for is_constant_size in [true, false] {
        panels.push((is_constant_size, "CPU ns an update", Vec::new()));
        panels.push((is_constant_size, "share of updates that hit", Vec::new()));
    }
    for dataset in &setting.datasets {
        let shapes = measure(setting, dataset, resolution_m)?;
        for shape in &shapes {
            table.push([
                dataset.name.into(),
                kept(shape.is_constant_size).into(),
                (shape.cache.tau as u64).into(),
                (shape.buckets as u64).into(),
                Cell::Share(shape.hit_rate),
                Cell::Number(shape.ns_per_update.median(), 0),
                Cell::Share(shape.ns_per_update.spread()),
            ]);
        }
        for (is_constant_size, label, lines) in &mut panels {
            let points =
                shapes.iter().filter(|shape| shape.is_constant_size == *is_constant_size).map(|shape| {
                    let is_time = *label == "CPU ns an update";
                    [
                        shape.cache.tau as f64,
                        if is_time { shape.ns_per_update.median() } else { shape.hit_rate },
                    ]
                });
            lines.push(Line { name: dataset.name.to_owned(), points: points.collect() });
        }
    }
    let panels = panels.into_iter().map(|(is_constant_size, label, lines)| Panel {
        title: format!("{} the same", kept(is_constant_size)),
        x_label: "tau".to_owned(),
        y_label: label.to_owned(),
        content: Content::Lines { x_scale: Scale::Log, y_scale: Scale::Linear, lines },
    });
    let caption = "Time of an update and hit rate by tau".to_owned();
    let plot = Plot { file: "bucket_depth", caption, panels: panels.collect() };
    Ok(Answer { tables: vec![table], plots: vec![plot] })
}

fn kept(is_constant_size: bool) -> &'static str {
    if is_constant_size { "w tau" } else { "w" }
}

/// Builds with all shapes in turn.
fn measure(setting: &Setting, dataset: &Dataset, resolution_m: f64) -> Result<Vec<Shape>> {
    let scans = dataset.scans(setting.size(dataset.some_scans, 1))?;
    let (config, scans) = in_one_tile(resolution_m, scans)?;
    let config = config.with_insert_mode(InsertMode::PerRay);
    let usual_buckets =
        (3 * voxels_of_a_scan(&config, &scans)? / USUAL_TAU as u64).next_power_of_two() as usize;
    let mut shapes = Vec::new();
    for is_constant_size in [true, false] {
        for tau in TAUS {
            let buckets = if is_constant_size { usual_buckets * USUAL_TAU / tau } else { usual_buckets };
            let cache = VoxelCacheConfig::new(tau, buckets);
            shapes.push(Shape {
                is_constant_size,
                cache,
                buckets,
                ns_per_update: Samples::default(),
                hit_rate: 0.0,
            });
        }
    }
    for _ in 0..setting.runs {
        for shape in &mut shapes {
            let build = Contender::Serial.build(&config, shape.cache, &scans)?;
            let counts = build.statistics.octrees.voxel_cache;
            let updates = (counts.hits + counts.misses).max(1) as f64;
            shape.ns_per_update.push(build.elapsed().cpu_s() * 1e9 / updates);
            shape.hit_rate = counts.hit_rate();
        }
    }
    Ok(shapes)
}

/// Distinct voxels of a scan, on average.
fn voxels_of_a_scan(config: &MapConfig, scans: &[Scan]) -> Result<u64> {
    let mut voxels = 0;
    for scan in scans {
        let mut mapper = InMemoryMapper::new(config.clone())?;
        mapper.insert_scan(scan)?;
        voxels += mapper.statistics().cached.voxels;
    }
    Ok(voxels / scans.len().max(1) as u64)
}
