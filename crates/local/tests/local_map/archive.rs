use super::{assert_equal, at_once, crowded_scan, scan};
use std::collections::BTreeSet;
use testkit::random_scans::Random;
use testkit::reference_local::ReferenceLocal;
use voxtile::space::VoxelIndex;
use voxtile::{InMemoryMapper, MapConfig, MapQueries, Mapper};
use voxtile_local::{LocalAnswer, LocalMap, LocalParameters, LocalState, WithLocalMap};

fn config() -> MapConfig {
    MapConfig::new(0.1, 6.4).unwrap()
}

#[test]
fn one_call_updates_both_maps_as_separate_calls_would() {
    let random = &mut Random(21);
    let parameters = at_once(LocalParameters::local_mapping().with_max_voxels(700));
    let archive = InMemoryMapper::new(config()).unwrap();
    let mut both = WithLocalMap::new(archive, LocalMap::new(0.1, parameters).unwrap()).unwrap();
    let mut archive = InMemoryMapper::new(config()).unwrap();
    let mut local = ReferenceLocal::new(0.1, parameters);
    for _ in 0..10 {
        let scan = crowded_scan(random, [0.0; 3], 60);
        let (report, local_report) = both.insert_scan(&scan).unwrap();
        assert_eq!(report, archive.insert_scan(&scan).unwrap());
        assert_eq!(local_report.points, scan.points.len() as u64);
        local.insert_scan(&scan);
    }
    assert_eq!(both.archive().digest().unwrap(), archive.digest().unwrap());
    assert_equal(both.local(), &local, "with an archive");
    // If one map refuses a scan, both maps are unchanged.
    assert!(both.insert_scan(&scan([f64::NAN; 3], &[])).is_err());
    assert_eq!(both.archive().digest().unwrap(), archive.digest().unwrap());
    assert_equal(both.local(), &local, "after an error");
    assert!(WithLocalMap::new(archive, LocalMap::new(0.2, parameters).unwrap()).is_err());
}

#[test]
fn the_archive_distinguishes_free_from_unknown() {
    let parameters = at_once(LocalParameters::local_mapping().with_max_voxels(1));
    let archive = InMemoryMapper::new(config()).unwrap();
    let mut both = WithLocalMap::new(archive, LocalMap::new(0.1, parameters).unwrap()).unwrap();
    let origin = [0.05, 0.05, 0.05];
    both.insert_scan(&scan(origin, &[[3.05, 0.05, 0.05]])).unwrap();
    both.insert_scan(&scan(origin, &[[0.05, 2.05, 0.05]])).unwrap();
    let at = |point| both.answer_at(point).unwrap();
    assert_eq!(at([0.05, 2.05, 0.05]), LocalAnswer::Occupied);
    assert_eq!(at([0.15, 2.05, 0.05]), LocalAnswer::Inflated);
    assert!(matches!(at([1.05, 0.05, 0.05]), LocalAnswer::Free(p) if p < 0.5));
    assert_eq!(at([1.05, 1.05, 0.05]), LocalAnswer::Unknown);
    assert_eq!(at([f64::NAN; 3]), LocalAnswer::Unknown);
    // This voxel was removed from the local map, but is still in the archive.
    assert_eq!(both.local().view().state_at([3.05, 0.05, 0.05]), LocalState::None);
    assert_eq!(at([3.05, 0.05, 0.05]), LocalAnswer::Occupied);
}

#[test]
fn priming_adds_the_nearest_archive_voxels_as_older_than_observed_ones() {
    let random = &mut Random(22);
    let mut archive = InMemoryMapper::new(config()).unwrap();
    for _ in 0..4 {
        archive.insert_scan(&crowded_scan(random, [0.0; 3], 150)).unwrap();
    }
    let position = [0.3, 0.2, 0.1];
    let mut expected: Vec<(f64, VoxelIndex)> = Vec::new();
    for voxel in archive.all_occupied_voxels(None).unwrap() {
        let center_m = archive_center(voxel.index);
        let squared = (0..3).map(|k| (center_m[k] - position[k]).powi(2)).sum::<f64>();
        if squared <= 3.0 * 3.0 {
            expected.push((squared, voxel.index));
        }
    }
    expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
    assert!(expected.len() > 200);

    for limit in [None, Some(50)] {
        let parameters = at_once(LocalParameters::local_mapping().with_max_voxels(limit));
        let mut map = LocalMap::new(0.1, parameters).unwrap();
        map.insert_scan(&scan(position, &[[1.05, 3.05, 0.05], [0.05, -2.05, 0.05]])).unwrap();
        let seen: Vec<VoxelIndex> = map.history().map(|(voxel, _)| voxel).collect();
        let new = map.prime(&archive, position, 3.0).unwrap();
        let room = limit.map_or(usize::MAX, |limit| limit - seen.len());
        let nearest = expected.iter().map(|(_, voxel)| *voxel).filter(|voxel| !seen.contains(voxel));
        let mut wanted: Vec<VoxelIndex> = nearest.take(room).collect();
        wanted.reverse();
        assert_eq!(new, wanted.len());
        wanted.extend(&seen);
        assert!(map.history().map(|(voxel, _)| voxel).eq(wanted.iter().copied()));
        // The inflation must be the same as if all voxels had been observed by scans.
        let mut naive = ReferenceLocal::new(0.1, parameters);
        (naive.position, naive.history) = (position, map.history().collect());
        assert_equal(&map, &naive, "when primed");
        // Priming again adds nothing, and a later scan continues from the same state.
        assert_eq!(map.prime(&archive, position, 3.0).unwrap(), 0);
        let scan = crowded_scan(random, [0.0; 3], 40);
        map.insert_scan(&scan).unwrap();
        naive.insert_scan(&scan);
        assert_equal(&map, &naive, "after a scan");
    }
    let mut map = LocalMap::new(0.1, LocalParameters::default()).unwrap();
    assert!(map.prime(&archive, [f64::NAN; 3], 1.0).is_err());
    assert!(map.prime(&archive, position, f64::INFINITY).is_err());
    assert!(LocalMap::new(0.2, LocalParameters::default()).unwrap().prime(&archive, position, 1.0).is_err());
    let primed: BTreeSet<VoxelIndex> = map.history().map(|(voxel, _)| voxel).collect();
    assert!(primed.is_empty() && map.view().update_number() == 0);
}

fn archive_center(voxel: VoxelIndex) -> [f64; 3] {
    config().grid.center_m(voxel)
}
