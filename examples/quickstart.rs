//! Builds a map out of core, queries it and opens it again: `cargo run --release --example quickstart`.

use voxtile::query::{RayQuery, UnknownAs};
use voxtile::{MapConfig, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper, Queries};
use voxtile_simulation::Survey;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::temp_dir().join(format!("voxtile_quickstart_{}", std::process::id()));
    let config = MapConfig::new(0.25, 10.0)?.with_range(0.0, 40.0);

    let mut mapper = OutOfCoreTileMapper::create(&folder, config)?;
    let mut survey = Survey::demo(1);
    let start = survey.scan_at(0).origin;
    for scan in survey.take(10) {
        mapper.insert_scan(&scan)?;
    }
    let forward = RayQuery {
        origin: start,
        direction: [0.0, 1.0, 0.0],
        max_range_m: Some(50.0),
        unknown: UnknownAs::Free,
    };
    println!("to the left: {:?}", mapper.cast_ray(&forward)?);
    println!("nearest: {:?}", mapper.nearest_occupied(start, 10.0)?);
    mapper.flush()?;
    drop(mapper);

    let map = MapReader::open(&folder, 64 << 20)?;
    println!("{} tiles, digest {}", map.tile_indices().len(), map.digest()?);
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}
