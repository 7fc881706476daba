use crate::random_map::{TILE_SIZES_M, centers_box, config, grow, random_options};
use testkit::memory_folder::memory_folder;
use testkit::random_scans::Random;
use testkit::support::{cases, message_of};
use voxtile::mapper::{MapReader, MapView, OutOfCoreTileMapper};
use voxtile::scan::PointBatch;
use voxtile::{InMemoryMapper, MapOptions, Mapper, Point, Scan};
use voxtile_distance::{
    DistanceField, DistanceOptions, FieldOptions, FieldReader, LiveDistances, MapDistances, UnknownRule,
    VoxelDistance, compute_field,
};
use voxtile_local::{LocalMap, LocalParameters, Obstacle};

const SIZE_M: [f64; 3] = [3.0, 4.1, 1.7];

/// The live field equals the one computed at once.
fn assert_equal(live: &LiveDistances, map: &impl MapView, options: DistanceOptions, case: u64) {
    let field = live.field().unwrap();
    let expected = map.distance_field(&centers_box(&field.grid(), &field.voxel_box()), options).unwrap();
    assert_eq!(field.voxel_box(), expected.voxel_box());
    assert!(field.to_array() == expected.to_array(), "case {case}: {options:?}");
}

/// Makes some obstacles of a map free.
fn clear_obstacles(map: &mut OutOfCoreTileMapper, view: &impl MapView, random: &mut Random) {
    let tiles = view.tile_indices();
    let mut points = Vec::new();
    for _ in 0..tiles.len().min(8) {
        let tile = tiles[random.below(tiles.len() as u64) as usize];
        let occupied = view.voxels_from(tile, view.config().occupied_log_odds()).unwrap();
        points.extend(
            occupied
                .iter()
                .filter(|_| random.below(2) == 0)
                .map(|voxel| view.config().grid.center_m(voxel.index)),
        );
    }
    let is_occupied = vec![false; points.len()];
    let misses = PointBatch { points: &points, intensities: None, is_occupied: &is_occupied };
    // More misses than a voxel has hits.
    (0..12).for_each(|_| map.batch_update(&misses).map(drop).unwrap());
}

/// Voxels that are obstacles in one field and not in another of the same box.
fn vanished(before: &DistanceField, after: &DistanceField) -> usize {
    if before.voxel_box() != after.voxel_box() {
        return 0;
    }
    let is_obstacle = |distance: &VoxelDistance| distance.to_bits() <= 0;
    let both = before.to_array().into_iter().zip(after.to_array());
    both.filter(|(before, after)| is_obstacle(before) && !is_obstacle(after)).count()
}

#[test]
fn random_lives_equal_fields_computed_at_once() {
    let (mut evicted, mut cleared) = (0, 0);
    for case in 0..cases(18, 300) {
        let random = &mut Random(case);
        let folder = memory_folder();
        let config = config(TILE_SIZES_M[case as usize % 3]);
        let map_options = MapOptions::new().config(config).create_if_missing(true);
        // With few tiles in memory, updates read evicted ones.
        let map_options = if case % 6 == 0 { map_options.memory_bytes(17 << 20) } else { map_options };
        let mut map = map_options.open(folder.path().join("map")).unwrap();
        let reader = map.reader().unwrap();
        let options = random_options(random);
        let mut live = LiveDistances::new(SIZE_M, options).unwrap();
        let mut robot: Point = random.point([0.0; 3], 1.0);
        for _ in 0..12 {
            match random.below(4) {
                0 => clear_obstacles(&mut map, &reader.view(), random),
                _ => grow(&mut map, random, robot),
            }
            if random.below(4) == 0 {
                map.flush().unwrap();
            }
            robot = random.point(robot, 0.8);
            let (view, before) = (reader.view(), live.field());
            live.update(&view, robot).unwrap();
            assert_equal(&live, &view, options, case);
            evicted += view.tile_indices().len() - view.cached_tile_indices().len();
            cleared += before.map_or(0, |before| vanished(&before, &live.field().unwrap()));
        }
        // The bulk field in a folder.
        map.flush().unwrap();
        let map = MapReader::open(folder.path().join("map"), 1 << 20).unwrap();
        let path = folder.path().join("field");
        let field = live.field().unwrap();
        let region = centers_box(&field.grid(), &field.voxel_box());
        let bulk = FieldOptions::new(options).with_region(region);
        compute_field(&map, &path, &bulk, &|_, _| {}).unwrap();
        let bulk = FieldReader::open(&path, 1 << 20).unwrap().load(&region).unwrap();
        assert!(bulk.to_array() == field.to_array(), "case {case}: {options:?}");
    }
    assert!(evicted > 0 && cleared > 0, "{evicted} evicted tiles, {cleared} obstacles that vanished");
}

#[test]
fn only_changes_are_computed_and_earlier_fields_remain() {
    let mut map = InMemoryMapper::new(config(10.0)).unwrap();
    let options = DistanceOptions::new(0.5).with_unknown(UnknownRule::Free);
    let mut live = LiveDistances::new(SIZE_M, options).unwrap();
    let reader = live.reader();
    assert!(reader.field().is_none() && live.update(&map, [0.0; 3]).unwrap().has_moved);
    let first = reader.field().unwrap();
    let second_scan = Scan { points: vec![[1.0, 0.0, 0.0]], ..Scan::default() };
    voxtile::Mapper::insert_scan(&mut map, &second_scan).unwrap();
    let update = live.update(&map, [0.5, 0.0, 0.0]).unwrap();
    assert!(!update.has_moved && update.changed_rows == 1, "{update:?}");
    let second = reader.field().unwrap();
    assert!(first.to_array() != second.to_array() && first.voxel_box() == second.voxel_box());
    // Without a change the field remains the same object.
    assert_eq!(live.update(&map, [0.5, 0.0, 0.0]).unwrap().changed_rows, 0);
    assert!(std::sync::Arc::ptr_eq(&second, &reader.field().unwrap()));
    assert!(live.update(&map, [2.0, 0.0, 0.0]).unwrap().has_moved);
    assert_equal(&live, &map, options, 0);
}

#[test]
fn fields_of_local_maps_follow_their_obstacles() {
    let mut cleared = 0;
    for case in 0..cases(6, 60) {
        let random = &mut Random(70 + case);
        // With a limit, voxels are removed.
        let limit = (case % 3 == 0).then_some(60);
        let parameters = LocalParameters::local_mapping().with_max_voxels(limit);
        let mut map = LocalMap::new(0.1, parameters).unwrap();
        let options = random_options(random);
        let obstacle = if case % 2 == 0 { Obstacle::Inflated } else { Obstacle::Occupied };
        let mut live = LiveDistances::new(SIZE_M, options).unwrap();
        let mut robot: Point = [0.1, 0.0, 0.0];
        for _ in 0..10 {
            robot = random.point(robot, 0.6);
            let scan = testkit::random_scans::random_scan(random, robot, 20);
            map.insert_scan(&Scan { intensities: None, ..scan }).unwrap();
            let view = map.view().clone();
            let obstacles = view.obstacles(obstacle);
            let before = live.field();
            live.update_from_set(&obstacles, robot).unwrap();
            let field = live.field().unwrap();
            cleared += before.map_or(0, |before| vanished(&before, &field));
            let region = centers_box(&field.grid(), &field.voxel_box());
            let expected = DistanceField::of_set(&obstacles, &region, options).unwrap();
            assert!(field.to_array() == expected.to_array(), "case {case}");
            let of_queries = DistanceField::of_queries(&obstacles, &region, options).unwrap();
            assert!(of_queries.to_array() == expected.to_array(), "case {case}");
        }
        // A field may change between kinds of maps.
        let mut archive = InMemoryMapper::new(config(10.0)).unwrap();
        grow(&mut archive, random, [0.0; 3]);
        live.update(&archive, [0.1, 0.0, 0.0]).unwrap();
        let view = map.view().clone();
        live.update_from_set(&view.obstacles(obstacle), [0.1, 0.0, 0.0]).unwrap();
        live.update(&archive, [0.1, 0.0, 0.0]).unwrap();
        if archive.config().grid == live.field().unwrap().grid() {
            assert_equal(&live, &archive, options, case);
        }
    }
    assert!(cleared > 0);
}

#[test]
fn invalid_boxes_are_refused() {
    for size_m in [[0.0, 1.0, 1.0], [1.0, f64::NAN, 1.0], [1.0, 1.0, f64::INFINITY]] {
        assert!(message_of(LiveDistances::new(size_m, DistanceOptions::default())).contains("positive"));
    }
    let map = InMemoryMapper::new(config(10.0)).unwrap();
    let mut live = LiveDistances::new([1e6; 3], DistanceOptions::new(1.0)).unwrap();
    assert!(message_of(live.update(&map, [0.0; 3])).contains("smaller box"));
    let mut live = LiveDistances::new([1.0; 3], DistanceOptions::new(1.0)).unwrap();
    assert!(message_of(live.update(&map, [f64::NAN; 3])).contains("outside"));
    let mut live = LiveDistances::new([1.0; 3], DistanceOptions::new(0.0)).unwrap();
    assert!(message_of(live.update(&map, [0.0; 3])).contains("max_distance"));
}
