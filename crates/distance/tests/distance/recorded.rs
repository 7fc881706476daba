use crate::naive::Naive;
use crate::random_map::{centers_box, sample};
use testkit::memory_folder::memory_folder;
use testkit::random_scans::Random;
use testkit::support::{fixtures, shared_data};
use voxtile::mapper::{MapReader, MapView};
use voxtile::{MapConfig, MapOptions, Mapper};
use voxtile_distance::{
    DistanceOptions, FieldOptions, FieldReader, LiveDistances, MapDistances, UnknownRule, compute_field,
};
use voxtile_formats::{ReadOptions, open_scans};

/// Recorded sets, as far as they are present, and a small one of the repository.
#[test]
fn fields_of_recorded_maps_equal_the_brute_force() {
    let sets =
        ["balm_os0_hall", "fastlio_hku_1", "kitti_0001_a", "mulran_riverside02_a", "sevenscenes_kinect"];
    let recorded = sets.map(shared_data);
    for (number, set) in recorded.into_iter().flatten().chain([fixtures("scans_1")]).enumerate() {
        let folder = memory_folder();
        let (map_path, field_path) = (folder.path().join("map"), folder.path().join("field"));
        let config = MapConfig::new(0.25, 5.0).unwrap().with_range(0.3, 15.0);
        let mut map = MapOptions::new().config(config).create_if_missing(true).open(&map_path).unwrap();
        let mut source = open_scans(&set, &ReadOptions::default()).unwrap();
        let rule = [UnknownRule::Unknown, UnknownRule::Free, UnknownRule::Obstacle][number % 3];
        let options = DistanceOptions::new(2.0).with_unknown(rule).with_sign(number % 2 == 0);
        let mut live = LiveDistances::new([20.0, 20.0, 6.0], options).unwrap();
        for _ in 0..3 {
            let mut scan = source.next_scan().unwrap().unwrap().into_scan();
            let every = (scan.points.len() / 4000).max(1);
            scan.points = scan.points.into_iter().step_by(every).collect();
            scan.intensities = None;
            map.insert_scan(&scan).unwrap();
            live.update(&map.reader().unwrap().view(), scan.origin).unwrap();
        }
        map.flush().unwrap();
        drop(map);
        let map = MapReader::open(&map_path, 1 << 24).unwrap();
        compute_field(&map, &field_path, &FieldOptions::new(options), &|_, _| {}).unwrap();
        let stored = FieldReader::open(&field_path, 1 << 24).unwrap();
        let (live, naive) = (live.field().unwrap(), Naive::of(&map, options));
        let random = &mut Random(number as u64);
        let voxels = live.voxel_box();
        for voxel in sample(random, &voxels, 100) {
            let expected = naive.distance(voxel);
            assert_eq!(live.voxel(voxel), expected, "{}: {voxel:?}", set.display());
            assert_eq!(stored.voxel(voxel).unwrap(), expected, "{}: {voxel:?}", set.display());
        }
        let at_once = map.distance_field(&centers_box(&map.config().grid, &voxels), options).unwrap();
        assert!(live.to_array() == at_once.to_array(), "{}", set.display());
    }
}
