//! Readers in other threads while the mapper inserts and flushes: every result is that of the naive map after some
//! scan.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;
use testkit::memory_folder::memory_folder;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use testkit::support::cases;
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::mapper::{LiveReader, LiveView};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::tile::Voxel;
use voxtile::{
    Error, InsertMode, MapConfig, MapPath, MapQueries, MapView, Mapper, OutOfCoreTileMapper, Result, Scan,
    Storage,
};

const SCANS: usize = 80;

fn scans(seed: u64) -> Vec<Scan> {
    let mut random = Random(seed);
    let mut scan = |_| {
        let center = [random.between(-6.0, 6.0), random.between(-2.0, 2.0), 0.0];
        random_scan(&mut random, center, 12)
    };
    (0..SCANS).map(&mut scan).collect()
}

/// The naive map after each number of scans.
fn naive_maps(config: &MapConfig, scans: &[Scan]) -> Vec<Voxels> {
    let mut naive = ReferenceMap::new(config);
    let mut maps = vec![naive.voxels.clone()];
    for scan in scans {
        naive.insert_scan(scan);
        maps.push(naive.voxels.clone());
    }
    maps
}

fn voxels(view: &LiveView) -> Result<Voxels> {
    let mut voxels = Voxels::new();
    for tile in view.tiles() {
        for Voxel { index, evidence } in tile?.voxels() {
            voxels.insert(index, (evidence.log_odds.to_bits(), evidence.observation_count));
        }
    }
    Ok(voxels)
}

/// Compares some points of a view, or all of it. Returns false if the view has expired.
fn agrees(view: &LiveView, naive: &[Voxels], random: &mut Random) -> bool {
    let (expected, grid) = (&naive[view.scan_number() as usize], view.config().grid);
    for _ in 0..30 {
        let point = random.point([0.0; 3], 8.0);
        let found = match view.voxel_at(point) {
            Ok(found) => found.map(|voxel| voxel.evidence),
            Err(Error::Expired) => return false,
            Err(error) => panic!("scan {}: {error}", view.scan_number()),
        };
        let found = found.map(|evidence| (evidence.log_odds.to_bits(), evidence.observation_count));
        let voxel = grid.voxel_of(point).unwrap();
        assert_eq!(found, expected.get(&voxel).copied(), "scan {}", view.scan_number());
    }
    if random.below(4) == 0 {
        match voxels(view) {
            Ok(voxels) => assert_eq!(voxels, *expected, "scan {}", view.scan_number()),
            Err(Error::Expired) => return false,
            Err(error) => panic!("{error}"),
        }
    }
    true
}

/// Queries until the mapper is done, with short-lived and long-lived views. Returns how many expired and how many did
/// not.
fn ask(reader: &LiveReader, naive: &[Voxels], is_over: &AtomicBool, seed: u64) -> (u64, u64) {
    let mut random = Random(seed);
    let (mut expired, mut answered) = (0, 0);
    let mut before = 0;
    while !is_over.load(Ordering::Relaxed) || answered == 0 {
        let view = reader.view();
        assert!(view.scan_number() >= before, "a later view has fewer scans");
        before = view.scan_number();
        for _ in 0..[1, 1, 8][random.below(3) as usize] {
            match agrees(&view, naive, &mut random) {
                true => answered += 1,
                false => expired += 1,
            }
            thread::sleep(Duration::from_micros(random.below(400)));
        }
    }
    (expired, answered)
}

fn run_concurrently(seed: u64, config: &MapConfig) -> (u64, u64) {
    let folder = memory_folder();
    let path = folder.path().join("map");
    let scans = scans(seed);
    let naive = naive_maps(config, &scans);
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config.clone()).unwrap();
    let is_over = AtomicBool::new(false);
    let reader = mapper.reader().unwrap();
    let counts = thread::scope(|scope| {
        let ask = |number| {
            let (reader, naive, is_over) = (reader.clone(), &naive, &is_over);
            scope.spawn(move || ask(&reader, naive, is_over, seed + number))
        };
        let readers = [1, 2].map(ask);
        for (number, scan) in scans.iter().enumerate() {
            mapper.insert_scan(scan).unwrap();
            if number % 7 == 6 {
                mapper.flush().unwrap();
            }
            // Lets readers run in between, even on a busy machine.
            thread::sleep(Duration::from_micros(300));
        }
        mapper.flush().unwrap();
        is_over.store(true, Ordering::Relaxed);
        readers.map(|reader| reader.join().unwrap())
    });
    drop(mapper);
    // The last scan remains visible.
    let view = reader.view();
    assert_eq!(view.scan_number(), SCANS as u64);
    assert_eq!(voxels_of(&view), naive[SCANS]);
    counts.iter().fold((0, 0), |sum, count| (sum.0 + count.0, sum.1 + count.1))
}

#[test]
fn concurrent_readers_see_complete_scans() {
    let config = MapConfig::new(0.2, 1.6).unwrap();
    for seed in 0..cases(3, 8) {
        let mode = if seed % 3 == 0 { InsertMode::PerRay } else { InsertMode::PerScan };
        let mut config = config.clone().with_insert_mode(mode);
        if seed % 2 == 1 {
            config = config.with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
        }
        if seed % 4 >= 2 {
            config = config.with_storage(Storage::Compact);
        }
        let (expired, _) = run_concurrently(seed, &config.clone().with_memory_bytes(1 << 30));
        assert_eq!(expired, 0, "views do not expire with enough memory");
        let bytes = [30_000, 100_000, 300_000][seed as usize % 3];
        for config in [
            config.clone().with_cache_tiles(1 + (seed as usize * 5) % 17),
            config.with_tight_memory_bytes(bytes),
        ] {
            let (expired, answered) = run_concurrently(seed, &config);
            assert!(answered > expired, "{expired} queries expired, {answered} were answered");
        }
    }
}

#[test]
fn a_view_that_holds_too_much_expires_and_the_next_does_not() {
    let folder = memory_folder();
    let config = MapConfig::new(0.2, 1.6).unwrap().with_tight_memory_bytes(40_000);
    let disk = UnsyncedDisk::shared();
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(disk, folder.path().join("map")), config.clone()).unwrap();
    let scans = scans(1);
    mapper.insert_scan(&scans[0]).unwrap();
    let reader = mapper.reader().unwrap();
    let view = reader.view();
    let mut held = 0;
    for scan in &scans[1..] {
        let holds_more = reader.view();
        mapper.insert_scan(scan).unwrap();
        let with_views = mapper.statistics().memory.readers;
        drop(holds_more);
        held = held.max(with_views.saturating_sub(mapper.statistics().memory.readers));
    }
    assert!(matches!(view.voxel_at([0.0; 3]), Err(Error::Expired)));
    // A view may hold an eighth of the limit, plus the table of held tiles.
    assert!(held < 2 * 40_000 / 8, "{held} bytes were held");
    drop(view);
    assert_eq!(voxels_of(&reader.view()), naive_maps(&config, &scans)[SCANS]);
}

fn insert(mapper: &mut OutOfCoreTileMapper, scan: &Scan) {
    mapper.insert_scan(scan).unwrap();
}

/// Counts the queries that a reader completes while the mapper works.
fn answers_during(reader: &LiveReader, work: impl FnOnce() + Send) -> u64 {
    let (is_over, answers) = (AtomicBool::new(false), AtomicU64::new(0));
    thread::scope(|scope| {
        let asking = scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                reader.view().voxel_at([0.5, 0.5, 0.5]).unwrap();
                answers.fetch_add(1, Ordering::Relaxed);
            }
        });
        while answers.load(Ordering::Relaxed) == 0 {
            thread::yield_now();
        }
        answers.store(0, Ordering::Relaxed);
        thread::Builder::new().name("mapper".into()).spawn_scoped(scope, work).unwrap().join().unwrap();
        is_over.store(true, Ordering::Relaxed);
        asking.join().unwrap();
    });
    answers.into_inner()
}

#[test]
fn readers_do_not_wait_for_flushes() {
    let folder = memory_folder();
    let config = MapConfig::new(0.2, 1.6).unwrap();
    let disk = UnsyncedDisk::with_sync_time(Duration::from_millis(150));
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(disk, folder.path().join("map")), config).unwrap();
    scans(2)[..5].iter().for_each(|scan| insert(&mut mapper, scan));
    let reader = mapper.reader().unwrap();
    // A reader that waited would complete only one or two.
    let answers = answers_during(&reader, || mapper.flush().unwrap());
    assert!(answers > 100, "{answers} answers during a flush");
}

#[test]
fn readers_do_not_wait_for_disk_reads_of_the_mapper() {
    let folder = memory_folder();
    let config = MapConfig::new(0.2, 1.6).unwrap();
    let path = folder.path().join("map");
    let mut mapper = OutOfCoreTileMapper::create(&path, config.clone()).unwrap();
    scans(3)[..5].iter().for_each(|scan| insert(&mut mapper, scan));
    mapper.flush().unwrap();
    drop(mapper);
    let disk = UnsyncedDisk::slow_to_read_for("mapper", Duration::from_millis(100));
    let mut mapper = OutOfCoreTileMapper::open(MapPath::on(disk, &path), config).unwrap();
    let reader = mapper.reader().unwrap();
    let tiles = mapper.tile_indices();
    let answers = answers_during(&reader, || {
        mapper.preload(tiles.into_iter().take(5)).unwrap();
    });
    assert!(answers > 100, "{answers} answers while tiles were read");
}
