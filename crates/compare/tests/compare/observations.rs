use crate::random_maps::{TILE_SIZES_M, random_map, random_region};
use std::collections::BTreeMap;
use testkit::random_scans::Random;
use testkit::support::cases;
use voxtile::Point;
use voxtile::mapper::MapView;
use voxtile_compare::{Class, FrontierOptions, observations};

#[test]
fn counts_and_distances_of_random_maps_equal_the_definition() {
    let mut farthest = 0.0_f64;
    for case in 0..cases(20, 1000) {
        let random = &mut Random(case);
        let map = random_map(case, 1, TILE_SIZES_M[random.below(3) as usize]);
        let grid = map.config().grid;
        let options = FrontierOptions::default().with_region(random_region(random));
        // Some are far from the map.
        let center = [[0.3, 12.4, -0.2], [9.0, 12.4, 0.0], [0.0, 95.0, -30.0]][random.below(3) as usize];
        let count = 1 + random.below(60);
        let mut positions: Vec<Point> = (0..count).map(|_| random.point(center, 6.0)).collect();
        positions.push([f64::NAN; 3]);
        let found = observations(&map, Some(&positions), &options, &|_, _| {}).unwrap();
        // Of the positions of one voxel, the first.
        let mut first = BTreeMap::new();
        for position in &positions[..positions.len() - 1] {
            first.entry(grid.voxel_of(*position).unwrap()).or_insert(*position);
        }
        let least_m = [0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0];
        let (mut counts, mut distances) = (BTreeMap::new(), BTreeMap::new());
        for tile in map.tiles() {
            for voxel in tile.unwrap().voxels() {
                let center_m = grid.center_m(voxel.index);
                let is_inside = options.region.is_none_or(|region| region.contains(center_m));
                if voxel.evidence.log_odds < 0.0 || !is_inside {
                    continue;
                }
                let seen = voxel.evidence.observation_count;
                *counts.entry((0..12).rev().find(|k| seen >= 1 << k).unwrap()).or_insert(0) += 1;
                let to = |position: &Point| {
                    (0..3).map(|k| (position[k] - center_m[k]).powi(2)).sum::<f64>().sqrt()
                };
                let distance_m = first.values().map(to).fold(f64::INFINITY, f64::min);
                farthest = farthest.max(distance_m);
                *distances
                    .entry(least_m.iter().rposition(|from| *from <= distance_m).unwrap())
                    .or_insert(0) += 1;
            }
        }
        let used = |classes: &[Class]| -> Vec<(f64, u64)> {
            classes.iter().filter(|class| class.voxels > 0).map(|class| (class.from, class.voxels)).collect()
        };
        let wanted: Vec<_> = counts.into_iter().map(|(k, voxels)| (f64::from(1 << k), voxels)).collect();
        assert_eq!(used(&found.counts), wanted, "case {case}");
        let wanted: Vec<_> = distances.into_iter().map(|(k, voxels)| (least_m[k], voxels)).collect();
        assert_eq!(used(found.distances_m.as_ref().unwrap()), wanted, "case {case}");
        let without = observations(&map, None, &options, &|_, _| {}).unwrap();
        assert_eq!((without.counts, without.distances_m), (found.counts, None));
    }
    assert!(farthest > 80.0, "{farthest}");
}
