//! How long does an update of a voxel take in a tile's table?

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use std::collections::BTreeMap;
use voxtile::scan::{ScanTracer, ScanUpdates};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::simulation::Survey;
use voxtile::space::TileIndex;
use voxtile::tile::Table;
use voxtile::{InsertMode, MapConfig};

type Tables = BTreeMap<TileIndex, Table>;

fn apply(tables: &mut Tables, config: &MapConfig, updates: &ScanUpdates) {
    let model = &config.sensor_model;
    for (tile, updates) in &updates.tiles {
        let table = tables.entry(*tile).or_default();
        table.apply(model, config.grid.voxels_of_tile(*tile).min, updates);
    }
}

fn bench(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, config: &MapConfig) {
    let scan = Survey::street(1).next().expect("a survey never ends");
    let updates = ScanTracer::default()
        .trace(&config.grid, &config.sensor_model, &config.rays, &scan)
        .expect("a good scan");
    group.throughput(Throughput::Elements(updates.tiles.iter().map(|(_, tile)| tile.len() as u64).sum()));
    group.bench_function(format!("{name}, fresh"), |bencher| {
        bencher.iter_batched_ref(
            Tables::new,
            |tables| apply(tables, config, &updates),
            BatchSize::PerIteration,
        );
    });
    let mut tables = Tables::new();
    apply(&mut tables, config, &updates);
    group.bench_function(format!("{name}, revisited"), |bencher| {
        bencher.iter(|| apply(&mut tables, config, &updates));
    });
}

fn street(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("updates by a street scan at 0.2 m");
    group.sample_size(20);
    for (model_name, model) in
        [("log-odds", SensorModel::default()), ("iwlo", SensorModel::Iwlo(Iwlo::default()))]
    {
        for (mode_name, mode) in [("per scan", InsertMode::PerScan), ("per ray", InsertMode::PerRay)] {
            let config = MapConfig::new(0.2, 10.0).expect("whole voxels").with_range(0.0, 60.0);
            let config = config.with_sensor_model(model).with_insert_mode(mode);
            bench(&mut group, &format!("{model_name}, {mode_name}"), &config);
        }
    }
    group.finish();
}

criterion_group!(benches, street);
criterion_main!(benches);
