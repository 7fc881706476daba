//! A build that flushes between a look at a map and its lock: what is to be removed was decided without its scans.

use std::fmt;
use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex};
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::support::message_of;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{NewPoses, Remap, Rework, ScanSelection, remap, remove_points, remove_scans};
use voxtile::store::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, ReaderWatch, Scratch};
use voxtile::{
    Aabb, MapConfig, MapPath, MapQueries, MapReader, Mapper, OutOfCoreTileMapper, Pose, Result, ScanRef,
};

/// A disk on which something else happens before the first lock is taken.
struct BusyDisk {
    disk: Arc<dyn Disk>,
    before_lock: Mutex<Option<Box<dyn FnOnce() + Send>>>,
}

impl fmt::Debug for BusyDisk {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("BusyDisk")
    }
}

impl Disk for BusyDisk {
    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>> {
        if let Some(happens) = self.before_lock.lock().unwrap().take() {
            happens();
        }
        self.disk.lock(path)
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        self.disk.open(path)
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        self.disk.open_shared(path)
    }

    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        self.disk.watch(path)
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        self.disk.create(path)
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        self.disk.append(path, offset)
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        self.disk.sync_file(path)
    }

    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        self.disk.sync_folder(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.disk.rename(from, to)
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        self.disk.remove_file(path)
    }

    fn create_folder(&self, path: &Path) -> io::Result<()> {
        self.disk.create_folder(path)
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        self.disk.remove_folder(path)
    }

    fn list(&self, path: &Path) -> io::Result<Vec<String>> {
        self.disk.list(path)
    }

    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>> {
        self.disk.scratch(folder)
    }

    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>> {
        self.disk.kind(path)
    }
}

fn at(disk: &FaultyDisk) -> MapPath {
    MapPath::on(disk.shared(), "/city/map")
}

fn config() -> MapConfig {
    MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 9.0).with_kept_scans(true)
}

fn insert(mapper: &mut OutOfCoreTileMapper, x: f64) {
    mapper.insert_points(&ScanRef::in_sensor(Pose::identity(), &[[x, 0.5, 0.5]])).unwrap();
    mapper.flush().unwrap();
}

/// The map is flushed between the look and the lock, and is then as that build left it.
fn is_refused<T: fmt::Debug>(work: impl FnOnce(MapPath) -> Result<T>) {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    insert(&mut mapper, 1.0);
    drop(mapper);
    let beside = disk.clone();
    let happens = move || {
        insert(&mut OutOfCoreTileMapper::open(at(&beside), config()).unwrap(), 2.0);
    };
    let busy = BusyDisk { disk: disk.shared(), before_lock: Mutex::new(Some(Box::new(happens))) };
    let message = message_of(work(MapPath::on(Arc::new(busy), "/city/map")));
    assert!(message.contains("flushed while it was being read"), "{message}");
    let wanted = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&wanted), config()).unwrap();
    [1.0, 2.0].into_iter().for_each(|x| insert(&mut mapper, x));
    drop(mapper);
    let digest = |disk: &FaultyDisk| MapReader::open(at(disk), 0).unwrap().digest().unwrap();
    assert_eq!(digest(&disk), digest(&wanted));
}

#[test]
fn points_that_came_meanwhile_are_not_passed_over() {
    let region = Aabb { min: [0.0; 3], max: [5.0; 3] };
    is_refused(|map| remove_points(map, &region, &Rework::default(), |_, _| ()));
}

#[test]
fn scans_that_came_meanwhile_are_not_removed_uncounted() {
    let scans = ScanSelection::Numbers(1, 9);
    is_refused(|map| remove_scans(map, &scans, false, &Rework::default(), |_, _| ()));
}

#[test]
fn scans_that_came_meanwhile_do_not_keep_poses_unasked() {
    let pose = Pose::from_quaternion([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let poses = NewPoses::InOrder(vec![pose]);
    is_refused(|map| remap(&KeptSummary::read(map)?, &poses, &Remap::new(Rework::default()), |_, _| ()));
}
