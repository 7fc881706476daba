//! One test for each error in the paper's pseudo-code.

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

/// The paper's Algorithm 1, line 4 stops at the first point that is too far.
#[test]
fn a_point_that_is_too_far_is_skipped_alone() {
    let mut map = map(parameters().with_ranges(5.0, f64::INFINITY));
    let report =
        map.insert_scan(&scan(ORIGIN, &[[1.05, 0.05, 0.05], [9.0, 0.0, 0.0], [0.05, 1.05, 0.05]])).unwrap();
    assert_eq!((report.beyond_input_range, report.new, map.stored_voxels()), (1, 2, 2));
}

/// The paper's Algorithm 1, lines 10 and 19 put every stored voxel into the inflation map, even if no voxel inflates
/// it.
#[test]
fn a_voxel_is_inflated_only_if_an_occupied_one_inflates_it() {
    let mut unsure = parameters();
    unsure.occupied_log_odds = 2.0;
    let mut map = map(unsure);
    map.insert_scan(&scan(ORIGIN, &[[1.05, 0.05, 0.05]])).unwrap();
    assert_eq!((map.stored_voxels(), map.inflated_voxels()), (1, 0));
    assert_eq!(map.view().state_at([1.05, 0.05, 0.05]), LocalState::None);
}

/// The paper's Algorithm 1, lines 12 to 14 ignore the initial probability if the voxel was inflated before.
#[test]
fn an_inflated_voxel_starts_with_the_initial_probability() {
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

/// The paper's Algorithm 1, line 20 casts a ray before later points are in the map: misses depend on the order of the
/// points.
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

/// The paper's Algorithm 2, line 2 considers only voxels that changed in this step: voxels that became occupied out of
/// range are not inflated when the robot approaches, and inflated voxels remain so after it has left.
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

/// The paper's Algorithm 2, lines 8 to 10 decrement counts that were never incremented.
#[test]
fn counts_never_go_below_zero() {
    let mut map = map(parameters());
    let wall = [2.05, 0.05, 0.05];
    // The voxel is observed as occupied, then as free, but never inflated anything: it was out of range.
    map.set_parameters(parameters().with_ranges(f64::INFINITY, 0.5)).unwrap();
    map.insert_scan(&scan(ORIGIN, &[wall])).unwrap();
    map.insert_scan(&scan(ORIGIN, &[[4.05, 0.05, 0.05]; 8])).unwrap();
    assert_eq!(map.view().state_at(wall), LocalState::None);
    // The neighbour's inflation of this voxel must remain.
    map.set_parameters(parameters()).unwrap();
    map.insert_scan(&scan(ORIGIN, &[[2.05, 0.15, 0.05]])).unwrap();
    assert_eq!(map.view().state_at(wall), LocalState::Inflated);
}

/// The paper's Algorithm 3, line 15 removes voxels from both maps, even if other voxels still inflate them.
#[test]
fn freed_voxels_remain_inflated_by_others() {
    let mut map = map(parameters());
    map.insert_scan(&scan(ORIGIN, &[[2.05, 0.05, 0.05], [2.05, 0.15, 0.05]])).unwrap();
    let report = map.insert_scan(&scan(ORIGIN, &[[4.05, 0.05, 0.05]; 8])).unwrap();
    assert_eq!(report.freed, 1);
    assert_eq!(map.view().state_at([2.05, 0.05, 0.05]), LocalState::Inflated);
    assert_eq!(map.view().state_at([2.05, 0.15, 0.05]), LocalState::Occupied);
}

/// The paper's Algorithm 3, line 19 runs after the inflation: the inflation of voxels removed by the limit is never
/// removed.
#[test]
fn removed_voxels_no_longer_inflate_others() {
    let mut map = map(parameters().with_max_voxels(1));
    map.insert_scan(&scan(ORIGIN, &[[1.05, 0.05, 0.05]])).unwrap();
    let report = map.insert_scan(&scan(ORIGIN, &[[0.05, 3.05, 0.05]])).unwrap();
    assert_eq!((report.forgotten, map.stored_voxels(), map.inflated_voxels()), (1, 1, 33));
    assert_eq!(map.view().state_at([1.05, 0.05, 0.05]), LocalState::None);
    assert_eq!(map.view().state_at([0.05, 3.05, 0.05]), LocalState::Occupied);
}

/// The paper's Algorithm 3, lines 3 and 10 add only occupied voxels to the history: those between occupied and free
/// would never be removed, and line 9 would remove them from a history that does not contain them.
#[test]
fn undecided_voxels_count_towards_the_limit_and_are_removed() {
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
