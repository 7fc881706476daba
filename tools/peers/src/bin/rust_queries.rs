//! The measurements of `python/benchmarks/beside_rust.py` from Rust: the same scans into a map, the same queries.
//!
//! ```text
//! rust_queries WORK FOLDER
//! ```
//!
//! WORK is written by the script: little-endian `f64`, except the points of scans, which are `f32`, and counts, which
//! are `u64`. Prints CPU seconds as JSON.

use anyhow::{Context, Result, bail};
use report::Stopwatch;
use std::env::args_os;
use std::fs;
use std::hint::black_box;
use std::path::Path;
use voxtile::mapper::{MapView, Mapper};
use voxtile::{MapConfig, MapOptions, OutOfCoreTileMapper, Point, Queries, RayQuery, ScanRef, UnknownAs};

const RESOLUTION_M: f64 = 0.1;
const MEMORY_BYTES: usize = 512 << 20;
const MAX_RANGE_M: f64 = 40.0;
const FROM: Point = [15.0, 10.0, 1.5];

/// Scans, points to query, and directions of rays.
struct Work {
    scans: Vec<(Point, Vec<[f32; 3]>)>,
    places: Vec<Point>,
    directions: Vec<Point>,
}

fn main() -> Result<()> {
    let mut args = args_os().skip(1);
    let (Some(work), Some(folder)) = (args.next(), args.next()) else {
        bail!("usage: rust_queries WORK FOLDER");
    };
    let work = Work::read(&fs::read(&work).with_context(|| format!("{}: cannot read", work.display()))?)?;
    let folder = Path::new(&folder);
    let config = MapConfig::new(RESOLUTION_M, 10.0)?.with_memory_bytes(MEMORY_BYTES);
    let mut mapper = OutOfCoreTileMapper::create(folder, config)?;
    let watch = Stopwatch::start()?;
    for (origin, points) in &work.scans {
        mapper.insert_points(&ScanRef::in_world(*origin, points))?;
    }
    let insert = watch.stop()?.cpu_s();
    let watch = Stopwatch::start()?;
    mapper.flush()?;
    let flush = watch.stop()?.cpu_s();
    drop(mapper);
    let reader = MapOptions::new().memory_bytes(MEMORY_BYTES).open_read_only(folder)?;
    // Warms up: all tiles are in memory from here on.
    black_box(reader.occupancy_at_points(&work.places)?);
    let watch = Stopwatch::start()?;
    black_box(reader.occupancy_at_points(&work.places)?);
    let query = watch.stop()?.cpu_s();
    let watch = Stopwatch::start()?;
    let ray = |&direction| RayQuery {
        origin: FROM,
        direction,
        max_range_m: Some(MAX_RANGE_M),
        unknown: UnknownAs::Free,
    };
    let rays: Vec<RayQuery> = work.directions.iter().map(ray).collect();
    black_box(reader.cast_rays(&rays)?);
    let rays = watch.stop()?.cpu_s();
    let watch = Stopwatch::start()?;
    for &place in work.places.iter().take(work.directions.len()) {
        black_box(reader.nearest_occupied(place, 10.0)?);
    }
    let nearest = watch.stop()?.cpu_s();
    let scans = reader.scan_number();
    let answers = serde_json::json!({
        "insert": insert, "flush": flush, "query": query, "rays": rays, "nearest": nearest, "scans": scans,
    });
    println!("{answers}");
    Ok(())
}

impl Work {
    fn read(bytes: &[u8]) -> Result<Self> {
        let mut rest = bytes;
        let scans = (0..number(&mut rest)?)
            .map(|_| {
                let (origin, count) = (point(take(&mut rest, 24)?), number(&mut rest)?);
                let points = take(&mut rest, count.saturating_mul(12))?.as_chunks::<4>().0;
                Ok((origin, points.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect::<Vec<_>>()))
            })
            .map(|scan: Result<(Point, Vec<f32>)>| scan.map(|(origin, x)| (origin, x.as_chunks().0.to_vec())))
            .collect::<Result<_>>()?;
        let mut points = || {
            let count = number(&mut rest)?;
            Ok::<_, anyhow::Error>(
                take(&mut rest, count.saturating_mul(24))?.chunks_exact(24).map(point).collect(),
            )
        };
        Ok(Self { scans, places: points()?, directions: points()? })
    }
}

fn number(rest: &mut &[u8]) -> Result<usize> {
    let bytes = take(rest, 8)?.first_chunk().context("too short")?;
    Ok(usize::try_from(u64::from_le_bytes(*bytes))?)
}

fn point(bytes: &[u8]) -> Point {
    let numbers = bytes.as_chunks::<8>().0;
    std::array::from_fn(|k| numbers.get(k).map_or(f64::NAN, |bytes| f64::from_le_bytes(*bytes)))
}

fn take<'a>(rest: &mut &'a [u8], bytes: usize) -> Result<&'a [u8]> {
    let (taken, left) = rest.split_at_checked(bytes).context("WORK is too short")?;
    *rest = left;
    Ok(taken)
}
