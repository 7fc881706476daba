//! Files that a killed command, or one whose rename failed, leaves in a map: `verify` reports them, and the next writer
//! and the same command complete them.

use crate::harness::{at, digest_of, keeping_scans, make_foreign, map, name, open_or_create, replay, scans};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use testkit::support::{message_of, some_of};
use voxtile::integrity::{Verification, repair, verify};
use voxtile::operations::{
    Decay, NewPoses, OnlineRemap, Part, Remap, ScanSelection, clear, decay, delete_snapshot, kept_bytes,
    remap, remove_points, remove_scans, revert, snapshot,
};
use voxtile::store::TileStore;
use voxtile::{
    Aabb, Error, MapConfig, MapReader, MapView, Mapper, OutOfCoreTileMapper, Pose, Result, ScanRef, Storage,
};

fn config(storage: Storage, keeps_scans: bool) -> MapConfig {
    keeping_scans().with_storage(storage).with_kept_scans(keeps_scans)
}

fn pose(number: u64, by_m: f64) -> Pose {
    Pose::from_quaternion([3.0 * (number % 4) as f64 + by_m, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]).unwrap()
}

/// Inserts scans with these numbers, with a flush after each.
fn build(disk: &FaultyDisk, config: MapConfig, numbers: std::ops::Range<u64>) -> Result<()> {
    let mut mapper = open_or_create(disk, &config)?;
    for number in numbers.filter(|&number| number >= mapper.scan_number()).collect::<Vec<_>>() {
        let scan = random_scan(&mut Random(number), [0.0; 3], 5);
        mapper.insert_points(&ScanRef::in_sensor(pose(number, 0.0), &scan.points))?;
        mapper.flush()?;
    }
    mapper.flush()
}

/// A map of four scans, with a snapshot of the first three.
fn four_scans(storage: Storage, keeps_scans: bool) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    build(&disk, config(storage, keeps_scans), 0..3).unwrap();
    snapshot(at(&disk), &name("third")).unwrap();
    build(&disk, config(storage, keeps_scans), 3..4).unwrap();
    disk.copy()
}

fn findings(disk: &FaultyDisk) -> (Verification, BTreeSet<PathBuf>) {
    let mut found = BTreeSet::new();
    let verification = verify(at(disk), |finding| found.extend([finding.path.clone()]), |_, _| ()).unwrap();
    (verification, found)
}

/// Files that wait to be renamed.
fn waiting(disk: &FaultyDisk) -> Vec<PathBuf> {
    disk.files()
        .into_keys()
        .filter(|path| {
            path.extension().is_some_and(|extension| extension == "next") || path.ends_with(".next")
        })
        .collect()
}

fn region() -> Aabb {
    Aabb { min: [-1.0, -1.0, -1.0], max: [4.1, 4.0, 4.0] }
}

/// A change of a map in a process of its own.
type Work = fn(&FaultyDisk) -> Result<()>;

fn appended(disk: &FaultyDisk) -> Result<()> {
    let config = MapReader::config_of(at(disk))?;
    build(disk, config.with_range(0.3, 3.0).with_cache_tiles(2).with_write_buffer_bytes(600), 4..9)
}

fn cleared(disk: &FaultyDisk) -> Result<()> {
    clear(at(disk), &Part::Inside(region()), |_, _| ()).map(drop)
}

fn decayed(disk: &FaultyDisk) -> Result<()> {
    decay(at(disk), &Decay::new(2.0).with_forget_below(0.25), |_, _| ()).map(drop)
}

fn kept(disk: &FaultyDisk) -> Result<()> {
    snapshot(at(disk), &name("now-and-then"))
}

fn deleted(disk: &FaultyDisk) -> Result<()> {
    match delete_snapshot(at(disk), &name("third")) {
        // Done by an earlier attempt.
        Err(Error::InvalidArgument { .. }) => Ok(()),
        deleted => deleted,
    }
}

fn reverted(disk: &FaultyDisk) -> Result<()> {
    revert(at(disk), &name("third"), Some(&name("fourth")), |_, _| ()).map(drop)
}

fn new_poses() -> NewPoses {
    NewPoses::Numbered(vec![(1, pose(0, 0.7)), (3, pose(2, 0.7))])
}

fn moved(disk: &FaultyDisk) -> Result<()> {
    remap(&scans(disk)?, &new_poses(), &Remap::new(replay().with_keep_as(name("before"))), |_, _| ())
        .map(drop)
}

fn moved_online(disk: &FaultyDisk) -> Result<()> {
    let how = Remap::new(replay().with_keep_as(name("before")));
    let mut online = OnlineRemap::begin(&scans(disk)?, &new_poses(), &how)?;
    online.follow(|_| ())?;
    online.finish().map(drop)
}

fn removed(disk: &FaultyDisk) -> Result<()> {
    remove_scans(at(disk), &ScanSelection::Numbers(2, 2), false, &replay(), |_, _| ()).map(drop)
}

fn removed_kept(disk: &FaultyDisk) -> Result<()> {
    let (scans, how) = (ScanSelection::Numbers(2, 2), replay().with_keep_as(name("before")));
    remove_scans(at(disk), &scans, false, &how, |_, _| ()).map(drop)
}

fn points_removed(disk: &FaultyDisk) -> Result<()> {
    remove_points(at(disk), &region(), &replay(), |_, _| ()).map(drop)
}

fn points_removed_kept(disk: &FaultyDisk) -> Result<()> {
    remove_points(at(disk), &region(), &replay().with_keep_as(name("before")), |_, _| ()).map(drop)
}

/// Repairs a map whose list of scans and one octree are damaged.
fn repaired(disk: &FaultyDisk) -> Result<()> {
    repair(at(disk), |_| (), |_, _| ()).map(drop)
}

fn damaged(storage: Storage) -> FaultyDisk {
    let disk = four_scans(storage, false);
    let files = disk.files();
    let list = &files[&map().join("scans.bin")];
    disk.put(&map().join("scans.bin"), &list[..list.len() - 5]);
    disk.make_unreadable(&map().join("scans.bin"));
    if let Some((octree, bytes)) = files.iter().find(|(path, _)| path.ends_with("octree.bt")) {
        disk.put(octree, &bytes[1..]);
    }
    disk
}

/// The same map without the files that voxtile adds.
fn foreign() -> FaultyDisk {
    let disk = four_scans(Storage::OctoMap, false);
    make_foreign(&disk, map());
    disk.copy()
}

fn all_works() -> Vec<(&'static str, FaultyDisk, Work)> {
    let mut works: Vec<(&'static str, FaultyDisk, Work)> = Vec::new();
    for storage in [Storage::OctoMap, Storage::Compact] {
        let (plain, keeping) = (four_scans(storage, false), four_scans(storage, true));
        works.push(("append", plain.copy(), appended));
        works.push(("append kept scans", keeping.copy(), appended));
        works.push(("clear", plain.copy(), cleared));
        works.push(("decay", plain.copy(), decayed));
        works.push(("snapshot", plain.copy(), kept));
        works.push(("delete", plain.copy(), deleted));
        works.push(("revert", plain.copy(), reverted));
        works.push(("revert kept scans", keeping.copy(), reverted));
        works.push(("remap", keeping.copy(), moved));
        works.push(("online remap", keeping.copy(), moved_online));
        works.push(("remove scans", keeping.copy(), removed));
        works.push(("remove points", keeping.copy(), points_removed));
        works.push(("repair", damaged(storage), repaired));
    }
    works.push(("upgrade", foreign(), kept));
    works
}

/// Returns the bytes on disk as `info` counts them: of the map, and of readers.
fn bytes_of(disk: &FaultyDisk) -> (Option<(u64, u64)>, u64) {
    let reader = MapReader::open(at(disk), 0).unwrap();
    (reader.disk_bytes(), kept_bytes(at(disk)).unwrap().reader_bytes)
}

/// `info` counts the bytes that are left after the cleanup.
#[test]
fn failed_renames_are_reported_and_completed_by_the_next_writer() {
    let (mut faults, mut kinds) = (0, BTreeMap::<String, u64>::new());
    for (what, start, work) in all_works() {
        let undisturbed = start.copy();
        undisturbed.set_fault(Fault::None);
        // Unreadable files remain unreadable.
        let begin = || {
            let disk = start.copy();
            if what == "repair" {
                disk.make_unreadable(&map().join("scans.bin"));
            }
            disk
        };
        work(&undisturbed).unwrap_or_else(|error| panic!("{what}: {error:#}"));
        for at_rename in some_of(0..undisturbed.renames(), 16) {
            let disk = begin();
            disk.set_fault(Fault::RefusesRename(at_rename));
            let outcome = work(&disk);
            let what = format!("{what}, rename {at_rename}");
            faults += 1;
            if outcome.is_ok() {
                let left = waiting(&disk);
                for path in &left {
                    let of = path.file_name().unwrap().to_string_lossy().into_owned();
                    *kinds.entry(of).or_default() += 1;
                }
                let (verification, found) = findings(&disk);
                assert_eq!(verification.damage, 0, "{what}: {found:?}");
                assert!(left.iter().all(|path| found.contains(path)), "{what}: {left:?}, found {found:?}");
                assert!(verification.leftovers >= left.len() as u64, "{what}");
                let before = bytes_of(&disk);
                disk.make_room();
                drop(
                    TileStore::open(disk.shared(), map()).unwrap_or_else(|error| panic!("{what}: {error:#}")),
                );
                assert_eq!(waiting(&disk), Vec::<PathBuf>::new(), "{what}");
                assert_eq!(findings(&disk).0.leftovers, 0, "{what}");
                assert_eq!(bytes_of(&disk), before, "{what}");
                assert_eq!(before.1, 0, "{what}: there is no reader");
            } else {
                disk.make_room();
                work(&disk).unwrap_or_else(|error| panic!("{what}: again: {error:#}"));
                assert_eq!(waiting(&disk), Vec::<PathBuf>::new(), "{what}: again");
            }
        }
    }
    println!("{faults} renames refused; left by commands that ended well: {kinds:?}");
    assert!(faults > 20);
}

/// Includes files that no current operation leaves.
#[test]
fn unfinished_replacements_are_reported_and_removed() {
    for start in [four_scans(Storage::Compact, false), foreign()] {
        let names = ["metadata.json.next", "commits.log.next", "scans.bin.next"];
        names.iter().for_each(|name| start.put(&map().join(name), b"half"));
        if !start.files().contains_key(&map().join("scans.bin")) {
            start.put(&map().join("scans.bin"), b"");
        }
        let (verification, found) = findings(&start);
        assert_eq!(verification.leftovers, 3, "{found:?}");
        assert!(names.iter().all(|name| found.contains(&map().join(name))));
        drop(TileStore::open(start.shared(), map()).unwrap());
        assert_eq!(waiting(&start), Vec::<PathBuf>::new());
    }
}

/// Returns the segments of the kept scans, and the number of kept scans.
fn segments(disk: &FaultyDisk) -> (BTreeSet<String>, u64) {
    let is_segment = |path: &PathBuf| {
        let name = path.file_name()?.to_string_lossy().into_owned();
        name.starts_with("segment.").then_some(name)
    };
    let found = disk.files().keys().filter_map(is_segment).collect();
    (found, MapReader::open(at(disk), 0).unwrap().kept_scans().unwrap().count() as u64)
}

/// A map of three scans in one segment.
fn one_segment() -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config(Storage::Compact, true)).unwrap();
    for number in 0..3 {
        let scan = random_scan(&mut Random(number), [0.0; 3], 5);
        mapper.insert_points(&ScanRef::in_sensor(pose(number, 0.0), &scan.points)).unwrap();
    }
    mapper.flush().unwrap();
    drop(mapper);
    disk.copy()
}

/// The first segment contains the removed scan. After a kill at any change, `verify` reports the segment while it
/// exists, and the same call or the next writer removes it.
#[test]
fn leftover_points_of_removed_scans_are_reported_and_removed() {
    let start = one_segment();
    let done = start.copy();
    removed(&done).unwrap();
    assert_eq!(segments(&done), (BTreeSet::from(["segment.2".to_owned()]), 2));
    let (mut left, changes) = (0, done.changes());
    for at in some_of(0..changes, 3) {
        let disk = start.copy();
        disk.set_fault(Fault::Crashes(at));
        let _ = removed(&disk);
        for disk in
            [disk.after_kill(), disk.after_crash(Unsynced::Shuffled(at)), disk.after_crash(Unsynced::Dropped)]
        {
            let what = format!("change {at} of {changes}");
            let (there, scans) = segments(&disk);
            let is_left = scans == 2 && there.contains("segment.1");
            if is_left {
                left += 1;
                let (verification, found) = findings(&disk);
                assert!(found.contains(&map().join("kept_scans/segment.1")), "{what}: {found:?}");
                assert!(verification.is_whole() && verification.leftovers > 0, "{what}");
                // Completed by another writer.
                let other = disk.copy();
                drop(TileStore::open(other.shared(), map()).unwrap());
                assert!(!segments(&other).0.contains("segment.1"), "{what}");
                removed(&other).unwrap_or_else(|error| panic!("{what}: after another writer: {error:#}"));
                // Unknown scan numbers are an error, after the earlier removal is completed.
                let other = disk.copy();
                let scans = ScanSelection::Numbers(7, 9);
                let refused = remove_scans(self::at(&other), &scans, false, &replay(), |_, _| ());
                assert!(message_of(refused).contains("the map keeps none"), "{what}");
                assert!(!segments(&other).0.contains("segment.1"), "{what}");
                let again =
                    remove_scans(self::at(&disk), &ScanSelection::Numbers(2, 2), false, &replay(), |_, _| ());
                assert!(again.unwrap().files_removed > 0, "{what}");
            } else {
                removed(&disk).unwrap();
            }
            assert_eq!(segments(&disk), segments(&done), "{what}");
            let (verification, found) = findings(&disk);
            assert_eq!(verification.leftovers, 0, "{what}, {scans} scans: {found:?}");
            // The removal is durable.
            let dropped = disk.after_crash(Unsynced::Dropped);
            assert_eq!(segments(&dropped), segments(&done), "{what}");
        }
    }
    assert!(left > 0);
}

/// A copy of the map, as in a bucket, contains no file that is to be removed.
#[test]
fn a_copy_of_a_map_skips_leftovers_of_a_killed_removal() {
    let start = one_segment();
    let done = start.copy();
    removed(&done).unwrap();
    let mut left = 0;
    for change in 0..done.changes() {
        let disk = start.copy();
        disk.set_fault(Fault::Crashes(change));
        let _ = removed(&disk);
        let disk = disk.after_kill();
        if segments(&disk).1 == 2 {
            let store = TileStore::open_read_only(disk.shared(), map()).unwrap();
            let files = store.committed_files(&store.snapshots().read_all().unwrap()).unwrap();
            let kept: Vec<_> =
                files.iter().map(|file| &*file.path).filter(|path| path.starts_with("kept_scans/")).collect();
            left += u64::from(segments(&disk).0.contains("segment.1"));
            assert_eq!(kept.len(), 2, "change {change}: {kept:?}");
            assert!(kept.contains(&"kept_scans/segment.2"), "change {change}: {kept:?}");
        }
    }
    assert!(left > 0);
}

/// After any writer has opened the map, readers need not wait for `metadata.json`, even if the writer commits nothing.
#[test]
fn a_writer_replaces_outdated_metadata() {
    let start = four_scans(Storage::Compact, false);
    let done = start.copy();
    decayed(&done).unwrap();
    let mut behind = 0;
    for change in 0..done.changes() {
        let disk = start.copy();
        disk.set_fault(Fault::Crashes(change));
        let _ = decayed(&disk);
        let disk = disk.after_kill();
        let is_behind = || TileStore::open_read_only(disk.shared(), map()).unwrap().is_metadata_behind();
        behind += u64::from(is_behind());
        drop(TileStore::open(disk.shared(), map()).unwrap());
        assert!(!is_behind(), "change {change}");
    }
    assert!(behind > 0);
}

/// If the disk cannot remove the files, the call fails.
#[test]
fn a_removal_whose_files_remain_is_an_error() {
    let start = one_segment();
    let done = start.copy();
    removed(&done).unwrap();
    let mut refused = 0;
    for operation in some_of(0..done.operations(), 3) {
        let disk = start.copy();
        disk.set_fault(Fault::Breaks(operation));
        let outcome = removed(&disk);
        let files = disk.files();
        let is_left = files.contains_key(&map().join("kept_scans/segment.1"));
        refused += u64::from(outcome.is_err());
        assert!(outcome.is_err() || !is_left, "operation {operation}");
        disk.mend();
        removed(&disk).unwrap();
        assert_eq!(segments(&disk).0, segments(&done).0, "operation {operation}");
    }
    assert!(refused > 0);
}

/// Kept scans are deleted with the last snapshot that needs them, if the map no longer keeps scans.
#[test]
fn kept_scans_are_deleted_with_the_last_snapshot_that_needs_them() {
    let disk = FaultyDisk::new(Fault::None);
    build(&disk, config(Storage::Compact, false), 0..1).unwrap();
    snapshot(at(&disk), &name("without")).unwrap();
    build(&disk, config(Storage::Compact, true), 1..2).unwrap();
    snapshot(at(&disk), &name("with")).unwrap();
    revert(at(&disk), &name("without"), None, |_, _| ()).unwrap();
    let has_scans = || disk.files().keys().any(|path| path.starts_with(map().join("kept_scans")));
    assert!(has_scans());
    delete_snapshot(at(&disk), &name("with")).unwrap();
    assert!(!has_scans());
    assert_eq!(findings(&disk).0.notes, 0);
}

#[test]
fn a_repeated_removal_succeeds_and_one_of_unknown_scans_fails() {
    let disk = one_segment();
    for (scans, how) in [(1, replay()), (0, replay()), (0, replay().with_keep_as(name("before")))] {
        let removed = remove_scans(at(&disk), &ScanSelection::Numbers(2, 2), false, &how, |_, _| ()).unwrap();
        assert_eq!((removed.scans_removed, removed.files_removed), (scans, 0));
    }
    assert_eq!(names(&disk), Vec::<String>::new());
    for from_snapshots in [false, true] {
        let scans = ScanSelection::Numbers(4, 9);
        let refused = remove_scans(at(&disk), &scans, from_snapshots, &replay(), |_, _| ());
        assert!(message_of(refused).contains("the map keeps none"));
    }
    // Another writer may hold the map if nothing is left to do.
    let writer = TileStore::open(disk.shared(), map()).unwrap();
    removed(&disk).unwrap();
    drop(writer);
    // The repeated removal also succeeds after other changes of the map.
    cleared(&disk).unwrap();
    removed(&disk).unwrap();
}

#[test]
fn a_revert_removes_unneeded_kept_scans() {
    let disk = four_scans(Storage::Compact, true);
    let before = segments(&disk).0;
    revert(at(&disk), &name("third"), None, |_, _| ()).unwrap();
    let (verification, found) = findings(&disk);
    assert_eq!(verification.leftovers, 0, "{found:?}");
    assert!(segments(&disk).0.len() < before.len());
}

/// The removal of a second map begins with `metadata.json` and `commits.log`, which contain its id. If it is killed
/// then, the next removal completes it.
#[test]
fn a_removal_completes_the_removal_of_a_second_map() {
    let start = four_scans(Storage::Compact, true);
    let online = OnlineRemap::begin(&scans(&start).unwrap(), &new_poses(), &Remap::new(replay())).unwrap();
    let start = start.after_kill();
    drop(online);
    let second = Path::new("/city/map.remapping");
    let has_second = |disk: &FaultyDisk| disk.files().keys().any(|path| path.starts_with(second));
    for gone in [&["metadata.json"][..], &["commits.log"], &["metadata.json", "commits.log"]] {
        for work in [removed as Work, points_removed] {
            let disk = start.copy();
            gone.iter().for_each(|name| disk.take(&second.join(name)));
            work(&disk).unwrap();
            assert!(!has_second(&disk), "{gone:?}");
        }
    }
}

/// A killed online remap leaves a second map, which has the evidence of all scans, including removed ones.
#[test]
fn a_removal_removes_the_second_map_of_a_killed_remap() {
    let start = four_scans(Storage::Compact, true);
    delete_snapshot(at(&start), &name("third")).unwrap();
    let online = OnlineRemap::begin(&scans(&start).unwrap(), &new_poses(), &Remap::new(replay())).unwrap();
    let disk = start.after_kill();
    drop(online);
    let second = Path::new("/city/map.remapping");
    assert!(findings(&disk).1.contains(second));
    removed(&disk).unwrap();
    assert!(!disk.files().keys().any(|path| path.starts_with(second)), "{:?}", disk.files().keys());
    assert!(!findings(&disk).1.contains(second));
}

fn names(disk: &FaultyDisk) -> Vec<String> {
    let infos = voxtile::operations::snapshots(at(disk)).unwrap();
    let mut names: Vec<_> =
        infos.into_iter().map(|info| format!("{} of scan {}", info.name, info.scan_number)).collect();
    names.sort_unstable();
    names
}

/// After a kill at any change, the same call succeeds with the same result, although it first creates a snapshot.
#[test]
fn a_call_that_makes_a_snapshot_first_can_be_repeated_after_a_kill() {
    let works: [(&str, Work); 6] = [
        ("snapshot", kept),
        ("revert", reverted),
        ("remap", moved),
        ("online remap", moved_online),
        ("remove scans", removed_kept),
        ("remove points", points_removed_kept),
    ];
    for (what, work) in works {
        for (storage, one_in) in [(Storage::Compact, 8), (Storage::OctoMap, 24)] {
            let start = four_scans(storage, true);
            let done = start.copy();
            work(&done).unwrap();
            let (before, after) = (digest_of(&start, None).unwrap(), digest_of(&done, None).unwrap());
            assert_eq!(before == after, what == "snapshot");
            for at in some_of(0..done.changes(), one_in) {
                let disk = start.copy();
                disk.set_fault(Fault::Crashes(at));
                let _ = work(&disk);
                let disk = disk.after_kill();
                let what = format!("{what}, change {at}");
                assert!([before, after].contains(&digest_of(&disk, None).unwrap()), "{what}");
                work(&disk).unwrap_or_else(|error| panic!("{what}: again: {error:#}"));
                assert_eq!((digest_of(&disk, None).unwrap(), names(&disk)), (after, names(&done)), "{what}");
                assert!(findings(&disk).0.is_whole(), "{what}");
            }
        }
    }
}

/// The name of a snapshot of another state is an error.
#[test]
fn an_existing_snapshot_of_another_state_is_an_error() {
    let disk = four_scans(Storage::Compact, true);
    let third = Some(name("third"));
    let before = (digest_of(&disk, None).unwrap(), names(&disk));
    let how = replay().with_keep_as(third.clone());
    let refusals = [
        message_of(snapshot(at(&disk), &name("third"))),
        message_of(
            scans(&disk).and_then(|scans| remap(&scans, &new_poses(), &Remap::new(how.clone()), |_, _| ())),
        ),
        message_of(remove_scans(at(&disk), &ScanSelection::Numbers(2, 2), false, &how, |_, _| ())),
        message_of(remove_points(at(&disk), &region(), &how, |_, _| ())),
        message_of(revert(at(&disk), &name("third"), third.as_ref(), |_, _| ())),
    ];
    for message in refusals {
        assert!(message.contains("snapshots/third"), "{message}");
    }
    assert_eq!((digest_of(&disk, None).unwrap(), names(&disk)), before);
    // The same tiles and another scan.
    snapshot(at(&disk), &name("fourth")).unwrap();
    snapshot(at(&disk), &name("fourth")).unwrap();
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config(Storage::Compact, true)).unwrap();
    mapper.insert_points(&ScanRef::in_sensor(pose(0, 0.0), &[] as &[[f64; 3]])).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    assert!(message_of(snapshot(at(&disk), &name("fourth"))).contains("snapshots/fourth"));
    // Only the pose of that scan changes, which is in no tile.
    snapshot(at(&disk), &name("fifth")).unwrap();
    let poses = NewPoses::Numbered(vec![(5, pose(0, 9.0))]);
    remap(&scans(&disk).unwrap(), &poses, &Remap::new(replay()), |_, _| ()).unwrap();
    assert!(message_of(snapshot(at(&disk), &name("fifth"))).contains("snapshots/fifth"));
}

/// Unflushed scans of a writer are no damage, and flushed ones are no leftovers.
#[test]
fn verify_during_writes_finds_no_damage_and_no_leftovers() {
    let disk = four_scans(Storage::Compact, true);
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config(Storage::Compact, true)).unwrap();
    for number in 4..8 {
        let scan = random_scan(&mut Random(number), [0.0; 3], 5);
        mapper.insert_points(&ScanRef::in_sensor(pose(number, 0.0), &scan.points)).unwrap();
        let (verification, found) = findings(&disk);
        assert!(verification.is_whole(), "{found:?}");
        mapper.flush().unwrap();
        let (verification, found) = findings(&disk);
        assert_eq!((verification.damage, verification.leftovers), (0, 0), "{found:?}");
    }
}
