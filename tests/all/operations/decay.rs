use super::random_maps::{config, disk, path, random_voxels, read_map, write_map};
use testkit::faulty_disk::FaultyDisk;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{Voxels, voxels_of};
use voxtile::integrity::repair;
use voxtile::operations::{Decay, Decayed, revert, snapshot};
use voxtile::sensor::Evidence;
use voxtile::store::SnapshotName;
use voxtile::{
    Error, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, Occupancy, OutOfCoreTileMapper,
    Queries, Result,
};

fn decay(disk: &FaultyDisk, rule: &Decay) -> Result<Decayed> {
    voxtile::operations::decay(MapPath::on(disk.shared(), path("map")), rule, |_, _| {})
}

fn naive(voxels: &Voxels, halflife: f64, scans: u64, forget_below: f64) -> Voxels {
    let factor = libm::exp2(-(scans as f64) / halflife);
    let mut faded = Voxels::new();
    for (&voxel, &(bits, count)) in voxels {
        let before = f64::from_bits(bits);
        let mut after = before * factor;
        // Log-odds other than 0 keep their sign, also as `f32`.
        let least = f64::from(f32::MIN_POSITIVE);
        if after.abs() < least && before != 0.0 {
            after = least.min(before.abs()) * before.signum();
        }
        if after.abs() >= forget_below {
            faded.insert(voxel, (after.to_bits(), count));
        }
    }
    faded
}

#[test]
fn log_odds_decay_by_the_rule_and_counts_are_unchanged() {
    let (mut forgotten, mut removed) = (0, 0);
    for seed in 0..60 {
        let mut random = Random(seed);
        let (disk, config) = (disk(), config(&mut random));
        let voxels = random_voxels(&mut random, 300);
        write_map(&disk, &path("map"), &config, &voxels);
        let halflife = [1.0, 7.5, 400.0, 1e-300][random.below(4) as usize];
        let scans = [0, 1, 3, 1000, u64::MAX][random.below(5) as usize];
        let forget_below = [0.0, 0.3, 1.0, 100.0][random.below(4) as usize];
        let rule = Decay::new(halflife).with_scans(scans).with_forget_below(forget_below);
        let decayed = decay(&disk, &rule).unwrap();
        let expected = naive(&voxels, halflife, scans, forget_below);
        assert_eq!(read_map(&disk, &path("map")), expected, "seed {seed}: {rule:?}");
        let reader = MapReader::open(MapPath::on(disk.shared(), path("map")), 0).unwrap();
        assert_eq!((decayed.scans, decayed.voxels), (scans, expected.len() as u64));
        assert_eq!(decayed.voxels_forgotten, (voxels.len() - expected.len()) as u64);
        assert_eq!(decayed.tiles, reader.tile_indices().len() as u64);
        forgotten += decayed.voxels_forgotten;
        removed += decayed.tiles_removed;
    }
    assert!(forgotten > 1000 && removed > 10, "{forgotten} {removed}");
}

#[test]
fn free_voxels_stay_free_after_any_decay() {
    let disk = disk();
    let voxels = Voxels::from([([0, 0, 0], ((-2.0_f64).to_bits(), 5)), ([9, 0, 0], (3.0_f64.to_bits(), 5))]);
    write_map(&disk, &path("map"), &MapConfig::new(0.5, 2.5).unwrap(), &voxels);
    decay(&disk, &Decay::new(1.0).with_scans(1_000_000)).unwrap();
    let reader = MapReader::open(MapPath::on(disk.shared(), path("map")), 0).unwrap();
    assert!(matches!(reader.occupancy_at([0.25; 3]).unwrap(), Occupancy::Free(_)));
    assert!(matches!(reader.occupancy_at([4.75, 0.25, 0.25]).unwrap(), Occupancy::Occupied(_)));
    let tree = reader.merged_octree(None, 1 << 20).unwrap();
    let occupied = tree.leaves().filter(|leaf| leaf.value >= 0.0).count();
    assert_eq!(occupied, 1, "the octree must have one occupied leaf");
}

/// A map of some scans.
fn mapped(scans: usize) -> (FaultyDisk, OutOfCoreTileMapper) {
    let (disk, mut random) = (disk(), Random(4));
    let config = MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 3.0).with_cache_tiles(2);
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), path("map")), config).unwrap();
    insert(&mut mapper, &mut random, scans);
    (disk, mapper)
}

fn insert(mapper: &mut OutOfCoreTileMapper, random: &mut Random, scans: usize) {
    for _ in 0..scans {
        mapper.insert_scan(&random_scan(random, [0.0; 3], 6)).unwrap();
    }
    mapper.flush().unwrap();
}

#[test]
fn only_scans_since_the_last_decay_count() {
    let (disk, mapper) = mapped(6);
    let config = mapper.config().clone();
    assert!(matches!(decay(&disk, &Decay::new(4.0)), Err(Error::Locked { .. })));
    drop(mapper);
    let before = read_map(&disk, &path("map"));
    assert_eq!(decay(&disk, &Decay::new(4.0)).unwrap().scans, 6);
    let once = read_map(&disk, &path("map"));
    assert_eq!(once, naive(&before, 4.0, 6, 0.0));
    let files = disk.files();
    assert_eq!(decay(&disk, &Decay::new(4.0)).unwrap().scans, 0);
    assert_eq!(disk.files(), files, "no scans since the last decay");
    // Inserts continue in several flushes, which must not reset the scan number of the last decay.
    let mut mapper = OutOfCoreTileMapper::open(MapPath::on(disk.shared(), path("map")), config).unwrap();
    insert(&mut mapper, &mut Random(9), 2);
    mapper.begin_input("more").unwrap();
    insert(&mut mapper, &mut Random(10), 1);
    drop(mapper);
    let before = read_map(&disk, &path("map"));
    assert_eq!(decay(&disk, &Decay::new(4.0)).unwrap().scans, 3);
    assert_eq!(read_map(&disk, &path("map")), naive(&before, 4.0, 3, 0.0));
    assert_eq!(decay(&disk, &Decay::new(4.0).with_scans(5)).unwrap().scans, 5);
    assert_eq!(decay(&disk, &Decay::new(4.0)).unwrap().scans, 0);
}

#[test]
fn snapshots_do_not_decay_and_a_revert_restores_log_odds() {
    let (disk, mapper) = mapped(6);
    drop(mapper);
    let name = SnapshotName::new("before").unwrap();
    snapshot(MapPath::on(disk.shared(), path("map")), &name).unwrap();
    let before = read_map(&disk, &path("map"));
    decay(&disk, &Decay::new(4.0).with_forget_below(0.3)).unwrap();
    let once = read_map(&disk, &path("map"));
    assert!(once.len() < before.len());
    let kept = MapReader::open_snapshot(MapPath::on(disk.shared(), path("map")), &name, 0).unwrap();
    assert_eq!(voxels_of(&kept), before);
    revert(MapPath::on(disk.shared(), path("map")), &name, None, |_, _| {}).unwrap();
    assert_eq!(read_map(&disk, &path("map")), before);
    assert_eq!(decay(&disk, &Decay::new(4.0).with_forget_below(0.3)).unwrap().scans, 6);
    assert_eq!(read_map(&disk, &path("map")), once);
}

#[test]
fn a_map_repaired_from_its_tiles_does_not_decay_twice() {
    let (disk, mapper) = mapped(6);
    drop(mapper);
    decay(&disk, &Decay::new(4.0)).unwrap();
    let once = read_map(&disk, &path("map"));
    disk.take(&path("map").join("commits.log"));
    disk.take(&path("map").join("metadata.json"));
    repair(MapPath::on(disk.shared(), path("map")), |_| {}, |_, _| {}).unwrap();
    assert_eq!(decay(&disk, &Decay::new(4.0)).unwrap().scans, 0);
    assert_eq!(read_map(&disk, &path("map")), once);
}

#[test]
fn invalid_rules_are_errors() {
    let (disk, _) = mapped(1);
    for rule in [
        Decay::new(0.0),
        Decay::new(-1.0),
        Decay::new(f64::NAN),
        Decay::new(f64::INFINITY),
        Decay::new(1.0).with_forget_below(f64::NAN),
        Decay::new(1.0).with_forget_below(-0.1),
        Decay::new(1.0).with_forget_below(f64::INFINITY),
    ] {
        assert!(matches!(decay(&disk, &rule), Err(Error::InvalidArgument { .. })), "{rule:?}");
    }
}

#[test]
fn half_is_left_after_the_half_life() {
    let rule = Decay::new(10.0);
    let factor = rule.factor(10);
    assert_eq!(factor, 0.5);
    let faded = rule.faded(Evidence { log_odds: -1.5, observation_count: 3 }, factor).unwrap();
    assert_eq!((faded.log_odds, faded.observation_count), (-0.75, 3));
    assert_eq!(rule.factor(0), 1.0);
}
