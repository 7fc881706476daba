use super::{at_once, crowded_scan};
use std::collections::{BTreeMap, BTreeSet};
use testkit::random_scans::Random;
use testkit::reference_local::states_of;
use voxtile::query::{Queries, Shape, UnknownAs};
use voxtile::scan::RayWalk;
use voxtile::space::{Aabb, Grid, Point, VoxelIndex};
use voxtile_local::{LocalMap, LocalParameters, LocalState, Obstacle};

const OBSTACLES: [Obstacle; 2] = [Obstacle::Occupied, Obstacle::Inflated];

fn map(random: &mut Random) -> LocalMap {
    let mut map =
        LocalMap::new(0.1, at_once(LocalParameters::local_mapping().with_ranges(9.0, 2.5))).unwrap();
    for x in 0..4 {
        map.insert_scan(&crowded_scan(random, [f64::from(x) * 3.0 - 5.0, 0.0, 6.0], 60)).unwrap();
    }
    map
}

fn obstacles(states: &BTreeMap<VoxelIndex, LocalState>, obstacle: Obstacle) -> BTreeSet<VoxelIndex> {
    states.iter().filter(|(_, state)| obstacle.is(**state)).map(|(voxel, _)| *voxel).collect()
}

#[test]
fn queries_equal_a_search_over_all_voxels() {
    let random = &mut Random(3);
    let (map, grid) = (map(random), Grid::new(0.1, 6.4).unwrap());
    let (view, states) = (map.view(), states_of(map.view()));
    let place = |random: &mut Random| random.point([0.0, 0.0, 6.0], 9.0);
    let mut found = [0; 4];
    for _ in 0..400 {
        let (a, b) = (place(random), place(random));
        let at = states.get(&grid.voxel_of(a).unwrap()).copied().unwrap_or(LocalState::None);
        assert_eq!(view.state_at(a), at);
        let center: Point = std::array::from_fn(|k| a[k] + (b[k] - a[k]) * 0.02);
        let bounds = Aabb::from_corners(a, center);
        for obstacle in OBSTACLES {
            let all = obstacles(&states, obstacle);

            let units = |p| grid.to_voxel_units(p);
            let mut walk =
                RayWalk::between(units(a), grid.voxel_of(a).unwrap(), units(b), grid.voxel_of(b).unwrap());
            while !walk.is_at_end() && !all.contains(&walk.voxel()) {
                walk.advance();
            }
            let first = Some(walk.voxel()).filter(|voxel| all.contains(voxel));
            let asked = view.obstacles(obstacle);
            let hit = asked.cast_segment(a, b, UnknownAs::Free).unwrap();
            assert_eq!(hit.map(|hit| hit.voxel), first);
            found[0] += usize::from(first.is_some());

            let radius_m = random.between(0.0, 0.8);
            for body in [Shape::Box(bounds), Shape::Sphere { center: a, radius_m }] {
                let edge = |voxel: VoxelIndex, add: i32| voxel.map(|k| f64::from(k + add) * 0.1);
                let touches = |voxel: &VoxelIndex| {
                    let voxel = Aabb { min: edge(*voxel, 0), max: edge(*voxel, 1) };
                    match body {
                        Shape::Box(b) => (0..3).all(|k| b.min[k] <= voxel.max[k] && voxel.min[k] <= b.max[k]),
                        Shape::Sphere { center, radius_m } => {
                            voxel.distance_squared(center) <= radius_m * radius_m
                        }
                        _ => unreachable!("the bodies above"),
                    }
                };
                let touched: BTreeSet<_> = all.iter().copied().filter(|voxel| touches(voxel)).collect();
                let answer = asked.collision(&body, UnknownAs::Free).unwrap().map(|hit| hit.voxel);
                assert_eq!(answer.is_some(), !touched.is_empty());
                assert!(answer.is_none_or(|voxel| touched.contains(&voxel)));
                found[1] += touched.len();
            }

            let radius_m = random.between(0.0, 3.0);
            let distance_m = |voxel: VoxelIndex| {
                let center_m = grid.center_m(voxel);
                (0..3).map(|k| (center_m[k] - a[k]).powi(2)).sum::<f64>().sqrt()
            };
            let nearest = all.iter().map(|&voxel| (distance_m(voxel), voxel));
            let nearest = nearest.filter(|(distance_m, _)| *distance_m <= radius_m);
            let nearest = nearest.min_by(|a, b| a.partial_cmp(b).unwrap());
            let answer = asked.nearest_occupied(a, radius_m).unwrap();
            assert_eq!(answer.map(|nearest| (nearest.distance_m, nearest.voxel)), nearest);
            found[2] += usize::from(nearest.is_some());

            let window = Aabb::from_corners(a, b);
            let mut points = view.points_in(&window, obstacle);
            points.sort_by(|a, b| a.partial_cmp(b).unwrap());
            let mut inside: Vec<Point> = all.iter().map(|&voxel| grid.center_m(voxel)).collect();
            inside.retain(|point| window.contains(*point));
            inside.sort_by(|a, b| a.partial_cmp(b).unwrap());
            assert_eq!(points, inside);
            found[3] += points.len();
        }
    }
    assert!(found.iter().all(|count| *count > 20), "{found:?}");
}

#[test]
fn invalid_queries_return_errors_and_never_panic() {
    let view = map(&mut Random(4)).view().clone();
    let odd = [f64::NAN, f64::INFINITY, -1e300, 1e12, 2.1e8, 0.0];
    for &x in &odd {
        for &y in &odd {
            let (a, b) = ([x, y, 6.0], [y, 0.1, x]);
            view.state_at(a);
            for obstacle in OBSTACLES {
                let asked = view.obstacles(obstacle);
                let segment = asked.cast_segment(a, b, UnknownAs::Free);
                assert!(segment.is_err() || x.max(y).abs() < 1e9);
                let _ = asked.collision(&Shape::Box(Aabb { min: a, max: b }), UnknownAs::Free);
                let _ = asked.collision(&Shape::Sphere { center: a, radius_m: y }, UnknownAs::Free);
                let _ = asked.nearest_occupied(a, y);
                view.points_in(&Aabb { min: a, max: b }, obstacle);
            }
        }
    }
    assert!(view.nearest_occupied([0.0; 3], -1.0).is_err());
    assert!(view.cast_segment([0.0; 3], [2e5, 0.0, 0.0], UnknownAs::Free).is_err());
    let all = view.points_in(&Aabb { min: [-1e9; 3], max: [1e9; 3] }, Obstacle::Inflated);
    assert_eq!(all.len(), states_of(&view).len());
}

#[test]
fn invalid_scans_and_parameters_leave_the_map_unchanged() {
    let mut map = map(&mut Random(5));
    let (before, number) = (map.history().collect::<Vec<_>>(), map.view().update_number());
    for origin in [[f64::NAN; 3], [f64::INFINITY; 3], [2.147_483e8, 0.0, 0.0]] {
        assert!(map.insert_scan(&super::scan(origin, &[[1.0; 3]])).is_err());
    }
    let good = LocalParameters::default();
    let mut wrong = vec![good.with_ranges(f64::NAN, 1.0), good.with_ranges(1.0, -1.0)];
    wrong.push(good.with_inflation_radius(2.5));
    wrong.push(good.with_max_voxels(0));
    let with = |change: fn(&mut LocalParameters)| {
        let mut parameters = good;
        change(&mut parameters);
        parameters
    };
    wrong.push(with(|p| p.initial_probability = 1.0));
    wrong.push(with(|p| p.occupied_log_odds = -1.0));
    wrong.push(with(|p| p.free_log_odds = -9.0));
    wrong.push(with(|p| p.log_odds.miss = 0.1));
    wrong.push(with(|p| p.work_per_update = 0));
    for parameters in wrong {
        assert!(map.set_parameters(parameters).is_err(), "{parameters:?}");
        assert!(LocalMap::new(0.1, parameters).is_err());
    }
    assert!(LocalMap::new(0.0, good).is_err());
    assert_eq!((map.history().collect::<Vec<_>>(), map.view().update_number()), (before, number));
}
