//! What the paper's pseudo-code gets wrong, a test each.

use super::{at_once, scan};
use voxtile::space::Point;
use voxtile_local::{LocalMap, LocalParameters, LocalState};

const ORIGIN: Point = [0.05, 0.05, 0.05];

fn parameters() -> LocalParameters {
    at_once(LocalParameters::passive_perception())
}

fn map(parameters: LocalParameters) -> LocalMap {
    LocalMap::new(0.1, parameters).unwrap()
}

/// Algorithm 1, line 4 ends the cloud at the first point that is too far.
#[test]
fn a_point_that_is_too_far_is_skipped_alone() {
    let mut map = map(parameters().with_ranges(5.0, f64::INFINITY));
    let report =
        map.insert_scan(&scan(ORIGIN, &[[1.05, 0.05, 0.05], [9.0, 0.0, 0.0], [0.05, 1.05, 0.05]])).unwrap();
    assert_eq!((report.beyond_input_range, report.new, map.stored_voxels()), (1, 2, 2));
}

/// Algorithm 1, lines 10 and 19 put every voxel with occupancy into the inflation map, though nothing inflates it.
#[test]
fn a_voxel_is_inflated_only_if_an_occupied_one_inflates_it() {
    let mut unsure = parameters();
    unsure.occupied_log_odds = 2.0;
    let mut map = map(unsure);
    map.insert_scan(&scan(ORIGIN, &[[1.05, 0.05, 0.05]])).unwrap();
    assert_eq!((map.stored_voxels(), map.inflated_voxels()), (1, 0));
    assert_eq!(map.view().state_at([1.05, 0.05, 0.05]), LocalState::None);
}

/// Algorithm 1, lines 12 to 14 forget the initial probability where the voxel was inflated before.
#[test]
fn a_voxel_begins_with_the_initial_probability_inflated_or_not() {
    let mut likely = parameters();
    likely.initial_probability = 0.6;
    let mut map = map(likely);
    map.insert_scan(&scan(ORIGIN, &[[1.05, 0.05, 0.05]])).unwrap();
    assert_eq!(map.view().state_at([1.05, 0.15, 0.05]), LocalState::Inflated);
    map.insert_scan(&scan(ORIGIN, &[[1.05, 0.15, 0.05]])).unwrap();
    let log_odds: Vec<f64> = map.history().map(|(_, log_odds)| log_odds).collect();
    assert_eq!(log_odds.len(), 2);
    assert_eq!(log_odds[0], log_odds[1]);
}

/// Algorithm 1, line 20 casts a ray before later points are in the map: misses depend on the order of the points.
#[test]
fn misses_do_not_depend_on_the_order_of_the_points() {
    let points = [[1.05, 0.05, 0.05], [2.05, 0.05, 0.05], [3.05, 0.05, 0.05]];
    let log_odds = |points: &[Point]| {
        let mut map = map(parameters());
        map.insert_scan(&scan(ORIGIN, points)).unwrap();
        let mut history: Vec<_> = map.history().collect();
        history.sort_by_key(|(voxel, _)| *voxel);
        history
    };
    let forward = log_odds(&points);
    assert_eq!(forward, log_odds(&[points[2], points[1], points[0]]));
    assert!(forward[0].1 < forward[1].1 && forward[1].1 < forward[2].1);
}

/// Algorithm 2, line 2 looks at voxels that changed in this step alone: what became occupied far away is not inflated
/// when the robot comes near, and what was inflated stays so when it has gone.
#[test]
fn inflation_follows_the_robot() {
    let mut map = map(parameters().with_ranges(f64::INFINITY, 3.0));
    map.insert_scan(&scan(ORIGIN, &[[10.05, 0.05, 0.05]])).unwrap();
    assert_eq!((map.stored_voxels(), map.inflated_voxels()), (1, 0));
    for (x, inflated) in [(7.2, 33), (10.0, 33), (13.2, 0), (12.9, 33)] {
        map.insert_scan(&scan([x, 0.05, 0.05], &[])).unwrap();
        assert_eq!(map.inflated_voxels(), inflated, "at {x} m");
    }
}

/// Algorithm 2, lines 8 to 10 count down what was never counted up.
#[test]
fn counts_never_go_below_zero() {
    let mut map = map(parameters());
    let wall = [2.05, 0.05, 0.05];
    // A voxel that is seen, then seen free before it ever inflated anything: it was out of range.
    map.set_parameters(parameters().with_ranges(f64::INFINITY, 0.5)).unwrap();
    map.insert_scan(&scan(ORIGIN, &[wall])).unwrap();
    map.insert_scan(&scan(ORIGIN, &[[4.05, 0.05, 0.05]; 8])).unwrap();
    assert_eq!(map.view().state_at(wall), LocalState::None);
    // Its neighbor inflates its place, and is not taken for it.
    map.set_parameters(parameters()).unwrap();
    map.insert_scan(&scan(ORIGIN, &[[2.05, 0.15, 0.05]])).unwrap();
    assert_eq!(map.view().state_at(wall), LocalState::Inflated);
}

/// Algorithm 3, line 15 removes voxels from both maps, also those that others still inflate.
#[test]
fn what_becomes_free_stays_inflated_by_others() {
    let mut map = map(parameters());
    map.insert_scan(&scan(ORIGIN, &[[2.05, 0.05, 0.05], [2.05, 0.15, 0.05]])).unwrap();
    let report = map.insert_scan(&scan(ORIGIN, &[[4.05, 0.05, 0.05]; 8])).unwrap();
    assert_eq!(report.freed, 1);
    assert_eq!(map.view().state_at([2.05, 0.05, 0.05]), LocalState::Inflated);
    assert_eq!(map.view().state_at([2.05, 0.15, 0.05]), LocalState::Occupied);
}

/// Algorithm 3, line 19 comes after the inflation: what the limit removes leaves its inflation behind for ever.
#[test]
fn what_is_forgotten_takes_its_inflation_with_it() {
    let mut map = map(parameters().with_max_voxels(1));
    map.insert_scan(&scan(ORIGIN, &[[1.05, 0.05, 0.05]])).unwrap();
    let report = map.insert_scan(&scan(ORIGIN, &[[0.05, 3.05, 0.05]])).unwrap();
    assert_eq!((report.forgotten, map.stored_voxels(), map.inflated_voxels()), (1, 1, 33));
    assert_eq!(map.view().state_at([1.05, 0.05, 0.05]), LocalState::None);
    assert_eq!(map.view().state_at([0.05, 3.05, 0.05]), LocalState::Occupied);
}

/// Algorithm 3, lines 3 and 10 put occupied voxels alone into the history: those between occupied and free would never
/// be removed, and line 9 would take them out of a history in which they are not.
#[test]
fn voxels_that_are_neither_occupied_nor_free_count_and_are_forgotten() {
    let mut unsure = parameters().with_max_voxels(10);
    unsure.occupied_log_odds = 2.0;
    let mut map = map(unsure);
    for k in 0..30 {
        let y = 0.05 + 0.1 * f64::from(k);
        map.insert_scan(&scan(ORIGIN, &[[3.05, y, 0.05]])).unwrap();
    }
    assert_eq!(map.stored_voxels(), 10);
    let kept: Vec<i32> = map.history().map(|(voxel, _)| voxel[1]).collect();
    assert_eq!(kept, (20..30).collect::<Vec<_>>());
}
