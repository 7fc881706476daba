//! Times queries of a map in memory: CPU time on one thread, with scans of a folder or of a synthetic survey.
//!
//! ```text
//! RAYON_NUM_THREADS=1 questions FOLDER|SURVEY RESOLUTION_M SCANS
//! ```
//!
//! Queries start at positions of the sensor, so that rays are like those of a robot. Prints microseconds per query as
//! JSON, and the number of hits, which must be equal in all versions. `point` discards the answer, so that its
//! probability need not be computed; `point_kept` and `point_of_array` return a list of answers.

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use report::Stopwatch;
use std::hint::black_box;
use std::path::Path;
use voxtile::{
    Aabb, InMemoryMapper, MapConfig, MapQueries, Mapper, Occupancy, Point, Queries, RayQuery, Scan, Shape,
    UnknownAs,
};
use voxtile_formats::{ReadOptions, open_scans};
use voxtile_simulation::Random;
use workload::SurveyName;

const SEED: u64 = 1;
const MAX_RANGE_M: f64 = 60.0;
const RAYS: usize = 20_000;
const POINTS: usize = 1_000_000;
const NEAREST: usize = 20_000;
/// Distance from a sensor within which points, nearest voxels and bodies are queried, in metres.
const AROUND_M: f64 = 20.0;
/// Distance of a near voxel, in metres.
const NEAR_M: f64 = 1.0;

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [scans, resolution_m, count] = &args[..] else {
        bail!("usage: questions FOLDER|SURVEY RESOLUTION_M SCANS")
    };
    let (resolution_m, count): (f64, usize) = (resolution_m.parse()?, count.parse()?);
    let mut map = InMemoryMapper::new(MapConfig::new(resolution_m, 10.0)?.with_range(0.0, MAX_RANGE_M))?;
    let scans = scans_of(scans, count)?;
    let from: Vec<Point> = scans.iter().map(|scan| scan.origin).collect();
    let watch = Stopwatch::start()?;
    for scan in &scans {
        map.insert_scan(scan)?;
    }
    let micros = 1e6 * watch.stop()?.cpu_s() / scans.len() as f64;
    let mut random = Random::of(SEED, &[]);
    let mut answers = serde_json::Map::new();
    answers.insert(
        "insert_of_a_scan".to_owned(),
        serde_json::json!({ "us": micros.round(), "hits": scans.len() }),
    );
    for (name, unknown) in [("ray", UnknownAs::Free), ("ray_unknown_stops", UnknownAs::Obstacle)] {
        let rays: Vec<RayQuery> = (0..RAYS)
            .map(|_| {
                let origin = from[random.below(from.len() as u64) as usize];
                let direction =
                    [random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-0.3, 0.3)];
                RayQuery { origin, direction, max_range_m: Some(MAX_RANGE_M), unknown }
            })
            .collect();
        note(&mut answers, name, RAYS, || {
            rays.iter().map(|ray| Ok(u64::from(map.cast_ray(ray)?.is_some()))).sum()
        })?;
    }
    let mut near = |count: usize| -> Vec<Point> {
        let mut point = || {
            let origin = from[random.below(from.len() as u64) as usize];
            let reach = [AROUND_M, AROUND_M, 2.0];
            std::array::from_fn(|k| origin[k] + random.between(-reach[k], reach[k]))
        };
        (0..count).map(|_| point()).collect()
    };
    let points = near(POINTS);
    note(&mut answers, "point", POINTS, || {
        points.iter().map(|&point| Ok(u64::from(map.occupancy_at(point)?.is_occupied()))).sum()
    })?;
    note(&mut answers, "point_kept", POINTS, || {
        let kept: Result<Vec<Occupancy>, _> = points.iter().map(|&point| map.occupancy_at(point)).collect();
        Ok(kept?.iter().filter(|occupancy| occupancy.is_occupied()).count() as u64)
    })?;
    note(&mut answers, "point_of_array", POINTS, || {
        Ok(map.occupancy_at_points(&points)?.iter().filter(|occupancy| occupancy.is_occupied()).count()
            as u64)
    })?;
    let places = near(NEAREST);
    note(&mut answers, "nearest_within_10_m", NEAREST, || {
        places.iter().map(|&place| Ok(u64::from(map.nearest_occupied(place, 10.0)?.is_some()))).sum()
    })?;
    let is_near_occupied =
        |place: &Point| -> Result<bool> { Ok(map.nearest_occupied(*place, NEAR_M)?.is_some()) };
    let near_places: Vec<Point> =
        places.iter().copied().filter(|place| is_near_occupied(place).unwrap_or(false)).collect();
    note(&mut answers, "nearest_where_one_is_near", near_places.len(), || {
        near_places.iter().map(|&place| Ok(u64::from(map.nearest_occupied(place, 10.0)?.is_some()))).sum()
    })?;
    note(&mut answers, "collision_of_a_sphere", NEAREST, || {
        let body = |center| Shape::Sphere { center, radius_m: 0.5 };
        places
            .iter()
            .map(|&place| Ok(u64::from(map.collision(&body(place), UnknownAs::Free)?.is_some())))
            .sum()
    })?;
    let everywhere = Aabb { min: [-1e6; 3], max: [1e6; 3] };
    note(&mut answers, "occupied_voxels_of_the_map", 1, || {
        let mut count = 0;
        map.for_each_occupied(None, Some(&everywhere), |_| count += 1)?;
        Ok(count)
    })?;
    println!("{}", serde_json::Value::Object(answers));
    Ok(())
}

fn scans_of(name: &str, count: usize) -> Result<Vec<Scan>> {
    if let Ok(survey) = SurveyName::from_str(name, true) {
        return Ok(survey.scans(SEED, 0, SurveyName::RAYS).take(count).collect());
    }
    let mut source = open_scans(Path::new(name), &ReadOptions::default())
        .with_context(|| format!("{name}: cannot read the scans"))?;
    let mut scans = Vec::new();
    while scans.len() < count
        && let Some(scan) = source.next_scan()?
    {
        scans.push(scan.into_scan());
    }
    Ok(scans)
}

fn note(
    answers: &mut serde_json::Map<String, serde_json::Value>,
    name: &str,
    count: usize,
    query: impl Fn() -> Result<u64>,
) -> Result<()> {
    black_box(query()?);
    let watch = Stopwatch::start()?;
    let hits = black_box(query()?);
    let micros = 1e6 * watch.stop()?.cpu_s() / count as f64;
    answers.insert(name.to_owned(), serde_json::json!({ "us": (1e3 * micros).round() / 1e3, "hits": hits }));
    Ok(())
}
