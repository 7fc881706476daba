use crate::harness::{at, config, damage_in, digest_of, map, name};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::random_scans::{Random, random_scan};
use voxtile::integrity::repair;
use voxtile::operations::delete_snapshot;
use voxtile::{Digest, MapReader, Mapper, OutOfCoreTileMapper, Result, Storage};

/// A map of a few tiles with a snapshot that needs older tables.
fn small(storage: Storage) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config().with_storage(storage)).unwrap();
    for seed in 0..4 {
        let x = 3.0 * (seed % 2) as f64;
        mapper.insert_scan(&random_scan(&mut Random(seed), [x, 0.0, 0.0], 5)).unwrap();
        mapper.flush().unwrap();
        if seed == 1 {
            mapper.snapshot(&name("s")).unwrap();
        }
    }
    drop(mapper);
    disk.copy()
}

fn digests(disk: &FaultyDisk) -> Result<[Digest; 2]> {
    Ok([digest_of(disk, None)?, digest_of(disk, Some("s"))?])
}

/// Inserts and flushes a scan far from all tiles.
fn continue_map(disk: &FaultyDisk, storage: Storage) -> Result<()> {
    let mut mapper = OutOfCoreTileMapper::open(at(disk), config().with_storage(storage))?;
    mapper.insert_scan(&random_scan(&mut Random(9), [300.0, 0.0, 0.0], 5))?;
    mapper.flush()
}

fn is_index(path: &Path) -> bool {
    ["metadata.json", "commits.log", "scans.bin"].iter().any(|name| path.ends_with(name))
}

#[test]
fn an_unreadable_file_is_reported_and_everything_else_is_repaired() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let whole = small(storage);
        let before = digests(&whole).unwrap();
        for path in whole.files().keys().filter(|path| !path.ends_with("writer.lock")) {
            let what = format!("{}, {storage}", path.display());
            let disk = whole.copy();
            disk.make_unreadable(path);
            let found = damage_in(&disk);
            assert!(found.contains(path) && found.len() == 1, "{what}: {found:?}");
            if !is_index(path) {
                continue_map(&disk, storage).unwrap_or_else(|error| panic!("{what}: {error:#}"));
            }
            if path.ends_with("s") {
                // The content of the snapshot is unchanged, and the snapshot can be deleted.
                let deleted = disk.clone();
                deleted.mend();
                assert_eq!(digests(&deleted).unwrap()[1], before[1], "{what}");
                disk.make_unreadable(path);
                delete_snapshot(at(&disk), &name("s")).unwrap();
                assert_eq!(damage_in(&disk).len(), 0);
                continue;
            }
            let disk = whole.copy();
            disk.make_unreadable(path);
            let octree = whole.files()[path].clone();
            let repair =
                repair(at(&disk), |_| (), |_, _| ()).unwrap_or_else(|error| panic!("{what}: {error:#}"));
            assert!(repair.actions > 0, "{what}");
            assert_eq!(damage_in(&disk), BTreeSet::new(), "{what}");
            if path.ends_with("octree.bt") {
                assert!(repair.is_complete() && disk.files()[path] == octree, "{what}");
            }
            if path.ends_with("octree.bt") || is_index(path) {
                assert_eq!(digests(&disk).unwrap(), before, "{what}");
            } else {
                assert!(!repair.is_complete(), "{what}");
            }
            // No file was deleted.
            disk.mend();
            let is_in_quarantine = |path: &PathBuf| path.starts_with(map().join("quarantine"));
            assert!(disk.files().keys().any(is_in_quarantine), "{what}");
        }
    }
}

#[test]
fn a_file_on_which_every_operation_fails_affects_no_other_file() {
    let whole = small(Storage::OctoMap);
    let before = digests(&whole).unwrap();
    for path in whole.files().keys().filter(|path| !path.ends_with("writer.lock")) {
        let what = path.display().to_string();
        let disk = whole.copy();
        disk.break_path(path);
        let found = damage_in(&disk);
        assert!(found.contains(path), "{what}: {found:?}");
        match continue_map(&disk, Storage::OctoMap) {
            Ok(()) => assert!(!is_index(path), "{what}"),
            Err(error) => {
                assert!(is_index(path) && format!("{error:#}").contains(&what), "{what}: {error:#}")
            }
        }
        // A repair either succeeds or names the file that stops it; nothing is lost.
        if let Err(error) = repair(at(&disk), |_| (), |_, _| ()) {
            assert!(format!("{error:#}").contains(&what), "{what}: {error:#}");
        }
        disk.mend();
        if is_index(path) {
            assert_eq!(digests(&disk).unwrap(), before, "{what}");
        }
    }
    for folder in whole.files().keys().filter_map(|path| path.parent()).collect::<BTreeSet<_>>() {
        if folder != map() {
            let disk = whole.copy();
            disk.break_path(folder);
            let what = folder.display().to_string();
            assert!(!damage_in(&disk).is_empty(), "{what}");
            continue_map(&disk, Storage::OctoMap).unwrap_or_else(|error| panic!("{what}: {error:#}"));
            disk.mend();
            assert_eq!(digests(&disk).unwrap()[1], before[1], "{what}");
        }
    }
}

/// Records before a bad sector of the list of scans are kept.
#[test]
fn a_bad_sector_of_the_list_of_scans_keeps_records_before_it() {
    let path = map().join("scans.bin");
    for storage in [Storage::OctoMap, Storage::Compact] {
        for disk in [small(storage), small(storage).without_links()] {
            let (before, list) = (digests(&disk).unwrap(), disk.files()[&path].clone());
            // A header of 16 bytes, and records of 64.
            disk.make_bytes_unreadable(&path, 16 + 2 * 64 + 5..16 + 2 * 64 + 6);
            assert!(damage_in(&disk).contains(&path));
            repair(at(&disk), |_| (), |_, _| ()).unwrap();
            assert_eq!(damage_in(&disk), BTreeSet::new());
            let numbers = || {
                let reader = MapReader::open(at(&disk), 1 << 20).unwrap();
                reader.scans().unwrap().iter().map(|scan| scan.number).collect::<Vec<_>>()
            };
            assert_eq!(numbers(), [1, 2]);
            assert_eq!(digests(&disk).unwrap(), before);
            let is_kept = |(path, bytes): (PathBuf, Vec<u8>)| {
                path.starts_with(map().join("quarantine")) && bytes == list
            };
            assert!(disk.files().into_iter().any(is_kept));
            continue_map(&disk, storage).unwrap();
            assert_eq!(numbers(), [1, 2, 5]);
        }
    }
}
