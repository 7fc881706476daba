//! Measures whether the time of a query depends on the number of tiles, from a hundred to a million. The voxels around
//! the query are the same; all other tiles have one voxel each, in memory.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use voxtile::query::{RayQuery, Shape, UnknownAs};
use voxtile::scan::PointBatch;
use voxtile::space::Point;
use voxtile::{InMemoryMapper, MapConfig, Mapper, Queries};
use voxtile_simulation::Survey;

const TILE_M: f64 = 10.0;
/// Tiles along each edge of the square that contains the other tiles, far from the scans.
const EDGES: [usize; 3] = [10, 100, 1000];

fn query(criterion: &mut Criterion) {
    for edge in EDGES {
        let (map, eye) = make_map(edge);
        let ray = |direction: Point| RayQuery {
            origin: eye,
            direction,
            max_range_m: Some(50.0),
            unknown: UnknownAs::Free,
        };
        let rays = [[1.0, 0.1, 0.0], [0.3, -1.0, 0.05], [-1.0, 0.4, 0.1], [0.0, 0.1, 1.0]].map(ray);
        let body = Shape::Sphere { center: eye, radius_m: 0.5 };
        let mut group = criterion.benchmark_group(format!("{} tiles", edge * edge));
        group.bench_function("4 rays of 50 m", |bencher| {
            bencher.iter(|| black_box(rays).map(|ray| map.cast_ray(&ray).expect("a ray with a length")));
        });
        group.bench_function("collision of a sphere", |bencher| {
            bencher.iter(|| map.collision(black_box(&body), UnknownAs::Free).expect("a finite body"));
        });
        group.bench_function("nearest within 100 m", |bencher| {
            bencher.iter(|| map.nearest_occupied(black_box(eye), 100.0).expect("a finite point"));
        });
        group.bench_function("point", |bencher| {
            bencher.iter(|| map.occupancy_at(black_box(eye)).expect("a map in memory"));
        });
        group.finish();
    }
}

/// Creates a map of a few blocks and, far from them, a square of tiles with one voxel each. Also returns the position
/// of the sensor.
fn make_map(edge: usize) -> (InMemoryMapper, Point) {
    let config = MapConfig::new(0.2, TILE_M).expect("whole voxels").with_range(0.5, 60.0);
    let mut map = InMemoryMapper::new(config).expect("a configuration that holds");
    let mut eye = [0.0; 3];
    for scan in Survey::tour(1, 8_000).take(4) {
        eye = scan.origin;
        map.insert_scan(&scan).expect("a scan that can be mapped");
    }
    let center = |number: usize| TILE_M * (number as f64 + 1000.5);
    let points: Vec<Point> =
        (0..edge * edge).map(|number| [center(number % edge), center(number / edge), 5.0]).collect();
    let is_occupied = vec![true; points.len()];
    let batch = PointBatch { points: &points, intensities: None, is_occupied: &is_occupied };
    map.batch_update(&batch).expect("points that can be mapped");
    (map, eye)
}

criterion_group!(benches, query);
criterion_main!(benches);
