//! Maps opened and created by options, and readers with a memory limit.

use tempfile::TempDir;
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::random_scans::{Random, random_scan};
use voxtile::{
    Error, MapConfig, MapOptions, MapPath, MapQueries, MapReader, MapView, Mapper, MemoryLimit, Queries,
    SnapshotName,
};

fn config() -> MapConfig {
    MapConfig::new(0.2, 1.6).unwrap()
}

#[test]
fn options_create_maps_only_on_request() {
    let folder = TempDir::new().unwrap();
    let place = folder.path().join("map");
    assert!(matches!(MapOptions::new().open(&place), Err(Error::NoMap { .. })));
    assert!(matches!(MapOptions::new().open_read_only(&place), Err(Error::NoMap { .. })));
    let options = MapOptions::new().config(config());
    let mut mapper = options.clone().create_if_missing(true).open(&place).unwrap();
    assert!(matches!(options.clone().create_if_missing(true).open(&place), Err(Error::Locked { .. })));
    mapper.insert_scan(&random_scan(&mut Random(1), [0.0; 3], 20)).unwrap();
    mapper.flush().unwrap();
    let digest = mapper.digest().unwrap();
    drop(mapper);

    assert!(matches!(options.clone().create_new(true).open(&place), Err(Error::AlreadyExists { .. })));
    let other = MapOptions::new().config(MapConfig::new(0.1, 1.6).unwrap());
    assert!(matches!(other.create_if_missing(true).open(&place), Err(Error::Mismatch { .. })));
    // Without a configuration, the map's own is used.
    let mapper = MapOptions::new().memory_bytes(64 << 20).open(&place).unwrap();
    assert_eq!(mapper.config().grid, config().grid);
    assert_eq!(mapper.digest().unwrap(), digest);
    drop(mapper);
    assert_eq!(MapOptions::new().open_read_only(&place).unwrap().digest().unwrap(), digest);
    let name: SnapshotName = "first".parse().unwrap();
    voxtile::operations::snapshot(&place, &name).unwrap();
    let snapshot = MapOptions::new().memory_bytes(1 << 20).open_snapshot(&place, &name).unwrap();
    assert_eq!(snapshot.digest().unwrap(), digest);
}

#[test]
fn a_map_is_opened_on_any_disk() {
    let disk = FaultyDisk::new(Fault::None);
    let place = MapPath::on(disk.shared(), "/map");
    let options = MapOptions::new().config(config()).create_new(true);
    let mut mapper = options.open(place.clone()).unwrap();
    mapper.insert_scan(&random_scan(&mut Random(2), [0.0; 3], 20)).unwrap();
    mapper.flush().unwrap();
    let reader = MapOptions::new().open_read_only(place).unwrap();
    assert_eq!(reader.digest().unwrap(), mapper.digest().unwrap());
}

#[test]
fn a_reader_respects_its_memory_limit_and_gives_the_same_results() {
    const BYTES: usize = 200_000;
    let folder = TempDir::new().unwrap();
    let place = folder.path().join("map");
    let mut mapper = MapOptions::new().config(config()).create_new(true).open(&place).unwrap();
    let mut random = Random(3);
    for _ in 0..6 {
        let center = [random.between(-6.0, 6.0), 0.0, 0.0];
        mapper.insert_scan(&random_scan(&mut random, center, 40)).unwrap();
    }
    mapper.flush().unwrap();
    let small = MapOptions::new().memory_bytes(BYTES).open_read_only(&place).unwrap();
    let all = MapReader::open(&place, 1 << 30).unwrap();
    let mut most = 0;
    for _ in 0..2000 {
        let point = random.point([0.0; 3], 9.0);
        assert_eq!(small.occupancy_at(point).unwrap(), all.occupancy_at(point).unwrap());
        most = most.max(small.statistics().cached.bytes());
    }
    assert!(all.statistics().cached.bytes() > 2 * BYTES as u64, "the map is larger than the limit");
    assert!((BYTES as u64 / 2..=BYTES as u64).contains(&most), "{most} bytes");
    // The limit belongs to the reader: its configuration does not contain it.
    assert_eq!(small.config().memory, MemoryLimit::Default);
    // Any limit has room for one tile.
    let least = MapOptions::new().memory_bytes(1).open_read_only(&place).unwrap();
    assert_eq!(least.digest().unwrap(), all.digest().unwrap());
    least.occupancy_at([0.0; 3]).unwrap();
}
