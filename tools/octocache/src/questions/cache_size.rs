//! Figure 23: hit rate of the cache by its size.

use crate::contender::Contender;
use crate::dataset::in_one_tile;
use crate::setting::Setting;
use anyhow::Result;
use report::Answer;
use report::plot::{Content, Line, Panel, Plot, Scale};
use report::{Cell, Table};
use voxtile::{InsertMode, VoxelCacheConfig};

const TAU: usize = 4;

pub fn answer(setting: &Setting) -> Result<Answer> {
    let exponents: &[u32] = setting.size(&[10, 12, 14, 16, 18, 20], &[8, 16]);
    let resolution_m = setting.size(0.2, 0.8);
    let columns = [
        "set",
        "buckets",
        "cells at most",
        "hit rate",
        "voxels written, by updates",
        "cells by nodes of the octree",
        "CPU ns an update",
    ];
    let caption = format!(
        "Updates that find their voxel in the cache, by the number of buckets of {TAU} cells; voxels of {resolution_m} m, \
         every ray counts, serial, one tile. One run: only the last column depends on the machine."
    );
    let mut table = Table::new("cache_size", caption, columns);
    let mut lines = Vec::new();
    for dataset in &setting.datasets {
        let scans = dataset.scans(setting.size(dataset.some_scans, 1))?;
        let (config, scans) = in_one_tile(resolution_m, scans)?;
        let config = config.with_insert_mode(InsertMode::PerRay);
        let mut points = Vec::new();
        for exponent in exponents {
            let buckets = 1_usize << exponent;
            let build = Contender::Serial.build(&config, VoxelCacheConfig::new(TAU, buckets), &scans)?;
            let octrees = &build.statistics.octrees;
            let counts = octrees.voxel_cache;
            let updates = (counts.hits + counts.misses).max(1) as f64;
            let cells = (buckets * TAU) as u64 * build.statistics.tiles;
            table.push([
                dataset.name.into(),
                (buckets as u64).into(),
                cells.into(),
                Cell::Share(counts.hit_rate()),
                Cell::Share(octrees.voxels_written as f64 / updates),
                Cell::Share(cells as f64 / build.statistics.cached.octree_nodes.max(1) as f64),
                Cell::Number(build.elapsed().cpu_s() * 1e9 / updates, 0),
            ]);
            points.push([cells as f64, counts.hit_rate()]);
        }
        lines.push(Line { name: dataset.name.to_owned(), points });
    }
    let panel = Panel {
        title: format!("voxels of {resolution_m} m, {TAU} cells a bucket"),
        x_label: "cells of the cache".to_owned(),
        y_label: "share of updates that hit".to_owned(),
        content: Content::Lines { x_scale: Scale::Log, y_scale: Scale::Linear, lines },
    };
    let caption = "Hit rate of the voxel cache by its size".to_owned();
    Ok(Answer { tables: vec![table], plots: vec![Plot { file: "cache_size", caption, panels: vec![panel] }] })
}
