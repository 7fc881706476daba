//! The trait `Queries` for all kinds of maps: every implementation gives the results of a search over all voxels.

use crate::queries::config;
use std::collections::BTreeMap;
use tempfile::TempDir;
use testkit::random_scans::{Random, random_scan};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use voxtile::scan::RayWalk;
use voxtile::space::{Aabb, Grid, Point, VoxelIndex};
use voxtile::store::SnapshotName;
use voxtile::{
    InMemoryMapper, MapConfig, MapPath, MapQueries, MapReader, Mapper, Occupancy, OutOfCoreTileMapper,
    Queries, RayQuery, Shape, United, UnknownAs,
};
use voxtile_local::{LocalMap, LocalParameters, Obstacle};
use voxtile_share::VoxelSet;

type Voxels = BTreeMap<VoxelIndex, Occupancy>;

fn everything() -> Aabb {
    Aabb { min: [-100.0; 3], max: [100.0; 3] }
}

fn voxels_of(map: &dyn Queries) -> Voxels {
    let voxels = map.voxels_in(&everything()).map(|voxel| voxel.unwrap());
    voxels.map(|voxel| (voxel.voxel, voxel.occupancy)).collect()
}

/// Generates a body. Exact tests of rotated boxes and capsules are approximated by points, see [`touches`].
fn body(random: &mut Random, number: usize) -> Shape {
    let center = random.point([0.0; 3], 3.0);
    match number % 4 {
        0 => Shape::Sphere { center, radius_m: random.between(0.0, 0.8) },
        1 => Shape::Box(Aabb::from_corners(center, random.point(center, 1.0))),
        2 => {
            let turn = Vector3::from(random.point([0.0; 3], 3.0));
            let translation = Translation3::from(Vector3::from(center));
            let rotation = UnitQuaternion::from_scaled_axis(turn);
            let half_extents_m = random.point([0.5; 3], 0.5);
            Shape::OrientedBox {
                world_from_box: Isometry3::from_parts(translation, rotation),
                half_extents_m,
            }
        }
        _ => Shape::SweptSphere {
            from: center,
            to: random.point(center, 2.0),
            radius_m: random.between(0.0, 0.5),
        },
    }
}

/// Whether a point is in the body enlarged by a margin, or shrunk if the margin is negative.
fn holds(body: &Shape, point: Point, margin_m: f64) -> bool {
    let distance = |a: Point, b: Point| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    match body {
        Shape::Sphere { center, radius_m } => distance(*center, point) <= radius_m + margin_m,
        Shape::Box(bounds) => {
            (0..3).all(|k| bounds.min[k] - margin_m <= point[k] && point[k] <= bounds.max[k] + margin_m)
        }
        Shape::OrientedBox { world_from_box, half_extents_m } => {
            let inside = world_from_box.inverse_transform_point(&point.into());
            (0..3).all(|k| inside[k].abs() <= half_extents_m[k] + margin_m)
        }
        Shape::SweptSphere { from, to, radius_m } => {
            let along: Point = std::array::from_fn(|k| to[k] - from[k]);
            let square: f64 = along.iter().map(|x| x * x).sum();
            let time: f64 = (0..3).map(|k| (point[k] - from[k]) * along[k]).sum::<f64>() / square.max(1e-300);
            let time = time.clamp(0.0, 1.0);
            let nearest = std::array::from_fn(|k| from[k] + time * along[k]);
            distance(nearest, point) <= radius_m + margin_m
        }
    }
}

/// Whether a point of a voxel is in a body: certainly, and possibly, within the spacing of the sample points.
fn touches(body: &Shape, grid: &Grid, voxel: VoxelIndex) -> [bool; 2] {
    const TRIED: i32 = 7;
    let edge_m = grid.resolution_m() / f64::from(TRIED - 1);
    let mut sure_and_possible = [false; 2];
    let (bounds, corner) = (body.bounds().unwrap(), voxel.map(|k| grid.corner_m(k)));
    if (0..3).any(|k| bounds.max[k] + 0.1 < corner[k] || corner[k] + 0.2 < bounds.min[k]) {
        return sure_and_possible;
    }
    for place in 0..TRIED.pow(3) {
        let offset = [place % TRIED, place / TRIED % TRIED, place / TRIED.pow(2)];
        let point = std::array::from_fn(|k| grid.corner_m(voxel[k]) + f64::from(offset[k]) * edge_m);
        sure_and_possible[0] |= holds(body, point, -1e-9);
        sure_and_possible[1] |= holds(body, point, edge_m);
    }
    sure_and_possible
}

fn is_obstacle(voxels: &Voxels, voxel: VoxelIndex, unknown: UnknownAs) -> bool {
    match voxels.get(&voxel) {
        Some(Occupancy::Occupied(_)) => true,
        Some(Occupancy::Free(_)) => false,
        _ => unknown == UnknownAs::Obstacle,
    }
}

/// Runs all queries and compares them with a search over all voxels.
fn check(name: &str, map: &dyn Queries, voxels: &Voxels, random: &mut Random) {
    let grid = map.grid();
    assert_eq!(voxels_of(map), *voxels, "{name}");
    let points: Vec<Point> = (0..200).map(|_| random.point([0.0; 3], 4.0)).collect();
    let expected = |point: Point| {
        let found = voxels.get(&grid.voxel_of(point).unwrap());
        found.copied().unwrap_or(Occupancy::Unknown)
    };
    let answers = map.occupancy_at_points(&points).unwrap();
    for (point, answer) in points.iter().zip(answers) {
        assert_eq!(answer, expected(*point), "{name}");
        assert_eq!(map.occupancy_at(*point).unwrap(), answer, "{name}");
    }
    assert_eq!(map.occupancy_at([f64::NAN; 3]).unwrap(), Occupancy::Unknown);

    let mut rays = Vec::new();
    for pair in points.chunks(2) {
        let (from, to) = (pair[0], pair[1]);
        for unknown in [UnknownAs::Free, UnknownAs::Obstacle] {
            let units = |point| grid.to_voxel_units(point);
            let ends = [from, to].map(|point| grid.voxel_of(point).unwrap());
            let mut walk = RayWalk::between(units(from), ends[0], units(to), ends[1]);
            while !walk.is_at_end() && !is_obstacle(voxels, walk.voxel(), unknown) {
                walk.advance();
            }
            let first = Some(walk.voxel()).filter(|voxel| is_obstacle(voxels, *voxel, unknown));
            let hit = map.cast_segment(from, to, unknown).unwrap();
            assert_eq!(hit.map(|hit| hit.voxel), first, "{name}");

            let direction: Point = std::array::from_fn(|k| to[k] - from[k]);
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            let unit = grid.to_voxel_units(direction.map(|x| x / length));
            let mut walk = RayWalk::along(units(from), ends[0], unit);
            while walk.entry_time() <= 3.0 && !is_obstacle(voxels, walk.voxel(), unknown) {
                walk.advance();
            }
            let first = (walk.entry_time() <= 3.0).then(|| (walk.voxel(), walk.entry_time()));
            let ray = RayQuery { origin: from, direction, max_range_m: Some(3.0), unknown };
            let hit = map.cast_ray(&ray).unwrap();
            assert_eq!(hit.map(|hit| (hit.voxel, hit.distance_m)), first, "{name}");
            if let Some(hit) = hit {
                assert_eq!(
                    hit.probability,
                    voxels.get(&hit.voxel).and_then(Occupancy::probability),
                    "{name}"
                );
            }
            rays.push(ray);
        }
    }
    let one_by_one: Vec<_> = rays.iter().map(|ray| map.cast_ray(ray).unwrap()).collect();
    assert_eq!(map.cast_rays(&rays).unwrap(), one_by_one, "{name}");
    let endless = RayQuery { max_range_m: None, unknown: UnknownAs::Free, ..rays[0] };
    map.cast_ray(&endless).unwrap();

    let occupied = || voxels.iter().filter(|(_, found)| found.is_occupied()).map(|(voxel, _)| *voxel);
    for (number, &point) in points.iter().enumerate().take(60) {
        let body = body(random, number);
        match map.collision(&body, UnknownAs::Free).unwrap() {
            Some(hit) => {
                assert!(voxels[&hit.voxel].is_occupied(), "{name}");
                assert!(
                    touches(&body, &grid, hit.voxel)[1],
                    "{name}: {body:?} does not touch {:?}",
                    hit.voxel
                );
            }
            None => {
                let touched = occupied().find(|voxel| touches(&body, &grid, *voxel)[0]);
                assert_eq!(touched, None, "{name}: {body:?}");
            }
        }
        let strict = map.collision(&body, UnknownAs::Obstacle).unwrap();
        if let Some(hit) = strict {
            assert!(is_obstacle(voxels, hit.voxel, UnknownAs::Obstacle), "{name}");
            assert!(touches(&body, &grid, hit.voxel)[1], "{name}");
        }

        let distance_m = |voxel: VoxelIndex| {
            let center_m = grid.center_m(voxel);
            (0..3).map(|k| (center_m[k] - point[k]).powi(2)).sum::<f64>().sqrt()
        };
        let nearest = occupied().map(|voxel| (distance_m(voxel), voxel));
        let nearest = nearest.filter(|(distance_m, _)| *distance_m <= 2.0);
        let nearest = nearest.min_by(|a, b| a.partial_cmp(b).unwrap());
        let hit = map.nearest_occupied(point, 2.0).unwrap();
        assert_eq!(hit.map(|hit| (hit.distance_m, hit.voxel)), nearest, "{name}");
    }
    assert!(map.nearest_occupied([0.0; 3], -1.0).is_err(), "{name}");
    let negative = Shape::SweptSphere { from: [0.0; 3], to: [1.0; 3], radius_m: -1.0 };
    assert!(map.collision(&negative, UnknownAs::Free).is_err(), "{name}");
    let nowhere = RayQuery { direction: [0.0; 3], ..rays[0] };
    assert!(map.cast_ray(&nowhere).is_err() && map.cast_rays(&[nowhere]).is_err(), "{name}");
}

#[test]
fn all_kinds_of_maps_give_the_same_results() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("map");
    let mut in_memory = InMemoryMapper::new(config()).unwrap();
    let mut out_of_core =
        OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config()).unwrap();
    for seed in 0..4 {
        let scan = random_scan(&mut Random(seed), [0.2, 0.1, -0.3], 40);
        in_memory.insert_scan(&scan).unwrap();
        out_of_core.insert_scan(&scan).unwrap();
    }
    let mut voxels = Voxels::new();
    in_memory
        .for_each_voxel_in(&everything(), |voxel| {
            let occupancy = Occupancy::of(&config(), Some(voxel.evidence));
            voxels.insert(voxel.index, occupancy);
        })
        .unwrap();
    let name: SnapshotName = "one".parse().unwrap();
    out_of_core.snapshot(&name).unwrap();
    let live = out_of_core.reader().unwrap();
    let view = live.view();
    let (reader, snapshot) =
        (MapReader::open(&path, 0).unwrap(), MapReader::open_snapshot(&path, &name, 0).unwrap());
    let united = United::new(&[&in_memory, &live]).unwrap();
    let maps: [(&str, &dyn Queries); 7] = [
        ("in memory", &in_memory),
        ("out of core", &out_of_core),
        ("reader", &reader),
        ("snapshot", &snapshot),
        ("live reader", &live),
        ("live view", &view),
        ("united", &united),
    ];
    for (name, map) in maps {
        check(name, map, &voxels, &mut Random(7));
    }
}

#[test]
fn voxel_sets_can_be_queried_and_united_with_maps() {
    let mut random = Random(21);
    let mut archive = InMemoryMapper::new(config()).unwrap();
    let mut local = LocalMap::new(0.1, LocalParameters::local_mapping()).unwrap();
    for _ in 0..3 {
        let scan = random_scan(&mut random, [0.0; 3], 60);
        archive.insert_scan(&scan).unwrap();
        local.insert_scan(&random_scan(&mut random, [0.5, 0.0, 0.0], 60)).unwrap();
    }
    let mut layer = VoxelSet::new(config().grid);
    for _ in 0..200 {
        layer.put(std::array::from_fn(|_| random.below(60) as i32 - 30), true);
    }
    let view = local.reader().view();
    let (occupied, inflated) = (view.obstacles(Obstacle::Occupied), view.obstacles(Obstacle::Inflated));
    let of_archive = voxels_of(&archive);
    let all_occupied = |voxels: Vec<VoxelIndex>| -> Voxels {
        voxels.into_iter().map(|voxel| (voxel, Occupancy::Occupied(1.0))).collect()
    };
    let obstacles = |obstacle: Obstacle| {
        let mut voxels = Vec::new();
        view.for_each(|voxel, state| voxels.extend(obstacle.is(state).then_some(voxel)));
        all_occupied(voxels)
    };
    let of_layer = all_occupied(layer.iter().collect());
    check("layer", &layer, &of_layer, &mut random);
    check("local map", &*view, &obstacles(Obstacle::Occupied), &mut random);
    check("occupied", &occupied, &obstacles(Obstacle::Occupied), &mut random);
    check("inflated", &inflated, &obstacles(Obstacle::Inflated), &mut random);
    check("empty layer", &VoxelSet::new(config().grid), &Voxels::new(), &mut random);

    let united = United::new(&[&archive, &inflated, &layer]).unwrap();
    let mut voxels = of_archive;
    for (voxel, occupancy) in obstacles(Obstacle::Inflated).into_iter().chain(of_layer) {
        let known = voxels.entry(voxel).or_insert(occupancy);
        if !known.is_occupied() {
            *known = occupancy;
        }
    }
    check("united", &united, &voxels, &mut random);
    assert!(United::new(&[]).is_err());
    let coarse = InMemoryMapper::new(MapConfig::new(0.2, 1.0).unwrap()).unwrap();
    assert!(United::new(&[&archive, &coarse]).is_err());
}
