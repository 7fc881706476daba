use crate::harness::{Act, State, all_layers, at, config, damage_in, keeping_scans, map as folder, perform};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use voxtile::integrity::verify;
use voxtile::mapper::KeptScan;
use voxtile::operations::{CopyScans, Part, convert, crop};
use voxtile::scan::ScanPoints;
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::space::Aabb;
use voxtile::{
    Error, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper, Point, Result,
    Scan, Storage,
};

const INPUT: &str = "random scans";

fn place(name: &str) -> PathBuf {
    Path::new("/city").join(name)
}

fn scan(number: u64) -> Scan {
    random_scan(&mut Random(number), [3.0 * number as f64, 0.0, 0.0], 4)
}

/// A map of two scans with a flush after each, so that tiles differ in their scan numbers.
fn map(disk: &FaultyDisk, config: MapConfig) -> voxtile::Digest {
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), place("map")), config).unwrap();
    mapper.begin_input(INPUT).unwrap();
    for number in 0..2 {
        mapper.insert_scan(&scan(number)).unwrap();
        mapper.flush().unwrap();
    }
    mapper.digest().unwrap()
}

fn reader(disk: &FaultyDisk, name: &str) -> Result<MapReader> {
    MapReader::open(MapPath::on(disk.shared(), place(name)), 0)
}

fn converted(disk: &FaultyDisk, from: &str, to: &str, storage: Storage) -> Result<()> {
    let mut told = 0;
    let reader = reader(disk, from)?;
    let written = convert(&reader, place(to), storage, CopyScans::Yes, |done, _| told = done)?;
    assert_eq!((written.tiles, told), (reader.tile_indices().len() as u64, written.tiles));
    Ok(())
}

/// Files of a map's tiles, by their path in the map.
fn tile_files(disk: &FaultyDisk, name: &str) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = disk.files().into_iter();
    let inside =
        files.filter_map(|(path, bytes)| Some((path.strip_prefix(place(name)).ok()?.to_owned(), bytes)));
    inside.filter(|(path, _)| path.components().count() == 2).collect()
}

#[test]
fn a_round_trip_keeps_content_and_files() {
    let iwlo = SensorModel::Iwlo(Iwlo::default());
    for config in [config(), config().with_sensor_model(iwlo).with_storage(Storage::Compact)] {
        let (own, other) = match config.storage {
            Storage::OctoMap => (Storage::OctoMap, Storage::Compact),
            Storage::Compact => (Storage::Compact, Storage::OctoMap),
        };
        let disk = FaultyDisk::new(Fault::None);
        let digest = map(&disk, config);
        converted(&disk, "map", "other", other).unwrap();
        converted(&disk, "other", "back", own).unwrap();
        let first = reader(&disk, "map").unwrap();
        for (name, storage) in [("other", other), ("back", own)] {
            let reader = reader(&disk, name).unwrap();
            assert_eq!((reader.config().storage, reader.digest().unwrap()), (storage, digest));
            assert_eq!(reader.voxel_counts(), first.voxel_counts());
            assert_eq!(reader.scan_number(), 2);
            let ids = [&first, &reader].map(|map| map.metadata().ext.clone().unwrap().map_id);
            assert_eq!(ids[0], ids[1]);
            let mut found = Vec::new();
            let verified = verify(
                MapPath::on(disk.shared(), place(name)),
                |finding| found.push(finding.clone()),
                |_, _| (),
            );
            assert!(verified.unwrap().is_whole() && found.is_empty(), "{found:?}");
        }
        let [seed, compact] = match own {
            Storage::OctoMap => ["map", "other"],
            Storage::Compact => ["other", "map"],
        };
        let [(seed_table, seed_octree), (table, octree)] =
            [seed, compact].map(|name| reader(&disk, name).unwrap().disk_bytes().unwrap());
        assert!(table < seed_table && octree == 0 && seed_octree > 0);
        assert!(tile_files(&disk, "map") == tile_files(&disk, "back"));
        assert!(tile_files(&disk, compact).keys().all(|path| path.ends_with("tile.vxt")));
    }
}

#[test]
fn a_build_resumes_a_converted_map() {
    let disk = FaultyDisk::new(Fault::None);
    map(&disk, config());
    converted(&disk, "map", "small", Storage::Compact).unwrap();
    let digests = ["map", "small"].map(|name| {
        let mut mapper =
            OutOfCoreTileMapper::open(MapPath::on(disk.shared(), place(name)), config()).unwrap();
        assert_eq!(mapper.resume_input(INPUT).unwrap(), 2);
        for number in [1, 2] {
            mapper.insert_scan(&scan(number)).unwrap();
        }
        mapper.flush().unwrap();
        reader(&disk, name).unwrap().digest().unwrap()
    });
    assert_eq!(digests[0], digests[1]);
}

/// The power failed between the commit and the replacement of `metadata.json`: the log decides.
#[test]
fn copies_of_a_map_with_outdated_metadata_have_all_scans() {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), place("map")), config()).unwrap();
    mapper.begin_input(INPUT).unwrap();
    let metadata = place("map/metadata.json");
    let behind = disk.files()[&metadata].clone();
    mapper.insert_scan(&scan(0)).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    disk.put(&metadata, &behind);
    converted(&disk, "map", "small", Storage::Compact).unwrap();
    let everywhere = Part::Inside(Aabb { min: [-50.0; 3], max: [50.0; 3] });
    crop(&reader(&disk, "map").unwrap(), &everywhere, CopyScans::No, place("part"), |_, _| ()).unwrap();
    for made in ["map", "small", "part"] {
        assert_eq!(reader(&disk, made).unwrap().scan_number(), 1, "{made}");
    }
    let mut mapper = OutOfCoreTileMapper::open(MapPath::on(disk.shared(), place("small")), config()).unwrap();
    assert_eq!(mapper.resume_input(INPUT).unwrap(), 1);
}

#[test]
fn a_conversion_is_atomic_after_faults_and_power_cuts() {
    is_atomic_after_faults_and_power_cuts(config());
}

#[test]
fn a_conversion_with_kept_scans_is_atomic_after_faults_and_power_cuts() {
    is_atomic_after_faults_and_power_cuts(keeping_scans());
}

fn is_atomic_after_faults_and_power_cuts(config: MapConfig) {
    let before = FaultyDisk::new(Fault::None);
    let digest = map(&before, config);
    let kept = kept_points(&reader(&before, "map").unwrap());
    let first = tile_files(&before, "map");
    let undisturbed = before.copy();
    let (operations, changes) = (undisturbed.operations(), undisturbed.changes());
    converted(&undisturbed, "map", "small", Storage::Compact).unwrap();
    let (operations, changes) = (undisturbed.operations() - operations, undisturbed.changes() - changes);
    println!("{operations} operations, {changes} of them changes");
    let is_there = |disk: &FaultyDisk, what: &str| match reader(disk, "small") {
        Ok(reader) => {
            assert_eq!(reader.digest().unwrap_or_else(|error| panic!("{what}: {error:#}")), digest, "{what}");
            assert_eq!(kept_points(&reader), kept, "{what}");
            true
        }
        Err(Error::NoMap { .. }) => false,
        Err(error) => panic!("{what}: {error:#}"),
    };
    let again = |disk: &FaultyDisk, what: &str| {
        let was_there = is_there(disk, what);
        match converted(disk, "map", "small", Storage::Compact) {
            Ok(()) => assert!(!was_there, "{what}"),
            Err(Error::AlreadyExists { .. }) => assert!(was_there, "{what}"),
            Err(error) => panic!("{what}: {error:#}"),
        }
        assert!(is_there(disk, what), "{what}");
        assert!(tile_files(disk, "map") == first, "{what}");
    };
    let failures = (0..operations).map(Fault::Fails);
    let failures = failures.chain((0..changes).map(Fault::LosesSync));
    for fault in failures.chain((0..changes).map(Fault::IsFull)) {
        let disk = before.copy();
        disk.set_fault(fault);
        let done = converted(&disk, "map", "small", Storage::Compact);
        disk.make_room();
        assert!(done.is_err() || is_there(&disk.after_crash(Unsynced::Dropped), "done"), "{fault:?}");
        again(&disk, &format!("{fault:?}"));
    }
    for at in 0..changes {
        let disk = before.copy();
        disk.set_fault(Fault::Crashes(at));
        let done = converted(&disk, "map", "small", Storage::Compact);
        for unsynced in [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(at)] {
            let (left, what) = (disk.after_crash(unsynced), format!("crash at {at}, {unsynced:?}"));
            assert!(done.is_err() || is_there(&left, &what), "{what}");
            again(&left, &what);
        }
    }
}

/// The points of the scans that a map keeps.
fn kept_points(reader: &MapReader) -> Vec<Vec<Point>> {
    let scans = reader.keeps_scans().then(|| reader.kept_scans().unwrap()).into_iter().flatten();
    let points_of = |scan: Result<KeptScan>| {
        let (scan, mut points) = (scan.unwrap(), Vec::new());
        scan.for_each_chunk(0..scan.len(), &mut |some, _| {
            points.extend_from_slice(some);
            true
        })
        .unwrap();
        points
    };
    scans.map(points_of).collect()
}

/// The same disk with the map `from` in the place of the map of the harness.
fn moved(disk: &FaultyDisk, from: &str) -> FaultyDisk {
    let other = disk.copy();
    other.shared().rename(folder(), &place("original")).unwrap();
    other.shared().rename(&place(from), folder()).unwrap();
    other
}

#[test]
fn copies_keep_scans_and_can_be_replayed() {
    for (config, storage) in [
        (keeping_scans(), Storage::Compact),
        (keeping_scans().with_storage(Storage::Compact).with_layers(all_layers()), Storage::OctoMap),
    ] {
        let disk = FaultyDisk::new(Fault::None);
        let mut state = State::default();
        let removed = Act::RemovePoints(Aabb { min: [0.0, -1.0, -1.0], max: [1.0, 1.5, 1.5] });
        let marked = Act::Mark { seed: 5, rest: Some(1) };
        for act in [Act::Scans(0..4), Act::RemoveScans(2, 2), marked, Act::Scans(4..6), removed] {
            perform(&disk, &config, &state, &act).unwrap();
            state = state.after(&act, &config);
        }
        converted(&disk, "map", "copy", storage).unwrap();
        let (copy, config) = (moved(&disk, "copy"), config.with_storage(storage));
        assert!(state.is_on(&copy) && damage_in(&copy).is_empty(), "{storage}");
        for act in [Act::Move { seed: 3, rest: None }, Act::Scans(6..8), Act::RemoveScans(1, 1)] {
            perform(&copy, &config, &state, &act).unwrap();
            state = state.after(&act, &config);
            assert!(state.is_on(&copy) && damage_in(&copy).is_empty(), "{storage}: {act:?}");
        }
        let whole = MapReader::open(at(&disk), 0).unwrap();
        convert(&whole, place("small"), storage, CopyScans::No, |_, _| ()).unwrap();
        let small = reader(&disk, "small").unwrap();
        assert!(!small.keeps_scans() && kept_points(&small).is_empty());
        assert_eq!(small.digest().unwrap(), whole.digest().unwrap());
    }
}

#[test]
fn damaged_kept_scans_are_an_error_without_output() {
    let whole = FaultyDisk::new(Fault::None);
    map(&whole, keeping_scans());
    for (path, bytes) in whole.files() {
        if !path.starts_with(place("map/kept_scans")) {
            continue;
        }
        let (disk, mut damaged) = (whole.copy(), bytes.clone());
        let middle = damaged.len() / 2;
        damaged[middle] ^= 4;
        disk.put(&path, &damaged);
        match converted(&disk, "map", "new", Storage::Compact) {
            Err(Error::Damaged { path: named, .. }) => assert_eq!(named, path),
            other => panic!("{other:?}"),
        }
        assert!(matches!(reader(&disk, "new"), Err(Error::NoMap { .. })));
    }
}

#[test]
fn a_damaged_tile_is_an_error_without_output() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let disk = FaultyDisk::new(Fault::None);
        map(&disk, config().with_storage(storage));
        let (path, mut bytes) = tile_files(&disk, "map").pop_last().unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 4;
        let path = place("map").join(path);
        let path = if path.ends_with("octree.bt") { path.with_file_name("iwlo_meta.bin") } else { path };
        disk.put(&path, &bytes);
        match converted(&disk, "map", "new", Storage::Compact) {
            Err(Error::Damaged { path: named, tile: Some(_), .. }) => assert_eq!(named, path),
            other => panic!("{other:?}"),
        }
        assert!(disk.files().keys().all(|path| path.starts_with(place("map"))));
    }
}

/// A map of the original format has no checksums; the converted one has.
#[test]
fn a_map_of_the_original_format_gets_checksums() {
    let disk = FaultyDisk::new(Fault::None);
    let digest = map(&disk, config());
    disk.take(&place("map").join("commits.log"));
    let metadata = br#"{"version": "1.0", "resolution": 0.4, "tile_size": 3.2, "bounds": {"min": [0,0,0], "max": [0,0,0]}}"#;
    disk.put(&place("map").join("metadata.json"), metadata);
    for (path, bytes) in disk.files() {
        if path.ends_with("iwlo_meta.bin") {
            let count = u64::from_le_bytes(bytes[8..16].try_into().unwrap()) as usize;
            disk.put(&path, &bytes[..16 + 18 * count]);
        }
    }
    converted(&disk, "map", "small", Storage::Compact).unwrap();
    let reader = reader(&disk, "small").unwrap();
    assert!(reader.is_verified());
    assert_eq!((reader.digest().unwrap(), reader.scan_number()), (digest, 0));
}
