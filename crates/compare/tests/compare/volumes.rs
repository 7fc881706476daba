use crate::naive::{Voxels, voxels_of};
use crate::random_maps::{TILE_SIZES_M, random_map, random_region};
use std::collections::{BTreeMap, BTreeSet};
use testkit::random_scans::Random;
use testkit::support::cases;
use voxtile::mapper::MapView;
use voxtile::space::Area;
use voxtile::{Aabb, InMemoryMapper, MapConfig, Mapper, VoxelIndex};
use voxtile_compare::{VolumeOptions, VolumeSums, volumes, volumes_over_plane};

const RESOLUTION_M: f64 = 0.1;

/// Highest occupied voxels of the columns, and whether the voxels above them are free.
fn tops(voxels: &Voxels, is_inside: &dyn Fn(VoxelIndex) -> bool) -> BTreeMap<[i32; 2], (i32, bool)> {
    let mut tops = BTreeMap::new();
    // In ascending order of z within a column.
    for (&[x, y, z], _) in voxels.iter().filter(|(voxel, log_odds)| **log_odds >= 0.0 && is_inside(**voxel)) {
        let is_free = voxels.get(&[x, y, z + 1]).is_some_and(|log_odds| *log_odds < 0.0);
        tops.insert([x, y], (z, is_free));
    }
    tops
}

/// Area, fill and cut of heights in voxels.
fn sums(heights: impl Iterator<Item = f64>) -> [f64; 3] {
    heights.fold([0.0; 3], |[area, fill, cut], height| {
        let cell_m2 = RESOLUTION_M * RESOLUTION_M;
        let volume_m3 = height * RESOLUTION_M * cell_m2;
        [area + cell_m2, fill + volume_m3.max(0.0), cut + (-volume_m3).max(0.0)]
    })
}

fn assert_near(found: VolumeSums, wanted: [f64; 3], name: &str) {
    let all = [found.area_m2, found.fill_m3, found.cut_m3];
    assert!((0..3).all(|k| (all[k] - wanted[k]).abs() < 1e-6), "{name}: {found:?}, not {wanted:?}");
    assert!((found.net_m3 - (wanted[1] - wanted[2])).abs() < 1e-6);
}

#[test]
fn volumes_of_random_maps_equal_the_definition() {
    let mut measured = 0.0;
    for case in 0..cases(16, 500) {
        let random = &mut Random(case);
        let [a, b] = [1, 2].map(|epoch| random_map(case, epoch, TILE_SIZES_M[random.below(3) as usize]));
        let region = random_region(random);
        let corner = |random: &mut Random| {
            let [x, y, _] = random.point([0.3, 12.4, 0.0], 2.0);
            [x, y]
        };
        let area = (random.below(2) == 0)
            .then(|| Area::new(&[vec![vec![corner(random), corner(random), corner(random)]]]).unwrap());
        let least = random.below(4);
        let options = VolumeOptions::default()
            .with_region(region)
            .with_area(area.clone())
            .with_least(least as f64 * RESOLUTION_M)
            .with_memory([0, 256 << 20][random.below(2) as usize]);
        let name = format!("case {case}: {options:?}");
        let grid = a.config().grid;
        let is_in_area = |[x, y]: [i32; 2]| {
            let column = voxtile::space::VoxelBox { min: [x, y, 0], end: [x + 1, y + 1, 1] };
            area.as_ref().is_none_or(|area| area.columns(&grid, &column).contains([x, y]))
        };
        let is_inside = |voxel: VoxelIndex| {
            region.is_none_or(|region| region.contains(grid.center_m(voxel)))
                && is_in_area([voxel[0], voxel[1]])
        };
        let [old, new] = [voxels_of(&a), voxels_of(&b)].map(|voxels| tops(&voxels, &is_inside));
        let both = |is_measured: bool| {
            old.iter().filter_map(|(column, old)| Some((old, new.get(column)?))).filter_map(
                move |((old, is_seen), (new, is_seen_too))| {
                    let height = f64::from(new - old);
                    let is_least = height.abs() >= least as f64;
                    let height = if is_least { height } else { 0.0 };
                    (is_measured == (*is_seen && *is_seen_too)).then_some(height)
                },
            )
        };
        let found = volumes(&a, &b, &options, &|_, _| {}).unwrap();
        assert_near(found.measured, sums(both(true)), &name);
        assert_near(found.open, sums(both(false)), &name);
        let only = |own: &BTreeMap<[i32; 2], _>, other: &BTreeMap<[i32; 2], _>| {
            own.keys().filter(|column| !other.contains_key(*column)).count() as f64 * 0.01
        };
        assert!((found.only_before_m2 - only(&old, &new)).abs() < 1e-6, "{name}");
        assert!((found.only_after_m2 - only(&new, &old)).abs() < 1e-6, "{name}");
        // The area of the region and polygon, column by column.
        let columns: BTreeSet<[i32; 2]> = match (region, area.is_some()) {
            (None, false) => old.keys().chain(new.keys()).copied().collect(),
            _ => (-60..100)
                .flat_map(|x| (30..220).map(move |y| [x, y]))
                .filter(|&[x, y]| {
                    let [x_m, y_m, _] = grid.center_m([x, y, 0]);
                    is_in_area([x, y])
                        && region.is_none_or(|region| region.contains([x_m, y_m, region.min[2]]))
                })
                .collect(),
        };
        assert!((found.area_m2 - columns.len() as f64 * 0.01).abs() < 1e-6, "{name}: {found:?}");
        let plane_m = -0.23;
        let over = volumes_over_plane(&a, plane_m, &options, &|_, _| {}).unwrap();
        let heights = |is_measured: bool| {
            old.values()
                .filter(move |(_, is_seen)| *is_seen == is_measured)
                .map(move |(z, _)| f64::from(*z) + 0.5 - plane_m / RESOLUTION_M)
        };
        assert_near(over.measured, sums(heights(true)), &name);
        assert_near(over.open, sums(heights(false)), &name);
        measured += found.measured.area_m2;
    }
    assert!(measured > 0.1, "{measured}");
}

/// Floor of 4 x 4 m with a heap, seen from above by vertical rays.
fn site(heap: impl Fn(i32, i32) -> i32) -> InMemoryMapper {
    site_in_tiles(10.0, heap)
}

fn site_in_tiles(tile_size_m: f64, heap: impl Fn(i32, i32) -> i32) -> InMemoryMapper {
    let mut map = InMemoryMapper::new(MapConfig::new(RESOLUTION_M, tile_size_m).unwrap()).unwrap();
    for (x, y) in (0..40).flat_map(|x| (0..40).map(move |y| (x, y))) {
        let center = |k: i32| (f64::from(k) + 0.5) * RESOLUTION_M;
        let point = [center(x), center(y), center(heap(x, y))];
        let scan = voxtile::Scan {
            origin: [point[0], point[1], 5.0],
            points: vec![point],
            ..voxtile::Scan::default()
        };
        map.insert_scan(&scan).unwrap();
    }
    map
}

#[test]
fn heaps_and_pits_have_their_volume() {
    let before = site(|x, _| if x < 10 { 6 } else { 0 });
    let after = site(|x, y| if x >= 30 && y < 20 { 15 } else { 0 });
    let all = volumes(&before, &after, &VolumeOptions::default(), &|_, _| {}).unwrap();
    assert_near(all.measured, [16.0, 10.0 * 20.0 * 15e-3, 10.0 * 40.0 * 6e-3], "heap and pit");
    assert_eq!((all.measured_share, all.only_before_m2, all.only_after_m2), (1.0, 0.0, 0.0));
    let region = Aabb { min: [3.0, 0.0, -1.0], max: [4.0, 1.0, 9.0] };
    let part = volumes(&before, &after, &VolumeOptions::default().with_region(region), &|_, _| {}).unwrap();
    assert_near(part.measured, [1.0, 100.0 * 15e-3, 0.0], "region");
    // In a region below its top, the heap has no seen top.
    let low = Aabb { min: [3.0, 0.0, -1.0], max: [4.0, 1.0, 1.0] };
    let low = volumes(&before, &after, &VolumeOptions::default().with_region(low), &|_, _| {}).unwrap();
    assert!(low.measured.area_m2 == 0.0 && (low.only_before_m2 - 1.0).abs() < 1e-9, "{low:?}");
    let plane = volumes_over_plane(&after, 0.05, &VolumeOptions::default(), &|_, _| {}).unwrap();
    assert_near(plane.measured, [16.0, 3.0, 0.0], "plane");
    assert_eq!(plane.measured.cut_m3.to_bits(), 0);
}

#[test]
fn the_voxel_above_a_region_may_be_in_another_tile() {
    let [before, after] = [0, 4].map(|top| site_in_tiles(0.5, move |_, _| top));
    let region = Aabb { min: [0.0, 0.0, -0.5], max: [4.0, 4.0, 0.5] };
    let found = volumes(&before, &after, &VolumeOptions::default().with_region(region), &|_, _| {}).unwrap();
    assert_near(found.measured, [16.0, 16.0 * 0.4, 0.0], "tiles");
}

#[test]
fn wrong_arguments_are_refused() {
    let map = site(|_, _| 0);
    let refused = |result: voxtile::Result<_>| result.unwrap_err().to_string();
    let options = VolumeOptions::default();
    let none = &|_, _| {};
    assert!(refused(volumes_over_plane(&map, f64::NAN, &options, none)).contains("finite height"));
    for least_m in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(volumes(&map, &map, &options.clone().with_least(least_m), none)).contains("least"));
    }
    let far = Aabb { min: [-1e8; 3], max: [1e8; 3] };
    assert!(refused(volumes(&map, &map, &options.with_region(far), none)).contains("blocks"));
    let other = InMemoryMapper::new(MapConfig::new(0.2, 10.0).unwrap()).unwrap();
    assert!(refused(volumes(&map, &other, &VolumeOptions::default(), none)).contains("remap"));
}
