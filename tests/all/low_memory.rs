//! Memory limits: the layers between resident tiles and the disk.

use std::sync::{Arc, Mutex, mpsc};
use std::thread;
use std::time::Duration;
use testkit::memory_folder::memory_folder;
use testkit::support::cases;
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::{
    InMemoryMapper, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper, Scan,
    ScanRef,
};
use voxtile_simulation::Survey;

fn config() -> MapConfig {
    MapConfig::new(0.2, 6.4).unwrap().with_range(0.0, 20.0)
}

fn scans(count: usize) -> Vec<Scan> {
    Survey::tour(3, 1_000).step_by(4).take(count).collect()
}

#[test]
fn tiles_ahead_are_fetched_before_they_are_needed() {
    let folder = memory_folder();
    let path = folder.path().join("map");
    let config = config().with_memory_bytes(64 << 20);
    let scans = scans(30);
    let mut expected = InMemoryMapper::new(config.clone()).unwrap();
    for _ in 0..2 {
        let mut mapper = match path.exists() {
            false => OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config.clone()),
            true => OutOfCoreTileMapper::open(MapPath::on(UnsyncedDisk::shared(), &path), config.clone()),
        }
        .unwrap();
        for scan in &scans {
            mapper.insert_scan(scan).unwrap();
            expected.insert_scan(scan).unwrap();
        }
        mapper.flush().unwrap();
        let io = mapper.statistics().io;
        // A new map has nothing to fetch; the second pass over the same ground has.
        assert_eq!(io.prefetches > 0, io.loads > 0, "{io:?}");
        assert_eq!(io.prefetches > 10, mapper.scan_number() > scans.len() as u64, "{io:?}");
    }
    let mapper = OutOfCoreTileMapper::open(MapPath::on(UnsyncedDisk::shared(), &path), config).unwrap();
    assert_eq!(mapper.digest().unwrap(), expected.digest().unwrap());
}

/// All statistics are counted and consistent.
#[test]
fn statistics_count_everything_with_little_memory() {
    let folder = memory_folder();
    let scans = scans(60);
    let mut expected = InMemoryMapper::new(config()).unwrap();
    const BYTES: usize = 900_000;
    let tight = config().with_tight_memory_bytes(BYTES);
    let disk = UnsyncedDisk::with_sync_time(Duration::ZERO);
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(disk, folder.path().join("map")), tight).unwrap();
    let mut most = 0;
    for scan in &scans {
        mapper.insert_scan(scan).unwrap();
        expected.insert_scan(scan).unwrap();
        let statistics = mapper.statistics();
        most = most.max(statistics.memory.bytes());
        assert_eq!(statistics.memory.write_buffer, statistics.buffered_bytes);
        assert!(statistics.dirty_compact_tiles <= statistics.compact_tiles);
        assert!(statistics.cached_tiles + statistics.compact_tiles <= statistics.tiles);
    }
    assert_eq!(mapper.digest().unwrap(), expected.digest().unwrap());
    let statistics = mapper.statistics();
    let in_memory = expected.statistics().cached.bytes();
    assert!(in_memory > 4 * BYTES as u64, "{in_memory} bytes do not need more than the limit");
    // The memory for the updates of a scan is only estimated in advance, so the limit may be exceeded.
    assert!(most < 2 * BYTES as u64, "{most} bytes");
    assert!(statistics.io.encoded > 20 && statistics.io.decoded > 0, "{:?}", statistics.io);
    assert!(statistics.compact_tiles > 0 && statistics.memory.compact_tiles > 0);
    mapper.flush().unwrap();
    let flushed = mapper.statistics();
    assert_eq!((flushed.dirty_tiles, flushed.dirty_compact_tiles, flushed.buffered_tiles), (0, 0, 0));
    assert_eq!(flushed.memory.in_flight, 0);
    let written = flushed.io.bytes_written as f64 / flushed.disk_bytes as f64;
    assert!(written < 4.0, "{written} bytes written per byte of the map");
    assert_eq!(flushed.stalls.count == 0, flushed.stalls.worst_us == 0);
    assert!(flushed.stalls.p50_us <= flushed.stalls.p99_us);
}

/// Tiles out of range are written once, with all their updates. Otherwise updates would accumulate in memory, and tiles
/// would be read and rewritten for them.
#[test]
fn tiles_out_of_range_are_written_once_with_their_updates() {
    let folder = memory_folder();
    let config = MapConfig::new(0.2, 1.6).unwrap().with_range(0.0, 20.0);
    let scans: Vec<Scan> = Survey::tour(3, 1_000).take(cases(80, 240) as usize).collect();
    let mut expected = InMemoryMapper::new(config.clone()).unwrap();
    let tight = config.with_tight_memory_bytes(2_000_000);
    let path = MapPath::on(UnsyncedDisk::shared(), folder.path().join("map"));
    let mut mapper = OutOfCoreTileMapper::create(path, tight).unwrap();
    for scan in &scans {
        mapper.insert_scan(scan).unwrap();
        expected.insert_scan(scan).unwrap();
    }
    let statistics = mapper.statistics();
    let of_tiles = |count: u64| count as f64 / statistics.tiles as f64;
    let [saved, read] = [statistics.io.saves, statistics.io.loads].map(of_tiles);
    assert!(saved > 0.3, "{saved} saves per tile: the limit is too large for this test");
    assert!(read < 0.05, "{read} reads per tile");
    mapper.flush().unwrap();
    let saved = of_tiles(mapper.statistics().io.saves);
    assert!(saved < 1.35, "{saved} saves per tile");
    assert_eq!(mapper.digest().unwrap(), expected.digest().unwrap());
}

/// A tile may be needed, changed and flushed while an older version is still being written.
#[test]
fn a_flush_does_not_overtake_an_older_version_of_a_tile() {
    let scans = scans(12);
    for bytes in [100_000, 300_000] {
        let folder = memory_folder();
        let path = folder.path().join("map");
        let tight = config().with_tight_memory_bytes(bytes);
        let disk = UnsyncedDisk::slow_in_background(Duration::from_millis(3));
        let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.clone(), &path), tight).unwrap();
        let mut expected = InMemoryMapper::new(config()).unwrap();
        for (number, scan) in scans.iter().chain(&scans).enumerate() {
            mapper.insert_scan(scan).unwrap();
            expected.insert_scan(scan).unwrap();
            if number % 6 == 5 {
                mapper.flush().unwrap();
                let reader = MapReader::open(MapPath::on(disk.clone(), &path), 0).unwrap();
                assert_eq!(reader.digest().unwrap(), expected.digest().unwrap(), "after scan {number}");
            }
        }
    }
}

/// More tiles are active than fit in memory: their updates wait in files instead of loading the tiles, and still count
/// in queries and in the map.
#[test]
fn updates_of_tiles_on_disk_wait_in_files() {
    let folder = memory_folder();
    let config = MapConfig::new(0.1, 6.4).unwrap().with_range(0.0, 20.0);
    let scans: Vec<Scan> = (0..3).flat_map(|_| scans(20)).collect();
    let mut expected = InMemoryMapper::new(config.clone()).unwrap();
    for scan in &scans {
        expected.insert_scan(scan).unwrap();
    }
    let digest = expected.digest().unwrap();
    // With the first limit, the updates of a single scan are too large. With the second, each update would load a tile
    // if updates did not wait in files.
    for (bytes, most_loads_of_tile) in [(100_000, 2.0), (2_000_000, 0.25)] {
        let path = folder.path().join(format!("map_{bytes}"));
        let tight = config.clone().with_tight_memory_bytes(bytes);
        let mut mapper =
            OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), tight).unwrap();
        let mut most_in_files = 0;
        for scan in &scans {
            mapper.insert_scan(scan).unwrap();
            most_in_files = most_in_files.max(mapper.statistics().spilled_bytes);
        }
        let statistics = mapper.statistics();
        assert!(most_in_files > 100_000, "{most_in_files} bytes in files");
        let loads = statistics.io.loads as f64 / statistics.tiles as f64;
        assert!(loads < most_loads_of_tile, "{loads} reads per tile with {bytes} bytes");
        assert_eq!(mapper.digest().unwrap(), digest);
        mapper.flush().unwrap();
        assert_eq!(MapReader::open(&path, 0).unwrap().digest().unwrap(), digest);
        let statistics = mapper.statistics();
        assert_eq!(statistics.spilled_bytes, 0);
        let written = statistics.io.bytes_written as f64 / statistics.disk_bytes as f64;
        assert!(written < 4.0, "{written} bytes written per byte of the map");
    }
}

/// The flush holds all tiles while its disk is blocked. They are evicted from memory nevertheless.
#[test]
fn a_blocked_flush_does_not_block_scans() {
    const BYTES: usize = 6_000_000;
    let folder = memory_folder();
    let path = folder.path().join("map");
    let scans = scans(60);
    let mut expected = InMemoryMapper::new(config()).unwrap();
    let gate = Arc::new(Mutex::new(()));
    let disk = UnsyncedDisk::gated(&gate);
    let tight = config().with_tight_memory_bytes(BYTES);
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk, &path), tight).unwrap();
    let (before, during) = scans.split_at(30);
    for scan in before {
        mapper.insert_scan(scan).unwrap();
        expected.insert_scan(scan).unwrap();
    }
    let as_of_flush = expected.digest().unwrap();
    let (closed, done) = mpsc::channel();
    let (end, ended) = mpsc::channel::<()>();
    let holder = thread::spawn(move || {
        let guard = gate.lock().unwrap();
        closed.send(()).unwrap();
        // A scan that waited for the flush would never end.
        let stood_still = ended.recv_timeout(Duration::from_secs(20)).is_ok();
        drop(guard);
        stood_still
    });
    done.recv().unwrap();
    mapper.begin_flush().unwrap();
    let encoded = mapper.statistics().io.encoded;
    for scan in during {
        mapper.insert_scan(scan).unwrap();
        expected.insert_scan(scan).unwrap();
    }
    assert!(mapper.is_flushing());
    assert!(mapper.statistics().io.encoded > encoded + 20, "no tile was evicted");
    let _ = end.send(());
    assert!(holder.join().unwrap(), "a scan waited");
    mapper.end_flush().unwrap();
    assert_eq!(MapReader::open(&path, 0).unwrap().digest().unwrap(), as_of_flush);
    assert_eq!(mapper.digest().unwrap(), expected.digest().unwrap());
    mapper.flush().unwrap();
    assert_eq!(MapReader::open(&path, 0).unwrap().digest().unwrap(), expected.digest().unwrap());
}

/// A background flush needs lists of its tiles, which would not fit in memory for very many small tiles.
#[test]
fn a_flush_of_very_many_small_tiles_runs_in_the_foreground() {
    let folder = memory_folder();
    let path = folder.path().join("map");
    let config = MapConfig::new(0.2, 0.8).unwrap().with_range(0.0, 100.0);
    let points = (0..150).map(|ray| {
        let azimuth = 2.4 * f64::from(ray);
        [80.0 * azimuth.cos(), 80.0 * azimuth.sin(), 0.1 * f64::from(ray) - 7.0]
    });
    let scan = Scan { origin: [0.03, 0.04, 0.5], points: points.collect(), intensities: None };
    let mut expected = InMemoryMapper::new(config.clone()).unwrap();
    expected.insert_scan(&scan).unwrap();
    assert!(expected.tile_indices().len() > 15_000, "{}", expected.tile_indices().len());
    let limited = config.with_memory_bytes(24 << 20);
    let map = MapPath::on(UnsyncedDisk::shared(), &path);
    let mut mapper = OutOfCoreTileMapper::create(map, limited).unwrap();
    mapper.insert_scan(&scan).unwrap();
    mapper.begin_flush().unwrap();
    assert!(!mapper.is_flushing());
    assert_eq!(mapper.flushed_scan_number(), 1);
    assert_eq!(MapReader::open(&path, 0).unwrap().digest().unwrap(), expected.digest().unwrap());
    // A few tiles are flushed in the background, independent of the size of the map.
    mapper.insert_points(&ScanRef::in_world([0.0; 3], &[[3.0, 0.0, 0.0]])).unwrap();
    mapper.begin_flush().unwrap();
    mapper.end_flush().unwrap();
    assert_eq!(mapper.flushed_scan_number(), 2);
}

#[test]
fn tables_kept_for_readers_count_as_memory() {
    let folder = memory_folder();
    let index_bytes = |name: &str, is_read: bool| {
        let map = folder.path().join(name);
        let mut mapper =
            OutOfCoreTileMapper::create(&*map, MapConfig::new(0.5, 1.0).unwrap().with_range(0.0, 500.0))
                .unwrap();
        let points = |shift: f64| (0..400).map(move |k| [f64::from(k) + shift, 0.2, 0.2]).collect::<Vec<_>>();
        let mut insert = |shift| {
            mapper.insert_points(&ScanRef::in_world([0.1, 0.2, 0.2], &points(shift))).unwrap();
            mapper.flush().unwrap();
            mapper.statistics().memory.index
        };
        insert(0.2);
        let reader = is_read.then(|| MapReader::open(&*map, 0).unwrap());
        let bytes = insert(0.7);
        drop(reader);
        bytes
    };
    let [alone, read] = [index_bytes("alone", false), index_bytes("read", true)];
    assert!(read >= alone + 400 * 100, "{alone} bytes, with a reader {read}");
}
