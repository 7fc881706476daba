use crate::harness::{at, config, digest_of, is_whole, make_foreign, map, name};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{Voxels, voxels_of};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::integrity::{Severity, repair, verify};
use voxtile::operations::{Diff, TileChange, TileDiff, delete_snapshot, diff, revert, snapshot, snapshots};
use voxtile::store::{Disk, EntryKind, FsDisk, TileFile, TileStore};
use voxtile::{
    Digest, Error, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper, Scan,
    Storage,
};

fn scan(seed: u64) -> Scan {
    random_scan(&mut Random(seed), [[0.0, 3.0, 6.0, 3.0][seed as usize % 4], 0.0, 0.0], 5)
}

/// A map in memory with three scans flushed one by one, a snapshot after the first and the second, and the digests.
fn small(storage: Storage) -> (FaultyDisk, Vec<Digest>) {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config().with_storage(storage)).unwrap();
    mapper.begin_input("scans").unwrap();
    let mut digests = Vec::new();
    for (seed, of) in (1..).zip([Some("first"), Some("second"), None]) {
        mapper.insert_scan(&scan(4 * seed)).unwrap();
        mapper.insert_scan(&scan(4 * seed + 1)).unwrap();
        mapper.flush().unwrap();
        digests.push(mapper.digest().unwrap());
        if let Some(of) = of {
            mapper.snapshot(&name(of)).unwrap();
        }
    }
    drop(mapper);
    (disk.copy(), digests)
}

#[test]
fn a_revert_restores_everything_and_does_not_affect_open_readers() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        for disk in [small(storage).0, small(storage).0.without_links()] {
            let (_, digests) = small(storage);
            let reader = MapReader::open(at(&disk), 0).unwrap();
            let reverted = revert(at(&disk), &name("first"), Some(&name("third")), |_, _| ()).unwrap();
            assert_eq!((reverted.scan_number_before, reverted.scan_number), (6, 2));
            assert!(reverted.flush_number > reader.flush_number());
            assert_eq!(reader.digest().unwrap(), digests[2], "a reader across the revert");
            for (of, digest) in [(None, 0), (Some("first"), 0), (Some("second"), 1), (Some("third"), 2)] {
                assert_eq!(digest_of(&disk, of).unwrap(), digests[digest], "{of:?}");
            }
            drop(reader);
            // The input is that of the snapshot, and inserting the same scans again gives the same maps.
            let mut mapper = OutOfCoreTileMapper::open(at(&disk), config().with_storage(storage)).unwrap();
            assert_eq!(mapper.resume_input("scans").unwrap(), 2);
            for seed in 2..4 {
                mapper.insert_scan(&scan(4 * seed)).unwrap();
                mapper.insert_scan(&scan(4 * seed + 1)).unwrap();
            }
            mapper.flush().unwrap();
            assert_eq!(mapper.digest().unwrap(), digests[2]);
            drop(mapper);
            for of in ["first", "second", "third"] {
                delete_snapshot(at(&disk), &name(of)).unwrap();
            }
            let kept = disk.files().into_keys().filter(|path| path.to_string_lossy().contains(".flush"));
            assert_eq!(kept.count(), 0, "no kept table is needed");
        }
    }
}

/// After a revert, the current and the kept table have the same bytes, as hard links or as two files.
#[test]
fn a_kept_table_takes_the_place_of_a_damaged_one_with_the_same_bytes() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        for disk in [small(storage).0, small(storage).0.without_links()] {
            let (_, digests) = small(storage);
            revert(at(&disk), &name("first"), None, |_, _| ()).unwrap();
            let (whole, table) = (disk.copy(), TileFile::Table.name(storage));
            let files = whole.files();
            let is_twice = |path: &Path, bytes: &[u8]| {
                let is_same = |(other, kept): (&PathBuf, &Vec<u8>)| {
                    other.parent() == path.parent() && other != path && kept == bytes
                };
                path.ends_with(table) && files.iter().any(is_same)
            };
            let tables: Vec<_> = files.iter().filter(|(path, bytes)| is_twice(path, bytes)).collect();
            assert!(!tables.is_empty());
            for (path, bytes) in tables {
                check_restored(&whole, (path, bytes), &digests, storage);
            }
        }
    }
}

fn check_restored(
    whole: &FaultyDisk,
    (path, bytes): (&PathBuf, &Vec<u8>),
    digests: &[Digest],
    storage: Storage,
) {
    let mut bad = bytes.clone();
    bad[bytes.len() / 2] ^= 4;
    let damaged = || {
        let disk = whole.copy();
        disk.put(path, &bad);
        disk
    };
    let repaired = |disk: &FaultyDisk| repair(at(disk), |_| (), |_, _| ()).unwrap();
    let check = |disk: &FaultyDisk, what: &str| {
        let what = format!("{}, {storage}, {what}", path.display());
        let kept =
            |(place, kept): (PathBuf, Vec<u8>)| place.starts_with(map().join("quarantine")) && kept == bad;
        assert_eq!(disk.files()[path], *bytes, "{what}");
        assert!(disk.files().into_iter().any(kept), "{what}");
        assert!(is_whole(disk), "{what}");
        for (of, digest) in [(None, 0), (Some("first"), 0), (Some("second"), 1)] {
            assert_eq!(digest_of(disk, of).unwrap(), digests[digest], "{what}, {of:?}");
        }
    };
    let disk = damaged();
    let repair_of_all = repaired(&disk);
    assert!(repair_of_all.is_complete() && repair_of_all.actions > 0, "{}", path.display());
    check(&disk, "at once");
    for change in 0.. {
        let disk = damaged();
        disk.set_fault(Fault::Crashes(change));
        let _ = repair(at(&disk), |_| (), |_, _| ());
        if !disk.has_crashed() {
            break;
        }
        for unsynced in [Unsynced::Dropped, Unsynced::Kept] {
            let disk = disk.after_crash(unsynced);
            repaired(&disk);
            check(&disk, &format!("after change {change}, {unsynced:?}"));
        }
    }
}

#[test]
fn own_bytes_are_freed_by_a_deletion() {
    let (disk, _) = small(Storage::OctoMap);
    // The log and `metadata.json` grow with each operation.
    let is_counted = |path: &Path| path.parent() != Some(map());
    let files = || disk.files().into_iter().filter(|(path, _)| is_counted(path));
    let bytes = || files().map(|(_, bytes)| bytes.len() as u64).sum::<u64>();
    for of in ["second", "first"] {
        let infos = snapshots(at(&disk)).unwrap();
        let info = infos.iter().find(|info| info.name == of).unwrap();
        let before = bytes();
        delete_snapshot(at(&disk), &name(of)).unwrap();
        assert_eq!(before - bytes(), info.own_bytes, "{of}");
        assert!(info.own_bytes > 500, "{of}");
    }
}

#[test]
fn wrong_names_are_errors_with_a_remedy() {
    let (disk, _) = small(Storage::OctoMap);
    let error = snapshot(at(&disk), &name("first")).unwrap_err();
    assert!(matches!(error, Error::AlreadyExists { .. }), "{error:#}");
    let revert = |to, keep: Option<&str>| {
        revert(at(&disk), &name(to), keep.map(name).as_ref(), |_, _| ()).unwrap_err()
    };
    assert!(matches!(revert("first", Some("second")), Error::AlreadyExists { .. }));
    for error in [
        revert("none", Some("kept")),
        delete_snapshot(at(&disk), &name("none")).unwrap_err(),
        MapReader::open_snapshot(at(&disk), &name("none"), 0).unwrap_err(),
    ] {
        assert!(error.to_string().contains("`voxtile snapshots /city/map` lists them"), "{error:#}");
    }
    assert_eq!(snapshots(at(&disk)).unwrap().len(), 2, "a failed call must not create a snapshot");
    let writer = TileStore::open(disk.shared(), map()).unwrap();
    assert!(matches!(snapshot(at(&disk), &name("x")), Err(Error::Locked { .. })));
    drop(writer);
}

#[test]
fn a_map_of_the_original_format_is_converted_by_its_first_snapshot() {
    let (disk, digests) = small(Storage::OctoMap);
    make_foreign(&disk, map());
    snapshot(at(&disk), &name("adopted")).unwrap();
    assert!(MapReader::open(at(&disk), 0).unwrap().is_verified());
    assert_eq!(digest_of(&disk, Some("adopted")).unwrap(), digests[2]);
}

/// Damage at every few bytes of a snapshot and of tables that only snapshots need, and removal of these files: it is
/// found and repaired, and the map and intact parts of snapshots are unchanged.
#[test]
fn damage_to_files_of_snapshots_is_found_and_repaired() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let (whole, digests) = small(storage);
        let is_of_snapshots = |path: &Path| {
            path.parent().is_some_and(|folder| folder.ends_with("snapshots"))
                || path.to_string_lossy().contains(".flush")
        };
        let mut damages = 0;
        for (path, bytes) in whole.files().into_iter().filter(|(path, _)| is_of_snapshots(path)) {
            for at in (0..=bytes.len()).step_by(23) {
                let disk = whole.copy();
                match bytes.get(at) {
                    Some(_) if at % 2 == 0 => {
                        let mut flipped = bytes.clone();
                        flipped[at] ^= 1 << (at % 8);
                        disk.put(&path, &flipped);
                    }
                    Some(_) => disk.put(&path, &bytes[..at]),
                    None => disk.take(&path),
                }
                damages += 1;
                check_repair(&disk, &digests, &path, &format!("{}, byte {at}", path.display()));
            }
        }
        println!("{damages} damages");
        assert!(damages > 100);
    }
}

fn check_repair(disk: &FaultyDisk, digests: &[Digest], path: &Path, what: &str) {
    let mut named = false;
    let found = |finding: &voxtile::integrity::Finding| {
        named |= finding.severity == Severity::Damage && finding.path == path;
    };
    assert!(!verify(at(disk), found, |_, _| ()).unwrap().is_whole(), "{what}");
    let is_missing = !disk.files().contains_key(path);
    assert!(named || is_missing, "{what}: the file is not named");
    assert_eq!(digest_of(disk, None).unwrap(), digests[2], "{what}");
    // A writer removes no file that a snapshot may need.
    let files = disk.files();
    drop(TileStore::open(disk.shared(), map()).unwrap());
    assert_eq!(disk.files(), files, "{what}");
    let repair = repair(at(disk), |_| (), |_, _| ()).unwrap();
    assert!(repair.actions > 0 && repair.tiles_lost == 0, "{what}");
    let lost: u64 =
        disk.files().keys().filter(|path| path.starts_with(map().join("quarantine"))).count() as u64;
    assert!(lost > 0 || is_missing, "{what}: the damaged file must be in quarantine");
    let verification = verify(at(disk), |_| (), |_, _| ()).unwrap();
    assert!(verification.is_whole(), "{what}");
    assert_eq!(digest_of(disk, None).unwrap(), digests[2], "{what}");
    for info in snapshots(at(disk)).unwrap() {
        assert!(info.damage.is_none(), "{what}");
        let digest = digest_of(disk, Some(&info.name)).unwrap();
        let was = &digests[usize::from(info.name == "second")];
        assert!(digest == *was || repair.snapshot_tiles_lost > 0, "{what}: {}", info.name);
    }
}

/// One of two snapshots has lost a table of a tile. The look-up by flush number must not use the table of the other
/// snapshot, whatever their names are.
#[test]
fn a_snapshot_without_its_own_table_is_damage() {
    for names in [["a", "b"], ["b", "a"]] {
        let disk = FaultyDisk::new(Fault::None);
        let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
        for (seed, of) in (1..).zip([Some(names[0]), Some(names[1]), None]) {
            for number in 0..8 {
                mapper.insert_scan(&scan(4 * (8 * seed + number))).unwrap();
            }
            mapper.flush().unwrap();
            of.into_iter().for_each(|of| mapper.snapshot(&name(of)).unwrap());
        }
        drop(mapper);
        let kept = |path: &PathBuf| path.to_string_lossy().contains(".flush");
        let tables: Vec<_> = disk.files().into_keys().filter(kept).collect();
        let twice = tables.windows(2).find(|two| two[0].parent() == two[1].parent()).unwrap();
        disk.take(&twice[0]);
        let mut found = Vec::new();
        verify(at(&disk), |finding| found.push(finding.clone()), |_, _| ()).unwrap();
        assert!(found.iter().any(|finding| finding.severity == Severity::Damage), "{names:?}: {found:?}");
        assert!(digest_of(&disk, Some(names[0])).is_err());
    }
}

#[test]
fn a_repair_does_not_change_intact_snapshots() {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    let mut digests = BTreeMap::new();
    for names in [&["a", "b", "c"][..], &["d", "e"], &["f"], &[]] {
        // The same tiles each time.
        mapper.insert_scan(&scan(4)).unwrap();
        mapper.flush().unwrap();
        for of in names {
            mapper.snapshot(&name(of)).unwrap();
            digests.insert(*of, mapper.digest().unwrap());
        }
    }
    drop(mapper);
    let files = disk.files();
    let kept: Vec<_> = files.keys().filter(|path| path.to_string_lossy().contains(".flush")).collect();
    assert!(kept.len() > 5);
    for path in kept {
        for is_missing in [true, false] {
            let damaged = disk.copy();
            match is_missing {
                true => damaged.take(path),
                false => damaged.put(path, b"damaged"),
            }
            repair(at(&damaged), |_| (), |_, _| ()).unwrap();
            assert!(is_whole(&damaged));
            let flush = path.to_string_lossy().rsplit_once(".flush").unwrap().1.to_owned();
            let hit = [("4", &["a", "b", "c"][..]), ("7", &["d", "e"]), ("9", &["f"])];
            let (_, hit) = hit.iter().find(|(number, _)| *number == flush).unwrap();
            for (of, digest) in &digests {
                let found = digest_of(&damaged, Some(of)).unwrap();
                assert_eq!(found == *digest, !hit.contains(of), "{}: {of}", path.display());
            }
        }
    }
}

/// After a repair from the tiles alone, snapshots are unchanged, also after further scans.
#[test]
fn snapshots_survive_the_loss_of_the_log_and_of_current_tables() {
    let (whole, digests) = small(Storage::OctoMap);
    for lost in [&["commits.log"][..], &["commits.log", "metadata.json"]] {
        let disk = whole.copy();
        lost.iter().for_each(|file| disk.take(&map().join(file)));
        repair(at(&disk), |_| (), |_, _| ()).unwrap();
        let mut mapper = OutOfCoreTileMapper::open(at(&disk), config());
        for seed in 30..34 {
            // Without metadata.json the ray ranges are lost, which does not affect snapshots.
            let mapper = mapper.as_mut().unwrap();
            mapper.insert_scan(&scan(seed)).unwrap();
            mapper.flush().unwrap();
        }
        drop(mapper);
        assert_eq!(digest_of(&disk, Some("first")).unwrap(), digests[0], "{lost:?}");
        assert_eq!(digest_of(&disk, Some("second")).unwrap(), digests[1], "{lost:?}");
    }
    // A current table is damaged: the tile is lost from the map, but not from snapshots.
    let disk = whole.copy();
    let files = disk.files();
    let kept = files.keys().find(|path| path.to_string_lossy().contains(".flush")).unwrap();
    disk.put(&kept.with_file_name("iwlo_meta.bin"), b"damaged");
    let repair = repair(at(&disk), |_| (), |_, _| ()).unwrap();
    assert_eq!(repair.tiles_lost, 1);
    assert!(is_whole(&disk));
    assert_eq!(digest_of(&disk, Some("first")).unwrap(), digests[0]);
    revert(at(&disk), &name("first"), None, |_, _| ()).unwrap();
    assert_eq!(digest_of(&disk, None).unwrap(), digests[0], "the tile is back");
}

/// The crash occurs after a flush is committed and recorded in `metadata.json`, and before all its tables have their
/// final names. The log is lost.
#[test]
fn a_repair_that_completes_a_commit_does_not_change_snapshots() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let (whole, digests) = small(storage);
        snapshot(at(&whole), &name("third")).unwrap();
        let mut crashes = 0;
        for moment in 0.. {
            let disk = whole.copy();
            let mut mapper = OutOfCoreTileMapper::open(at(&disk), config().with_storage(storage)).unwrap();
            mapper.insert_scan(&scan(28)).unwrap();
            mapper.insert_scan(&scan(29)).unwrap();
            disk.set_fault(Fault::Crashes(moment));
            let _ = mapper.flush();
            drop(mapper);
            if !disk.has_crashed() {
                break;
            }
            let left = disk.after_crash(Unsynced::Kept);
            let metadata = left.files()[&map().join("metadata.json")].clone();
            if !String::from_utf8_lossy(&metadata).contains("\"scan_number\": 8") {
                continue;
            }
            let what = format!("crash at {moment}, {storage}");
            let now = digest_of(&left, None).unwrap();
            left.take(&map().join("commits.log"));
            repair(at(&left), |_| (), |_, _| ()).unwrap();
            assert_eq!(digest_of(&left, None).unwrap(), now, "{what}");
            for (of, digest) in ["first", "second", "third"].into_iter().zip(&digests) {
                assert_eq!(digest_of(&left, Some(of)).unwrap(), *digest, "{what}: {of}");
            }
            let verified = verify(at(&left), |_| (), |_, _| ()).unwrap();
            assert!(verified.is_whole(), "{what}");
            crashes += 1;
        }
        assert!(crashes > 5, "{crashes}");
    }
}

#[test]
fn a_file_in_place_of_the_folder_of_snapshots_is_damage_even_without_snapshots() {
    let (disk, digests) = small(Storage::OctoMap);
    for of in ["first", "second"] {
        delete_snapshot(at(&disk), &name(of)).unwrap();
    }
    let folder = map().join("snapshots");
    disk.take(&folder);
    disk.put(&folder, b"no folder");
    let mut found = Vec::new();
    let mut note =
        |finding: &voxtile::integrity::Finding| found.push((finding.severity, finding.path.clone()));
    verify(at(&disk), &mut note, |_, _| ()).unwrap();
    assert_eq!(found, [(Severity::Damage, folder)]);
    repair(at(&disk), |_| (), |_, _| ()).unwrap();
    assert!(is_whole(&disk));
    assert_eq!(digest_of(&disk, None).unwrap(), digests[2]);
}

/// The naive difference of two maps, voxel by voxel.
fn naive_diff(config: &MapConfig, a: &Voxels, b: &Voxels) -> BTreeMap<[i32; 3], [u64; 5]> {
    let mut tiles: BTreeMap<[i32; 3], [u64; 5]> = BTreeMap::new();
    let is_occupied = |bits: u64| f64::from_bits(bits) >= 0.0;
    for voxel in a.keys().chain(b.keys()).collect::<std::collections::BTreeSet<_>>() {
        let kind = match (a.get(voxel), b.get(voxel)) {
            (None, _) => 0,
            (_, None) => 1,
            (Some(a), Some(b)) if !is_occupied(a.0) && is_occupied(b.0) => 2,
            (Some(a), Some(b)) if is_occupied(a.0) && !is_occupied(b.0) => 3,
            (Some(a), Some(b)) if a != b => 4,
            _ => continue,
        };
        tiles.entry(config.grid.tile_of_voxel(*voxel).to_array()).or_default()[kind] += 1;
    }
    tiles
}

#[test]
fn a_diff_equals_the_naive_diff() {
    let folder = TempDir::new().unwrap();
    let build = |map: &str, storage, seeds: std::ops::Range<u64>| {
        let path = folder.path().join(map);
        let mut mapper = OutOfCoreTileMapper::create(
            MapPath::on(UnsyncedDisk::shared(), &path),
            config().with_storage(storage),
        )
        .unwrap();
        for seed in seeds {
            mapper.insert_scan(&scan(seed)).unwrap();
            mapper.snapshot(&name(&format!("s{seed}"))).unwrap();
        }
        path
    };
    let (a, b) = (build("a", Storage::OctoMap, 0..6), build("b", Storage::Compact, 3..8));
    let empty = build("empty", Storage::OctoMap, 0..0);
    let open = |map: &Path| MapReader::open(map, 1 << 20).unwrap();
    let at = |seed: u64| MapReader::open_snapshot(&a, &name(&format!("s{seed}")), 1 << 20).unwrap();
    let pairs = [
        (at(0), at(5)),
        (at(4), at(2)),
        (at(3), at(4)),
        (at(5), open(&a)),
        (open(&a), open(&b)),
        (open(&b), open(&a)),
        (open(&a), open(&empty)),
        (open(&empty), open(&b)),
    ];
    for (number, (from, to)) in pairs.iter().enumerate() {
        let mut found: Vec<TileDiff> = Vec::new();
        let Diff { tiles_appeared, tiles_gone, tiles_changed, tiles_equal, tiles_read, .. } =
            diff(from, to, |tile| found.push(tile), |_, _| ()).unwrap();
        let naive = naive_diff(from.config(), &voxels_of(from), &voxels_of(to));
        let reported: BTreeMap<_, _> = found
            .iter()
            .map(|tile| {
                let v = tile.voxels;
                (tile.tile, [v.appeared, v.gone, v.to_occupied, v.to_free, v.changed])
            })
            .collect();
        assert_eq!(reported, naive, "pair {number}");
        let [before, after] = [from, to].map(|map| map.tile_indices());
        for tile in &found {
            let holds =
                |tiles: &[voxtile::space::TileIndex]| tiles.iter().any(|index| index.to_array() == tile.tile);
            let change = match (holds(&before), holds(&after)) {
                (false, _) => TileChange::Appeared,
                (_, false) => TileChange::Gone,
                _ => TileChange::Changed,
            };
            assert_eq!(tile.change, change, "pair {number}");
        }
        assert_eq!(tiles_appeared + tiles_gone + tiles_changed, naive.len() as u64, "pair {number}");
        assert!(tiles_read >= naive.len() as u64, "pair {number}");
        if number < 4 {
            assert!(
                tiles_read < naive.len() as u64 + tiles_equal || tiles_equal == 0,
                "equal tiles must not be read"
            );
        }
    }
    let other = MapConfig::new(0.2, 3.2).unwrap();
    let path = folder.path().join("other");
    drop(OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), other).unwrap());
    let error = diff(&open(&a), &open(&path), |_| (), |_, _| ()).unwrap_err();
    assert!(matches!(error, Error::Mismatch { what: "resolution", .. }), "{error:#}");
}

/// Writing a hard-linked file through one name does not change the other.
#[test]
#[cfg(unix)]
fn creating_a_hard_linked_file_does_not_change_its_other_name() {
    let folder = TempDir::new().unwrap();
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    let write = |path: &Path, text: &[u8]| FsDisk.create(path).unwrap().write_all(text).unwrap();
    let read = |path: &Path| {
        let mut bytes = Vec::new();
        FsDisk.open(path).unwrap().read_to_end(&mut bytes).unwrap();
        bytes
    };
    write(&a, b"kept");
    FsDisk.link(&a, &b).unwrap();
    assert_eq!(read(&b), b"kept");
    write(&b, b"new");
    assert_eq!((read(&a), read(&b)), (b"kept".to_vec(), b"new".to_vec()));
    assert!(FsDisk.link(&a, &b).is_err(), "a link must not replace an existing file");
    assert_eq!(FsDisk.kind(&a).unwrap(), Some(EntryKind::File(4)));
}
