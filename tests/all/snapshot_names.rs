use crate::harness::{at, config, damage_in, digest_of, map, name};
use std::collections::BTreeSet;
use std::path::PathBuf;
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use testkit::support::message_of;
use voxtile::integrity::repair;
use voxtile::operations::{delete_snapshot, revert, snapshots};
use voxtile::store::{CommitLog, Layout, TileStore, read_log};
use voxtile::{Digest, Mapper, OutOfCoreTileMapper, Result};

/// Inserts scans into the same tiles each time, and flushes.
fn continue_map(disk: &FaultyDisk, seeds: std::ops::Range<u64>) -> Result<()> {
    let mut mapper = OutOfCoreTileMapper::open(at(disk), config())?;
    for seed in seeds {
        mapper.insert_scan(&random_scan(&mut Random(seed), [0.0; 3], 5))?;
        mapper.flush()?;
    }
    Ok(())
}

/// Returns a map with two snapshots of different flushes, changed since then, and the digests of the snapshots.
fn with_two() -> (FaultyDisk, [Digest; 2]) {
    let disk = FaultyDisk::new(Fault::None);
    drop(OutOfCoreTileMapper::create(at(&disk), config()).unwrap());
    let digests = ["s1", "s2"].map(|of| {
        continue_map(&disk, if of == "s1" { 0..2 } else { 2..4 }).unwrap();
        OutOfCoreTileMapper::open(at(&disk), config()).unwrap().snapshot(&name(of)).unwrap();
        digest_of(&disk, Some(of)).unwrap()
    });
    continue_map(&disk, 4..6).unwrap();
    (disk, digests)
}

fn path(of: &str) -> PathBuf {
    map().join("snapshots").join(of)
}

fn kept(disk: &FaultyDisk) -> usize {
    disk.files().keys().filter(|path| path.to_string_lossy().contains(".flush")).count()
}

fn swap(disk: &FaultyDisk) {
    let files = disk.files();
    disk.put(&path("s1"), &files[&path("s2")]);
    disk.put(&path("s2"), &files[&path("s1")]);
}

#[test]
fn swapped_snapshots_are_found_refused_and_put_back() {
    let (disk, digests) = with_two();
    let now = digest_of(&disk, None).unwrap();
    swap(&disk);
    assert_eq!(damage_in(&disk), BTreeSet::from(["s1", "s2"].map(path)));
    let error = message_of(revert(at(&disk), &name("s1"), None, |_, _| ()));
    assert!(error.contains("belongs to the snapshot s2"), "{error}");
    assert!(digest_of(&disk, Some("s2")).is_err());
    assert_eq!(digest_of(&disk, None).unwrap(), now);
    // Inserts continue, and both snapshots are unchanged.
    continue_map(&disk, 6..9).unwrap();
    let repaired = disk.copy();
    swap(&disk);
    for disk in [&disk, &repaired] {
        let repair = repair(at(disk), |_| (), |_, _| ()).unwrap();
        assert!(repair.is_complete());
        assert_eq!(damage_in(disk), BTreeSet::new());
        for (of, digest) in ["s1", "s2"].iter().zip(&digests) {
            assert_eq!(digest_of(disk, Some(of)).unwrap(), *digest);
        }
    }
}

#[test]
fn a_repair_of_swapped_snapshots_can_be_interrupted_anywhere() {
    let (disk, digests) = with_two();
    swap(&disk);
    for moment in 0.. {
        let cut = disk.copy();
        cut.set_fault(Fault::Crashes(moment));
        let _ = repair(at(&cut), |_| (), |_, _| ());
        if !cut.has_crashed() {
            assert!(moment > 5);
            break;
        }
        for unsynced in [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(moment)] {
            let left = cut.after_crash(unsynced);
            repair(at(&left), |_| (), |_, _| ()).unwrap();
            for (of, digest) in ["s1", "s2"].iter().zip(&digests) {
                assert_eq!(
                    digest_of(&left, Some(of)).unwrap(),
                    *digest,
                    "crash at {moment}, {unsynced:?}: {of}"
                );
            }
        }
    }
}

#[test]
fn a_missing_snapshot_is_reported_and_its_tables_are_kept_until_it_is_deleted() {
    let (disk, digests) = with_two();
    let file = disk.files()[&path("s1")].clone();
    disk.take(&path("s1"));
    assert_eq!(damage_in(&disk), BTreeSet::from([path("s1")]));
    assert!(snapshots(at(&disk)).unwrap().iter().any(|info| info.damage.is_some()));
    continue_map(&disk, 6..9).unwrap();
    assert_eq!(digest_of(&disk, Some("s2")).unwrap(), digests[1]);
    // The file is put back.
    let again = disk.copy();
    again.put(&path("s1"), &file);
    assert_eq!(damage_in(&again), BTreeSet::new());
    assert_eq!(digest_of(&again, Some("s1")).unwrap(), digests[0]);
    // The snapshot is deleted by name.
    let given_up = disk.copy();
    delete_snapshot(at(&given_up), &name("s1")).unwrap();
    assert_eq!(damage_in(&given_up), BTreeSet::new());
    assert!(kept(&given_up) < kept(&disk));
    assert_eq!(digest_of(&given_up, Some("s2")).unwrap(), digests[1]);
    // A repair removes the snapshot, but no tables.
    let repair = repair(at(&disk), |_| (), |_, _| ()).unwrap();
    assert_eq!((repair.snapshots_lost, repair.tiles_lost, repair.is_complete()), (1, 0, false));
    assert_eq!(damage_in(&disk), BTreeSet::new());
    assert_eq!(kept(&disk), kept(&again), "in quarantine");
    assert_eq!(digest_of(&disk, Some("s2")).unwrap(), digests[1]);
}

/// Turns the map into one of earlier versions, which did not list snapshots.
fn without_list(disk: &FaultyDisk) {
    let (log, commits) = read_log(&*disk.shared(), &Layout::new(map())).unwrap().unwrap();
    let mut metadata = TileStore::open_read_only(disk.shared(), map()).unwrap().metadata().clone();
    metadata.ext.as_mut().unwrap().snapshots = None;
    let text = metadata.to_text();
    CommitLog::write_whole(&*disk.shared(), &map().join("commits.log"), log.map_id(), &commits, &text)
        .unwrap();
    disk.put(&map().join("metadata.json"), text.as_bytes());
    for of in ["s1", "s2"] {
        let layout = Layout::new(map());
        let snapshot =
            voxtile::store::Snapshot::read(&*disk.shared(), &layout, &name(of), log.map_id(), None);
        let snapshot = snapshot.unwrap();
        let mut metadata = snapshot.metadata;
        metadata.ext.as_mut().unwrap().snapshots = None;
        let text = metadata.to_text();
        CommitLog::write_whole(&*disk.shared(), &path(of), log.map_id(), &snapshot.commits, &text).unwrap();
    }
}

#[test]
fn snapshots_of_maps_that_do_not_list_them_are_read_and_listed_at_the_next_commit() {
    let (disk, digests) = with_two();
    without_list(&disk);
    assert_eq!(damage_in(&disk), BTreeSet::new());
    for (of, digest) in ["s1", "s2"].iter().zip(&digests) {
        assert_eq!(digest_of(&disk, Some(of)).unwrap(), *digest);
    }
    continue_map(&disk, 6..7).unwrap();
    for (of, digest) in ["s1", "s2"].iter().zip(&digests) {
        assert_eq!(digest_of(&disk, Some(of)).unwrap(), *digest);
    }
    swap(&disk);
    assert_eq!(damage_in(&disk), BTreeSet::from(["s1", "s2"].map(path)), "by the flushes that the log names");
    swap(&disk);
    delete_snapshot(at(&disk), &name("s1")).unwrap();
    assert_eq!(digest_of(&disk, Some("s2")).unwrap(), digests[1]);
    delete_snapshot(at(&disk), &name("s2")).unwrap();
    assert_eq!((kept(&disk), damage_in(&disk).len()), (0, 0));
}

/// Copied files, files of other maps and notes are not in the log. They are kept, unlike a deleted snapshot.
#[test]
fn foreign_files_in_the_folder_of_snapshots_are_kept() {
    let (disk, digests) = with_two();
    let (other, _) = with_two();
    let files = disk.files();
    let put: [(PathBuf, &[u8]); 3] = [
        (path("copy"), &files[&path("s1")]),
        (path("other"), &other.files()[&path("s1")]),
        (path("notes"), b"what the snapshots are of"),
    ];
    put.iter().for_each(|(path, bytes)| disk.put(path, bytes));
    let deleted = files[&path("s2")].clone();
    delete_snapshot(at(&disk), &name("s2")).unwrap();
    // As after a power cut before the removal is durable.
    disk.put(&path("s2"), &deleted);
    continue_map(&disk, 6..8).unwrap();
    let left = disk.files();
    assert!(!left.contains_key(&path("s2")));
    for (path, bytes) in &put {
        assert_eq!(left.get(path).map(Vec::as_slice), Some(*bytes), "{}", path.display());
    }
    assert_eq!(digest_of(&disk, Some("s1")).unwrap(), digests[0]);
    repair(at(&disk), |_| (), |_, _| ()).unwrap();
    let left = disk.files();
    for (path, bytes) in &put {
        assert!(left.values().any(|file| file == bytes), "{}", path.display());
    }
    assert_eq!(digest_of(&disk, Some("s1")).unwrap(), digests[0]);
}
