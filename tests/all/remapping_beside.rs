//! Online remaps during inserts. Random sequences are tested in `remapping` and `map_life`.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use testkit::random_scans::{Random, random_scan};
use testkit::support::message_of;
use voxtile::integrity::{Finding, Severity, verify};
use voxtile::mapper::KeptSummary;
use voxtile::operations::{
    NewPoses, OnlineRemap, Part, Remap, Replay, ScanSelection, clear, remap, remove_scans,
};
use voxtile::scan::Stop;
use voxtile::store::SnapshotName;
use voxtile::{
    Error, MapConfig, MapQueries, MapReader, MapView, Mapper, MemoryLimit, OutOfCoreTileMapper, Pose, Result,
    ScanRef, Storage,
};

fn config() -> MapConfig {
    let config = MapConfig::new(0.2, 3.2).unwrap().with_range(0.3, 12.0).with_kept_scans(true);
    config.with_memory_bytes(20 << 20)
}

fn scans(folder: impl AsRef<Path>) -> Result<KeptSummary> {
    KeptSummary::read(folder)
}

fn how() -> Remap {
    Remap::new(Replay::default().with_memory(MemoryLimit::Bytes(20 << 20)))
}

fn insert(mapper: &mut OutOfCoreTileMapper, number: u64) {
    let points = random_scan(&mut Random(number), [0.0; 3], 60).points;
    mapper.insert_points(&ScanRef::in_sensor(pose(number, 0.0), &points)).unwrap();
}

/// A drive along x; the corrected one is shifted by some metres.
fn pose(number: u64, y: f64) -> Pose {
    Pose::from_quaternion([0.3 * number as f64, y, 0.0], [0.0, 0.0, 0.1, 1.0]).unwrap()
}

fn moved(scans: u64) -> NewPoses {
    NewPoses::Numbered((1..=scans).map(|number| (number, pose(number, 1.7))).collect())
}

fn with_scans(folder: &Path, config: MapConfig, scans: u64) -> OutOfCoreTileMapper {
    let mut mapper = OutOfCoreTileMapper::create(folder, config).unwrap();
    (1..=scans).for_each(|number| insert(&mut mapper, number));
    mapper.flush().unwrap();
    mapper
}

fn digest_of(folder: &Path) -> String {
    let is_damage = |finding: &Finding| finding.severity == Severity::Damage;
    let found = |finding: &Finding| assert!(!is_damage(finding), "{finding}");
    verify(folder, found, |_, _| ()).unwrap();
    MapReader::open(folder, 0).unwrap().digest().unwrap().to_string()
}

fn assert_no_leftovers(folder: &Path) {
    let names: Vec<_> = std::fs::read_dir(folder.parent().unwrap()).unwrap().flatten().collect();
    assert!(names.iter().all(|entry| entry.file_name() != "map.remapping"), "{names:?}");
}

/// A mapper inserts scans, flushes in the background and is queried, while another thread runs an online remap; for
/// both storages, and for poses that move some of the scans or all.
#[test]
fn scans_are_inserted_during_an_online_remap() {
    for (storage, moving) in [(Storage::OctoMap, 40), (Storage::Compact, 8)] {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("map");
        let mut mapper = with_scans(&folder, config().with_storage(storage), 40);
        let online = OnlineRemap::begin(&scans(&folder).unwrap(), &moved(moving), &how()).unwrap();
        assert!(online.moves_scans());
        let (is_over, mut followed) = (AtomicBool::new(false), 0);
        let online = std::thread::scope(|scope| {
            let follower = scope.spawn(|| {
                let mut online = online;
                while !is_over.load(Ordering::Relaxed) {
                    followed += online.follow(|_| ()).unwrap();
                }
                online
            });
            for number in 41..=90 {
                insert(&mut mapper, number);
                if number % 10 == 0 {
                    mapper.begin_flush().unwrap();
                }
            }
            mapper.flush().unwrap();
            is_over.store(true, Ordering::Relaxed);
            follower.join().unwrap()
        });
        insert(&mut mapper, 91);
        mapper.flush().unwrap();
        drop(mapper);
        let report = online.finish().unwrap();
        assert!((40..=91).contains(&followed), "{followed}");
        assert_eq!((report.mapped.scans, report.mapped.scans_changed), (91, moving), "{report:?}");
        assert!((report.largest_move_m - 1.7).abs() < 1e-9, "{report:?}");
        assert!(
            report.mapped.tiles_mapped > 0 && report.mapped.tiles_mapped <= report.mapped.tiles,
            "{report:?}"
        );

        // The result of an offline remap with the same scans and poses.
        let other = place.path().join("other");
        drop(with_scans(&other, config().with_storage(storage), 91));
        remap(&scans(&other).unwrap(), &moved(moving), &how(), |_, _| ()).unwrap();
        assert_eq!(digest_of(&folder), digest_of(&other), "{storage:?}");
        assert_no_leftovers(&folder);

        // The map can be continued and replayed: its scans have the new poses and tiles.
        for map in [&folder, &other] {
            let mut mapper = OutOfCoreTileMapper::open(&**map, config()).unwrap();
            insert(&mut mapper, 92);
            mapper.flush().unwrap();
            drop(mapper);
            remove_scans(&**map, &ScanSelection::Numbers(3, 50), false, &Replay::default(), |_, _| ())
                .unwrap();
        }
        assert_eq!(digest_of(&folder), digest_of(&other), "{storage:?}, without some scans");
    }
}

#[test]
fn unchanged_poses_do_not_change_the_map() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("map");
    drop(with_scans(&folder, config(), 5));
    let commits = std::fs::read(folder.join("commits.log")).unwrap();
    let same = NewPoses::Numbered((1..=5).map(|number| (number, pose(number, 0.0))).collect());
    let mut online = OnlineRemap::begin(&scans(&folder).unwrap(), &same, &how()).unwrap();
    assert!(!online.moves_scans());
    assert_eq!(online.follow(|_| ()).unwrap(), 0);
    assert_eq!(online.finish().unwrap().mapped.scans_changed, 0);
    assert_eq!(std::fs::read(folder.join("commits.log")).unwrap(), commits);
}

/// Another process changed earlier scans before the end: the remap is not swapped in.
#[test]
fn concurrent_changes_of_scans_are_not_overwritten() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("map");
    drop(with_scans(&folder, config(), 6));
    let begun = || {
        let mut online = OnlineRemap::begin(&scans(&folder).unwrap(), &moved(6), &how()).unwrap();
        online.follow(|_| ()).unwrap();
        online
    };
    let online = begun();
    remove_scans(&*folder, &ScanSelection::Numbers(2, 2), false, &Replay::default(), |_, _| ()).unwrap();
    let digest = digest_of(&folder);
    assert!(matches!(online.finish(), Err(Error::Changed { .. })));
    assert_eq!(digest_of(&folder), digest);
    assert_no_leftovers(&folder);

    let moved = moved(1);
    let online = OnlineRemap::begin(&scans(&folder).unwrap(), &moved, &how()).unwrap();
    let region = voxtile::Aabb { min: [0.0; 3], max: [1.0; 3] };
    clear(&*folder, &Part::Inside(region), |_, _| ()).unwrap();
    let digest = digest_of(&folder);
    let message = message_of(online.finish());
    assert!(message.contains("a change by another operation: clear"), "{message}");
    assert_eq!(digest_of(&folder), digest);
}

#[test]
fn only_one_remap_runs_and_a_stop_or_drop_leaves_nothing() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("map");
    let mut mapper = with_scans(&folder, config(), 6);
    let digest = digest_of(&folder);
    let stop = Stop::default();
    let mut stoppable = how();
    stoppable.replay = stoppable.replay.with_stop(stop.clone());
    let mut online = OnlineRemap::begin(&scans(&folder).unwrap(), &moved(6), &stoppable).unwrap();
    let second = OnlineRemap::begin(&scans(&folder).unwrap(), &moved(6), &how());
    assert!(matches!(second, Err(Error::Locked { .. })), "{second:?}");
    assert!(place.path().join("map.remapping").exists());
    assert!(matches!(
        online.follow(|scan| if scan == 2 {
            stop.set()
        }),
        Err(Error::Stopped)
    ));
    drop(online);
    assert_no_leftovers(&folder);
    insert(&mut mapper, 7);
    mapper.flush().unwrap();
    // The end needs the lock that the mapper holds.
    let online = OnlineRemap::begin(&scans(&folder).unwrap(), &moved(6), &how()).unwrap();
    assert!(matches!(online.finish(), Err(Error::Locked { .. })));
    assert_no_leftovers(&folder);
    drop(mapper);
    assert_ne!(digest_of(&folder), digest);

    let message = message_of(scans(&folder).and_then(|scans| OnlineRemap::begin(&scans, &moved(8), &how())));
    assert!(message.contains("no scan with the number 8"), "{message}");
    let mut dry = how();
    dry.replay = dry.replay.with_dry_run(true);
    assert!(
        message_of(scans(&folder).and_then(|scans| OnlineRemap::begin(&scans, &moved(6), &dry)))
            .contains("dry_run")
    );
    // Foreign files are kept and block the remap.
    std::fs::create_dir_all(place.path().join("map.remapping/kept_scans")).unwrap();
    std::fs::write(place.path().join("map.remapping/kept_scans/letter.txt"), "dear").unwrap();
    let message = message_of(scans(&folder).and_then(|scans| OnlineRemap::begin(&scans, &moved(6), &how())));
    assert!(message.contains("letter.txt"), "{message}");
    assert!(place.path().join("map.remapping/kept_scans/letter.txt").exists());
}

#[test]
fn a_snapshot_keeps_the_map_before_the_swap() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("map");
    let mut mapper = with_scans(&folder, config(), 6);
    let name = SnapshotName::new("before").unwrap();
    let mut keeping = how();
    keeping.replay = keeping.replay.with_keep_as(name.clone());
    let online = OnlineRemap::begin(&scans(&folder).unwrap(), &moved(6), &keeping).unwrap();
    insert(&mut mapper, 7);
    mapper.flush().unwrap();
    drop(mapper);
    let digest = digest_of(&folder);
    online.finish().unwrap();
    let kept = MapReader::open_snapshot(&*folder, &name, 0).unwrap();
    assert_eq!(kept.digest().unwrap().to_string(), digest);
    assert_eq!(kept.scan_number(), 7);
    assert_ne!(digest_of(&folder), digest);
}
