//! Interrupted deletions of snapshots: the same command completes them and succeeds.

use crate::harness::{at, keeping_scans as config, map, name};
use std::path::Path;
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use voxtile::integrity::{Verification, verify};
use voxtile::operations::{delete_snapshot, snapshot};
use voxtile::store::TileStore;
use voxtile::{Error, Mapper, OutOfCoreTileMapper, Pose, ScanRef};

fn insert(mapper: &mut OutOfCoreTileMapper, number: u64) {
    let pose = Pose::from_quaternion([3.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let scan = random_scan(&mut Random(number), [0.0; 3], 5);
    mapper.insert_points(&ScanRef::in_sensor(pose, &scan.points)).unwrap();
    mapper.flush().unwrap();
}

fn looked_at(disk: &FaultyDisk) -> Verification {
    verify(at(disk), |_| (), |_, _| ()).unwrap()
}

#[test]
fn a_killed_deletion_is_completed_by_the_same_call() {
    let of = name("s");
    let start = FaultyDisk::new(Fault::None);
    insert(&mut OutOfCoreTileMapper::create(at(&start), config()).unwrap(), 1);
    snapshot(at(&start), &of).unwrap();
    insert(&mut OutOfCoreTileMapper::open(at(&start), config()).unwrap(), 2);
    let start = start.copy();
    let (mut completed, mut gone) = (0, 0);
    for change in 0.. {
        let disk = start.copy();
        disk.set_fault(Fault::Crashes(change));
        let _ = delete_snapshot(at(&disk), &of);
        if !disk.has_crashed() {
            break;
        }
        for disk in [disk.after_kill(), disk.after_crash(Unsynced::Dropped), disk.after_crash(Unsynced::Kept)]
        {
            let store = TileStore::open_read_only(disk.shared(), map()).unwrap();
            let is_listed = store.snapshots().names().unwrap().contains(&of);
            drop(store);
            let before = looked_at(&disk);
            match delete_snapshot(at(&disk), &of) {
                Ok(()) => completed += usize::from(!is_listed),
                // The deletion was already complete.
                Err(Error::InvalidArgument { .. }) => {
                    assert_eq!((is_listed, before.leftovers), (false, 0), "change {change}");
                    gone += 1;
                }
                Err(error) => panic!("change {change}: {error:#}"),
            }
            let after = looked_at(&disk);
            assert_eq!((after.damage, after.leftovers, after.snapshots), (0, 0, 0), "change {change}");
            let is_of_snapshot = |path: &Path| path.to_string_lossy().contains(".flush");
            assert!(!disk.files().keys().any(|path| is_of_snapshot(path)), "change {change}");
        }
    }
    assert!(completed > 5, "{completed} completed, {gone} were complete");
}

#[test]
fn an_unknown_snapshot_name_is_an_error() {
    let disk = FaultyDisk::new(Fault::None);
    insert(&mut OutOfCoreTileMapper::create(at(&disk), config()).unwrap(), 1);
    let refused = delete_snapshot(at(&disk), &name("s"));
    assert!(matches!(refused, Err(Error::InvalidArgument { .. })), "{refused:?}");
}
