use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use testkit::support::{message_of, some_of};
use voxtile::integrity::{self, Action, ActionKind, Finding, Repair, Severity, Verification, verify};
use voxtile::space::TileIndex;
use voxtile::store::{TileFile, TileStore, tile_of_folder};
use voxtile::{Error, MapConfig, MapPath, MapReader, MapView, Mapper, OutOfCoreTileMapper, Scan, Storage};

type Digests = BTreeMap<TileIndex, Vec<(u64, i32)>>;

fn map() -> &'static Path {
    Path::new("/map")
}

fn config() -> MapConfig {
    MapConfig::new(0.5, 2.0).unwrap().with_range(0.0, 2.0)
}

fn scan(seed: u64) -> Scan {
    random_scan(&mut Random(seed), [0.5, 0.5, 1.0], 2)
}

const STORAGES: [Storage; 2] = [Storage::OctoMap, Storage::Compact];

/// Name of a tile's table.
fn table_name(storage: Storage) -> &'static str {
    TileFile::Table.name(storage)
}

/// A map of a few tiles, flushed more than once.
fn small_map(storage: Storage) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let config = config().with_storage(storage);
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), map()), config).unwrap();
    mapper.begin_input("random scans").unwrap();
    for seed in [1, 4] {
        mapper.insert_scan(&scan(seed)).unwrap();
        mapper.flush().unwrap();
    }
    disk.copy()
}

/// Digests of all tiles.
fn contents(disk: &FaultyDisk) -> voxtile::Result<Digests> {
    let reader = MapReader::open(MapPath::on(disk.shared(), map()), 1 << 20)?;
    let mut contents = Digests::new();
    for index in reader.tile_indices() {
        if let Some(tile) = reader.tile(index)? {
            let entries = tile.table().iter();
            let entries = entries.map(|(_, e)| (e.log_odds.to_bits(), e.observation_count)).collect();
            contents.insert(index, entries);
        }
    }
    Ok(contents)
}

fn findings(disk: &FaultyDisk) -> (Verification, Vec<Finding>) {
    let mut findings = Vec::new();
    let verification =
        verify(MapPath::on(disk.shared(), map()), |finding| findings.push(finding.clone()), |_, _| ())
            .unwrap();
    (verification, findings)
}

fn repair(disk: &FaultyDisk) -> voxtile::Result<Repair> {
    integrity::repair(MapPath::on(disk.shared(), map()), |_| (), |_, _| ())
}

fn tile_of(path: &Path) -> Option<TileIndex> {
    tile_of_folder(path.parent()?.file_name()?.to_str()?)
}

/// Every file with a bit of one byte flipped, for each byte, and truncated to each length.
fn damages(disk: &FaultyDisk) -> Vec<(PathBuf, Vec<u8>)> {
    let mut damages = Vec::new();
    for (path, bytes) in disk.files() {
        if path.ends_with("writer.lock") {
            continue;
        }
        for at in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[at] ^= 1 << (at % 8);
            damages.push((path.clone(), flipped));
            damages.push((path.clone(), bytes[..at].to_vec()));
        }
    }
    damages
}

#[test]
fn every_flipped_byte_and_every_truncation_is_found_and_repaired() {
    STORAGES.into_iter().for_each(check_every_damage);
}

fn check_every_damage(storage: Storage) {
    let whole = small_map(storage);
    let before = contents(&whole).unwrap();
    assert!(before.len() >= 3);
    let (verification, found) = findings(&whole);
    assert!(verification.is_whole() && found.is_empty(), "{found:?}");
    let damages = damages(&whole);
    println!("{} damages, {storage}", damages.len());
    for (path, bytes) in some_of(damages, 8) {
        let what = format!("{} of {} bytes", path.display(), bytes.len());
        let disk = whole.copy();
        disk.put(&path, &bytes);
        let (verification, found) = findings(&disk);
        assert!(!verification.is_whole(), "{what}");
        let named = found.iter().any(|finding| {
            // Differences between metadata and log are reported for the log, whichever is damaged.
            let log = path.ends_with("metadata.json") && finding.path.ends_with("commits.log");
            let same_file = finding.path == path || log;
            finding.severity == Severity::Damage
                && same_file
                && (finding.offset.is_some() || finding.line.is_some())
        });
        assert!(named, "{what}: {found:?}");

        let is_derived = path.ends_with("octree.bt");
        // Queries do not need the list of scans.
        let is_list = path.ends_with("scans.bin");
        let tile = tile_of(&path).filter(|_| !is_derived);
        check_reading(&disk, &before, tile, is_derived || is_list, &what);
        // A writer does not overwrite a file that it cannot read.
        if let Ok(mut mapper) = OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config()) {
            let refused = [1, 4].map(|seed| mapper.insert_scan(&scan(seed)).is_err());
            assert_eq!(refused.contains(&true), tile.is_some(), "{what}");
        }
        if !is_derived {
            assert_eq!(disk.files()[&path], bytes, "{what}");
        }

        let repaired = repair(&disk).unwrap_or_else(|error| panic!("{what}: {error:#}"));
        assert_eq!(repaired.tiles_lost, u64::from(tile.is_some()), "{what}");
        let mut expected = before.clone();
        expected.retain(|index, _| Some(*index) != tile);
        assert_eq!(contents(&disk).unwrap(), expected, "{what}");
        let (verification, found) = findings(&disk);
        assert!(verification.is_whole(), "{what}: {found:?}");
        assert_eq!(repair(&disk).unwrap().actions, 0, "{what}");
        let kept =
            disk.files().iter().any(|(path, kept)| path.starts_with("/map/quarantine") && *kept == bytes);
        assert!(kept, "{what}");
    }
}

/// Reads report the damage, and all other tiles can be read.
fn check_reading(disk: &FaultyDisk, before: &Digests, tile: Option<TileIndex>, is_derived: bool, what: &str) {
    let reader = MapReader::open(MapPath::on(disk.shared(), map()), 1 << 20);
    let Ok(reader) = reader else {
        assert!(tile.is_none() && !is_derived, "{what}");
        assert!(matches!(reader, Err(Error::Damaged { .. })), "{what}: {reader:?}");
        return;
    };
    assert!(tile.is_some() || is_derived, "{what}: opening the map must report the damage");
    for &index in before.keys() {
        match reader.tile(index) {
            Err(Error::Damaged { tile: named, .. }) => {
                assert_eq!((tile, named), (Some(index), tile), "{what}")
            }
            read => assert!(read.unwrap().is_some() && tile != Some(index), "{what}"),
        }
    }
}

#[test]
fn missing_swapped_outdated_and_foreign_files_are_found_and_repaired() {
    STORAGES.into_iter().for_each(check_foreign_files);
}

fn check_foreign_files(storage: Storage) {
    let whole = small_map(storage);
    let before = contents(&whole).unwrap();
    let files = whole.files();
    let tables: Vec<&PathBuf> = files.keys().filter(|path| path.ends_with(table_name(storage))).collect();
    let table = tables[0];
    let tile = tile_of(table).unwrap();
    let other_map = small_map(storage);
    let other_storage = small_map(STORAGES[usize::from(storage == STORAGES[0])]);
    let older = {
        let disk = FaultyDisk::new(Fault::None);
        let config = config().with_storage(storage);
        let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), map()), config).unwrap();
        mapper.insert_scan(&scan(1)).unwrap();
        mapper.flush().unwrap();
        disk
    };
    type Case<'a> = (&'a str, Box<dyn Fn(&FaultyDisk) + 'a>, &'a str, bool);
    let cases: Vec<Case> = vec![
        ("a missing table", Box::new(|disk| disk.take(table)), "the file is missing", true),
        (
            "a missing folder",
            Box::new(|disk| disk.take(table.parent().unwrap())),
            "the tile's folder is missing",
            true,
        ),
        (
            "a missing octree",
            Box::new(|disk| disk.take(&table.with_file_name("octree.bt"))),
            "is missing",
            false,
        ),
        ("swapped tables", Box::new(|disk| disk.put(table, &files[tables[1]])), "to another tile", true),
        (
            "a table of another map",
            Box::new(|disk| disk.put(table, &other_map.files()[table])),
            "the file belongs to map",
            true,
        ),
        (
            "a table of an earlier map with this path",
            Box::new(|disk| disk.put(table, &older.files()[table])),
            "the file belongs to map",
            true,
        ),
        (
            "an octree of another tile",
            Box::new(|disk| {
                let octree = tables[1].with_file_name("octree.bt");
                disk.put(&table.with_file_name("octree.bt"), &files[&octree]);
            }),
            "the log records ",
            false,
        ),
        (
            "a missing log",
            Box::new(|disk| disk.take(Path::new("/map/commits.log"))),
            "the file is missing",
            false,
        ),
        (
            "missing metadata",
            Box::new(|disk| disk.take(Path::new("/map/metadata.json"))),
            "the file is missing",
            false,
        ),
        (
            "neither metadata nor log",
            Box::new(|disk| {
                disk.take(Path::new("/map/metadata.json"));
                disk.take(Path::new("/map/commits.log"));
            }),
            "the file is missing",
            false,
        ),
        (
            "the log of another map",
            Box::new(|disk| {
                let log = Path::new("/map/commits.log");
                disk.put(log, &other_map.files()[log]);
            }),
            "the log belongs to map",
            false,
        ),
        (
            "the metadata of another map",
            Box::new(|disk| {
                let metadata = Path::new("/map/metadata.json");
                disk.put(metadata, &other_map.files()[metadata]);
            }),
            "the log belongs to map",
            false,
        ),
        (
            "the metadata of a map with the other storage",
            Box::new(|disk| {
                let metadata = Path::new("/map/metadata.json");
                disk.put(metadata, &other_storage.files()[metadata]);
            }),
            "the log belongs to map",
            false,
        ),
        (
            "a tile in the wrong folder",
            Box::new(|disk| {
                let folder = Path::new("/map/tile_7_7_7");
                disk.shared().create_folder(folder).unwrap();
                disk.put(&folder.join(table_name(storage)), &files[table]);
            }),
            "commits.log has no entry for this tile",
            false,
        ),
    ];
    for (what, damage, reason, loses_tile) in cases {
        if storage == Storage::Compact && what.contains("octree") {
            continue;
        }
        let disk = whole.copy();
        damage(&disk);
        let (verification, found) = findings(&disk);
        assert!(!verification.is_whole(), "{what}");
        assert!(found.iter().any(|finding| finding.reason.contains(reason)), "{what}: {found:?}");
        let repaired = repair(&disk).unwrap_or_else(|error| panic!("{what}: {error:#}"));
        assert_eq!(repaired.tiles_lost, u64::from(loses_tile), "{what}");
        let mut expected = before.clone();
        expected.retain(|index, _| !loses_tile || *index != tile);
        assert_eq!(contents(&disk).unwrap(), expected, "{what}");
        let (verification, found) = findings(&disk);
        assert!(verification.is_whole(), "{what}: {found:?}");
        let config = MapReader::config_of(MapPath::on(disk.shared(), map())).unwrap();
        assert_eq!((config.grid, config.sensor_model), (self::config().grid, self::config().sensor_model));
        assert_eq!(config.storage, storage, "{what}");
    }
}

#[test]
fn an_interrupted_repair_is_completed_by_the_next() {
    STORAGES.into_iter().for_each(check_crashes_of_repairs);
}

fn check_crashes_of_repairs(storage: Storage) {
    let whole = small_map(storage);
    let before = contents(&whole).unwrap();
    let files = whole.files();
    let table = files.keys().find(|path| path.ends_with(table_name(storage))).unwrap();
    let waiting = TileFile::all(storage)[0].next_name(storage);
    let cut = |path: &Path| files[path][..files[path].len() - 1].to_vec();
    let damaged = |paths: &[&Path]| {
        let disk = whole.copy();
        paths.iter().for_each(|path| disk.put(path, &cut(path)));
        disk.put(&table.with_file_name(waiting), b"left behind");
        disk
    };
    let (log, metadata) = (Path::new("/map/commits.log"), Path::new("/map/metadata.json"));
    let octree = table.with_file_name("octree.bt");
    let mut points = 0;
    let cases: [&[&Path]; 6] =
        [&[table], &[log], &[metadata], &[log, metadata], &[&octree], &[table, log, metadata]];
    for paths in cases.into_iter().filter(|paths| paths.iter().all(|path| files.contains_key(*path))) {
        for unsynced in [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(1), Unsynced::Shuffled(2)] {
            for at in 0.. {
                let disk = damaged(paths);
                disk.set_fault(Fault::Crashes(at));
                let repaired = repair(&disk);
                if !disk.has_crashed() {
                    break;
                }
                points += 1;
                let what = format!("{paths:?}, crash at {at}, {unsynced:?}");
                assert!(repaired.is_err(), "{what}");
                let disk = disk.after_crash(unsynced);
                repair(&disk).unwrap_or_else(|error| panic!("{what}: {error:#}"));
                let mut expected = before.clone();
                expected
                    .retain(|index, _| !paths.contains(&table.as_path()) || Some(*index) != tile_of(table));
                assert_eq!(contents(&disk).unwrap(), expected, "{what}");
                let (verification, found) = findings(&disk);
                assert!(verification.is_whole(), "{what}: {found:?}");
                for path in paths
                    .iter()
                    .filter(|path| path.parent() == Some(map()) || path.ends_with(table_name(storage)))
                {
                    let kept = disk
                        .files()
                        .into_iter()
                        .any(|(place, bytes)| place.starts_with("/map/quarantine") && bytes == cut(path));
                    assert!(kept, "{what}: {} is gone", path.display());
                }
            }
        }
    }
    println!("{points} crashes");
}

#[test]
fn impossible_numbers_in_the_log_are_damage() {
    let whole = small_map(Storage::OctoMap);
    let log = Path::new("/map/commits.log");
    let bytes = whole.files()[log].clone();
    // Fields of the last record from the beginning of its payload: flush, scan, and for the first tile: scan, lengths,
    // voxels, occupied.
    let mut last = 32;
    while last + 12 + length(&bytes, last) < bytes.len() {
        last += 12 + length(&bytes, last);
    }
    for field in [8, 16, 36, 44, 56, 68, 76] {
        let mut hostile = bytes.clone();
        let payload = last + 8..last + 8 + length(&bytes, last);
        hostile[payload.start + field..][..8].copy_from_slice(&u64::MAX.to_le_bytes());
        let crc = crc32fast::hash(&hostile[payload.clone()]);
        hostile[payload.end..payload.end + 4].copy_from_slice(&crc.to_le_bytes());
        let disk = whole.copy();
        disk.put(log, &hostile);
        let error = message_of(MapReader::open(MapPath::on(disk.shared(), map()), 0));
        assert!(
            error.contains("exceeds 2^62") || error.contains("tile sizes or counts out of range"),
            "{error:#}"
        );
        repair(&disk).unwrap();
        assert_eq!(contents(&disk).unwrap(), contents(&whole).unwrap());
    }
}

#[test]
fn tiles_are_checked_although_the_index_is_damaged() {
    for (index, storage, name) in [
        ("metadata.json", Storage::OctoMap, "iwlo_meta.bin"),
        ("metadata.json", Storage::OctoMap, "octree.bt"),
        ("metadata.json", Storage::Compact, "tile.vxt"),
        ("commits.log", Storage::OctoMap, "iwlo_meta.bin"),
        ("commits.log", Storage::OctoMap, "octree.bt"),
        ("commits.log", Storage::Compact, "tile.vxt"),
    ] {
        let whole = small_map(storage);
        let disk = whole.copy();
        let mut damaged = vec![map().join(index)];
        damaged.extend(whole.files().into_keys().filter(|path| path.ends_with(name)));
        for path in &damaged {
            let mut bytes = whole.files()[path].clone();
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            disk.put(path, &bytes);
        }
        let (_, found) = findings(&disk);
        for path in &damaged {
            assert!(found.iter().any(|finding| finding.path == *path), "{index}, {name}: {found:?}");
        }
        assert_eq!(found.len(), damaged.len(), "{index}, {name}: {found:?}");
    }
}

#[test]
fn verify_during_writes_finds_no_damage() {
    STORAGES.into_iter().for_each(verify_during_writes);
}

fn verify_during_writes(storage: Storage) {
    let disk = small_map(storage);
    let config = || MapReader::config_of(MapPath::on(disk.shared(), map())).unwrap();
    let open = || OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config()).unwrap();
    let (mut writer, mut seed) = (Some(open()), 10);
    let found = &mut Vec::new();
    let work = |_, _| {
        // A new writer each time, which does not know the readers.
        let mut mapper = writer.take().unwrap();
        for _ in 0..4 {
            seed += 1;
            mapper.insert_scan(&scan(seed)).unwrap();
            mapper.flush().unwrap();
        }
        drop(mapper);
        writer = Some(open());
    };
    let verification =
        verify(MapPath::on(disk.shared(), map()), |finding| found.push(finding.clone()), work).unwrap();
    assert!(verification.is_whole(), "{found:?}");
}

#[test]
fn a_repair_without_a_log_keeps_all_versions_of_tables() {
    STORAGES.into_iter().for_each(repair_without_a_log);
}

/// Returns the disk after a crash of the process at a change of a flush; `None` if the flush has fewer changes.
fn after_a_crash_in_a_flush(storage: Storage, at: u64) -> Option<FaultyDisk> {
    let disk = small_map(storage);
    let mut mapper = OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config()).unwrap();
    // Existing tiles and new ones.
    for seed in [1, 5, 6] {
        mapper.insert_scan(&scan(seed)).unwrap();
    }
    disk.set_fault(Fault::Crashes(at));
    let _ = mapper.flush();
    disk.has_crashed().then(|| disk.after_crash(Unsynced::Kept))
}

fn repair_without_a_log(storage: Storage) {
    let tables = |disk: &FaultyDisk| -> BTreeSet<Vec<u8>> {
        let files = disk.files().into_iter();
        files
            .filter(|(path, _)| path.to_string_lossy().contains(table_name(storage)))
            .map(|(_, bytes)| bytes)
            .collect()
    };
    let mut crashes = 0;
    for at in 0.. {
        let Some(left) = after_a_crash_in_a_flush(storage, at) else { break };
        left.take(Path::new("/map/commits.log"));
        let before: BTreeSet<_> = tables(&left);
        let repaired = repair(&left).unwrap();
        let kept = left.files().into_values().collect::<BTreeSet<_>>();
        assert!(before.iter().all(|table| kept.contains(table)), "crash at {at}: {repaired:?}");
        assert!(findings(&left).0.is_whole(), "crash at {at}");
        crashes += 1;
    }
    assert!(crashes > 15);
}

/// Whether a build can resume the map with its original input.
fn can_be_resumed(disk: &FaultyDisk) -> bool {
    let config = MapReader::config_of(MapPath::on(disk.shared(), map())).unwrap();
    let mut mapper = OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config).unwrap();
    match mapper.resume_input("random scans") {
        Err(Error::Mismatch { .. }) => false,
        resumed => resumed.is_ok(),
    }
}

/// The crash occurs after the commit and the replacement of `metadata.json`, when some tables have their final names.
/// The log is damaged.
#[test]
fn a_repair_with_a_damaged_log_completes_the_last_commit_and_drops_the_input() {
    for storage in STORAGES {
        let log = Path::new("/map/commits.log");
        let mut crashes = 0;
        for at in 0.. {
            let Some(left) = after_a_crash_in_a_flush(storage, at) else { break };
            let files = left.files();
            if !String::from_utf8_lossy(&files[Path::new("/map/metadata.json")])
                .contains("\"scan_number\": 5")
            {
                continue;
            }
            let committed = contents(&left).unwrap();
            let mut damaged = files[log].clone();
            let middle = damaged.len() / 2;
            damaged[middle] ^= 1;
            left.put(log, &damaged);
            let repaired = repair(&left).unwrap();
            assert_eq!(contents(&left).unwrap(), committed, "crash at {at}, {storage}: {repaired:?}");
            assert_eq!((repaired.tiles_lost, repaired.inputs_forgotten), (0, 1), "crash at {at}, {storage}");
            assert!(!repaired.is_complete());
            assert!(findings(&left).0.is_whole(), "crash at {at}, {storage}");
            assert!(!can_be_resumed(&left), "crash at {at}, {storage}");
            assert_eq!(repair(&left).unwrap().actions, 0);
            crashes += 1;
        }
        assert!(crashes > 5, "{crashes}");
    }
}

/// As after a copy that was made during a flush: the log and one tile are of an earlier flush.
#[test]
fn a_map_of_tiles_from_two_flushes_cannot_be_resumed() {
    for storage in STORAGES {
        let earlier = small_map(storage);
        let disk = earlier.copy();
        let mut mapper = OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config()).unwrap();
        for seed in [1, 5, 6] {
            mapper.insert_scan(&scan(seed)).unwrap();
        }
        mapper.flush().unwrap();
        drop(mapper);
        assert!(can_be_resumed(&disk));
        let (before, after) = (earlier.files(), disk.files());
        let table =
            before.keys().find(|path| path.ends_with(table_name(storage)) && before[*path] != after[*path]);
        let tile = table.unwrap().parent().unwrap();
        for (path, bytes) in before.iter().filter(|(path, _)| path.starts_with(tile)) {
            disk.put(path, bytes);
        }
        let log = Path::new("/map/commits.log");
        disk.put(log, &before[log]);
        let repaired = repair(&disk).unwrap();
        assert_eq!((repaired.tiles_lost, repaired.inputs_forgotten), (0, 1), "{storage}");
        assert!(!can_be_resumed(&disk), "{storage}");
    }
}

#[test]
fn metadata_of_another_map_is_repaired_without_losses() {
    for storage in STORAGES {
        let whole = small_map(storage);
        let other = small_map(storage);
        let mut mapper = OutOfCoreTileMapper::open(MapPath::on(other.shared(), map()), config()).unwrap();
        for seed in [1, 5, 6] {
            mapper.insert_scan(&scan(seed)).unwrap();
            mapper.flush().unwrap();
        }
        drop(mapper);
        let (log, metadata) = (Path::new("/map/commits.log"), Path::new("/map/metadata.json"));
        let (before, files) = (contents(&whole).unwrap(), whole.files());
        let with_others = || {
            let disk = whole.copy();
            disk.put(metadata, &other.files()[metadata]);
            disk
        };
        let index = |disk: &FaultyDisk| {
            let store = TileStore::open_read_only(disk.shared(), map()).unwrap();
            let inputs = store.metadata().ext.as_ref().unwrap().inputs.clone();
            (store.map_id(), store.commits().scan_number, store.commits().flush_number, inputs)
        };
        let disk = with_others();
        assert!(repair(&disk).unwrap().is_complete());
        assert_eq!((index(&disk), contents(&disk).unwrap()), (index(&whole), before.clone()), "{storage}");
        assert!(can_be_resumed(&disk), "{storage}");
        // Without a readable log, the tiles contain the map id and the number of scans.
        let mut cut = files[log].clone();
        cut.pop();
        for damaged in [None, Some(cut), Some(vec![0; 100])] {
            let disk = with_others();
            match &damaged {
                None => disk.take(log),
                Some(bytes) => disk.put(log, bytes),
            }
            let repaired = repair(&disk).unwrap();
            let what = format!("{storage}, {:?} bytes", damaged.map(|bytes| bytes.len()));
            assert_eq!((repaired.tiles_lost, contents(&disk).unwrap()), (0, before.clone()), "{what}");
            let (map_id, scan_number, ..) = index(&disk);
            assert_eq!((map_id, scan_number), (index(&whole).0, 2), "{what}");
            assert!(findings(&disk).0.is_whole(), "{what}");
        }
    }
}

/// As after a kill of the writer between the record of a commit and `metadata.json`.
#[test]
fn outdated_metadata_is_updated_from_the_log() {
    for storage in STORAGES {
        let disk = small_map(storage);
        let metadata = Path::new("/map/metadata.json");
        let earlier = disk.files()[metadata].clone();
        let mut mapper = OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config()).unwrap();
        mapper.insert_scan(&scan(5)).unwrap();
        mapper.flush().unwrap();
        drop(mapper);
        // The number of scans in the list is not part of a commit.
        let content = |disk: &FaultyDisk| {
            let text = String::from_utf8(disk.files()[metadata].clone()).unwrap();
            let is_kept = |line: &&str| !["scan_records", "crc32"].iter().any(|key| line.contains(key));
            text.lines().filter(is_kept).map(str::to_owned).collect::<Vec<_>>()
        };
        let (before, now) = (contents(&disk).unwrap(), content(&disk));
        disk.put(metadata, &earlier);
        let mut actions = Vec::new();
        let done = |action: &Action| actions.push((action.kind, action.path.clone()));
        let repaired = integrity::repair(MapPath::on(disk.shared(), map()), done, |_, _| ()).unwrap();
        assert!(repaired.is_complete(), "{storage}: {repaired:?}");
        assert_eq!(actions, [(ActionKind::Derived, metadata.to_owned())], "{storage}");
        assert_eq!((content(&disk), contents(&disk).unwrap()), (now, before), "{storage}");
        assert_eq!(repair(&disk).unwrap().actions, 0, "{storage}");
    }
}

#[test]
fn verify_reads_an_unchanged_log_at_most_three_times() {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), map()), config()).unwrap();
    for seed in 0..10 {
        let origin = [10.0 * seed as f64 + 0.5, 0.5, 1.0];
        mapper.insert_scan(&random_scan(&mut Random(seed), origin, 2)).unwrap();
    }
    mapper.flush().unwrap();
    drop(mapper);
    let disk = disk.copy();
    let files = disk.files();
    let tables = || files.iter().filter(|(path, _)| path.ends_with(table_name(Storage::OctoMap)));
    for (number, (path, bytes)) in tables().enumerate() {
        disk.take(path);
        let stray = map().join(format!("tile_0_{}_7", 50 + number));
        disk.shared().create_folder(&stray).unwrap();
        disk.put(&stray.join(path.file_name().unwrap()), bytes);
    }
    let (verification, found) = findings(&disk);
    let tiles = tables().count() as u64;
    assert!(tiles > 10);
    assert_eq!((verification.tiles, verification.damage), (tiles, 2 * tiles), "{found:?}");
    let opened = disk.times_opened(Path::new("/map/commits.log"));
    // Once for the first check, once for the second, once for the search for stray files.
    assert!(opened <= 3, "{opened} times for {tiles} tiles");
}

#[test]
fn foreign_files_are_kept_and_ignored() {
    let whole = small_map(Storage::OctoMap);
    let tile = whole.files().into_keys().find(|path| path.ends_with("octree.bt")).unwrap();
    let notes = Path::new("/map/notes.next");
    let disk = whole.copy();
    disk.put(notes, b"notes of a user");
    disk.shared().create_folder(Path::new("/map/old.next")).unwrap();
    disk.shared().create_folder(&tile.with_file_name("octree.bt.next")).unwrap();
    assert!(!findings(&disk).1.is_empty());
    drop(OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config()).unwrap());
    repair(&disk).unwrap();
    assert_eq!(disk.files()[notes], b"notes of a user");
    assert_eq!(contents(&disk).unwrap(), contents(&whole).unwrap());
    // Bytes after the end of the log.
    let disk = whole.copy();
    let log = Path::new("/map/commits.log");
    disk.put(log, &[&whole.files()[log][..], &[7; 1000]].concat());
    let (verification, found) = findings(&disk);
    assert_eq!((verification.damage, verification.notes), (0, 1), "{found:?}");
    // The log is deleted during a write.
    let disk = whole.copy();
    let mut mapper = OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config()).unwrap();
    mapper.insert_scan(&scan(1)).unwrap();
    disk.take(log);
    assert!(mapper.flush().is_err());
    assert!(disk.files().keys().all(|path| path != log), "a log without its beginning must not exist");
}

fn length(log: &[u8], record: usize) -> usize {
    u32::from_le_bytes(log[record..record + 4].try_into().unwrap()) as usize
}
