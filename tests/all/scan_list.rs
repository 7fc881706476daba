//! Tests of `scans.bin`: remains of a crash, and damage. The tests in `snapshots` and `faults` cover it together with
//! the map.

use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use voxtile::integrity::{repair, verify};
use voxtile::operations::{CopyScans, convert, revert, snapshot};
use voxtile::store::ScanRecord;
use voxtile::{MapConfig, MapReader, Mapper, OutOfCoreTileMapper, Scan, ScanRef, SnapshotName, Storage};

fn scan(k: u64) -> Scan {
    let x = k as f64;
    Scan { origin: [x, 0.5, 0.25], points: vec![[x + 2.0, 0.5, 0.25]], intensities: None }
}

fn make_map(folder: &Path, scans: u64) -> OutOfCoreTileMapper {
    let config = MapConfig::new(0.5, 5.0).unwrap();
    let mut mapper = OutOfCoreTileMapper::create(folder, config).unwrap();
    insert(&mut mapper, 1..scans + 1);
    mapper
}

fn insert(mapper: &mut OutOfCoreTileMapper, scans: std::ops::Range<u64>) {
    for k in scans {
        match k % 2 {
            0 => {
                let Scan { origin, points, .. } = scan(k);
                let stamped = ScanRef::in_world(origin, &points).with_stamp_ns(-7 + k as i64);
                mapper.insert_points(&stamped).unwrap()
            }
            _ => mapper.insert_scan(&scan(k)).unwrap(),
        };
    }
}

fn expected(scans: u64) -> Vec<ScanRecord> {
    let stamp = |k: u64| k.is_multiple_of(2).then_some(-7 + k as i64);
    (1..=scans).map(|k| ScanRecord::new(k, stamp(k), [k as f64, 0.5, 0.25])).collect()
}

fn scans_of(folder: &Path) -> Vec<ScanRecord> {
    MapReader::open(folder, 1 << 20).unwrap().scans().unwrap()
}

#[test]
fn a_map_lists_the_scans_of_its_last_flush() {
    let folder = TempDir::new().unwrap();
    let map = folder.path().join("map");
    let mut mapper = make_map(&map, 3);
    assert_eq!(scans_of(&map), []);
    mapper.flush().unwrap();
    insert(&mut mapper, 4..6);
    assert_eq!(scans_of(&map), expected(3));
    mapper.flush().unwrap();
    assert_eq!(scans_of(&map), expected(5));
    drop(mapper);
    let config = MapReader::config_of(&map).unwrap();
    let mut mapper = OutOfCoreTileMapper::open(&map, config).unwrap();
    insert(&mut mapper, 6..8);
    mapper.flush().unwrap();
    assert_eq!(scans_of(&map), expected(7));
    let other = folder.path().join("other");
    convert(&MapReader::open(&map, 1 << 20).unwrap(), &other, Storage::Compact, CopyScans::Yes, |_, _| ())
        .unwrap();
    assert_eq!(scans_of(&other), expected(7));
}

#[test]
fn a_flush_without_scans_does_not_commit_records_of_a_killed_writer() {
    let folder = TempDir::new().unwrap();
    let (map, killed) = (folder.path().join("map"), folder.path().join("killed"));
    let [base, other] = ["base", "other"].map(|name| SnapshotName::new(name).unwrap());
    let mut mapper = make_map(&map, 2);
    mapper.snapshot(&base).unwrap();
    insert(&mut mapper, 3..6);
    mapper.flush().unwrap();
    drop(mapper);
    // A revert that was killed between its record in the list and its commit.
    let reverted = copy_folder(&map, &killed);
    revert(&*reverted, &base, None, |_, _| ()).unwrap();
    fs::copy(killed.join("scans.bin"), map.join("scans.bin")).unwrap();
    assert_eq!(scans_of(&map), expected(5));
    // The snapshot is a flush with the same number.
    snapshot(&*map, &other).unwrap();
    let found = verify(&*map, |finding| panic!("{finding}"), |_, _| ()).unwrap();
    assert_eq!(found.damage, 0);
    assert_eq!(scans_of(&map), expected(5));
    // A damaged list remains as it is, as evidence for `repair`.
    let cut = fs::read(map.join("scans.bin")).unwrap()[..100].to_vec();
    fs::write(map.join("scans.bin"), &cut).unwrap();
    snapshot(&*map, &SnapshotName::new("cut").unwrap()).unwrap();
    assert_eq!(fs::read(map.join("scans.bin")).unwrap(), cut);
    fs::remove_file(map.join("scans.bin")).unwrap();
    snapshot(&*map, &SnapshotName::new("missing").unwrap()).unwrap();
    assert!(!map.join("quarantine").exists());
}

/// Copies a folder with its subfolders.
fn copy_folder(from: &Path, to: &Path) -> PathBuf {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let copy = to.join(path.file_name().unwrap());
        match path.is_dir() {
            true => drop(copy_folder(&path, &copy)),
            false => drop(fs::copy(&path, &copy).unwrap()),
        }
    }
    to.to_owned()
}

#[test]
fn uncommitted_records_of_a_killed_writer_are_ignored_and_truncated() {
    let folder = TempDir::new().unwrap();
    let map = folder.path().join("map");
    let mut mapper = make_map(&map, 2);
    mapper.flush().unwrap();
    let path = map.join("scans.bin");
    let committed = fs::read(&path).unwrap();
    insert(&mut mapper, 3..5);
    mapper.flush().unwrap();
    let with_more = fs::read(&path).unwrap();
    drop(mapper);
    // Another map in which only the first flush was committed.
    for length in committed.len()..=with_more.len() {
        let other = folder.path().join(format!("other {length}"));
        let mut mapper = make_map(&other, 2);
        mapper.flush().unwrap();
        drop(mapper);
        fs::write(other.join("scans.bin"), &with_more[..length]).unwrap();
        assert_eq!(scans_of(&other), expected(2), "{length}");
        assert!(verify(&other, |_| (), |_, _| ()).unwrap().is_whole(), "{length}");
        if length % 32 != 0 {
            continue;
        }
        let config = MapReader::config_of(&other).unwrap();
        let mut mapper = OutOfCoreTileMapper::open(&other, config).unwrap();
        insert(&mut mapper, 3..4);
        mapper.flush().unwrap();
        assert_eq!(scans_of(&other), expected(3), "{length}");
        assert_eq!(fs::read(other.join("scans.bin")).unwrap()[..], with_more[..committed.len() + 64]);
    }
}

#[test]
fn any_damaged_byte_is_found_and_repair_keeps_the_records_before_it() {
    let folder = TempDir::new().unwrap();
    for at in (0..16 + 3 * 64).step_by(5) {
        let map = folder.path().join(at.to_string());
        make_map(&map, 3).flush().unwrap();
        let path = map.join("scans.bin");
        let mut bytes = fs::read(&path).unwrap();
        bytes[at] ^= 0x40;
        fs::write(&path, &bytes).unwrap();
        check_damage(&map, at, &format!("byte {at}"));
    }
}

#[test]
fn a_truncated_or_removed_list_is_found() {
    let folder = TempDir::new().unwrap();
    for length in [None, Some(0), Some(15), Some(16), Some(79), Some(80), Some(207)] {
        let map = folder.path().join(format!("{length:?}"));
        make_map(&map, 3).flush().unwrap();
        let path = map.join("scans.bin");
        match length {
            Some(length) => fs::write(&path, &fs::read(&path).unwrap()[..length]).unwrap(),
            None => fs::remove_file(&path).unwrap(),
        }
        check_damage(&map, length.unwrap_or(0), &format!("{length:?} bytes"));
    }
}

/// Checks that damage at a byte of the list is found, and that repair keeps the records before it.
fn check_damage(map: &Path, at: usize, what: &str) {
    assert!(!verify(map, |_| (), |_, _| ()).unwrap().is_whole(), "{what}");
    assert!(MapReader::open(map, 1 << 20).unwrap().scans().is_err(), "{what}");
    repair(map, |_| (), |_, _| ()).unwrap();
    let kept = at.saturating_sub(16) as u64 / 64;
    assert_eq!(scans_of(map), expected(kept), "{what}");
    assert!(verify(map, |_| (), |_, _| ()).unwrap().is_whole(), "{what}");
    let config = MapReader::config_of(map).unwrap();
    OutOfCoreTileMapper::open(map, config).unwrap().flush().unwrap();
    assert_eq!(scans_of(map), expected(kept), "{what}");
}

#[test]
fn a_mapper_that_continues_after_damage_keeps_the_damaged_list() {
    let folder = TempDir::new().unwrap();
    // The position of a changed byte, or the remaining length.
    let flips = (0..16 + 3 * 64).step_by(5).map(|at| (at, true));
    let cuts = [0, 15, 16, 79, 80, 207].map(|length| (length, false));
    for (at, is_flip) in flips.chain(cuts) {
        let number = format!("{at} {is_flip}");
        let map = folder.path().join(&number);
        make_map(&map, 3).flush().unwrap();
        let path = map.join("scans.bin");
        let mut damaged = fs::read(&path).unwrap();
        match is_flip {
            true => damaged[at] ^= 0x40,
            false => damaged.truncate(at),
        }
        fs::write(&path, &damaged).unwrap();
        let mut mapper = OutOfCoreTileMapper::open(&map, MapReader::config_of(&map).unwrap()).unwrap();
        insert(&mut mapper, 4..6);
        mapper.flush().unwrap();
        drop(mapper);
        assert_eq!(fs::read(map.join("quarantine/scans.bin")).unwrap(), damaged, "damage {number}");
        let listed = scans_of(&map);
        assert!(listed.ends_with(&expected(5)[3..]) && listed.len() < 5, "damage {number}: {listed:?}");
    }
}
