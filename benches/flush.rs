//! Measures the cost of durability: the time of a flush, and the part of it that waits for the storage medium.

use criterion::{BatchSize, Criterion, SamplingMode, criterion_group, criterion_main};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::store::{Disk, FsDisk};
use voxtile::{MapConfig, MapPath, MapView, Mapper, OutOfCoreTileMapper, Scan};
use voxtile_simulation::Survey;

fn disks() -> [(&'static str, Arc<dyn Disk>); 3] {
    [
        ("synced", Arc::new(FsDisk)),
        ("not synced", UnsyncedDisk::shared()),
        ("5 ms a sync", UnsyncedDisk::with_sync_time(Duration::from_millis(5))),
    ]
}

/// The cache holds all tiles, so that only flushes write.
fn config() -> MapConfig {
    MapConfig::new(0.2, 10.0).expect("whole voxels").with_range(0.0, 30.0).with_cache_tiles(1000)
}

/// Creates a temporary folder in the build folder, because the system's temporary folder may be in memory.
fn temporary_folder() -> TempDir {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder in the build directory")
}

fn new_mapper(disk: &Arc<dyn Disk>, folder: &TempDir) -> OutOfCoreTileMapper {
    let path = folder.path().join("map");
    OutOfCoreTileMapper::create(MapPath::on(disk.clone(), &path), config()).expect("an empty folder")
}

fn build(criterion: &mut Criterion) {
    let scans: Vec<Scan> = Survey::street(1).take(3).collect();
    let mut group = criterion.benchmark_group("three street scans at 0.2 m");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(5));
    for (flushed, flush_interval) in [("flushed at the end", scans.len()), ("flushed after each", 1)] {
        for (name, disk) in disks() {
            let build = |folder: &mut TempDir| {
                let mut mapper = new_mapper(&disk, folder);
                for chunk in scans.chunks(flush_interval) {
                    for scan in chunk {
                        mapper.insert_scan(scan).expect("a scan that can be mapped");
                    }
                    mapper.flush().expect("room on the disk");
                }
            };
            group.bench_function(format!("{flushed}, {name}"), |bencher| {
                bencher.iter_batched_ref(temporary_folder, build, BatchSize::PerIteration);
            });
        }
    }
    group.finish();
}

fn flush(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one flush");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(5));
    for mib in [16, 64] {
        for (name, disk) in disks() {
            let folder = temporary_folder();
            let mut grown = None;
            group.bench_function(format!("dirty tiles of {mib} MiB, {name}"), |bencher| {
                let (mapper, scans) = grown.get_or_insert_with(|| {
                    let mut mapper = new_mapper(&disk, &folder);
                    let scans = grow(&mut mapper, mib << 20);
                    (mapper, scans)
                });
                bencher.iter_custom(|iterations| (0..iterations).map(|_| time_flush(mapper, scans)).sum());
            });
        }
    }
    group.finish();
}

/// Maps the street, one scan every 10 m, until the tiles in memory have `bytes` bytes.
fn grow(mapper: &mut OutOfCoreTileMapper, bytes: u64) -> Vec<Scan> {
    let mut scans = Vec::new();
    for scan in Survey::street(1).step_by(10) {
        mapper.insert_scan(&scan).expect("a scan that can be mapped");
        scans.push(scan);
        if mapper.statistics().cached.bytes() >= bytes {
            break;
        }
    }
    let in_memory = mapper.statistics();
    mapper.flush().expect("room on the disk");
    let (tiles, memory_mib) = (in_memory.dirty_tiles, in_memory.cached.bytes() >> 20);
    let disk_mib = mapper.statistics().disk_bytes >> 20;
    eprintln!("{} scans, {tiles} tiles of {memory_mib} MiB in memory, {disk_mib} MiB on disk", scans.len());
    scans
}

/// Inserts the scans, which makes all tiles dirty, and returns the time of the flush.
fn time_flush(mapper: &mut OutOfCoreTileMapper, scans: &[Scan]) -> Duration {
    for scan in scans {
        mapper.insert_scan(scan).expect("a scan that can be mapped");
    }
    let statistics = mapper.statistics();
    assert_eq!(statistics.dirty_tiles, statistics.tiles, "a flush of every tile");
    let start = Instant::now();
    mapper.flush().expect("room on the disk");
    start.elapsed()
}

criterion_group!(benches, build, flush);
criterion_main!(benches);
