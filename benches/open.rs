//! Measures the time to open a map of 100 000 tiles, and the memory per tile.

use criterion::{BatchSize, Criterion, SamplingMode, criterion_group, criterion_main};
use std::path::Path;
use std::time::{Duration, Instant};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::scan::PointBatch;
use voxtile::space::Point;
use voxtile::{MapConfig, MapPath, MapReader, MapView, Mapper, OutOfCoreTileMapper};

const TILES: i32 = 100_000;
const TILES_A_FLUSH: i32 = 10_000;

fn open(criterion: &mut Criterion) {
    // In the build folder, because the system's folder for temporary files may be in memory.
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder in the build directory");
    let path = folder.path().join("map");
    let start = Instant::now();
    let config = make_map(&path);
    eprintln!("{TILES} tiles made in {:.1} s", start.elapsed().as_secs_f64());
    print_memory(&path);

    let open_reader = || MapReader::open(&path, 0).expect("a map");
    let open_mapper = || OutOfCoreTileMapper::open(&path, config.clone()).expect("a map");
    let mut group = criterion.benchmark_group("open 100 000 tiles");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(5));
    // Batches exclude the drop of the opened map from the time.
    group.bench_function("reader", |bencher| {
        bencher.iter_batched(|| (), |()| open_reader(), BatchSize::PerIteration);
    });
    group.bench_function("mapper", |bencher| {
        bencher.iter_batched(|| (), |()| open_mapper(), BatchSize::PerIteration);
    });
    group.finish();
}

/// Creates a map whose tiles have one voxel each.
fn make_map(path: &Path) -> MapConfig {
    // All updates of a flush are buffered, so that each tile is loaded once.
    let config = MapConfig::new(0.2, 10.0).expect("whole voxels").with_write_buffer_bytes(1 << 30);
    let disk = UnsyncedDisk::shared();
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(disk, path), config.clone()).expect("an empty folder");
    for first in (0..TILES).step_by(TILES_A_FLUSH as usize) {
        let center = |index: i32| 10.0 * f64::from(index) + 5.0;
        let tiles = first..first + TILES_A_FLUSH;
        let points: Vec<Point> = tiles.map(|n| [center(n % 400), center(n / 400), 5.0]).collect();
        let is_occupied = vec![true; points.len()];
        let batch = PointBatch { points: &points, intensities: None, is_occupied: &is_occupied };
        mapper.batch_update(&batch).expect("points that can be mapped");
        mapper.flush().expect("room on the disk");
    }
    assert_eq!(mapper.statistics().tiles, TILES as u64);
    config
}

fn print_memory(path: &Path) {
    const READERS: usize = 10;
    let mut readers = vec![MapReader::open(path, 0).expect("a map")];
    // The first reader may reuse memory freed during the creation of the map; the others show the memory per reader.
    let Some(before) = resident_bytes() else {
        eprintln!("memory of an open map: skipped, there is no /proc/self/status here");
        return;
    };
    readers.extend((0..READERS).map(|_| MapReader::open(path, 0).expect("a map")));
    let bytes = resident_bytes().unwrap_or_default().saturating_sub(before);
    eprintln!("memory of an open map: {} bytes a tile", bytes / (READERS * TILES as usize));
}

fn resident_bytes() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<usize>().ok()? << 10)
}

criterion_group!(benches, open);
criterion_main!(benches);
