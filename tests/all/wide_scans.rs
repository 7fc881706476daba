//! Scans whose updates exceed the memory limit.

use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::memory_folder::memory_folder;
use testkit::random_scans::{Random, random_scan};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::{
    InMemoryMapper, InsertMode, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, MemoryLimit,
    OutOfCoreTileMapper, Queries, Scan, Storage,
};

/// Scans from scattered masts: long rays through many tiles.
fn scans() -> Vec<Scan> {
    let mut random = Random(11);
    let masts = [0.0, 0.0, 9.0, 0.0, -7.0, 9.0];
    let mut scan = |x: f64| {
        let near = random_scan(&mut random, [x, 0.0, 0.0], 40);
        let far =
            |point: &[f64; 3]| std::array::from_fn(|k| near.origin[k] + 9.0 * (point[k] - near.origin[k]));
        Scan { points: near.points.iter().map(far).collect(), ..near }
    };
    masts.iter().map(|&x| scan(x)).collect()
}

fn configs() -> impl Iterator<Item = MapConfig> {
    let config = MapConfig::new(0.25, 4.0).unwrap();
    let iwlo = config.clone().with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
    let every_ray = config.clone().with_insert_mode(InsertMode::PerRay);
    [config, iwlo, every_ray].into_iter()
}

#[test]
fn a_scan_with_more_updates_than_memory_is_inserted_completely() {
    let scans = scans();
    for config in configs() {
        let mut expected = InMemoryMapper::new(config.clone()).unwrap();
        for bytes in [0, 100_000] {
            let disk = FaultyDisk::new(Fault::None);
            let tight = config.clone().with_tight_memory_bytes(bytes);
            let mut mapper =
                OutOfCoreTileMapper::create(MapPath::on(disk.shared(), Path::new("/map")), tight).unwrap();
            let mut in_files = 0;
            for (number, scan) in scans.iter().enumerate() {
                let report = mapper.insert_scan(scan).unwrap();
                if bytes == 0 {
                    assert_eq!(expected.insert_scan(scan).unwrap(), report);
                }
                in_files = in_files.max(mapper.statistics().spilled_bytes);
                if number == 3 {
                    mapper.flush().unwrap();
                    assert_eq!(mapper.statistics().spilled_bytes, 0);
                }
                let point = scan.points[7];
                mapper.occupancy_at(point).unwrap();
            }
            assert!(in_files > 0, "{bytes} bytes: updates must be spilled to files");
            let digest = mapper.digest().unwrap();
            if expected.scan_number() as usize == scans.len() {
                assert_eq!(digest, expected.digest().unwrap(), "{bytes} bytes");
            }
            mapper.flush().unwrap();
            drop(mapper);
            let reader = MapReader::open(MapPath::on(disk.shared(), Path::new("/map")), 1 << 20).unwrap();
            assert_eq!(reader.digest().unwrap(), digest);
            assert!(disk.files().keys().all(|path| path.extension().is_none_or(|last| last != "next")));
        }
    }
}

/// Number of operations that are tested.
const POINTS: u64 = 24;

/// The disk fails once at any operation: the scan is undone and can be repeated. After a crash the map is at the last
/// flush, without the updates that waited in files.
#[test]
fn a_wide_scan_that_fails_is_undone() {
    let scans = &scans()[..4];
    let config = MapConfig::new(0.4, 6.4).unwrap();
    let tight = config.clone().with_tight_memory_bytes(5_000);
    let mut digests = Vec::new();
    let mut expected = InMemoryMapper::new(config).unwrap();
    for scan in scans {
        expected.insert_scan(scan).unwrap();
        digests.push(expected.digest().unwrap());
    }
    let begin = |disk: &FaultyDisk| {
        let mut mapper =
            OutOfCoreTileMapper::create(MapPath::on(disk.shared(), Path::new("/map")), tight.clone())
                .unwrap();
        mapper.insert_scan(&scans[0]).unwrap();
        mapper.flush().unwrap();
        mapper.insert_scan(&scans[1]).unwrap();
        mapper
    };
    let operations = {
        let disk = FaultyDisk::new(Fault::None);
        let mut mapper = begin(&disk);
        let before = disk.operations();
        mapper.insert_scan(&scans[2]).unwrap();
        disk.operations() - before
    };
    println!("{operations} operations in a wide scan");
    let mut refusals = 0;
    for number in 0..POINTS {
        let at = operations * number / POINTS;
        let disk = FaultyDisk::new(Fault::None);
        let mut mapper = begin(&disk);
        let crashes = number % 2 == 1;
        disk.set_fault(if crashes { Fault::Crashes(at / 4) } else { Fault::Fails(at) });
        let is_refused = mapper.insert_scan(&scans[2]).is_err();
        if crashes && disk.has_crashed() {
            drop(mapper);
            let left = disk.after_crash(Unsynced::Shuffled(at));
            let mut mapper =
                OutOfCoreTileMapper::open(MapPath::on(left.shared(), Path::new("/map")), tight.clone())
                    .unwrap();
            assert_eq!(mapper.digest().unwrap(), digests[0], "crash at {at}");
            for scan in &scans[1..] {
                mapper.insert_scan(scan).unwrap();
            }
            assert_eq!(mapper.digest().unwrap(), digests[3], "crash at {at}, then all other scans");
            continue;
        }
        refusals += usize::from(is_refused);
        disk.make_room();
        if is_refused {
            let waits = |path: &PathBuf| path.ends_with("updates.next");
            let bytes: usize =
                disk.files().iter().filter(|(path, _)| waits(path)).map(|(_, bytes)| bytes.len()).sum();
            assert_eq!(mapper.statistics().spilled_bytes, bytes as u64, "bytes of a failed scan");
            assert_eq!(mapper.digest().unwrap(), digests[1], "refused at {at}");
            mapper.insert_scan(&scans[2]).unwrap();
        }
        mapper.insert_scan(&scans[3]).unwrap();
        assert_eq!(mapper.digest().unwrap(), digests[3], "at {at}");
        mapper.flush().unwrap();
    }
    assert!(refusals > POINTS as usize / 4, "{refusals} scans were refused");
}

/// The index of tiles takes memory, too. A scan that touches more tiles than fit is an error, and the next one
/// succeeds.
#[test]
fn a_scan_of_too_many_tiles_is_an_error_and_the_next_one_succeeds() {
    let folder = memory_folder();
    let config = MapConfig::new(0.1, 0.2).unwrap();
    let mut expected = InMemoryMapper::new(config.clone()).unwrap();
    let bytes = MemoryLimit::min_bytes(&config.grid);
    let mut mapper =
        OutOfCoreTileMapper::create(folder.path().join("map"), config.with_memory_bytes(bytes)).unwrap();
    let mut random = Random(3);
    let near = [1, 2].map(|_| random_scan(&mut random, [0.0; 3], 20));
    let wide = random_scan(&mut random, [0.0; 3], 800);
    let wide = Scan { points: wide.points.iter().map(|point| point.map(|x| 40.0 * x)).collect(), ..wide };
    for scan in near {
        let refused = mapper.insert_scan(&wide).unwrap_err().to_string();
        assert!(refused.contains("too few for a scan that changes more than"), "{refused}");
        assert_eq!(mapper.insert_scan(&scan).unwrap(), expected.insert_scan(&scan).unwrap());
        assert_eq!(mapper.digest().unwrap(), expected.digest().unwrap());
    }
    assert_eq!(mapper.statistics().spilled_bytes, 0);
}

/// New tiles are created while memory lasts, and long level rays make each tile much larger than its updates.
#[test]
fn many_new_tiles_at_once_stay_within_the_limit() {
    const LIMIT_BYTES: u64 = 96 << 20;
    const RAYS: u32 = 1_200;
    let end = |ray: u32| {
        let azimuth_rad = f64::from(ray) * 2.399_963;
        [700.0 * azimuth_rad.cos(), 700.0 * azimuth_rad.sin(), 8.0 * f64::from(ray) / f64::from(RAYS)]
    };
    let scan = Scan { origin: [0.03, 0.04, 1.8], points: (0..RAYS).map(end).collect(), intensities: None };
    let config = MapConfig::new(0.1, 10.0).unwrap();
    let config = config.with_storage(Storage::Compact).with_memory_bytes(LIMIT_BYTES as usize);
    let folder = tempfile::tempdir().unwrap();
    let mut mapper = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
    mapper.insert_scan(&scan).unwrap();
    let statistics = mapper.statistics();
    let memory = statistics.memory;
    assert!(statistics.cached_tiles > 500 && memory.write_buffer > 0, "{statistics:?}");
    // Three eighths of the limit are reserved for tiles in the compact form. The last created tiles may exceed the
    // limit.
    let beyond = (memory.bytes() + LIMIT_BYTES / 8 * 3).saturating_sub(LIMIT_BYTES);
    assert!(beyond < 14 << 20, "{beyond} bytes beyond: {memory:?}");
}
