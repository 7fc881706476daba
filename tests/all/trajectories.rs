use tempfile::TempDir;
use voxtile::mapper::{MapView, OutOfCoreTileMapper};
use voxtile::{InMemoryMapper, MapConfig, MapQueries, Mapper, Scan};
use voxtile_simulation::Survey;

/// Checks that a map with a small cache and a small write buffer equals the map in memory. Returns the number of tiles.
fn check(name: &str, resolution_m: f64, scans: impl Iterator<Item = Scan>) -> u64 {
    let folder = TempDir::new().unwrap();
    let config = MapConfig::new(resolution_m, 8.0 * resolution_m).unwrap();
    let small = config.clone().with_cache_tiles(4).with_write_buffer_bytes(1 << 20);
    let mut naive = InMemoryMapper::new(config).unwrap();
    let mut map = OutOfCoreTileMapper::create(folder.path().join("map"), small).unwrap();
    for scan in scans {
        map.insert_scan(&scan).unwrap();
        naive.insert_scan(&scan).unwrap();
    }
    assert!(map.statistics().cached_tiles <= 4, "{name}");
    assert_eq!(map.digest().unwrap(), naive.digest().unwrap(), "{name}");
    map.statistics().tiles
}

#[test]
fn trajectories_that_stress_the_cache_give_the_map_in_memory() {
    check("a tour", 0.5, Survey::tour(1, 400).step_by(20).take(20));
    check("laps", 0.5, Survey::laps(1, 2, 400).step_by(60).take(24));
    check("teleports", 0.5, Survey::teleports(1, 5_000.0, 400).take(8));
    let tiles = check("a scan from a mast", 1.0, Survey::masts(1, 1_000.0, 3_000).take(1));
    assert!(tiles > 1_000, "{tiles}");
}
