//! Checks the rule that separates rooms from open places, and pictures without ceilings.

use std::collections::HashMap;
use voxtile::scan::PointBatch;
use voxtile::space::{Aabb, Point};
use voxtile::{InMemoryMapper, MapConfig, MapView, Mapper, Scan, VoxelIndex};
use voxtile_render::{Picture, Roof, View};

const RESOLUTION_M: f64 = 0.25;

/// Returns a map seen from scans along x, of a floor, with a ceiling over a part of it.
fn corridor(roofed_share: f64) -> (InMemoryMapper, Vec<Point>) {
    let mut map =
        InMemoryMapper::new(MapConfig::new(RESOLUTION_M, 4.0).unwrap().with_range(0.0, 30.0)).unwrap();
    let mut path = Vec::new();
    for step in 0..20 {
        let origin = [f64::from(step), 0.0, 1.1];
        let mut points = Vec::new();
        for x in -12..=12 {
            for y in -12..=12 {
                let at = [origin[0] + f64::from(x) * 0.5, f64::from(y) * 0.25];
                points.push([at[0], at[1], -0.1]);
                if at[0] < 20.0 * roofed_share {
                    points.push([at[0], at[1], 3.1]);
                }
            }
        }
        for turn in 0..200 {
            let (sin, cos) = (f64::from(turn) * 0.0314159).sin_cos();
            points.push([origin[0] + 6.0 * cos, 3.0 * sin, 1.1]);
        }
        map.insert_scan(&Scan { origin, points, intensities: None }).unwrap();
        path.push(origin);
    }
    (map, path)
}

#[test]
fn columns_are_those_of_a_naive_count() {
    for share in [0.0, 0.3, 1.0] {
        let (map, path) = corridor(share);
        let roof = Roof::of(&map, &path).unwrap().unwrap();
        let [mut free, mut roofed, mut floored]: [HashMap<[i32; 2], bool>; 3] = Default::default();
        let tiles: Vec<[i32; 2]> =
            path.iter().map(|at| [0, 1].map(|k| (at[k] / 4.0).floor() as i32)).collect();
        for voxel in map.tile_indices().into_iter().flat_map(|index| {
            let tile = map.tile_uncached(index).unwrap().unwrap();
            tile.voxels().collect::<Vec<_>>()
        }) {
            let [x, y, z] = voxel.index;
            if !tiles.contains(&[x.div_euclid(16), y.div_euclid(16)]) {
                continue;
            }
            let is_occupied = voxel.evidence.log_odds >= 0.0;
            // 1.1 m is in the voxel of height 4.
            // Two voxels are half a metre.
            if z == 4 && !is_occupied {
                free.insert([x.div_euclid(2), y.div_euclid(2)], true);
            }
            if z > 4 && is_occupied {
                roofed.insert([x.div_euclid(2), y.div_euclid(2)], true);
            }
            if z < 4 && is_occupied {
                floored.insert([x.div_euclid(2), y.div_euclid(2)], true);
            }
        }
        let both = free.keys().filter(|&column| roofed.contains_key(column)).count() as u64;
        let is_room = |column: &&[i32; 2]| roofed.contains_key(*column) && floored.contains_key(*column);
        let rooms = free.keys().filter(is_room).count() as u64;
        assert_eq!((roof.columns, roof.roofed, roof.sensor_m), (free.len() as u64, both, 1.1), "{share}");
        assert_eq!(roof.floored, rooms, "{share}");
        assert_eq!(roof.cut_m(), (roof.share() >= 0.55).then_some(1.1));
        assert_eq!(roof.ceiling_m, if share > 0.0 { 3.0 } else { f64::INFINITY }, "{share}");
        let between = f64::midpoint(1.1, 3.0);
        assert_eq!(roof.oblique_cut_m(), roof.cut_m().map(|_| between), "{share}");
    }
}

#[test]
fn rooms_are_cut_and_the_open_is_not() {
    assert_eq!([0.0, 0.3].map(cut), [None; 2]);
    assert_eq!([0.8, 1.0].map(cut), [Some(1.1); 2]);
    let (map, mut path) = corridor(1.0);
    // A scan from another storey: a cut would hide what it saw.
    path.push([0.0, 0.0, 5.1]);
    assert_eq!(Roof::of(&map, &path).unwrap().unwrap().cut_m(), None);
    // Upside down: z of a camera is not up.
    let (mut below, path) = (InMemoryMapper::new(map.config().clone()).unwrap(), vec![[10.0, 0.0, -1.1]]);
    let ceiling = |k: i32| [0.25 * f64::from(k % 80) + 0.125, 0.25 * f64::from(k / 80) - 5.0, 3.1];
    let points = (0..3200).map(ceiling).collect();
    below.insert_scan(&Scan { origin: path[0], points, intensities: None }).unwrap();
    let rest = (0..400).map(|k| [10.0 + 0.02 * f64::from(k), 5.0, -1.1]).collect();
    below.insert_scan(&Scan { origin: path[0], points: rest, intensities: None }).unwrap();
    let roof = Roof::of(&below, &path).unwrap().unwrap();
    assert!(roof.share() > 0.6 && roof.columns > 10, "{roof:?}");
    assert_eq!((roof.floored, roof.cut_m()), (0, None));
    assert_eq!(Roof::of(&map, &[]).unwrap(), None);
    assert_eq!(Roof::of(&map, &[[f64::NAN; 3], [1e300; 3]]).unwrap(), None);
    let far = Roof::of(&map, &[[500.0, 500.0, 1.0]]).unwrap().unwrap();
    assert_eq!((far.columns, far.cut_m()), (0, None));
}

fn cut(share: f64) -> Option<f64> {
    let (map, path) = corridor(share);
    Roof::of(&map, &path).unwrap().unwrap().cut_m()
}

#[test]
fn pictures_up_to_a_height_are_those_of_the_map_below() {
    let (map, _) = corridor(1.0);
    for view in [View::Above, View::Oblique { azimuth_deg: -60.0, elevation_deg: 40.0 }] {
        let picture = Picture::new().with_view(view).with_size_px([300; 2]);
        let cut = picture.clone().with_max_height_m(Some(1.1)).draw(&map, |_, _| {}).unwrap();
        let below = Aabb { min: [-1e6; 3], max: [1e6, 1e6, 1.1] };
        let region = picture.clone().with_region(below).with_view(View::Above).draw(&map, |_, _| {}).unwrap();
        let whole = picture.draw(&map, |_, _| {}).unwrap();
        assert!(cut.range.unwrap()[1] < 1.1 && whole.range.unwrap()[1] > 3.0);
        if view == View::Above {
            assert_eq!(cut.image, region.image);
        }
    }
}

/// Voxels at a height belong to the picture if their middle is below it.
#[test]
fn the_limit_is_exact() {
    let voxels: Vec<VoxelIndex> = (0..10).map(|z| [z, 0, z]).collect();
    let points: Vec<Point> =
        voxels.iter().map(|voxel| voxel.map(|k| (f64::from(k) + 0.5) * RESOLUTION_M)).collect();
    let mut map = InMemoryMapper::new(MapConfig::new(RESOLUTION_M, 4.0).unwrap()).unwrap();
    map.batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &[true; 10] }).unwrap();
    let solid = |height_m: f64| {
        let picture = Picture::new().with_legend(false).with_max_height_m(Some(height_m));
        picture.draw(&map, |_, _| {}).unwrap().solid_cells
    };
    assert_eq!([0.1, 0.126, 1.0, 1.125, 1.126, 99.0].map(solid), [0, 1, 4, 4, 5, 10]);
    let error = Picture::new().with_max_height_m(Some(f64::NAN)).draw(&map, |_, _| {}).unwrap_err();
    assert_eq!(error.kind(), "invalid_argument");
}
