//! Measures the insertion of a scan: in memory, into a quarter of its tiles, and out of core with much and with very
//! little memory.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use voxtile::mapper::MapView;
use voxtile::{InMemoryMapper, InsertMode, MapConfig, Mapper, OutOfCoreTileMapper, Scan, TileSelection};
use voxtile_simulation::Survey;

fn config() -> MapConfig {
    MapConfig::new(0.2, 10.0).expect("whole voxels").with_range(0.0, 60.0)
}

fn scans() -> Vec<Scan> {
    Survey::street(1).take(5).collect()
}

fn insert_all(mapper: &mut impl Mapper, scans: &[Scan]) {
    for scan in scans {
        mapper.insert_scan(scan).expect("a scan that can be mapped");
    }
}

fn street(criterion: &mut Criterion) {
    let scans = scans();
    let mut group = criterion.benchmark_group("five street scans at 0.2 m");
    group.sample_size(10);
    for (name, mode) in [("per scan", InsertMode::PerScan), ("per ray", InsertMode::PerRay)] {
        group.bench_function(format!("in memory, {name}"), |bencher| {
            let mapper =
                || InMemoryMapper::new(config().with_insert_mode(mode)).expect("a valid configuration");
            bencher.iter_batched_ref(mapper, |mapper| insert_all(mapper, &scans), BatchSize::PerIteration);
        });
    }
    let mut whole = InMemoryMapper::new(config()).expect("a valid configuration");
    insert_all(&mut whole, &scans);
    let tiles = whole.tile_indices();
    let quarter: TileSelection = tiles[..tiles.len() / 4].iter().copied().collect();
    group.bench_function("in memory, a quarter of the tiles", |bencher| {
        let mapper = || InMemoryMapper::new(config()).expect("a valid configuration");
        let insert = |mapper: &mut InMemoryMapper| {
            for scan in &scans {
                mapper.insert_points_in(scan, &quarter).expect("a scan that can be mapped");
            }
        };
        bencher.iter_batched_ref(mapper, insert, BatchSize::PerIteration);
    });
    for (name, cache_tiles, write_buffer_bytes) in [("with room", 1000, 0), ("four tiles", 4, 1 << 20)] {
        group.bench_function(format!("out of core, {name}, flushed"), |bencher| {
            let config = config().with_cache_tiles(cache_tiles).with_write_buffer_bytes(write_buffer_bytes);
            let folder = || tempfile::tempdir().expect("room for a map");
            let build = |folder: &mut tempfile::TempDir| {
                let path = folder.path().join("map");
                let mut mapper = OutOfCoreTileMapper::create(path, config.clone()).expect("an empty folder");
                insert_all(&mut mapper, &scans);
                mapper.flush().expect("room on the disk");
            };
            bencher.iter_batched_ref(folder, build, BatchSize::PerIteration);
        });
    }
    group.finish();
}

criterion_group!(benches, street);
criterion_main!(benches);
