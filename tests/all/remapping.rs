//! Maps that keep their scans: errors, reports, and unchanged maps. Random sequences are tested in `map_life`.

use crate::harness::{
    Act, Content, Job, State, Taken, at, check_files, damage_in, digest_of, faults, keeping_scans as config,
    map, name, new_poses, perform, replay, scans, snapshot_names,
};
use std::collections::{BTreeMap, BTreeSet};
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::reference_map::voxels_of;
use testkit::support::message_of;
use voxtile::integrity::{repair, verify};
use voxtile::operations::{
    NewPoses, Part, Remap, Replay, ScanSelection, clear, delete_snapshot, remap, remove_points, remove_scans,
};
use voxtile::scan::{PointBatch, Stop};
use voxtile::{Aabb, Error, MapReader, MapView, Mapper, OutOfCoreTileMapper, Pose, ScanRef};

fn region(low: f64, high: f64) -> Aabb {
    Aabb { min: [low, -1.0, -1.0], max: [high, 1.5, 1.5] }
}

fn a_map_with_kept_scans() -> (FaultyDisk, State) {
    let disk = FaultyDisk::new(Fault::None);
    let scans = Act::Scans(0..5);
    perform(&disk, &config(), &State::default(), &scans).unwrap();
    (disk, State::default().after(&scans, &config()))
}

/// Any damaged byte of the kept scans is found, or has no effect. A replay that finds damage changes nothing.
#[test]
fn damage_to_kept_scans_is_an_error_and_changes_nothing() {
    let (whole, state) = a_map_with_kept_scans();
    let files = whole.files();
    let kept = files.iter().filter(|(path, _)| path.to_string_lossy().contains("kept_scans"));
    let mut found = 0;
    for (path, bytes) in kept {
        for offset in (0..bytes.len()).step_by(7) {
            let disk = whole.copy();
            let mut damaged = bytes.clone();
            damaged[offset] ^= 0x20;
            disk.put(path, &damaged);
            let what = format!("{} at {offset}", path.display());
            let mut findings = Vec::new();
            verify(at(&disk), |finding| findings.push(finding.to_string()), |_, _| ()).unwrap();
            let poses = NewPoses::Moving(new_poses(&state.now.scans, 3, None));
            let before = disk.files();
            let remapped =
                scans(&disk).and_then(|scans| remap(&scans, &poses, &Remap::new(replay()), |_, _| ()));
            match remapped {
                Ok(_) => {
                    let moved = state.after(&Act::Move { seed: 3, rest: None }, &config());
                    assert!(findings.is_empty() && moved.is_on(&disk), "{what}");
                }
                Err(error) => {
                    found += 1;
                    assert!(matches!(error, Error::Damaged { .. }), "{what}: {error:#}");
                    assert!(!findings.is_empty(), "{what}: {error:#} was not found before");
                    assert!(format!("{error:#}").contains("kept_scans"), "{what}: {error:#}");
                    let tables = |files: &BTreeMap<std::path::PathBuf, Vec<u8>>| {
                        let tables =
                            files.iter().filter(|(path, _)| path.to_string_lossy().contains("tile_"));
                        tables.map(|(path, bytes)| (path.clone(), bytes.clone())).collect::<Vec<_>>()
                    };
                    assert_eq!(tables(&before), tables(&disk.files()), "{what}");
                }
            }
            // The repaired map works, but no longer keeps all scans.
            repair(at(&disk), |_| (), |_, _| ()).unwrap();
            assert_eq!(damage_in(&disk), BTreeSet::new(), "{what}");
        }
    }
    assert!(found > 100, "{found}");
}

#[test]
fn segments_and_catalogs_that_are_missing_are_damage() {
    let (whole, state) = a_map_with_kept_scans();
    let names: Vec<_> = whole.files().into_keys().collect();
    let names = names.iter().filter(|path| path.to_string_lossy().contains("kept_scans"));
    for path in names {
        let disk = whole.copy();
        disk.take(path);
        let poses = NewPoses::Moving(new_poses(&state.now.scans, 3, None));
        let message = message_of(
            scans(&disk).and_then(|scans| remap(&scans, &poses, &Remap::new(replay()), |_, _| ())),
        );
        assert!(message.contains("missing"), "{message}");
        let mut damage = 0;
        verify(at(&disk), |_| damage += 1, |_, _| ()).unwrap();
        assert!(damage > 0);
        repair(at(&disk), |_| (), |_, _| ()).unwrap();
        assert_eq!(damage_in(&disk), BTreeSet::new(), "repaired");
        let reader = MapReader::open(at(&disk), 0).unwrap();
        assert_eq!(voxels_of(&reader), state.now.voxels);
    }
}

#[test]
fn maps_with_other_changes_than_scans_are_not_replayed() {
    let refused = |disk: &FaultyDisk| {
        let poses = NewPoses::Numbered(vec![(1, Pose::identity())]);
        message_of(scans(disk).and_then(|scans| remap(&scans, &poses, &Remap::new(replay()), |_, _| ())))
    };
    let (disk, _) = a_map_with_kept_scans();
    clear(at(&disk), &Part::Inside(region(0.0, 1.0)), |_, _| ()).unwrap();
    assert!(refused(&disk).contains("a change by another operation: clear"), "{}", refused(&disk));

    let (disk, _) = a_map_with_kept_scans();
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
    let batch = PointBatch { points: &[[0.1; 3]], intensities: Some(&[9.0]), is_occupied: &[true] };
    mapper.batch_update(&batch).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    assert!(refused(&disk).contains("number 6, which is not a scan"), "{}", refused(&disk));

    // Scans inserted before scans were kept, and a map without any.
    let disk = FaultyDisk::new(Fault::None);
    let without = config().with_kept_scans(false);
    perform(&disk, &without, &State::default(), &Act::Scans(0..2)).unwrap();
    assert!(refused(&disk).contains("keeps no scans"), "{}", refused(&disk));
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
    Taken::new(3).insert_into(&mut mapper).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    assert!(refused(&disk).contains("scan 1, whose points are not kept"), "{}", refused(&disk));
    assert_eq!(MapReader::open(at(&disk), 0).unwrap().scans().unwrap().len(), 3);

    // Scans in the world frame have no pose to change.
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    mapper.insert_scan(&Taken::new(3).in_world()).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    assert!(refused(&disk).contains("the points of scan 1 are in the world frame"), "{}", refused(&disk));
    let region = region(-9.0, 9.0);
    let removed = remove_points(at(&disk), &region, &replay(), |_, _| ()).unwrap();
    assert!(removed.points_removed > 0);
}

#[test]
fn invalid_new_poses_are_errors() {
    let (disk, _) = a_map_with_kept_scans();
    let wrong = |poses: NewPoses| {
        message_of(scans(&disk).and_then(|scans| remap(&scans, &poses, &Remap::new(replay()), |_, _| ())))
    };
    let identity = Pose::identity();
    let message = wrong(NewPoses::InOrder(vec![identity; 3]));
    assert!(message.contains("3 poses for 5 scans: none for scan 4 of the map and later ones"), "{message}");
    let message = wrong(NewPoses::InOrder(vec![identity; 7]));
    assert!(message.contains("7 poses for 5 scans: 2 too many"), "{message}");
    let message = wrong(NewPoses::Numbered(vec![(2, identity), (9, identity)]));
    assert!(message.contains("no scan with the number 9"), "{message}");
    let message = wrong(NewPoses::Numbered(vec![(2, identity), (2, identity)]));
    assert!(message.contains("two poses for scan 2"), "{message}");
    let mut isometry = *identity.isometry();
    isometry.translation.vector.y = f64::NAN;
    let message = wrong(NewPoses::Numbered(vec![(4, isometry.into())]));
    assert!(message.contains("the pose of scan 4 is not finite"), "{message}");
}

#[test]
fn scans_within_the_tolerance_are_unchanged_and_reported() {
    let (disk, state) = a_map_with_kept_scans();
    let digest = digest_of(&disk, None).unwrap();
    let moved = |by_m: f64| {
        let poses = state.now.scans.iter().map(|(&number, scan)| {
            let mut isometry = *scan.pose.isometry();
            isometry.translation.vector.x += by_m * number as f64;
            (number, isometry.into())
        });
        NewPoses::Numbered(poses.collect())
    };
    let how = Remap::new(replay()).with_tolerance((0.045, 0.01));
    let remapped = remap(&scans(&disk).unwrap(), &moved(0.01), &how, |_, _| ()).unwrap();
    assert_eq!((remapped.scans_within_tolerance, remapped.mapped.scans_changed), (4, 1), "{remapped:?}");
    let left_m = remapped.largest_move_left_m;
    assert!((left_m - 0.04).abs() < 1e-9 && (remapped.largest_move_m - 0.05).abs() < 1e-9);
    assert!(digest_of(&disk, None).unwrap() != digest);
    let wide = Remap::new(replay().with_dry_run(true)).with_tolerance((9.0, 9.0));
    assert_eq!(
        remap(&scans(&disk).unwrap(), &moved(0.02), &wide, |_, _| ()).unwrap().mapped.scans_changed,
        0
    );
}

/// A dry run, a remap that is stopped during the replay, and then a complete one.
#[test]
fn a_dry_run_and_a_stop_change_nothing() {
    let (disk, state) = a_map_with_kept_scans();
    let poses = NewPoses::Moving(new_poses(&state.now.scans, 5, Some(1)));
    let before = disk.files();
    let dry = Remap::new(replay().with_dry_run(true));
    let dry = remap(&scans(&disk).unwrap(), &poses, &dry, |_, _| ()).unwrap().mapped;
    assert!(dry.estimated_s.is_some() && dry.scans_changed == 2 && dry.tiles_mapped > 0, "{dry:?}");
    let is_lock = |path: &std::path::PathBuf| path.ends_with("writer.lock");
    let without_lock = |files: BTreeMap<std::path::PathBuf, Vec<u8>>| {
        files.into_iter().filter(|(path, _)| !is_lock(path)).collect::<Vec<_>>()
    };
    assert!(without_lock(before) == without_lock(disk.files()));
    let stop = Stop::default();
    let how = Remap::new(replay().with_stop(stop.clone()));
    let stopped = remap(&scans(&disk).unwrap(), &poses, &how, |done, _| {
        if done == 1 {
            stop.set()
        }
    });
    assert!(matches!(stopped, Err(Error::Stopped)));
    assert!(state.is_on(&disk));
    assert_eq!(damage_in(&disk), BTreeSet::new(), "stopped");
    let done = remap(&scans(&disk).unwrap(), &poses, &Remap::new(replay()), |_, _| ()).unwrap().mapped;
    assert_eq!((done.tiles_mapped > 0, done.scans_changed), (true, 2));
}

#[test]
fn scans_are_removed_by_time_and_by_input_and_snapshots_are_reported() {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    for (input, seeds) in [("first", 0..3), ("second", 3..5)] {
        mapper.begin_input(input).unwrap();
        seeds.for_each(|seed| Taken::new(seed).insert_into(&mut mapper).unwrap());
    }
    mapper.snapshot(&name("old")).unwrap();
    drop(mapper);
    let remove = |scans: ScanSelection, from_snapshots| {
        remove_scans(at(&disk), &scans, from_snapshots, &replay(), |_, _| ())
    };
    assert!(message_of(remove(ScanSelection::Time(0, 9), false)).contains("the map keeps none"));
    let message = message_of(remove(ScanSelection::Input("third".to_owned()), false));
    assert!(message.contains("its inputs are first, second"), "{message}");
    let removed = remove(ScanSelection::Input("second".to_owned()), false).unwrap();
    assert_eq!((removed.scans_removed, removed.snapshots_with_them.len()), (2, 1));
    let reader = MapReader::open(at(&disk), 0).unwrap();
    let three = State::default().after(&Act::Scans(0..3), &config());
    assert!(Content { scan_number: 5, ..three.now }.is_of(&reader));
    // Scan numbers are not reused: the next scan is the sixth.
    drop(reader);
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
    Taken::new(7).insert_into(&mut mapper).unwrap();
    assert_eq!(mapper.scan_number(), 6);
    mapper.flush().unwrap();
    drop(mapper);
    let removed = remove(ScanSelection::Numbers(1, 1), true).unwrap();
    assert_eq!(removed.snapshots_deleted, [name("old")]);
    check_files(&disk, "no leftovers of removed scans");
}

/// A map of five scans of two inputs, which are also in two snapshots.
fn a_map_with_snapshots() -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    for (input, seeds) in [("first", 0..3), ("second", 3..5)] {
        mapper.begin_input(input).unwrap();
        for seed in seeds {
            let Taken { points, intensities, pose, .. } = Taken::new(seed);
            let scan = ScanRef::in_sensor(pose, &points).with_stamp_ns(seed as i64);
            mapper.insert_points(&scan.with_intensities(&intensities).unwrap()).unwrap();
        }
        mapper.snapshot(&name(input)).unwrap();
    }
    mapper.snapshot(&name("third")).unwrap();
    drop(mapper);
    disk.copy()
}

/// Scans that were removed from the map are still found in snapshots, for any selection.
#[test]
fn scans_removed_from_the_map_are_removed_from_its_snapshots() {
    let selections =
        [ScanSelection::Numbers(4, 5), ScanSelection::Time(3, 4), ScanSelection::Input("second".to_owned())];
    for scans in selections {
        let disk = a_map_with_snapshots();
        let remove =
            |from_snapshots, how: &Replay| remove_scans(at(&disk), &scans, from_snapshots, how, |_, _| ());
        let removed = remove(false, &replay()).unwrap();
        assert_eq!((removed.scans_removed, removed.snapshots_with_them.len()), (2, 2), "{scans:?}");
        // The map does not keep the times of removed scans.
        let is_reported = !matches!(scans, ScanSelection::Time(..));
        match remove(false, &replay()) {
            Ok(removed) => assert!(is_reported && removed.scans_removed == 0, "{scans:?}"),
            refused => {
                assert!(!is_reported && message_of(refused).contains("the map keeps none"), "{scans:?}")
            }
        }
        let dry = remove(true, &replay().with_dry_run(true)).unwrap();
        assert_eq!((dry.scans_removed, dry.snapshots_with_them.len()), (0, 2), "{scans:?}");
        // The snapshot that the call creates contains the scans as well.
        let kept = remove(true, &replay().with_keep_as(name("third"))).unwrap();
        assert_eq!(kept.snapshots_deleted, [name("second")], "{scans:?}");
        assert_eq!(kept.snapshots_with_them, [name("third")], "{scans:?}");
        assert_eq!(remove(true, &replay()).unwrap().snapshots_deleted, [name("third")], "{scans:?}");
        assert_eq!(snapshot_names(&disk), ["first"], "{scans:?}");
        match remove(true, &replay()) {
            Ok(removed) => assert!(is_reported && removed.snapshots_deleted.is_empty(), "{scans:?}"),
            refused => {
                assert!(!is_reported && message_of(refused).contains("the map keeps none"), "{scans:?}")
            }
        }
        check_files(&disk, "removed");
    }
}

/// A map that was changed by another operation is not replayed, but snapshots are deleted.
#[test]
fn snapshots_are_deleted_although_the_map_was_changed() {
    let disk = a_map_with_snapshots();
    let scans = ScanSelection::Numbers(4, 5);
    remove_scans(at(&disk), &scans, false, &replay(), |_, _| ()).unwrap();
    clear(at(&disk), &Part::Inside(region(0.0, 1.0)), |_, _| ()).unwrap();
    let removed = remove_scans(at(&disk), &scans, true, &replay(), |_, _| ()).unwrap();
    assert_eq!(removed.snapshots_deleted, [name("second"), name("third")]);
}

#[test]
fn an_unreadable_snapshot_is_reported_after_the_others_are_deleted() {
    let disk = a_map_with_snapshots();
    disk.put(&map().join("snapshots/second"), b"nothing");
    let scans = ScanSelection::Numbers(4, 5);
    let remove = || remove_scans(at(&disk), &scans, true, &replay(), |_, _| ());
    let is_reported =
        |message: &str| message.contains("snapshots/second") && message.contains("may contain scans");
    let removed = remove().unwrap();
    let [failed] = &*removed.snapshots_failed else { panic!("{removed:?}") };
    assert!(is_reported(&failed.reason) && failed.name == name("second"), "{failed:?}");
    assert_eq!(removed.snapshots_deleted, [name("third")]);
    // No scan is left to remove.
    let message = message_of(remove());
    assert!(is_reported(&message), "{message}");
    assert_eq!(snapshot_names(&disk), ["first", "second"]);
    assert_eq!(MapReader::open(at(&disk), 0).unwrap().scans().unwrap().len(), 3);
    delete_snapshot(at(&disk), &name("second")).unwrap();
    let removed = remove().unwrap();
    assert_eq!((removed.scans_removed, removed.snapshots_deleted.len()), (0, 0));
}

/// After a fault or kill at any operation, the same call completes the removal.
#[test]
fn an_interrupted_removal_is_completed_by_the_same_call() {
    let remove = |disk: &FaultyDisk| {
        let scans = ScanSelection::Numbers(4, 5);
        remove_scans(at(disk), &scans, true, &replay(), |_, _| ()).map(drop)
    };
    let start = a_map_with_snapshots();
    let job = Job::new(start.copy(), map(), remove, |disk| {
        MapReader::open(at(disk), 0).unwrap().scans().unwrap().len()
    });
    let fails = faults(&job, &[Fault::Fails], 3);
    for fault in fails.into_iter().chain(faults(&job, &[Fault::Crashes], 2)) {
        let disk = start.copy();
        disk.set_fault(fault);
        let _ = remove(&disk);
        let disk = disk.after_kill();
        remove(&disk).unwrap_or_else(|error| panic!("{fault:?}: {error:#}"));
        assert_eq!(snapshot_names(&disk), ["first"], "{fault:?}");
        assert_eq!(MapReader::open(at(&disk), 0).unwrap().scans().unwrap().len(), 3, "{fault:?}");
        check_files(&disk, &format!("{fault:?}"));
    }
}
