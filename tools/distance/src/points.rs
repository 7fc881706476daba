use crate::{Arguments, recorded};
use anyhow::Result;
use report::Stopwatch;
use testkit::random_scans::Random;
use voxtile::{Aabb, InMemoryMapper, Mapper, Point, Queries};
use voxtile_distance::{DistanceOptions, MapDistances, UnknownRule};

const POINTS: usize = 1 << 20;
const SIZE_M: [f64; 3] = [40.0, 40.0, 8.0];

pub fn measure(arguments: &Arguments) -> Result<()> {
    let mut map = InMemoryMapper::new(recorded::config(arguments)?)?;
    let mut robot = [0.0; 3];
    recorded::for_each_scan(arguments, |scan| {
        map.insert_scan(scan)?;
        robot = scan.origin;
        Ok(())
    })?;
    let region = Aabb {
        min: std::array::from_fn(|k| robot[k] - SIZE_M[k] / 2.0),
        max: std::array::from_fn(|k| robot[k] + SIZE_M[k] / 2.0),
    };
    let options = DistanceOptions::new(arguments.cap).with_unknown(UnknownRule::Free);
    let field = map.distance_field(&region, options)?;
    let random = &mut Random(1);
    let inside = |random: &mut Random| {
        std::array::from_fn(|k| random.between(region.min[k] + 0.2, region.max[k] - 0.2))
    };
    let anywhere: Vec<Point> = (0..POINTS).map(|_| inside(random)).collect();
    // Trajectories: steps of 5 cm from random starts.
    let mut trajectories = Vec::with_capacity(POINTS);
    while trajectories.len() < POINTS {
        let (start, end): (Point, Point) = (inside(random), inside(random));
        let steps = 200;
        trajectories.extend((0..steps).map(|step| -> Point {
            std::array::from_fn(|k| start[k] + (end[k] - start[k]) * f64::from(step) / f64::from(steps) * 0.3)
        }));
    }
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    for (name, points) in [("random points", &anywhere), ("trajectories", &trajectories)] {
        let measured = || -> Result<_> {
            let mut best = f64::INFINITY;
            for _ in 0..5 {
                let clock = Stopwatch::start()?;
                std::hint::black_box(field.distance_and_gradient_at(points));
                best = best.min(clock.stop()?.wall_s);
            }
            Ok(1e9 * best / points.len() as f64)
        };
        let one_ns = one_thread.install(measured)?;
        let all_ns = measured()?;
        let few = &points[..points.len().min(20_000)];
        let clock = Stopwatch::start()?;
        for &point in few {
            std::hint::black_box(map.nearest_occupied(point, arguments.cap)?);
        }
        let nearest_ns = 1e9 * clock.stop()?.wall_s / few.len() as f64;
        println!(
            "| `{}` | {} | {} | {name} | {one_ns:.0} | {all_ns:.0} | {nearest_ns:.0} |",
            recorded::name(arguments),
            arguments.resolution,
            arguments.cap,
        );
    }
    Ok(())
}
