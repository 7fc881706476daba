use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::voxels_of;
use testkit::support::message_of;
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::integrity::verify;
use voxtile::space::TileIndex;
use voxtile::store::{InputContent, InputRecord, TileStore};
use voxtile::{Error, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper};
use voxtile_simulation::{City, Drive, Lidar, Survey};

fn config() -> MapConfig {
    MapConfig::new(0.1, 3.2).unwrap().with_cache_tiles(2).with_write_buffer_bytes(1000)
}

/// A flushed map of a few tiles.
fn map(folder: &TempDir) -> PathBuf {
    let path = folder.path().join("map");
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config()).unwrap();
    for seed in 0..3 {
        mapper.insert_scan(&random_scan(&mut Random(seed), [0.0; 3], 20)).unwrap();
    }
    mapper.flush().unwrap();
    path
}

fn open(path: &Path) -> voxtile::Result<OutOfCoreTileMapper> {
    OutOfCoreTileMapper::open(MapPath::on(UnsyncedDisk::shared(), path), config())
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

#[test]
fn a_crash_loses_only_scans_after_the_last_flush() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let flushed = voxels_of(&MapReader::open(&path, 1 << 20).unwrap());
    let mut mapper = open(&path).unwrap();
    for seed in 10..14 {
        // Evictions write tiles during this loop.
        mapper.insert_scan(&random_scan(&mut Random(seed), [0.5; 3], 30)).unwrap();
    }
    assert!(!mapper.take_saved_tiles().is_empty());
    assert_eq!(voxels_of(&MapReader::open(&path, 1 << 20).unwrap()), flushed, "a concurrent reader");
    let crashed = folder.path().join("crashed");
    copy(&path, &crashed);
    let reopened = open(&crashed).unwrap();
    assert_eq!((voxels_of(&reopened), reopened.scan_number()), (flushed, 3));
    let leftovers =
        walk(&crashed).into_iter().filter(|path| path.to_string_lossy().ends_with(".next")).count();
    assert_eq!(leftovers, 0);
}

/// Returns the start of the trailer of a table.
fn entries_end(table: &[u8]) -> usize {
    16 + 18 * u64::from_le_bytes(table[8..16].try_into().unwrap()) as usize
}

fn walk(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}

#[test]
fn opening_completes_the_renames_of_a_commit() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let before = folder.path().join("before");
    copy(&path, &before);
    let mut mapper = open(&path).unwrap();
    mapper.insert_scan(&random_scan(&mut Random(30), [0.0; 3], 30)).unwrap();
    mapper.flush().unwrap();
    let committed = voxels_of(&mapper);
    drop(mapper);
    // As after a power cut following the commit record: old files, new ones next to them, the new log.
    let cut = folder.path().join("cut");
    copy(&before, &cut);
    fs::copy(path.join("commits.log"), cut.join("commits.log")).unwrap();
    for (number, file) in walk(&path).into_iter().enumerate() {
        let name = file.strip_prefix(&path).unwrap();
        if name.components().count() == 2 {
            fs::create_dir_all(cut.join(name).parent().unwrap()).unwrap();
            let done = number % 3 == 0;
            let next = if done { cut.join(name) } else { cut.join(format!("{}.next", name.display())) };
            if fs::read(&file).unwrap() != fs::read(before.join(name)).unwrap_or_default() {
                fs::copy(&file, next).unwrap();
            }
        }
    }
    assert_eq!(voxels_of(&MapReader::open(&cut, 1 << 20).unwrap()), committed, "read without a writer");
    let mapper = open(&cut).unwrap();
    assert_eq!((voxels_of(&mapper), mapper.scan_number()), (committed, 4));
}

#[test]
fn one_writer_and_several_readers() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let writer = open(&path).unwrap();
    assert!(matches!(open(&path), Err(Error::Locked { .. })));
    assert!(MapReader::open(&path, 0).unwrap().digest().is_ok());
    drop(writer);
    assert!(open(&path).is_ok());
}

#[test]
fn a_reader_sees_one_flush_during_later_flushes() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let mut writer = open(&path).unwrap();
    let mut readers = Vec::new();
    for seed in 40..46 {
        // Opened for reading while versions wait for the commit.
        readers.push((MapReader::open(&path, 0).unwrap(), voxels_of(&MapReader::open(&path, 0).unwrap())));
        writer.insert_scan(&random_scan(&mut Random(seed), [0.0; 3], 30)).unwrap();
        writer.flush().unwrap();
        for (reader, voxels) in &readers {
            assert_eq!(&voxels_of(reader), voxels);
        }
        if seed == 43 {
            readers.remove(0);
        }
    }
    assert!(walk(&path).iter().any(|path| path.to_string_lossy().contains(".bin.flush")));
    readers.clear();
    writer.insert_scan(&random_scan(&mut Random(50), [0.0; 3], 30)).unwrap();
    writer.flush().unwrap();
    let kept = walk(&path).into_iter().filter(|path| path.to_string_lossy().contains(".bin.flush"));
    assert_eq!(kept.count(), 0, "no reader is left");
    assert_eq!(MapReader::open(&path, 0).unwrap().digest().unwrap(), writer.digest().unwrap());
}

/// Bytes of the tables that are kept for readers.
fn kept_bytes(map: &Path) -> u64 {
    let is_kept = |path: &PathBuf| path.to_string_lossy().contains(".bin.flush");
    walk(map).into_iter().filter(is_kept).map(|path| fs::metadata(path).unwrap().len()).sum()
}

#[test]
fn a_long_running_reader_keeps_one_version_of_its_tables() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let mut writer = open(&path).unwrap();
    let mut insert = |seed: u64| {
        // The robot moves, so that new tiles appear that the reader has never seen.
        let x = 0.2 * seed as f64;
        writer.insert_scan(&random_scan(&mut Random(seed), [x, 0.0, 0.0], 30)).unwrap();
        writer.flush().unwrap();
    };
    insert(0);
    let mut reader = MapReader::open(&path, 0).unwrap();
    let (digest, seen_bytes) = (reader.digest().unwrap(), reader.disk_bytes().unwrap().0);
    let mut later = None;
    for seed in 1..31 {
        insert(seed);
        if seed == 20 {
            later = Some(MapReader::open(&path, 0).unwrap());
        }
        let readers_bytes = seen_bytes + later.as_ref().map_or(0, |later| later.disk_bytes().unwrap().0);
        let kept = kept_bytes(&path);
        assert!(kept <= readers_bytes, "after {seed} flushes: {kept} bytes kept, {readers_bytes} seen");
        let kept_by = voxtile::operations::kept_bytes(&path).unwrap();
        assert_eq!((kept_by.reader_bytes, kept_by.snapshot_bytes), (kept, 0));
    }
    assert_eq!(reader.digest().unwrap(), digest);
    assert!(kept_bytes(&path) > 0);
    assert!(reader.refresh().unwrap() && !reader.refresh().unwrap());
    assert_eq!(reader.digest().unwrap(), MapReader::open(&path, 0).unwrap().digest().unwrap());
    drop(later);
    let now = reader.digest().unwrap();
    insert(31);
    assert!(kept_bytes(&path) <= reader.disk_bytes().unwrap().0);
    assert_eq!(reader.digest().unwrap(), now, "a writer must keep the tables of the refreshed reader");
    reader.refresh().unwrap();
    insert(32);
    drop(reader);
    insert(33);
    assert_eq!(kept_bytes(&path), 0);
}

#[test]
#[cfg(unix)]
fn a_removed_or_foreign_lock_never_allows_two_writers() {
    use std::os::unix::fs::PermissionsExt;
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let lock = path.join("writer.lock");
    let mut first = open(&path).unwrap();
    let scan = |seed| random_scan(&mut Random(seed), [0.0; 3], 10);
    first.insert_scan(&scan(1)).unwrap();
    first.flush().unwrap();
    // Read-only users must not be able to open the lock file, because they could lock it.
    let mode = fs::metadata(&lock).unwrap().permissions().mode();
    assert_eq!(mode & !(mode << 1) & 0o044, 0, "{mode:o}");
    fs::remove_file(&lock).unwrap();
    let mut second = open(&path).unwrap();
    second.insert_scan(&scan(2)).unwrap();
    // Already fails here if a tile must be evicted.
    let _ = first.insert_scan(&scan(3));
    assert!(matches!(first.flush(), Err(Error::LockLost { .. })));
    second.flush().unwrap();
    let digest = second.digest().unwrap();
    assert!(matches!(first.flush(), Err(Error::LockLost { .. })));
    drop((first, second));
    assert_eq!(open(&path).unwrap().digest().unwrap(), digest);
    // A lock file that others may read, as earlier versions created it.
    fs::set_permissions(&lock, fs::Permissions::from_mode(0o664)).unwrap();
    drop(open(&path).unwrap());
    assert_eq!(fs::metadata(&lock).unwrap().permissions().mode() & 0o777, 0o660);
    // A lock that is not a file is reported and moved away.
    fs::remove_file(&lock).unwrap();
    fs::create_dir(&lock).unwrap();
    assert!(message_of(open(&path)).contains("writer.lock"));
    let mut found = Vec::new();
    verify(&path, |finding| found.push(finding.path.clone()), |_, _| ()).unwrap();
    assert_eq!(found, [lock]);
    assert!(voxtile::integrity::repair(&path, |_| (), |_, _| ()).unwrap().is_complete());
    assert_eq!(open(&path).unwrap().digest().unwrap(), digest);
}

#[test]
fn a_folder_in_place_of_an_octree_is_moved_away() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let mut writer = open(&path).unwrap();
    let scan = |seed| random_scan(&mut Random(seed), [0.0; 3], 10);
    writer.insert_scan(&scan(1)).unwrap();
    writer.flush().unwrap();
    let octrees: Vec<_> = walk(&path).into_iter().filter(|path| path.ends_with("octree.bt")).collect();
    for octree in &octrees {
        fs::remove_file(octree).unwrap();
        fs::create_dir(octree).unwrap();
        fs::write(octree.join("note"), "a foreign file").unwrap();
    }
    for seed in 2..4 {
        writer.insert_scan(&scan(seed)).unwrap();
        writer.flush().unwrap();
    }
    let digest = writer.digest().unwrap();
    drop(writer);
    assert!(octrees.iter().any(|octree| octree.is_file()));
    assert!(walk(&path).iter().any(|path| path.ends_with("note")), "moved, not deleted");
    voxtile::integrity::repair(&path, |_| (), |_, _| ()).unwrap();
    assert!(verify(&path, |_| (), |_, _| ()).unwrap().is_whole());
    assert_eq!(open(&path).unwrap().digest().unwrap(), digest);
}

#[test]
fn different_parameters_are_errors_with_both_values() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let other = |resolution_m, tile_size_m| MapConfig::new(resolution_m, tile_size_m).unwrap();
    let iwlo = voxtile::sensor::SensorModel::Iwlo(voxtile::sensor::Iwlo::default());
    for (config, message) in [
        (other(0.2, 3.2), "resolution 0.1 m, not 0.2 m"),
        (other(0.1, 1.6), "tile size 3.2 m, not 1.6 m"),
        (config().with_sensor_model(iwlo), "sensor model"),
    ] {
        let error = OutOfCoreTileMapper::open(&path, config).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
    assert!(matches!(OutOfCoreTileMapper::create(&path, config()), Err(Error::AlreadyExists { .. })));
    assert!(matches!(open(&folder.path().join("none")), Err(Error::NoMap { .. })));
}

#[test]
fn damage_is_reported_and_never_overwritten() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let tile = TileIndex::new(0, 0, 0);
    let file = path.join("tile_0_0_0/iwlo_meta.bin");
    let whole = fs::read(&file).unwrap();
    let other = fs::read(path.join("tile_-1_0_0/iwlo_meta.bin")).unwrap();
    let without_trailer = whole[..entries_end(&whole)].to_vec();
    let mut cases = vec![whole[..whole.len() / 2].to_vec(), other, without_trailer, Vec::new()];
    for at in (0..whole.len()).step_by(whole.len() / 150) {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at % 8);
        cases.push(flipped);
    }
    for damaged in cases {
        fs::write(&file, &damaged).unwrap();
        let reader = MapReader::open(&path, 1 << 20).unwrap();
        let error = reader.tile(tile).unwrap_err();
        assert!(matches!(&error, Error::Damaged { tile: Some(named), .. } if *named == tile), "{error:#}");
        assert!(error.to_string().contains("tile_0_0_0"), "{error:#}");
        assert!(reader.tile(TileIndex::new(-1, 0, 0)).unwrap().is_some(), "other tiles can be read");
        // A scan that touches the damaged tile fails as a whole, and the file is kept.
        let mut mapper = open(&path).unwrap();
        let before = mapper.scan_number();
        assert!(mapper.insert_scan(&random_scan(&mut Random(3), [0.0; 3], 30)).is_err());
        assert_eq!(mapper.scan_number(), before);
        mapper.flush().unwrap();
        assert_eq!(fs::read(&file).unwrap(), damaged);
    }
    fs::remove_file(&file).unwrap();
    let error = message_of(MapReader::open(&path, 1 << 20).unwrap().tile(tile));
    assert!(error.contains("the file is missing"), "{error}");
}

#[test]
fn an_older_version_of_a_tile_is_damage() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let file = path.join("tile_0_0_0/iwlo_meta.bin");
    let old = fs::read(&file).unwrap();
    let mut mapper = open(&path).unwrap();
    mapper.insert_scan(&random_scan(&mut Random(3), [0.0; 3], 30)).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    fs::write(&file, old).unwrap();
    let error = message_of(MapReader::open(&path, 1 << 20).unwrap().digest());
    assert!(
        error.contains("the file is from scan 3, but commits.log records the version from scan 4"),
        "{error}"
    );
}

#[test]
fn a_stray_tile_folder_is_neither_read_nor_overwritten() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    copy(&path.join("tile_0_0_0"), &path.join("tile_0_0_7"));
    let mapper = open(&path).unwrap();
    let error = message_of(mapper.tile(TileIndex::new(0, 0, 7)));
    assert!(error.contains("commits.log has no entry for this tile"), "{error}");
}

#[test]
fn a_map_of_the_original_format_is_converted_on_the_first_write() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let voxels = voxels_of(&MapReader::open(&path, 1 << 20).unwrap());
    // Remove all voxtile extensions and the order of the entries.
    fs::remove_file(path.join("commits.log")).unwrap();
    let metadata = r#"{"version": "1.0", "resolution": 0.1, "tile_size": 3.2, "bounds": {"min": [0,0,0], "max": [0,0,0]}}"#;
    fs::write(path.join("metadata.json"), metadata).unwrap();
    for file in walk(&path).into_iter().filter(|path| path.ends_with("iwlo_meta.bin")) {
        let bytes = fs::read(&file).unwrap();
        let mut entries: Vec<&[u8]> = bytes[16..entries_end(&bytes)].chunks(18).collect();
        entries.reverse();
        fs::write(&file, [&bytes[..16], &entries.concat()].concat()).unwrap();
    }
    let reader = MapReader::open(&path, 1 << 20).unwrap();
    assert!(!reader.is_verified());
    assert_eq!(voxels_of(&reader), voxels);

    let mut mapper = open(&path).unwrap();
    assert_eq!(voxels_of(&mapper), voxels);
    mapper.insert_scan(&random_scan(&mut Random(5), [0.0; 3], 30)).unwrap();
    mapper.flush().unwrap();
    let reader = MapReader::open(&path, 1 << 20).unwrap();
    assert!(reader.is_verified());
    assert_eq!(voxels_of(&reader), voxels_of(&mapper));
}

#[test]
fn inputs_with_long_names_and_many_skipped_scans() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("map");
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config()).unwrap();
    let long = |number: u64| format!("{number} {}", "\u{e9}".repeat(2000));
    let content = InputContent { scans: 5000, skipped: (4000..5000).collect(), ..InputContent::default() };
    let mut begin = |number, content: Option<&InputContent>| {
        let record = InputRecord { content: content.cloned(), ..InputRecord::from(long(number)) };
        mapper.begin_input(record).unwrap();
        mapper.insert_scan(&random_scan(&mut Random(number), [0.0; 3], 2)).unwrap();
    };
    for number in 0..60 {
        begin(number, Some(&content));
    }
    begin(60, None);
    mapper.flush().unwrap();
    drop(mapper);
    // Earlier versions read at most this much.
    assert!(fs::metadata(path.join("metadata.json")).unwrap().len() < 1 << 20);
    let mut mapper = open(&path).unwrap();
    let inputs = mapper.inputs();
    assert!((20..60).contains(&inputs.len()), "{}", inputs.len());
    assert!(inputs.iter().all(|input| (250..=255).contains(&input.name.len())));
    let firsts: Vec<u64> = inputs.iter().map(|input| input.first_scan).collect();
    assert_eq!(firsts, (61 - inputs.len() as u64..61).collect::<Vec<_>>(), "the latest");
    assert_eq!(mapper.resume_input(&long(60)).unwrap(), 1);
    assert!(verify(&path, |_| (), |_, _| ()).unwrap().is_whole());
}

#[test]
fn metadata_of_more_than_1_mib_is_read_and_shortened_by_the_next_flush() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let file = path.join("metadata.json");
    let mut metadata = TileStore::open_read_only(UnsyncedDisk::shared(), &path).unwrap().metadata().clone();
    let inputs = (0..300).map(|number| InputRecord::from(format!("{number} {}", "x".repeat(4096))));
    metadata.ext.as_mut().unwrap().inputs = inputs.collect();
    fs::write(&file, metadata.to_text()).unwrap();
    assert!(fs::metadata(&file).unwrap().len() > 1 << 20);
    assert!(verify(&path, |_| (), |_, _| ()).unwrap().is_whole());
    let mut mapper = open(&path).unwrap();
    mapper.insert_scan(&random_scan(&mut Random(3), [0.0; 3], 30)).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    assert!(fs::metadata(&file).unwrap().len() < 1 << 20);
    let inputs = open(&path).unwrap().inputs();
    assert!((100..300).contains(&inputs.len()) && inputs.last().unwrap().name.starts_with("299 x"));
}

/// A file of a file manager, and a name that is not valid UTF-8.
#[test]
#[cfg(target_os = "linux")]
fn a_foreign_file_in_the_folder_of_a_removed_tile_is_kept() {
    use std::os::unix::ffi::OsStrExt;
    let tile = TileIndex::new(0, 0, 0);
    for name in [&b".DS_Store"[..], b"na\xefve"] {
        let folder = TempDir::new().unwrap();
        let path = map(&folder);
        let stray = path.join("tile_0_0_0").join(std::ffi::OsStr::from_bytes(name));
        fs::write(&stray, "a foreign file").unwrap();
        let mut store = TileStore::open(UnsyncedDisk::shared(), &path).unwrap();
        store.remove(tile).unwrap();
        store.commit(store.metadata().clone(), store.commits().scan_number).unwrap();
        drop(store);
        // The first writer completes the removal; later ones find the remaining file.
        for seed in 60..63 {
            let mut mapper = open(&path).unwrap();
            mapper.insert_scan(&random_scan(&mut Random(seed), [100.0, 0.0, 0.0], 10)).unwrap();
            mapper.flush().unwrap();
        }
        assert!(verify(&path, |_| (), |_, _| ()).unwrap().is_whole());
        assert!(voxtile::integrity::repair(&path, |_| (), |_, _| ()).unwrap().is_complete());
        let mut mapper = open(&path).unwrap();
        assert!(mapper.tile(tile).unwrap().is_none());
        mapper.insert_scan(&random_scan(&mut Random(3), [0.0; 3], 30)).unwrap();
        mapper.flush().unwrap();
        assert!(mapper.tile(tile).unwrap().is_some());
        drop(mapper);
        assert!(verify(&path, |_| (), |_, _| ()).unwrap().is_whole());
        assert_eq!(fs::read(&stray).unwrap(), b"a foreign file");
    }
}

#[test]
fn octree_files_equal_the_octree_of_the_table() {
    let folder = TempDir::new().unwrap();
    let path = map(&folder);
    let reader = MapReader::open(&path, 1 << 20).unwrap();
    for tile in reader.tiles() {
        let tile = tile.unwrap();
        let mut expected = Vec::new();
        voxtile::octree::write_bt(&tile.octree(), 0.1, 0.0, &mut expected).unwrap();
        let index = tile.index();
        let file = path.join(format!("tile_{}_{}_{}/octree.bt", index.x, index.y, index.z));
        assert_eq!(fs::read(file).unwrap(), expected);
    }
}

/// The digest is stable: the map in the repository has that of a rebuilt map of the same city.
#[test]
fn the_example_map_has_the_digest_of_its_rebuilt_city() {
    let golden = "a6c7d4295b7b4c7095b24eac4ea6227dfb799ad759fa1b4428543507e5ac7b7b";
    let example_folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("map_tiles_example");
    let example = MapReader::open(&example_folder, 1 << 20).unwrap();
    assert_eq!(example.digest().unwrap().to_string(), golden);
    for tile in example.tiles() {
        let tile = tile.unwrap();
        let (mut by_table, mut by_tree) = (Vec::new(), Vec::new());
        tile.table().write_bt(1.0, 0.0, &mut by_table).unwrap();
        voxtile::octree::write_bt(&tile.octree(), 1.0, 0.0, &mut by_tree).unwrap();
        let TileIndex { x, y, z } = tile.index();
        let file = fs::read(example_folder.join(format!("tile_{x}_{y}_{z}/octree.bt"))).unwrap();
        assert!(by_table == file && by_tree == file, "tile {x} {y} {z}");
    }
    let config = MapConfig::new(1.0, 10.0).unwrap().with_range(0.0, 40.0);
    let mut mapper = voxtile::InMemoryMapper::new(config).unwrap();
    let survey = Survey::new(City::new(1), Drive::new(1, 2.0), Lidar::demo(), 1);
    for scan in survey.take(10) {
        mapper.insert_scan(&scan).unwrap();
    }
    assert_eq!(mapper.digest().unwrap().to_string(), golden);
}
