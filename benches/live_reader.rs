//! Measures the effect of a live reader on a mapper. The same scans are inserted with no reader, with an idle one, and
//! with one that queries 40 times a second: 20 rays of 50 m and 20 collisions each time, all as of one scan.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use voxtile::mapper::LiveReader;
use voxtile::{MapConfig, Mapper, OutOfCoreTileMapper, Queries, RayQuery, Scan, Shape, UnknownAs};
use voxtile_simulation::Survey;

/// Number of scans inserted before the measurement, and during it.
const SCANS: [usize; 2] = [20, 60];
const EVERY: Duration = Duration::from_millis(25);

fn mapper(scans: &[Scan]) -> (OutOfCoreTileMapper, PathBuf) {
    let folder = std::env::temp_dir().join(format!("voxtile_live_reader_{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    let config = MapConfig::new(0.1, 10.0).expect("whole voxels").with_range(0.5, 60.0);
    let config = config.with_memory_bytes(2 << 30);
    let mut mapper = OutOfCoreTileMapper::create(&folder, config).expect("an empty folder");
    scans.iter().for_each(|scan| insert(&mut mapper, scan));
    (mapper, folder)
}

fn insert(mapper: &mut OutOfCoreTileMapper, scan: &Scan) {
    mapper.insert_scan(scan).expect("a scan that can be mapped");
}

fn ask(reader: &LiveReader, eye: [f64; 3]) -> usize {
    let view = reader.view();
    let rays: Vec<RayQuery> = (0..20)
        .map(|k| {
            let azimuth = f64::from(k) * 0.314;
            let direction = [azimuth.cos(), azimuth.sin(), 0.02];
            RayQuery { origin: eye, direction, max_range_m: Some(50.0), unknown: UnknownAs::Free }
        })
        .collect();
    let hits = rays.iter().filter(|ray| view.cast_ray(ray).expect("a ray").is_some()).count();
    let bodies =
        (0..20).map(|k| Shape::Sphere { center: [eye[0], eye[1] + f64::from(k), eye[2]], radius_m: 0.5 });
    hits + bodies.filter(|body| view.collision(body, UnknownAs::Free).expect("a body").is_some()).count()
}

fn live_reader(criterion: &mut Criterion) {
    let scans: Vec<Scan> = Survey::tour(1, 30_000).take(SCANS[0] + SCANS[1]).collect();
    let (before, measured) = scans.split_at(SCANS[0]);
    let mut group = criterion.benchmark_group(format!("{} scans", SCANS[1]));
    group.sample_size(10);
    let all = |(mut mapper, folder): (OutOfCoreTileMapper, PathBuf)| {
        measured.iter().for_each(|scan| insert(&mut mapper, scan));
        (mapper, folder)
    };
    group.bench_function("no reader", |bencher| {
        bencher.iter_batched(|| mapper(before), all, BatchSize::PerIteration);
    });
    group.bench_function("idle reader", |bencher| {
        let open = || {
            let mapper = mapper(before);
            let reader = mapper.0.reader().expect("a map of this version");
            (mapper, reader)
        };
        bencher.iter_batched(open, |(mapper, reader)| (all(mapper), reader), BatchSize::PerIteration);
    });
    let (queries, micros) = (AtomicU64::new(0), AtomicU64::new(0));
    group.bench_function("reader at 40 Hz", |bencher| {
        bencher.iter_batched(
            || mapper(before),
            |mapper| {
                let reader = mapper.0.reader().expect("a map of this version");
                let is_over = AtomicBool::new(false);
                thread::scope(|scope| {
                    scope.spawn(|| {
                        while !is_over.load(Ordering::Relaxed) {
                            let since = Instant::now();
                            black_box(ask(&reader, measured[0].origin));
                            queries.fetch_add(1, Ordering::Relaxed);
                            micros.fetch_add(since.elapsed().as_micros() as u64, Ordering::Relaxed);
                            thread::sleep(EVERY.saturating_sub(since.elapsed()));
                        }
                    });
                    let mapped = all(mapper);
                    is_over.store(true, Ordering::Relaxed);
                    mapped
                })
            },
            BatchSize::PerIteration,
        );
    });
    group.finish();
    let (queries, micros) = (queries.into_inner(), micros.into_inner());
    println!("queries {queries} times, {} us each", micros / queries.max(1));
}

criterion_group!(benches, live_reader);
criterion_main!(benches);
