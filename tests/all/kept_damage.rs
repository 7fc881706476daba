//! Damage to files of kept scans that the map or only a snapshot needs: it is found and repaired, and removed scans
//! never reappear.

use crate::harness::{
    at, damage_in, digest_of, keeping_scans as config, map, name, open_or_create, replay, scans,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use voxtile::integrity::{Repair, repair};
use voxtile::operations::{
    NewPoses, Remap, ScanSelection, delete_snapshot, mark_moving, remap, remove_scans, revert, snapshot,
};
use voxtile::scan::MovingMarks;
use voxtile::store::{CommitLog, Layout, TileStore, read_log};
use voxtile::{Digest, MapReader, Mapper, OutOfCoreTileMapper, Pose, Result, ScanRef};

fn pose(number: u64, by_m: f64) -> Pose {
    Pose::from_quaternion([3.0 * (number % 4) as f64 + by_m, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]).unwrap()
}

/// Inserts a scan in a new process, so that it gets its own segment.
fn insert(disk: &FaultyDisk, number: u64) -> Result<()> {
    let mut mapper = open_or_create(disk, &config())?;
    let scan = random_scan(&mut Random(number), [0.0; 3], 5);
    mapper.insert_points(&ScanRef::in_sensor(pose(number, 0.0), &scan.points))?;
    mapper.flush()
}

/// Number of the removed scan.
const REMOVED: u64 = 3;

/// Four scans, snapshot `s`, removal of the third scan, snapshot `t`, a fifth scan. Only `s` needs the old catalog and
/// a segment; `t` needs the beginning of the map's catalog.
fn a_map() -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    (1..=4).for_each(|number| insert(&disk, number).unwrap());
    snapshot(at(&disk), &name("s")).unwrap();
    remove(&disk, REMOVED).unwrap();
    snapshot(at(&disk), &name("t")).unwrap();
    insert(&disk, 5).unwrap();
    disk.copy()
}

fn remove(disk: &FaultyDisk, number: u64) -> Result<()> {
    remove_scans(at(disk), &ScanSelection::Numbers(number, number), false, &replay(), |_, _| ()).map(drop)
}

fn moved(disk: &FaultyDisk) -> Result<()> {
    let poses = NewPoses::Numbered(vec![(1, pose(1, 0.7)), (4, pose(4, 0.7))]);
    remap(&scans(disk)?, &poses, &Remap::new(replay()), |_, _| ()).map(drop)
}

fn reverted(disk: &FaultyDisk, to: &str) -> Result<()> {
    revert(at(disk), &name(to), Some(&name("before")), |_, _| ()).map(drop)
}

/// An operation, and whether it may restore the removed scan.
type Work = (&'static str, fn(&FaultyDisk) -> Result<()>, bool);

const WORKS: [Work; 5] = [
    ("remap", moved, false),
    ("remove", |disk| remove(disk, 2), false),
    ("insert", |disk| insert(disk, 6), false),
    ("revert to s", |disk| reverted(disk, "s"), true),
    ("revert to t", |disk| reverted(disk, "t"), false),
];

fn files_of_scans(disk: &FaultyDisk) -> BTreeMap<PathBuf, Vec<u8>> {
    let folder = map().join("kept_scans");
    disk.files().into_iter().filter(|(path, _)| path.starts_with(&folder)).collect()
}

fn flush_number(disk: &FaultyDisk) -> u64 {
    MapReader::open(at(disk), 0).unwrap().flush_number()
}

/// Returns the numbers of the scans whose points can be read.
fn kept(disk: &FaultyDisk) -> Result<Vec<u64>> {
    MapReader::open(at(disk), 0)?.kept_scans()?.map(|scan| scan.map(|scan| scan.number())).collect()
}

fn repaired(disk: &FaultyDisk, what: &str) -> Repair {
    let repair = repair(at(disk), |_| (), |_, _| ()).unwrap_or_else(|error| panic!("{what}: {error:#}"));
    assert_eq!(damage_in(disk), BTreeSet::new(), "{what}");
    repair
}

/// The points of a scan survive damage to its marks. Until the marks are renewed, nothing that uses them is done.
#[test]
fn damaged_marks_cost_no_scan() {
    let disk = FaultyDisk::new(Fault::None);
    (1..=4).for_each(|number| insert(&disk, number).unwrap());
    let unmarked = digest_of(&disk, None).unwrap();
    let before = files_of_scans(&disk);
    let points: Vec<u64> = scans(&disk).unwrap().scans().iter().map(|scan| scan.points).collect();
    let third = move |number: u64| Ok(MovingMarks::new((0..points[number as usize - 1]).map(|k| k % 3 == 0)));
    mark_moving(&scans(&disk).unwrap(), [2, 3], third, &replay(), |_, _| ()).unwrap();
    let marked = digest_of(&disk, None).unwrap();
    snapshot(at(&disk), &name("s")).unwrap();
    // Marks are in a segment of their own.
    let is_new = |path: &&PathBuf| !before.contains_key(*path) && !path.to_string_lossy().contains("catalog");
    let files = files_of_scans(&disk);
    let segment = files.keys().find(is_new).unwrap();
    for (damage, bytes) in damages(&files, segment) {
        let disk = disk.copy();
        match bytes {
            Some(bytes) => disk.put(segment, &bytes),
            None => disk.take(segment),
        }
        assert!(damage_in(&disk).contains(segment), "{damage}");
        let repair = repaired(&disk, &damage);
        assert_eq!((repair.scans_lost, repair.snapshot_scans_lost), (0, 0), "{damage}");
        let lost: Vec<u64> = {
            let summary = scans(&disk).unwrap();
            let lost = summary.scans().iter().filter(|scan| scan.has_lost_marks);
            lost.map(|scan| scan.number).collect()
        };
        // Both the map and the snapshot need the marks.
        assert!(!lost.is_empty() && repair.marks_lost == 2 * lost.len() as u64, "{damage}: {repair:?}");
        assert_eq!(
            (kept(&disk).unwrap(), digest_of(&disk, None).unwrap()),
            (vec![1, 2, 3, 4], marked),
            "{damage}"
        );
        let refused = moved(&disk).unwrap_err().to_string();
        assert!(refused.contains(&format!("scan {} are lost", lost[0])), "{damage}: {refused}");
        // New marks, or none, restore the map.
        let points: Vec<u64> = scans(&disk).unwrap().scans().iter().map(|scan| scan.points).collect();
        let none = move |number: u64| Ok(MovingMarks::none(points[number as usize - 1]));
        mark_moving(&scans(&disk).unwrap(), [2, 3], none, &replay(), |_, _| ()).unwrap();
        assert_eq!(
            (digest_of(&disk, None).unwrap(), damage_in(&disk)),
            (unmarked, BTreeSet::new()),
            "{damage}"
        );
        moved(&disk).unwrap();
    }
}

/// Returns damaged versions of a file.
fn damages(files: &BTreeMap<PathBuf, Vec<u8>>, path: &Path) -> Vec<(String, Option<Vec<u8>>)> {
    let bytes = &files[path];
    let mut damages = vec![("lost".to_owned(), None)];
    for length in [0, bytes.len() / 2, bytes.len() - 1] {
        damages.push((format!("cut to {length}"), Some(bytes[..length].to_vec())));
    }
    let is_catalog = path.to_string_lossy().contains("catalog");
    let offsets = if is_catalog { vec![0, 14, 17, 21, 26, 40, bytes.len() / 2] } else { vec![9] };
    for offset in offsets.into_iter().chain([bytes.len() - 1]) {
        let mut flipped = bytes.clone();
        flipped[offset] ^= 1 << (offset % 8);
        damages.push((format!("a bit at {offset}"), Some(flipped)));
    }
    // The other catalog under this name, as from an old copy.
    let is_other = |other: &Path| other != path && other.to_string_lossy().contains("catalog");
    for (other, content) in files.iter().filter(|(other, _)| is_catalog && is_other(other)) {
        damages.push((format!("{} in its place", other.display()), Some(content.clone())));
    }
    damages
}

/// Runs an operation on a damaged map: it either has the result of the undamaged map, or fails and changes nothing.
fn works(disk: &FaultyDisk, work: &Work, expected: Digest, what: &str, is_repaired: bool) -> bool {
    let (name, work, may_bring_back) = work;
    let (before, flush) = (digest_of(disk, None).unwrap(), flush_number(disk));
    let what = format!("{what}: {name}");
    match work(disk) {
        Ok(()) => assert_eq!(digest_of(disk, None).unwrap(), expected, "{what}"),
        Err(error) => {
            assert_eq!(digest_of(disk, None).unwrap(), before, "{what}: {error:#}");
            assert_eq!(flush_number(disk), flush, "{what}: {error:#}");
            return false;
        }
    }
    if !is_repaired && *name == "insert" {
        assert_ne!(damage_in(disk), BTreeSet::new(), "{what}: hidden");
    }
    let is_back = kept(disk).is_ok_and(|kept| kept.contains(&REMOVED));
    assert!(!is_back || *may_bring_back, "{what}: the removed scan is back");
    true
}

#[test]
fn damage_to_kept_scans_is_repaired_and_restores_no_removed_scan() {
    let whole = a_map();
    assert_eq!(damage_in(&whole), BTreeSet::new());
    let files = files_of_scans(&whole);
    assert_eq!(files.len(), 7, "{:?}", files.keys());
    assert_eq!(kept(&whole).unwrap(), [1, 2, 4, 5]);
    let digests = WORKS.map(|(name, work, _)| {
        let disk = whole.copy();
        work(&disk).unwrap_or_else(|error| panic!("{name}: {error:#}"));
        digest_of(&disk, None).unwrap()
    });
    let (mut done, mut refused) = (0, 0);
    for path in files.keys() {
        for (how, content) in damages(&files, path) {
            let (what, damaged) = (format!("{}: {how}", path.display()), whole.copy());
            match &content {
                Some(content) => damaged.put(path, content),
                None => damaged.take(path),
            }
            assert!(damage_in(&damaged).contains(path), "{what}: {:?}", damage_in(&damaged));
            if let Err(error) = kept(&damaged) {
                assert!(format!("{error:#}").contains(&path.display().to_string()), "{what}: {error:#}");
            }
            let mut done_before = 0;
            for (work, &expected) in WORKS.iter().zip(&digests) {
                done_before += usize::from(works(&damaged.copy(), work, expected, &what, false));
            }
            let before = files_of_scans(&damaged);
            let repair = repaired(&damaged, &what);
            // The header is the same for all catalogs, so damage to it loses no scan.
            let is_header = ["catalog", "a bit at 0", "a bit at 14"].map(|part| what.contains(part));
            let is_complete = is_header[0] && (is_header[1] && how.ends_with(" 0") || is_header[2]);
            assert_eq!((repair.is_complete(), repair.tiles_lost), (is_complete, 0), "{what}: {repair:?}");
            let lost = repair.scans_lost + repair.snapshot_scans_lost;
            assert!(is_complete == (lost == 0) && repair.actions > 0, "{what}: {repair:?}");
            assert_eq!(digest_of(&damaged, None).unwrap(), digest_of(&whole, None).unwrap(), "{what}");
            assert!(!kept(&damaged).unwrap().contains(&REMOVED), "{what}");
            let left = damaged.files();
            let is_left = |bytes: &Vec<u8>| left.values().any(|other| other == bytes);
            assert!(before.values().all(is_left), "{what}: a file is gone");
            let mut done_after = 0;
            for (work, &expected) in WORKS.iter().zip(&digests) {
                let disk = damaged.copy();
                done_after += usize::from(works(&disk, work, expected, &what, true));
                assert_eq!(damage_in(&disk), BTreeSet::new(), "{what}");
            }
            // A repaired map accepts scans and can be reverted to its snapshots.
            assert!(done_after >= 3, "{what}: {done_after}");
            (done, refused) = (done + done_before + done_after, refused + 10 - done_before - done_after);
        }
    }
    println!("{done} done, {refused} refused");
    assert!(done > 200 && refused > 50, "{done} done, {refused} refused");
}

/// Catalogs and points shared by several snapshots are read only once.
#[test]
fn verify_reads_catalogs_and_points_once_for_all_snapshots() {
    let opened = |snapshots: u64| {
        let disk = FaultyDisk::new(Fault::None);
        (1..=3).for_each(|number| insert(&disk, number).unwrap());
        for number in 1..=snapshots {
            snapshot(at(&disk), &name(&format!("s{number}"))).unwrap();
            insert(&disk, 3 + number).unwrap();
        }
        (snapshots + 1..=4).for_each(|number| insert(&disk, 3 + number).unwrap());
        let disk = disk.copy();
        assert_eq!(damage_in(&disk), BTreeSet::new());
        files_of_scans(&disk).into_keys().map(|path| disk.times_opened(&path)).collect::<Vec<_>>()
    };
    assert_eq!(opened(1), opened(4));
}

/// A power cut at every step of a repair of a snapshot's scans.
#[test]
fn an_interrupted_repair_of_a_snapshots_scans_is_completed_by_the_next() {
    let damaged = a_map();
    let mut files = files_of_scans(&damaged);
    let only_snapshots = map().join("kept_scans/segment.3");
    let shared = map().join("kept_scans/segment.2");
    for path in [&only_snapshots, &shared] {
        let bytes = files.get_mut(path).unwrap();
        bytes[9] ^= 4;
        damaged.put(path, bytes);
    }
    let mut crashes = 0;
    for change in 0.. {
        let disk = damaged.copy();
        disk.set_fault(Fault::Crashes(change));
        let _ = repair(at(&disk), |_| (), |_, _| ());
        if !disk.has_crashed() {
            break;
        }
        crashes += 1;
        for unsynced in [Unsynced::Dropped, Unsynced::Kept] {
            let (disk, what) = (disk.after_crash(unsynced), format!("change {change}, {unsynced:?}"));
            drop(TileStore::open(disk.shared(), map()).unwrap());
            repaired(&disk, &what);
            assert_eq!(kept(&disk).unwrap(), [1, 4, 5], "{what}");
            let past = MapReader::open_snapshot(at(&disk), &name("s"), 0).unwrap();
            assert_eq!(past.kept_scans().unwrap().count(), 2, "{what}");
            insert(&disk, 6).unwrap();
            let left = disk.files();
            assert!(files.values().all(|bytes| left.values().any(|other| other == bytes)), "{what}");
        }
    }
    assert!(crashes > 10, "{crashes}");
}

/// Only snapshots keep scans, and the folder of kept scans is replaced by a file.
#[test]
fn a_file_in_place_of_the_folder_of_kept_scans_is_moved_away() {
    let disk = FaultyDisk::new(Fault::None);
    let plain = config().with_kept_scans(false);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), plain).unwrap();
    mapper.insert_scan(&random_scan(&mut Random(1), [0.0; 3], 5)).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    snapshot(at(&disk), &name("plain")).unwrap();
    insert(&disk, 2).unwrap();
    snapshot(at(&disk), &name("kept")).unwrap();
    reverted(&disk, "plain").unwrap();
    let digest_before = digest_of(&disk, None).unwrap();
    let scans = map().join("kept_scans");
    assert!(!files_of_scans(&disk).is_empty());
    disk.take(&scans);
    disk.put(&scans, b"not a folder");
    assert!(!damage_in(&disk).is_empty());
    let report = repaired(&disk, "a file");
    assert!(report.snapshot_scans_lost > 0, "{report:?}");
    assert!(disk.files().iter().any(|(path, bytes)| path.starts_with(map()) && bytes == b"not a folder"));
    assert_eq!(digest_of(&disk, None).unwrap(), digest_before);
    insert(&disk, 3).unwrap();
    revert(at(&disk), &name("kept"), None, |_, _| ()).unwrap();
}

/// Removes the names of catalogs from a log of one record.
fn forget_catalog(disk: &FaultyDisk, path: &Path) {
    let bytes = disk.files()[path].clone();
    let (log, mut commits) = CommitLog::read(&mut &*bytes, bytes.len() as u64).unwrap();
    let mut metadata = commits.metadata.clone().unwrap();
    assert!(commits.catalog.take().is_some());
    metadata.ext.as_mut().unwrap().catalog = None;
    let text = metadata.to_text();
    CommitLog::write_whole(&*disk.shared(), path, log.map_id(), &commits, &text).unwrap();
}

/// A map of earlier versions, whose log does not name catalogs.
#[test]
fn the_next_flush_names_the_catalog_of_a_log_without_one() {
    let whole = a_map();
    let disk = whole.copy();
    // A log of one record, with the current metadata.
    repair_index(&disk);
    ["commits.log", "snapshots/s", "snapshots/t"]
        .iter()
        .for_each(|path| forget_catalog(&disk, &map().join(path)));
    let mut metadata = MapReader::open(at(&disk), 0).unwrap().metadata().clone();
    metadata.ext.as_mut().unwrap().catalog = None;
    disk.put(&map().join("metadata.json"), metadata.to_text().as_bytes());
    let disk = disk.copy();
    let named =
        |disk: &FaultyDisk| read_log(&*disk.shared(), &Layout::new(map())).unwrap().unwrap().1.catalog;
    assert_eq!(named(&disk), None);
    assert_eq!(damage_in(&disk), BTreeSet::new());
    assert_eq!(kept(&disk).unwrap(), [1, 2, 4, 5]);
    for (name, work, _) in WORKS {
        let (disk, undisturbed) = (disk.copy(), whole.copy());
        work(&disk).unwrap_or_else(|error| panic!("{name}: {error:#}"));
        work(&undisturbed).unwrap();
        assert_eq!(digest_of(&disk, None).unwrap(), digest_of(&undisturbed, None).unwrap(), "{name}");
        assert!(named(&disk).is_some(), "{name}");
        assert_eq!(damage_in(&disk), BTreeSet::new(), "{name}");
    }
    // A repair of a snapshot's scans does not change the map's own catalog.
    let segment = map().join("kept_scans/segment.3");
    disk.take(&segment);
    assert_eq!(damage_in(&disk), BTreeSet::from([segment]));
    assert_eq!(repaired(&disk, "").snapshot_scans_lost, 1);
    assert_eq!(kept(&disk).unwrap(), [1, 2, 4, 5]);
}

/// Rewrites the log as one record of the whole map.
fn repair_index(disk: &FaultyDisk) {
    disk.take(&map().join("metadata.json"));
    repair(at(disk), |_| (), |_, _| ()).unwrap();
    assert_eq!(damage_in(disk), BTreeSet::new());
}

/// While the catalog of a snapshot is damaged, it is unknown which files the snapshot needs: a removal changes nothing.
#[test]
fn a_removal_changes_nothing_while_the_catalog_of_a_snapshot_is_damaged() {
    let disk = a_map();
    let catalog = files_of_scans(&disk).into_keys().find(|path| path.ends_with("catalog.1")).unwrap();
    disk.take(&catalog);
    let (before, flush) = (digest_of(&disk, None).unwrap(), flush_number(&disk));
    let how = replay().with_keep_as(name("before"));
    let refused = remove_scans(at(&disk), &ScanSelection::Numbers(2, 2), true, &how, |_, _| ());
    let message = testkit::support::message_of(refused);
    let parts = ["catalog.1: ", "the snapshot s needs it", "nothing was changed"];
    assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    assert_eq!((digest_of(&disk, None).unwrap(), flush_number(&disk)), (before, flush));
    delete_snapshot(at(&disk), &name("s")).unwrap();
    remove(&disk, 2).unwrap();
    assert_eq!(kept(&disk).unwrap(), [1, 4, 5]);
}

/// The report contains the removals that were done and those that failed.
#[test]
fn the_report_of_a_removal_contains_unreadable_snapshots() {
    let disk = a_map();
    disk.put(&map().join("snapshots/t"), b"nothing");
    let remove =
        |number| remove_scans(at(&disk), &ScanSelection::Numbers(number, number), true, &replay(), |_, _| ());
    let removed = remove(2).unwrap();
    assert_eq!((removed.scans_removed, removed.snapshots_deleted), (1, vec![name("s")]));
    let [failed] = &*removed.snapshots_failed else { panic!("{:?}", removed.snapshots_failed) };
    assert!(failed.name == name("t") && failed.reason.contains("may contain scans"), "{failed:?}");
    assert_eq!(kept(&disk).unwrap(), [1, 4, 5]);
    // No scan is left to remove.
    let message = testkit::support::message_of(remove(2));
    assert!(message.contains("snapshots/t") && message.contains("may contain scans"), "{message}");
}

/// Returns damaged logs: missing, truncated, or with a flipped bit.
fn damaged_logs(bytes: &[u8]) -> Vec<Option<Vec<u8>>> {
    let mut damages = vec![None];
    for part in 1..8 {
        let at = bytes.len() * part / 8;
        damages.push(Some(bytes[..at].to_vec()));
        let mut flipped = bytes.to_vec();
        flipped[at] ^= 16;
        damages.push(Some(flipped));
    }
    damages
}

/// The log is damaged, and `metadata.json` is missing or outdated: perhaps only the newest catalog lacks the removed
/// scan.
#[test]
fn no_removed_scan_reappears_after_damage_to_log_and_metadata() {
    let (log, metadata) = (map().join("commits.log"), map().join("metadata.json"));
    let (mut from_tiles, mut repairs) = (0, 0);
    for has_later_snapshot in [false, true] {
        let disk = FaultyDisk::new(Fault::None);
        (1..=4).for_each(|number| insert(&disk, number).unwrap());
        snapshot(at(&disk), &name("s")).unwrap();
        let old = disk.files()[&metadata].clone();
        remove(&disk, REMOVED).unwrap();
        if has_later_snapshot {
            snapshot(at(&disk), &name("t")).unwrap();
            insert(&disk, 5).unwrap();
        }
        let whole = disk.copy();
        let (files, kept_scans) = (whole.files(), files_of_scans(&whole));
        for (old_metadata, log_now) in [None, Some(&old), Some(&files[&metadata])]
            .into_iter()
            .flat_map(|metadata| damaged_logs(&files[&log]).into_iter().map(move |log| (metadata, log)))
        {
            let damaged = whole.copy();
            match old_metadata {
                Some(text) => damaged.put(&metadata, text),
                None => damaged.take(&metadata),
            }
            match &log_now {
                Some(bytes) => damaged.put(&log, bytes),
                None => damaged.take(&log),
            }
            let length = log_now.map(|bytes| bytes.len());
            let what = format!("{has_later_snapshot}, {}, {length:?}", old_metadata.is_some());
            let Ok(repair) = repair(at(&damaged), |_| (), |_, _| ()) else { continue };
            (repairs, from_tiles) = (repairs + 1, from_tiles + u64::from(repair.scans_lost > 0));
            // A log truncated at the end of a record is the valid log of an earlier flush. A map without log and
            // metadata keeps no scans.
            let is_back = kept(&damaged).unwrap_or_default().contains(&REMOVED);
            let is_earlier = flush_number(&damaged) < flush_number(&whole);
            assert!(!is_back || is_earlier, "{what}: {repair:?}");
            assert_eq!(damage_in(&damaged), BTreeSet::new(), "{what}");
            let left = damaged.files();
            let is_gone = |bytes: &Vec<u8>| !left.values().any(|other| other.starts_with(bytes));
            let gone: Vec<_> =
                kept_scans.iter().filter(|(_, bytes)| is_gone(bytes)).map(|(path, _)| path).collect();
            // Data of a flush that the log no longer contains is truncated, as after a crash.
            assert!(is_earlier || gone.is_empty(), "{what}: {gone:?} are gone: {repair:?}");
            let past = MapReader::open_snapshot(at(&damaged), &name("s"), 0).unwrap();
            assert_eq!(past.kept_scans().unwrap().count(), 4, "{what}");
            insert(&damaged, 6).unwrap();
            assert_eq!(damage_in(&damaged), BTreeSet::new(), "{what}");
        }
    }
    assert!(repairs > 60 && from_tiles > 20, "{repairs} repairs, {from_tiles} of them lost scans");
}

/// A failed removal of points that only a deleted snapshot needed is an error.
#[test]
fn a_deletion_that_cannot_remove_points_fails_and_is_completed_by_the_next() {
    let disk = a_map();
    let catalog = map().join("kept_scans/catalog.1");
    let segment = map().join("kept_scans/segment.3");
    // Without the map's own catalog it is unknown whether the map needs the points.
    let own = files_of_scans(&disk)
        .into_keys()
        .find(|path| path != &catalog && path.to_string_lossy().contains("catalog"));
    let (own, snapshot_t) = (own.unwrap(), name("t"));
    let bytes = disk.files()[&own].clone();
    disk.take(&own);
    let message = testkit::support::message_of(delete_snapshot(at(&disk), &name("s")));
    assert!(
        message.contains("the snapshot s is deleted, but points") && disk.files().contains_key(&segment),
        "{message}"
    );
    disk.put(&own, &bytes);
    delete_snapshot(at(&disk), &name("s")).unwrap();
    assert!([&catalog, &segment].iter().all(|path| !disk.files().contains_key(*path)));
    delete_snapshot(at(&disk), &snapshot_t).unwrap();
    assert_eq!(damage_in(&disk), BTreeSet::new());
}
