//! How often a remap reads the list of kept scans.

use std::path::Path;
use testkit::faulty_disk::{Fault, FaultyDisk};
use voxtile::mapper::KeptSummary;
use voxtile::operations::{NewPoses, Remap, remap};
use voxtile::{MapConfig, MapPath, Mapper, OutOfCoreTileMapper, Pose, ScanRef};

fn at(disk: &FaultyDisk) -> MapPath {
    MapPath::on(disk.shared(), "/city/map")
}

fn pose(number: u64, y: f64) -> Pose {
    Pose::from_quaternion([9.0 * number as f64, y, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()
}

/// A map of scans whose tiles are far apart.
fn map_of(scans: u64) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let config = MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 3.0).with_kept_scans(true);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config).unwrap();
    for number in 1..=scans {
        mapper.insert_points(&ScanRef::in_sensor(pose(number, 0.0), &[[1.0, 0.5, 0.5]])).unwrap();
    }
    mapper.flush().unwrap();
    drop(mapper);
    disk.copy()
}

/// Each read opens the catalog twice: for its checksum, and for its content.
#[test]
fn a_remap_reads_the_catalog_three_times_and_once_more_where_few_scans_move() {
    for (moved, readings) in [(6, 3), (1, 4)] {
        let disk = map_of(6);
        let scans = KeptSummary::read(at(&disk)).unwrap();
        let poses = NewPoses::Numbered((1..=moved).map(|number| (number, pose(number, 0.5))).collect());
        let remapped = remap(&scans, &poses, &Remap::default(), |_, _| ()).unwrap();
        assert_eq!(remapped.mapped.scans_changed, moved);
        assert_eq!(disk.times_opened(Path::new("/city/map/kept_scans/catalog.1")), 2 * readings, "{moved}");
    }
}
