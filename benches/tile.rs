//! Measures the time per voxel for updating a tile's table, and for encoding and decoding its compact form.

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use std::collections::BTreeMap;
use voxtile::scan::{ScanTracer, ScanUpdates};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::space::TileIndex;
use voxtile::tile::Table;
use voxtile::tile::format::{CompactEffort, CompactReader, CompactWriter};
use voxtile::{InsertMode, MapConfig};
use voxtile_simulation::Survey;

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

/// Tables of a drive of twenty scans, written and read again.
fn compact(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("the compact form of a street at 0.2 m");
    group.sample_size(20);
    for (name, model) in [("log-odds", SensorModel::default()), ("iwlo", SensorModel::Iwlo(Iwlo::default()))]
    {
        let config = MapConfig::new(0.2, 10.0).expect("whole voxels").with_range(0.0, 60.0);
        let config = config.with_sensor_model(model);
        let mut tables = Tables::new();
        let mut tracer = ScanTracer::default();
        for scan in Survey::street(1).take(20) {
            let updates = tracer.trace(&config.grid, &model, &config.rays, &scan).expect("a good scan");
            apply(&mut tables, &config, &updates);
        }
        group.throughput(Throughput::Elements(tables.values().map(|table| table.len() as u64).sum()));
        for (effort_name, effort) in [("fast", CompactEffort::Fast), ("small", CompactEffort::Small)] {
            let mut writer = CompactWriter::new(effort).expect("a writer");
            group.bench_function(format!("{name}, {effort_name}"), |bencher| {
                bencher.iter(|| compact_tables(&mut writer, &tables));
            });
        }
        let bytes = compact_tables(&mut CompactWriter::new(CompactEffort::Fast).expect("a writer"), &tables);
        let mut reader = CompactReader::new().expect("a reader");
        group.bench_function(format!("{name}, read"), |bencher| {
            let mut read = |(tile, bytes): (&TileIndex, &Vec<u8>)| {
                let voxels = config.grid.voxels_of_tile(*tile);
                reader.read(&mut &bytes[..], bytes.len() as u64, &voxels).expect("what was written")
            };
            bencher.iter_with_large_drop(|| tables.keys().zip(&bytes).map(&mut read).collect::<Vec<_>>());
        });
    }
    group.finish();
}

fn compact_tables(writer: &mut CompactWriter, tables: &Tables) -> Vec<Vec<u8>> {
    let compact = |table| {
        let mut bytes = Vec::new();
        writer.write(table, &mut bytes).expect("memory takes all");
        bytes
    };
    tables.values().map(compact).collect()
}

criterion_group!(benches, street, compact);
criterion_main!(benches);
