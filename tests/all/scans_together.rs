//! Scans inserted as a batch make the same map as one by one.

use rayon::{ThreadPool, ThreadPoolBuilder};
use testkit::random_scans::{Random, random_scan};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::space::TileBox;
use voxtile::{
    Clearing, Guard, InMemoryMapper, InsertMode, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper,
    OutOfCoreTileMapper, Scan, ScanPoints, ScanReport, Storage,
};
use voxtile_simulation::Survey;

/// Scans with many rays, with few, and with none.
fn scans() -> Vec<Scan> {
    let mut random = Random(7);
    let mut scans: Vec<Scan> = Survey::tour(3, 900).step_by(3).take(4).collect();
    scans.insert(1, random_scan(&mut random, scans[0].origin, 30));
    scans.insert(2, Scan { points: Vec::new(), intensities: Some(Vec::new()), ..scans[1].clone() });
    scans.push(random_scan(&mut random, scans[0].origin, 500));
    scans
}

fn all(scans: &[Scan]) -> Vec<&dyn ScanPoints> {
    scans.iter().map(|scan| scan as _).collect()
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

fn configs() -> Vec<MapConfig> {
    let config = MapConfig::new(0.2, 6.4).unwrap().with_range(0.0, 20.0);
    let iwlo = config.clone().with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
    let (mut region, mut every_ray) = (config.clone(), config.clone());
    let origin = config.grid.tile_of(scans()[0].origin).unwrap();
    region.rays.region = Some(TileBox::new(origin, origin));
    every_ray.rays.insert_mode = InsertMode::PerRay;
    let guarded = region.clone().with_clearing(Clearing::Guarded(Guard::default()));
    vec![config, iwlo, region, every_ray, guarded]
}

/// Returns the reports and the digest of scans that are inserted one by one.
fn one_by_one(config: &MapConfig, scans: &[Scan]) -> (Vec<ScanReport>, String) {
    let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
    let reports = scans.iter().map(|scan| mapper.insert_scan(scan).unwrap()).collect();
    (reports, mapper.digest().unwrap().to_string())
}

#[test]
fn batches_equal_single_inserts_for_any_threads_and_memory() {
    let scans = scans();
    for config in configs() {
        let wanted = one_by_one(&config, &scans);
        for threads in [1, 2, 3, 8] {
            let mut reports = Vec::new();
            let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
            pool(threads).install(|| mapper.insert_all(&all(&scans), &mut reports)).unwrap();
            assert_eq!((reports, mapper.digest().unwrap().to_string()), wanted, "{threads} threads");
            assert_eq!(mapper.scan_number(), scans.len() as u64);
        }
        let limits = [None, Some(0), Some(400_000), Some(40 << 20), Some(1 << 30)];
        let all_limits = limits.map(|bytes| (2, bytes));
        for (threads, bytes) in
            [(1, Some(0)), (1, Some(400_000)), (3, Some(400_000))].into_iter().chain(all_limits)
        {
            let folder = tempfile::tempdir().unwrap();
            let path = MapPath::on(UnsyncedDisk::shared(), folder.path().join("map"));
            let mut config = config.clone().with_storage(Storage::Compact);
            if let Some(bytes) = bytes {
                config = config.with_tight_memory_bytes(bytes);
            }
            config.keeps_scans = threads == 2;
            let mut mapper = OutOfCoreTileMapper::create(path, config.clone()).unwrap();
            let mut reports = Vec::new();
            pool(threads).install(|| {
                let (first, others) = scans.split_at(5);
                mapper.insert_all(&all(first), &mut reports).unwrap();
                mapper.insert_all(&[], &mut reports).unwrap();
                mapper.insert_all(&all(others), &mut reports).unwrap();
            });
            let digest = mapper.digest().unwrap().to_string();
            // The reports of a scan inserted in parts have the same counts of points, but may differ in tiles.
            let counts = |reports: &[ScanReport]| {
                reports.iter().map(|r| (r.points, r.hits, r.misses)).collect::<Vec<_>>()
            };
            assert_eq!(counts(&reports), counts(&wanted.0), "{threads} threads, {bytes:?} bytes");
            assert_eq!(digest, wanted.1, "{threads} threads, {bytes:?} bytes");
            mapper.flush().unwrap();
            drop(mapper);
            let reader = MapReader::open(folder.path().join("map"), 1 << 20).unwrap();
            assert_eq!(reader.digest().unwrap().to_string(), wanted.1);
            let listed: Vec<u64> = reader.scans().unwrap().iter().map(|scan| scan.number).collect();
            assert_eq!(listed, (1..=scans.len() as u64).collect::<Vec<_>>());
            if config.keeps_scans {
                assert_eq!(reader.kept_scans().unwrap().count(), scans.len());
            }
        }
    }
}

#[test]
fn scans_before_an_invalid_one_are_in_the_map() {
    let config = MapConfig::new(0.2, 6.4).unwrap().with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
    for bad in [0, 1, 3, 4] {
        let mut scans: Vec<Scan> =
            (0..6).map(|seed| random_scan(&mut Random(seed), [0.3, 0.1, 0.2], 80)).collect();
        let good = scans.clone();
        scans[bad].intensities = None;
        let folder = tempfile::tempdir().unwrap();
        let path = MapPath::on(UnsyncedDisk::shared(), folder.path().join("map"));
        let in_memory = InMemoryMapper::new(config.clone()).unwrap();
        let mut keeping = config.clone().with_memory_bytes(64 << 20);
        keeping.keeps_scans = true;
        let out_of_core = OutOfCoreTileMapper::create(path, keeping).unwrap();
        pool(2).install(|| {
            check_refused(in_memory, &scans, &good, bad);
            check_refused(out_of_core, &scans, &good, bad);
        });
    }
}

fn check_refused(mut mapper: impl Mapper, scans: &[Scan], good: &[Scan], bad: usize) {
    let mut reports = Vec::new();
    let error = mapper.insert_all(&all(scans), &mut reports).unwrap_err();
    assert!(error.to_string().contains("needs an intensity"), "{error}");
    let (wanted, digest) = one_by_one(mapper.config(), &good[..bad]);
    assert_eq!(reports, wanted);
    assert_eq!(mapper.digest().unwrap().to_string(), digest);
    assert_eq!(mapper.scan_number(), bad as u64);
    mapper.insert_all(&all(&good[bad..]), &mut reports).unwrap();
    let (wanted, digest) = one_by_one(mapper.config(), good);
    assert_eq!(reports, wanted);
    assert_eq!(mapper.digest().unwrap().to_string(), digest);
}
