//! Flushes between the first read of a map and its lock: a removal or remap would miss the new scans.

use crate::harness::{at, digest_of, keeping_scans as config};
use std::fmt;
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::support::message_of;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{NewPoses, Remap, Replay, ScanSelection, remap, remove_points, remove_scans};
use voxtile::{Aabb, MapPath, Mapper, OutOfCoreTileMapper, Pose, Result, ScanRef};

fn insert(mapper: &mut OutOfCoreTileMapper, x: f64) {
    mapper.insert_points(&ScanRef::in_sensor(Pose::identity(), &[[x, 0.5, 0.5]])).unwrap();
    mapper.flush().unwrap();
}

/// Flushes the map between the first read and the lock. The call must fail and leave the map of that flush.
fn is_refused<T: fmt::Debug>(work: impl FnOnce(MapPath) -> Result<T>) {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    insert(&mut mapper, 1.0);
    drop(mapper);
    let other = disk.clone();
    disk.before_lock(move || insert(&mut OutOfCoreTileMapper::open(at(&other), config()).unwrap(), 2.0));
    let message = message_of(work(at(&disk)));
    assert!(message.contains("flushed while it was being read"), "{message}");
    let wanted = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&wanted), config()).unwrap();
    [1.0, 2.0].into_iter().for_each(|x| insert(&mut mapper, x));
    drop(mapper);
    assert_eq!(digest_of(&disk, None).unwrap(), digest_of(&wanted, None).unwrap());
}

#[test]
fn a_removal_of_points_fails_if_scans_were_added_meanwhile() {
    let region = Aabb { min: [0.0; 3], max: [5.0; 3] };
    is_refused(|map| remove_points(map, &region, &Replay::default(), |_, _| ()));
}

#[test]
fn a_removal_of_scans_fails_if_scans_were_added_meanwhile() {
    let scans = ScanSelection::Numbers(1, 9);
    is_refused(|map| remove_scans(map, &scans, false, &Replay::default(), |_, _| ()));
}

#[test]
fn a_remap_fails_if_scans_were_added_meanwhile() {
    let pose = Pose::from_quaternion([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let poses = NewPoses::InOrder(vec![pose]);
    is_refused(|map| remap(&KeptSummary::read(map)?, &poses, &Remap::new(Replay::default()), |_, _| ()));
}
