use crate::naive::Naive;
use crate::random_map::{TILE_SIZES_M, random_map, random_options, random_region, sample, voxels_of};
use testkit::random_scans::Random;
use testkit::support::{cases, message_of};
use voxtile::{Aabb, InMemoryMapper, MapConfig, Mapper, Point, Queries, Scan};
use voxtile_distance::{Distance, DistanceField, DistanceOptions, MapDistances, UnknownRule, VoxelDistance};

#[test]
fn fields_of_random_maps_equal_the_brute_force() {
    for case in 0..cases(60, 2000) {
        let random = &mut Random(case);
        let map = random_map(random, TILE_SIZES_M[case as usize % 3]);
        let (options, region) = (random_options(random), random_region(random));
        let field = map.distance_field(&region, options).unwrap();
        assert_eq!(field.voxel_box(), map.grid().voxels_in(&region));
        let naive = Naive::of(&map, options);
        for voxel in sample(random, &field.voxel_box(), 150) {
            assert_eq!(
                field.voxel(voxel),
                naive.distance(voxel),
                "case {case}: {voxel:?}, {options:?}, {region}"
            );
        }
    }
}

#[test]
fn fields_of_queries_and_of_parts_equal_those_of_maps() {
    for case in 0..cases(20, 300) {
        let random = &mut Random(1000 + case);
        let map = random_map(random, TILE_SIZES_M[case as usize % 3]);
        let (options, region) = (random_options(random), random_region(random));
        let field = map.distance_field(&region, options).unwrap();
        let of_queries = DistanceField::of_queries(&map, &region, options).unwrap();
        assert_eq!(field.to_array(), of_queries.to_array());
        // No seam: a part has the same distances.
        let part = map.distance_field(&random_region(random), options).unwrap();
        let voxels = field.voxel_box();
        for voxel in voxels_of(&part.voxel_box().intersection(&voxels)) {
            assert_eq!(field.voxel(voxel), part.voxel(voxel), "case {case}: {voxel:?}");
        }
        let region_of_part = random_region(random);
        let of_part = part.part(&region_of_part).unwrap();
        for voxel in voxels_of(&of_part.voxel_box()) {
            assert_eq!(of_part.voxel(voxel), part.voxel(voxel));
        }
        let in_order = voxels_of(&voxels).map(|voxel| field.voxel(voxel));
        assert!(in_order.eq(field.to_array()));
    }
}

fn one_obstacle() -> InMemoryMapper {
    let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0).unwrap()).unwrap();
    map.insert_scan(&Scan { points: vec![[2.05, 0.05, 0.05]], ..Scan::default() }).unwrap();
    map
}

const AROUND: Aabb = Aabb { min: [-1.0; 3], max: [4.0, 1.0, 1.0] };

#[test]
fn points_between_voxels_are_interpolated() {
    let options = DistanceOptions::new(1.0).with_unknown(UnknownRule::Free);
    let field = one_obstacle().distance_field(&AROUND, options).unwrap();
    let at = |point: Point| field.distance_and_gradient_at(&[point])[0];
    let found = at([1.5, 0.05, 0.05]);
    let Distance::Within(distance_m) = found.distance else { panic!("{found:?}") };
    assert!((distance_m - 0.55).abs() < 1e-12, "{distance_m}");
    assert!((found.gradient[0] + 1.0).abs() < 1e-9 && field.distance_at([1.5, 0.05, 0.05]) == found.distance);
    // Beyond the cap, at the border of the field, outside of it and without a position.
    assert_eq!(at([-0.5, 0.0, 0.0]).distance, Distance::Beyond);
    for outside in [[-1.0, 0.0, 0.0], [9.0, 0.0, 0.0], [f64::NAN; 3], [1e30, 0.0, 0.0]] {
        assert_eq!((at(outside).distance, at(outside).gradient), (Distance::Unknown, [0.0; 3]));
    }
    // One of the corners is at the cap, the others are beyond it.
    let Distance::Within(distance_m) = field.distance_at([1.0, 0.05, 0.05]) else { panic!() };
    assert!((0.99..=1.0).contains(&distance_m), "{distance_m}");
}

#[test]
fn interpolation_equals_the_definition_at_random_points() {
    for case in 0..20 {
        let random = &mut Random(50 + case);
        let map = random_map(random, 0.5);
        let options = random_options(random);
        let region = Aabb { min: [-3.0; 3], max: [3.0; 3] };
        let field = map.distance_field(&region, options).unwrap();
        let points: Vec<Point> = (0..200).map(|_| random.point([0.0; 3], 3.2)).collect();
        for (point, found) in points.iter().zip(field.distance_and_gradient_at(&points)) {
            let units = point.map(|k| k / 0.1 - 0.5);
            let low = units.map(|k| k.floor() as i32);
            let (mut sum, mut states) = (0.0, Vec::new());
            for corner in 0..8_i32 {
                let voxel = [0, 1, 2].map(|k| low[k] + (corner >> k & 1));
                let weight: f64 = (0..3)
                    .map(|k| {
                        let part = units[k] - f64::from(low[k]);
                        if corner >> k & 1 == 1 { part } else { 1.0 - part }
                    })
                    .product();
                let distance = field.voxel(voxel).in_metres(0.1);
                sum += weight * distance.capped_m(options.max_distance_m).unwrap_or(f64::NAN);
                states.push(distance);
            }
            match found.distance {
                Distance::Unknown => assert!(states.contains(&Distance::Unknown)),
                Distance::Within(distance_m) => {
                    assert!((distance_m - sum).abs() < 1e-9, "{distance_m} {sum}")
                }
                all => assert!(states.iter().all(|state| *state == all)),
            }
        }
    }
}

#[test]
fn paths_are_checked_up_to_the_first_blocked_place() {
    let options = DistanceOptions::new(1.0).with_unknown(UnknownRule::Free);
    let field = one_obstacle().distance_field(&AROUND, options).unwrap();
    let path = [[-0.5, 0.5, 0.0], [3.5, 0.5, 0.0]];
    let clear = field.clearance_along(&path, 0.4).unwrap();
    assert!(clear.is_clear() && clear.min_distance_m.is_some_and(|least_m| (0.4..0.5).contains(&least_m)));
    let blocked = field.clearance_along(&path, 0.6).unwrap().blocked.unwrap();
    assert!(
        (1.5..1.9).contains(&blocked.point[0]) && (blocked.along_m - blocked.point[0] - 0.5).abs() < 1e-9
    );
    let leaves = field.clearance_along(&[[3.5, 0.0, 0.0], [4.5, 0.0, 0.0]], 0.1).unwrap().blocked.unwrap();
    assert!(leaves.distance.is_unknown() && leaves.point[0] > 3.9);
    assert!(field.clearance_along(&[], 0.1).unwrap().is_clear());
    assert!(field.clearance_along(&[[3.5, 0.0, 0.0]], 1.0).unwrap().is_clear());
    for radius_m in [-0.1, 1.1, f64::NAN] {
        assert!(message_of(field.clearance_along(&path, radius_m)).contains("from 0 m to 1 m"));
    }
    assert!(message_of(field.clearance_along(&[[f64::INFINITY; 3]], 0.1)).contains("not finite"));
    assert!(message_of(field.clearance_along(&[[0.0; 3], [1e12, 0.0, 0.0]], 0.1)).contains("shorter path"));
}

#[test]
fn a_map_without_obstacles_is_beyond_the_cap_everywhere() {
    let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0).unwrap()).unwrap();
    let region = Aabb { min: [0.0; 3], max: [1.0; 3] };
    let options = DistanceOptions::new(0.5).with_unknown(UnknownRule::Free);
    let is_all = |map: &InMemoryMapper, options, wanted| {
        map.distance_field(&region, options).unwrap().to_array().iter().all(|distance| *distance == wanted)
    };
    assert!(is_all(&map, options, VoxelDistance::BEYOND));
    assert!(is_all(&map, DistanceOptions::new(0.5), VoxelDistance::UNKNOWN));
    map.insert_scan(&Scan { points: vec![[-5.0, 0.0, 0.0]], ..Scan::default() }).unwrap();
    assert!(is_all(&map, options, VoxelDistance::BEYOND));
}

#[test]
fn invalid_arguments_are_refused() {
    let map = one_obstacle();
    for cap_m in [0.0, f64::NAN, f64::INFINITY, 0.01, 19.0] {
        let message = message_of(map.distance_field(&AROUND, DistanceOptions::new(cap_m)));
        assert!(message.contains("from 0.1 m to 18.1 m"), "{message}");
    }
    let everything = Aabb { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] };
    let message = message_of(map.distance_field(&everything, DistanceOptions::default()));
    assert!(message.contains("smaller box"), "{message}");
    let nothing = Aabb { min: [f64::NAN; 3], max: [1.0; 3] };
    assert!(map.distance_field(&nothing, DistanceOptions::default()).unwrap().to_array().is_empty());
    // At the end of the range of indices.
    let far = Aabb { min: [2e8; 3], max: [f64::INFINITY; 3] };
    assert!(map.distance_field(&far, DistanceOptions::default()).is_err());
}
