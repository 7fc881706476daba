//! Time from a scan to the first answer that includes it.

use crate::contender::Contender;
use crate::dataset::map_config;
use crate::setting::Setting;
use anyhow::{Result, ensure};
use report::Answer;
use report::Samples;
use report::Stopwatch;
use report::plot::{Bars, Content, Panel, Plot};
use report::{Cell, Table};
use std::hint::black_box;
use voxtile::space::{Aabb, Grid, Point};
use voxtile::{
    InMemoryMapper, InsertMode, MapConfig, MapQueries, MapView, Mapper, Occupancy, Scan, VoxelCacheConfig,
};

/// Depth of the queried nodes: 8 x 8 x 8 voxels.
const DEPTH: u8 = 13;
const NODE_EDGE_VOXELS: i64 = 1 << (16 - DEPTH);
/// Number of queried points.
const PLACES: usize = 100;

/// Times from the call of `insert_scan`, scan by scan, in milliseconds.
#[derive(Default)]
struct Times {
    inserted_ms: Samples,
    first_ms: Samples,
    all_ms: Samples,
}

pub fn answer(setting: &Setting) -> Result<Answer> {
    let resolution_m = setting.size(0.1, 0.4);
    let columns = [
        "set",
        "counting",
        "contender",
        "insert_scan, median ms",
        "first answer, median ms",
        "first answer, 95 % ms",
        "100 answers, median ms",
        "by off",
    ];
    let caption = format!(
        "Wall time from handing in a scan to the return of `insert_scan`, to the first answer about a node of \
         {NODE_EDGE_VOXELS} x {NODE_EDGE_VOXELS} x {NODE_EDGE_VOXELS} voxels where the scan hit, and to {PLACES} of them; voxels \
         of {resolution_m} m, scan upon scan without a pause. Every answer was compared with the largest log-odds of the \
         node's voxels in the table, outside the time measured. *by off*: 100 answers."
    );
    let mut table = Table::new("first_answer", caption, columns);
    let mut panels = Vec::new();
    for (insert_mode, scans_factor, counting) in
        [(InsertMode::PerRay, 1, "every ray"), (InsertMode::PerScan, 2, "once a scan")]
    {
        let config = map_config(resolution_m)?.with_insert_mode(insert_mode);
        let mut sets = Vec::new();
        for dataset in &setting.datasets {
            let times =
                measure(&config, &dataset.scans(setting.size(dataset.some_scans * scans_factor, 1))?)?;
            for (contender, of_one) in Contender::ALL.into_iter().zip(&times) {
                let by_off = times[0].all_ms.median() / of_one.all_ms.median();
                table.push([dataset.name, counting, contender.name()].map(Cell::from).into_iter().chain([
                    Cell::Number(of_one.inserted_ms.median(), 2),
                    Cell::Number(of_one.first_ms.median(), 2),
                    Cell::Number(of_one.first_ms.quantile(0.95), 2),
                    Cell::Number(of_one.all_ms.median(), 2),
                    Cell::Number(by_off, 2),
                ]));
            }
            sets.push((dataset.name, times));
        }
        panels.push(panel(counting, &sets));
    }
    let caption = format!("Time from a scan to {PLACES} answers that know it");
    Ok(Answer { tables: vec![table], plots: vec![Plot { file: "first_answer", caption, panels }] })
}

fn panel(counting: &str, sets: &[(&str, [Times; 4])]) -> Panel {
    let series = Contender::ALL.into_iter().enumerate().map(|(number, contender)| {
        let values = sets.iter().map(|(_, times)| times[number].all_ms.median());
        (contender.name().to_owned(), values.collect())
    });
    let categories = sets.iter().map(|(set, _)| (*set).to_owned()).collect();
    Panel {
        title: counting.to_owned(),
        x_label: String::new(),
        y_label: format!("ms to {PLACES} answers"),
        content: Content::Bars(Bars { categories, series: series.collect(), are_stacked: false }),
    }
}

/// Runs the contenders in turn, scan by scan.
fn measure(config: &MapConfig, scans: &[Scan]) -> Result<[Times; 4]> {
    let mut times: [Times; 4] = Default::default();
    for (contender, times) in Contender::ALL.into_iter().zip(&mut times) {
        let mut mapper =
            InMemoryMapper::new(contender.configure(config.clone(), VoxelCacheConfig::default()))?;
        for scan in scans {
            measure_scan(&mut mapper, scan, times)?;
        }
    }
    Ok(times)
}

/// Inserts a scan, queries it, and checks the answers.
fn measure_scan(mapper: &mut InMemoryMapper, scan: &Scan, times: &mut Times) -> Result<()> {
    let places = places(scan);
    let mut answers = Vec::with_capacity(places.len());
    let stopwatch = Stopwatch::start()?;
    mapper.insert_scan(scan)?;
    let inserted = stopwatch.stop()?;
    let mut first = None;
    for &place in &places {
        answers.push(black_box(mapper.occupancy_at_depth(place, DEPTH)?));
        if first.is_none() {
            first = Some(stopwatch.stop()?);
        }
    }
    let all = stopwatch.stop()?;
    times.inserted_ms.push(inserted.wall_s * 1e3);
    times.first_ms.push(first.unwrap_or(all).wall_s * 1e3);
    times.all_ms.push(all.wall_s * 1e3);
    for (place, answer) in places.into_iter().zip(answers) {
        let truth = truth(mapper, place)?;
        ensure!(answer == truth, "{place:?} m: the octree has {answer:?}, the table {truth:?}");
    }
    Ok(())
}

/// Evenly chosen points of the scan.
fn places(scan: &Scan) -> Vec<Point> {
    let step = scan.points.len().div_ceil(PLACES).max(1);
    scan.points.iter().step_by(step).copied().collect()
}

/// Occupancy of the node around a point, from its voxels one by one.
fn truth(mapper: &InMemoryMapper, place: Point) -> Result<Occupancy> {
    let mut max: Option<f32> = None;
    if let Some(region) = node_at(&mapper.config().grid, place) {
        mapper.for_each_voxel_in(&region, |voxel| {
            let log_odds = voxel.evidence.log_odds as f32;
            max = Some(max.map_or(log_odds, |max| max.max(log_odds)));
        })?;
    }
    Ok(Occupancy::of_log_odds(mapper.config(), max.map(f64::from)))
}

/// Box of the node around a point; it contains the centers of exactly its voxels.
fn node_at(grid: &Grid, place: Point) -> Option<Aabb> {
    let first =
        grid.voxel_of(place)?.map(|index| i64::from(index).div_euclid(NODE_EDGE_VOXELS) * NODE_EDGE_VOXELS);
    let min = first.map(|index| index as f64 * grid.resolution_m());
    let max = first.map(|index| (index + NODE_EDGE_VOXELS) as f64 * grid.resolution_m());
    Some(Aabb::from_corners(min, max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::datasets;
    use std::path::Path;

    #[test]
    fn all_forms_of_octree_agree_with_the_table() {
        let scans = datasets(Path::new(""))[1].scans(2).unwrap();
        let config = map_config(0.2).unwrap();
        for contender in Contender::ALL {
            let config = contender.configure(config.clone(), VoxelCacheConfig::default());
            let mut mapper = InMemoryMapper::new(config).unwrap();
            let mut times = Times::default();
            for scan in &scans {
                measure_scan(&mut mapper, scan, &mut times).unwrap();
                assert!(places(scan).iter().any(|&place| truth(&mapper, place).unwrap().is_occupied()));
            }
            assert_eq!(truth(&mapper, [1e6; 3]).unwrap(), Occupancy::Unknown);
        }
    }
}
