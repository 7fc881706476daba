//! Inserts a stream of world points, as written by `tools/octomap_compat/points.py`, into a folder of tiles.
//!
//! ```text
//! insert_stream STREAM RESOLUTION_M MAP_FOLDER
//! ```
//!
//! Per scan, little-endian: count `u32`, origin 3 x `f32`, points 3 x `f32` each.
use std::error::Error;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::time::Instant;
use voxtile::mapper::{MapView, Mapper};
use voxtile::{MapConfig, OutOfCoreTileMapper, ScanRef};

type Point = [f32; 3];
type Points = Vec<Point>;

/// The same value is passed to OctoMap.
const MAX_RANGE_M: f64 = 60.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [stream, resolution_m, folder] = arguments.as_slice() else {
        return Err("usage: insert_stream STREAM RESOLUTION_M MAP_FOLDER".into());
    };
    // All tiles remain in memory, because the comparison is about the map and not about disk access.
    let config = MapConfig::with_resolution(resolution_m.parse()?)?
        .with_range(0.0, MAX_RANGE_M)
        .with_cache_tiles(1 << 20);
    let mut mapper = OutOfCoreTileMapper::create(folder, config)?;
    let mut input = BufReader::new(File::open(stream)?);
    let (mut points_seen, mut skipped, mut seconds) = (0, 0, 0.0);
    while let Some((origin, points)) = read_scan(&mut input)? {
        let start = Instant::now();
        let report = mapper.insert_points(&ScanRef::in_world(origin.map(f64::from), &points))?;
        seconds += start.elapsed().as_secs_f64();
        points_seen += report.points;
        skipped += report.skipped.total();
    }
    mapper.flush()?;
    println!(
        "{{\"scans\":{},\"points\":{points_seen},\"skipped\":{skipped},\"tiles\":{},\"voxtile_seconds\":{seconds:.2}}}",
        mapper.scan_number(),
        mapper.tile_indices().len()
    );
    Ok(())
}

/// Reads origin and points of the next scan; `None` at the end of the stream.
fn read_scan(input: &mut impl Read) -> io::Result<Option<(Point, Points)>> {
    let mut count = [0; 4];
    match input.read_exact(&mut count) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
        result => result?,
    }
    let origin = read_point(input)?;
    let points = (0..u32::from_le_bytes(count)).map(|_| read_point(input)).collect::<io::Result<_>>()?;
    Ok(Some((origin, points)))
}

fn read_point(input: &mut impl Read) -> io::Result<Point> {
    let mut bytes = [0; 12];
    input.read_exact(&mut bytes)?;
    Ok(std::array::from_fn(|k| f32::from_le_bytes(std::array::from_fn(|byte| bytes[4 * k + byte]))))
}
