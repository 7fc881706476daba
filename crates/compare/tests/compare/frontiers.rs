use crate::naive::{bounds_m, clusters, is_same_box, neighbors, voxels_of};
use crate::random_maps::{TILE_SIZES_M, random_map, random_region};
use std::collections::BTreeSet;
use testkit::random_scans::Random;
use testkit::support::cases;
use voxtile::VoxelIndex;
use voxtile::mapper::MapView;
use voxtile_compare::{FrontierOptions, frontiers, frontiers_in};

#[test]
fn frontiers_of_random_maps_equal_the_definition() {
    for case in 0..cases(12, 500) {
        let random = &mut Random(case);
        let map = random_map(case, 1, TILE_SIZES_M[case as usize % 3]);
        let options = FrontierOptions::default()
            .with_min_voxels(1 + random.below(9))
            .with_region(random_region(random))
            .with_memory([0, 256 << 20][random.below(2) as usize]);
        let found = frontiers(&map, &options, &|_, _| {}).unwrap();
        let (voxels, grid) = (voxels_of(&map), map.config().grid);
        let is_inside =
            |voxel: &VoxelIndex| options.region.is_none_or(|region| region.contains(grid.center_m(*voxel)));
        let free: BTreeSet<VoxelIndex> = voxels
            .iter()
            .filter(|(voxel, log_odds)| **log_odds < 0.0 && is_inside(voxel))
            .map(|(voxel, _)| *voxel)
            .collect();
        let faces =
            |voxel: VoxelIndex| neighbors(voxel).iter().filter(|near| !voxels.contains_key(*near)).count();
        let at_frontier: Vec<VoxelIndex> = free.iter().copied().filter(|voxel| faces(*voxel) > 0).collect();
        let observed = voxels.keys().filter(|voxel| is_inside(voxel)).count() as u64;
        assert_eq!((found.free, found.free + found.occupied), (free.len() as u64, observed), "case {case}");
        assert_eq!(found.frontier_voxels, at_frontier.len() as u64);
        let (large, small): (Vec<_>, Vec<_>) = clusters(at_frontier.into_iter())
            .into_iter()
            .partition(|cluster| cluster.len() as u64 >= options.min_voxels);
        assert_eq!((found.frontiers.len(), found.small_frontiers), (large.len(), small.len() as u64));
        for (frontier, cluster) in found.frontiers.iter().zip(&large) {
            assert_eq!(frontier.voxels, cluster.len() as u64);
            let area_m2 = cluster.iter().map(|voxel| faces(*voxel)).sum::<usize>() as f64 * 0.01;
            assert!((frontier.area_m2 - area_m2).abs() < 1e-9, "case {case}");
            assert!(is_same_box(&frontier.bounds_m, &bounds_m(cluster)));
        }
        if let Some(region) = options.region {
            assert_eq!(found.frontiers, frontiers_in(&map, &region, &options).unwrap());
            let in_box = grid.voxels_in(&region);
            let all: u64 = (0..3).map(|k| (in_box.end[k] - in_box.min[k]) as u64).product();
            assert_eq!(found.voxels_of_box, Some(all));
            assert!(all == 0 || (found.observed_share.unwrap() - observed as f64 / all as f64).abs() < 1e-12);
        }
    }
}
