use crate::naive::{around, bounds_m, clusters, is_same_box, neighbors, voxels_of};
use crate::random_maps::{TILE_SIZES_M, config, fill, random_map, storage_of};
use std::collections::BTreeSet;
use testkit::random_scans::Random;
use testkit::support::cases;
use voxtile::mapper::{MapStatistics, MapView, TileRef};
use voxtile::space::TileBox;
use voxtile::{
    Aabb, InMemoryMapper, MapConfig, MapOptions, MapReader, Mapper, Result, Scan, TileIndex, VoxelIndex,
};
use voxtile_compare::{Frontier, FrontierOptions, frontiers, frontiers_in};

/// A box of up to 6 m. Most of them cut clusters, tiles and the border of the blocks at 12.8 m.
fn random_box(random: &mut Random) -> Aabb {
    let center = [0.3, 12.4, -0.2];
    Aabb::from_corners(random.point(center, 3.0), random.point(center, 3.0))
}

/// The frontiers of a box by the definition: clusters, the largest first, with their areas in square metres.
fn naive(map: &impl MapView, region: &Aabb, min_voxels: u64) -> Vec<(BTreeSet<VoxelIndex>, f64)> {
    let (voxels, grid) = (voxels_of(map), map.config().grid);
    let faces =
        |voxel: &VoxelIndex| neighbors(*voxel).iter().filter(|near| !voxels.contains_key(*near)).count();
    let is_frontier = |(voxel, log_odds): &(&VoxelIndex, &f64)| {
        **log_odds < 0.0 && region.contains(grid.center_m(**voxel)) && faces(voxel) > 0
    };
    let all = clusters(voxels.iter().filter(is_frontier).map(|(voxel, _)| *voxel));
    let large = all.into_iter().filter(|cluster| cluster.len() as u64 >= min_voxels);
    large
        .map(|cluster| {
            let area_m2 = cluster.iter().map(faces).sum::<usize>() as f64 * 0.01;
            (cluster, area_m2)
        })
        .collect()
}

/// The voxel of a cluster nearest to its mean; of equally near ones the lowest by z, y, x.
fn naive_goal(cluster: &BTreeSet<VoxelIndex>) -> VoxelIndex {
    let mean: [f64; 3] = std::array::from_fn(|k| {
        let total: i64 = cluster.iter().map(|voxel| i64::from(voxel[k])).sum();
        total as f64 / cluster.len() as f64
    });
    let distance = |voxel: &VoxelIndex| (0..3).map(|k| (f64::from(voxel[k]) - mean[k]).powi(2)).sum::<f64>();
    let key = |voxel: &VoxelIndex| (distance(voxel), [voxel[2], voxel[1], voxel[0]]);
    *cluster.iter().min_by(|a, b| key(a).partial_cmp(&key(b)).unwrap()).unwrap()
}

fn check(map: &impl MapView, region: &Aabb, options: &FrontierOptions, name: &str) -> Vec<Frontier> {
    let found = frontiers_in(map, region, options).unwrap();
    let wanted = naive(map, region, options.min_voxels);
    assert_eq!(found.len(), wanted.len(), "{name}");
    let (grid, voxels) = (map.config().grid, voxels_of(map));
    for ((frontier, (cluster, area_m2)), number) in found.iter().zip(&wanted).zip(1..) {
        assert_eq!((frontier.number, frontier.voxels), (number, cluster.len() as u64), "{name}");
        assert!((frontier.area_m2 - area_m2).abs() < 1e-9, "{name}");
        assert!(is_same_box(&frontier.bounds_m, &bounds_m(cluster)), "{name}");
        let mean_m = |k: usize| {
            cluster.iter().map(|voxel| grid.center_m(*voxel)[k]).sum::<f64>() / cluster.len() as f64
        };
        assert!((0..3).all(|k| (frontier.center_m[k] - mean_m(k)).abs() < 1e-6), "{name}");
        let goal = naive_goal(cluster);
        assert_eq!(frontier.goal_m, grid.center_m(goal), "{name}");
        assert!(voxels[&goal] < 0.0 && around(goal, 1).any(|near| !voxels.contains_key(&near)), "{name}");
    }
    found
}

#[test]
fn frontiers_in_random_boxes_equal_the_definition() {
    let (mut listed, mut cut) = (0, 0);
    for case in 0..cases(12, 500) {
        let random = &mut Random(case);
        let map = random_map(case, 1, TILE_SIZES_M[case as usize % 3]);
        let options = FrontierOptions::default()
            .with_min_voxels(1 + random.below(9))
            .with_memory([0, 256 << 20][random.below(2) as usize]);
        let region = match case % 4 {
            0 => Aabb { min: [-100.0; 3], max: [100.0; 3] },
            _ => random_box(random),
        };
        let found = check(&map, &region, &options, &format!("case {case}: {region:?}"));
        listed += found.len();
        let whole = frontiers(&map, &options, &|_, _| {}).unwrap();
        let is_whole = |frontier: &Frontier| {
            whole
                .frontiers
                .iter()
                .any(|other| (other.voxels, other.bounds_m) == (frontier.voxels, frontier.bounds_m))
        };
        cut += found.iter().filter(|frontier| !is_whole(frontier)).count();
    }
    assert!(listed > cut && cut > 5, "{listed} listed, {cut} cut by the box");
}

#[test]
fn frontiers_of_a_map_that_is_being_built_equal_the_definition() {
    for case in 0..cases(4, 60) {
        let random = &mut Random(case);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map");
        // Tiles are evicted and read again.
        let config =
            config(TILE_SIZES_M[case as usize % 3]).with_storage(storage_of(case)).with_cache_tiles(4);
        let mut map = MapOptions::new().config(config).create_new(true).open(&path).unwrap();
        fill(&mut map, case, 1);
        let reader = map.reader().unwrap();
        let (region, options) = (random_box(random), FrontierOptions::default().with_min_voxels(2));
        let of_view = check(&reader.view(), &region, &options, &format!("view, case {case}"));
        assert_eq!(check(&map, &region, &options, &format!("mapper, case {case}")), of_view);
        map.insert_scan(&Scan {
            origin: [0.3, 12.4, 0.3],
            points: vec![[3.0, 13.0, 0.5]],
            intensities: None,
        })
        .unwrap();
        let later = check(&reader.view(), &region, &options, &format!("later view, case {case}"));
        map.flush().unwrap();
        drop((reader, map));
        let saved = MapReader::open(&path, 1 << 20).unwrap();
        assert_eq!(check(&saved, &region, &options, &format!("saved, case {case}")), later);
    }
}

/// A map that may only be read near a box.
struct OnlyNear<'a> {
    map: &'a InMemoryMapper,
    tiles: TileBox,
}

impl MapView for OnlyNear<'_> {
    fn config(&self) -> &MapConfig {
        self.map.config()
    }

    fn scan_number(&self) -> u64 {
        self.map.scan_number()
    }

    fn tile_indices(&self) -> Vec<TileIndex> {
        panic!("all tiles are listed")
    }

    fn tile_bounds(&self) -> Option<TileBox> {
        self.map.tile_bounds()
    }

    fn has_tile(&self, index: TileIndex) -> bool {
        self.map.has_tile(index)
    }

    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        panic!("all tiles are listed")
    }

    fn tile(&self, _: TileIndex) -> Result<Option<TileRef<'_>>> {
        panic!("a tile is cached")
    }

    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        assert!(self.tiles.contains(index), "{index:?} is far from the box");
        self.map.tile_uncached(index)
    }

    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.map.voxels_of_tile_hint(index)
    }

    fn statistics(&self) -> MapStatistics {
        self.map.statistics()
    }
}

#[test]
fn only_blocks_around_the_box_are_read() {
    let mut map = random_map(1, 1, 3.0);
    let far = Scan { origin: [500.0, 0.0, 0.0], points: vec![[502.0, 0.5, 0.3]], intensities: None };
    map.insert_scan(&far).unwrap();
    let region = Aabb { min: [-1.0, 11.0, -1.0], max: [1.0, 12.5, 1.0] };
    // Voxels -1 to 129 of the blocks of the box.
    let grid = map.config().grid;
    let tiles = TileBox::new(grid.tile_of_voxel([-129, -1, -129]), grid.tile_of_voxel([128, 128, 128]));
    let near = OnlyNear { map: &map, tiles };
    let options = FrontierOptions::default();
    let found = frontiers_in(&near, &region, &options).unwrap();
    assert!(!found.is_empty());
    assert_eq!(found, frontiers_in(&map, &region, &options).unwrap());
    let nowhere = Aabb { min: [100.0; 3], max: [1e9; 3] };
    assert_eq!(frontiers_in(&near, &nowhere, &options).unwrap(), []);
}
