//! Tests of the local map: against a naive reference after every update, its queries, and its use with archives.

mod archive;
mod mended;
mod queries;
mod random_lives;
mod readers;

use testkit::random_scans::{Random, random_scan};
use testkit::reference_local::{ReferenceLocal, states_of};
use voxtile::Scan;
use voxtile::space::Point;
use voxtile_local::{LocalMap, LocalParameters};

/// A scan like that of [`random_scan`] in a world of few voxels, where rays often pass voxels that others hit.
fn crowded_scan(random: &mut Random, center: Point, points: usize) -> Scan {
    let mut scan = random_scan(random, center, points);
    let wall: Vec<Point> = scan.points.iter().map(|p| [center[0] + 2.0, p[1], p[2]]).collect();
    scan.points.extend(wall);
    scan.intensities = None;
    scan
}

/// Parameters without a work limit: the map is settled after every update.
fn at_once(parameters: LocalParameters) -> LocalParameters {
    let mut parameters = parameters;
    parameters.work_per_update = usize::MAX;
    parameters
}

fn scan(origin: Point, points: &[Point]) -> Scan {
    Scan { origin, points: points.to_vec(), intensities: None }
}

/// Asserts that the map equals the naive one: log-odds bit for bit, history order, occupied and inflated sets.
fn assert_equal(map: &LocalMap, naive: &ReferenceLocal, when: &str) {
    assert!(map.history().eq(naive.history.iter().copied()), "the histories differ {when}");
    let (states, expected) = (states_of(map.view()), naive.states());
    assert!(states == expected, "{} voxels, not {}, {when}", states.len(), expected.len());
    assert_eq!(map.inflated_voxels(), naive.inflated().len(), "{when}");
    assert_eq!(map.view().occupied_voxels(), naive.occupied().len(), "{when}");
    assert_eq!((map.stored_voxels(), map.view().stored_voxels()), (naive.history.len(), naive.history.len()));
}
