use std::collections::{BTreeMap, HashMap};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, voxels_of};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::mapper::OctreeMap;
use voxtile::octree::read;
use voxtile::query::{Column, RayQuery, Shape, UnknownAs};
use voxtile::scan::{PointBatch, RayWalk};
use voxtile::sensor::{Iwlo, LogOdds, SensorModel};
use voxtile::space::{Aabb, MortonCode, VoxelIndex, VoxelKey};
use voxtile::{
    InMemoryMapper, InsertMode, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, Occupancy,
    OutOfCoreTileMapper, Queries, Scan, Storage,
};

/// A map of ten voxels per tile edge, with four tiles in memory and a write buffer.
pub fn config() -> MapConfig {
    MapConfig::new(0.1, 1.0).unwrap().with_cache_tiles(4).with_write_buffer_bytes(5_000)
}

/// Returns the same map twice: in memory, and out of core with updates in the write buffer.
fn maps(folder: &TempDir) -> (InMemoryMapper, OutOfCoreTileMapper) {
    let mut in_memory = InMemoryMapper::new(config()).unwrap();
    let path = folder.path().join("map");
    let mut out_of_core =
        OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config()).unwrap();
    for seed in 0..4 {
        let scan = random_scan(&mut Random(seed), [0.2, 0.1, -0.3], 40);
        in_memory.insert_scan(&scan).unwrap();
        out_of_core.insert_scan(&scan).unwrap();
    }
    (in_memory, out_of_core)
}

fn occupancy(view: &impl MapView, voxel: VoxelIndex) -> Occupancy {
    view.occupancy_at(view.config().grid.center_m(voxel)).unwrap()
}

#[test]
fn rays_end_where_single_steps_end() {
    let folder = TempDir::new().unwrap();
    let (map, out_of_core) = maps(&folder);
    let mut random = Random(50);
    let (mut hits, grid) = (0, map.config().grid);
    let occupied = map.all_occupied_voxels(None).unwrap();
    for number in 0..400 {
        let origin = random.point([0.0; 3], 5.0);
        let direction = match number % 5 {
            0 => [0.0, -1.0, 0.0],
            1 => random.point([0.0; 3], 1.0),
            // Few random rays hit anything, so aim at an occupied voxel.
            _ => {
                let target = grid.center_m(occupied[random.below(occupied.len() as u64) as usize].index);
                std::array::from_fn(|k| target[k] - origin[k])
            }
        };
        let unknown = if number % 4 == 0 { UnknownAs::Obstacle } else { UnknownAs::Free };
        let max_range_m = random.between(2.0, 12.0);
        let query = RayQuery { origin, direction, max_range_m: Some(max_range_m), unknown };
        let answer = map.cast_ray(&query).unwrap();
        assert_eq!(out_of_core.cast_ray(&query).unwrap(), answer);

        let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
        let start = grid.voxel_of(origin).unwrap();
        let unit = grid.to_voxel_units(direction.map(|d| d / length));
        let mut walk = RayWalk::along(grid.to_voxel_units(origin), start, unit);
        let stopped = loop {
            if walk.entry_time() > max_range_m {
                break None;
            }
            let found = occupancy(&map, walk.voxel());
            if found.is_occupied() || (found == Occupancy::Unknown && unknown == UnknownAs::Obstacle) {
                break Some((walk.voxel(), walk.entry_time(), found.probability()));
            }
            walk.advance();
        };
        assert_eq!(answer.map(|hit| (hit.voxel, hit.distance_m, hit.probability)), stopped);
        hits += u32::from(stopped.is_some_and(|(.., probability)| probability.is_some()));
        let unlimited = map.cast_ray(&RayQuery { max_range_m: None, ..query }).unwrap();
        assert!(answer.is_none() || unlimited == answer);
    }
    assert!(hits > 40, "{hits} hits");
}

#[test]
fn rays_from_a_distance_end_where_single_steps_end() {
    let folder = TempDir::new().unwrap();
    let (map, out_of_core) = maps(&folder);
    let grid = map.config().grid;
    let occupied: HashMap<VoxelIndex, f64> = map
        .all_occupied_voxels(None)
        .unwrap()
        .into_iter()
        .map(|voxel| (voxel.index, voxel.evidence.probability()))
        .collect();
    let mut targets: Vec<VoxelIndex> = occupied.keys().copied().collect();
    targets.sort_unstable();
    let farthest = targets.iter().flatten().map(|index| index.abs()).max().unwrap();
    let mut random = Random(51);
    let mut hits = 0;
    for number in 0..61 {
        let distance_m = if number == 60 { 1e6 } else { 10_f64.powi(number % 5) };
        let target = targets[random.below(targets.len() as u64) as usize];
        let mut direction = random.point([0.0; 3], 1.0);
        if number % 4 == 0 {
            // Along an axis: the ray never crosses borders of the other two.
            direction = std::array::from_fn(|k| f64::from(u8::from(k == number as usize % 3)));
        }
        let origin = std::array::from_fn(|k| grid.center_m(target)[k] - distance_m * direction[k]);
        let query = RayQuery { origin, direction, max_range_m: None, unknown: UnknownAs::Free };
        let began = Instant::now();
        let answer = map.cast_ray(&query).unwrap();
        assert!(began.elapsed() < Duration::from_millis(200), "{:?} from {distance_m} m", began.elapsed());
        assert_eq!(out_of_core.cast_ray(&query).unwrap(), answer);

        let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
        let unit = grid.to_voxel_units(direction.map(|d| d / length));
        let mut walk = RayWalk::along(grid.to_voxel_units(origin), grid.voxel_of(origin).unwrap(), unit);
        let is_past = |voxel: VoxelIndex| {
            (0..3).any(|k| unit[k] != 0.0 && f64::from(voxel[k]) * unit[k].signum() > f64::from(farthest))
        };
        let stopped = loop {
            let voxel = walk.voxel();
            // Most steps are outside the map, and need no look-up.
            let is_near = voxel.iter().all(|index| index.abs() <= farthest);
            if let Some(probability) = is_near.then(|| occupied.get(&voxel)).flatten() {
                break Some((voxel, walk.entry_time(), Some(*probability)));
            }
            if is_past(voxel) {
                break None;
            }
            walk.advance();
        };
        assert_eq!(answer.map(|hit| (hit.voxel, hit.distance_m, hit.probability)), stopped);
        hits += u32::from(stopped.is_some());
        // The opposite direction, away from the map: no hit, and quickly.
        let away = RayQuery { direction: direction.map(|d| -d), ..query };
        if distance_m > 100.0 {
            assert_eq!(map.cast_ray(&away).unwrap(), None);
        }
        let short = RayQuery { max_range_m: Some(distance_m / 2.0), ..query };
        assert!(map.cast_ray(&short).unwrap().is_none_or(|hit| hit.distance_m <= distance_m / 2.0));
    }
    assert!(hits > 30, "{hits} hits");
}

#[test]
fn rays_along_the_ends_of_all_voxels() {
    let (low, high) = (i32::MIN, i32::MAX - 1);
    let grid = config().grid;
    for [from, to] in [[[low; 3], [high; 3]], [[high, 5, low], [low, 5, low]], [[high; 3], [low, high, high]]]
    {
        let mut map = InMemoryMapper::new(config()).unwrap();
        let points = [grid.center_m(to)];
        map.batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &[true] }).unwrap();
        let (origin, target) = (grid.center_m(from), points[0]);
        let direction = std::array::from_fn(|k| target[k] - origin[k]);
        for unknown in [UnknownAs::Free, UnknownAs::Obstacle] {
            let hit =
                map.cast_ray(&RayQuery { origin, direction, max_range_m: None, unknown }).unwrap().unwrap();
            assert_eq!(hit.voxel, if unknown == UnknownAs::Free { to } else { from });
            let away = RayQuery { origin, direction: direction.map(|d| -d), max_range_m: None, unknown };
            assert_eq!(map.cast_ray(&away).unwrap().is_some(), unknown == UnknownAs::Obstacle);
        }
    }
}

#[test]
fn an_octree_equals_the_table_at_the_finest_depth() {
    let folder = TempDir::new().unwrap();
    let (in_memory, mut out_of_core) = maps(&folder);
    out_of_core.flush().unwrap();
    let reader = MapReader::open(folder.path().join("map"), 100_000).unwrap();
    let voxels = {
        let mut voxels = Vec::new();
        in_memory.for_each_occupied(Some(0.0), None, |voxel| voxels.push(voxel)).unwrap();
        voxels
    };
    let rounded =
        voxels.iter().filter(|voxel| f64::from(voxel.evidence.log_odds as f32) != voxel.evidence.log_odds);
    assert!(rounded.count() > 100);
    let grid = in_memory.config().grid;
    let points: Vec<_> =
        voxels.iter().map(|voxel| grid.center_m(voxel.index)).chain([[1e3; 3], [f64::NAN; 3]]).collect();
    let exact = in_memory.occupancy_at_points(&points).unwrap();
    for (point, exact) in points.iter().zip(&exact) {
        assert_eq!(in_memory.occupancy_at_depth(*point, 16).unwrap(), *exact);
        assert_eq!(out_of_core.occupancy_at_depth(*point, 16).unwrap(), *exact);
        assert_eq!(reader.occupancy_at_depth(*point, 16).unwrap(), *exact);
        assert_eq!(reader.occupancy_at(*point).unwrap(), *exact);
    }
}

#[test]
fn regions_collisions_and_nearest_are_those_of_a_search_of_every_voxel() {
    let folder = TempDir::new().unwrap();
    let (map, out_of_core) = maps(&folder);
    let grid = map.config().grid;
    let all: Vec<VoxelIndex> = voxels_of(&map).into_keys().collect();
    let occupied: Vec<VoxelIndex> =
        all.iter().copied().filter(|&v| occupancy(&map, v).is_occupied()).collect();
    let mut random = Random(60);
    for _ in 0..40 {
        let region = Aabb::from_corners(random.point([0.0; 3], 3.0), random.point([0.0; 3], 3.0));
        let mut found = Vec::new();
        out_of_core.for_each_voxel_in(&region, |voxel| found.push(voxel.index)).unwrap();
        found.sort_unstable();
        let inside: Vec<_> = all.iter().copied().filter(|&v| region.contains(grid.center_m(v))).collect();
        assert_eq!(found, inside);

        let center = random.point([0.0; 3], 4.0);
        let radius_m = random.between(0.0, 0.6);
        let touches = |voxel: &VoxelIndex| {
            let corner = voxel.map(|k| f64::from(k) * grid.resolution_m());
            let far = voxel.map(|k| f64::from(k + 1) * grid.resolution_m());
            Aabb { min: corner, max: far }.distance_squared(center) <= radius_m * radius_m
        };
        let sphere = Shape::Sphere { center, radius_m };
        let answer = out_of_core.collision(&sphere, UnknownAs::Free).unwrap().map(|hit| hit.voxel);
        assert_eq!(answer.is_some(), occupied.iter().any(touches));
        assert!(answer.is_none_or(|voxel| occupied.contains(&voxel) && touches(&voxel)));
        let strict = map.collision(&sphere, UnknownAs::Obstacle).unwrap().map(|hit| hit.voxel);
        assert!(answer.is_none() || strict.is_some());
        assert!(
            strict
                .is_none_or(|voxel| !matches!(occupancy(&map, voxel), Occupancy::Free(_)) && touches(&voxel))
        );
        let cube = Shape::Box(region);
        assert_eq!(
            map.collision(&cube, UnknownAs::Free).unwrap().is_some(),
            out_of_core.collision(&cube, UnknownAs::Free).unwrap().is_some()
        );

        let max_distance_m = random.between(0.1, 3.0);
        let distance =
            |v: &VoxelIndex| (0..3).map(|k| (grid.center_m(*v)[k] - center[k]).powi(2)).sum::<f64>().sqrt();
        let nearest = occupied
            .iter()
            .map(|v| (distance(v), *v))
            .filter(|(distance, _)| *distance <= max_distance_m)
            .min_by(|a, b| a.partial_cmp(b).unwrap());
        let answer = out_of_core.nearest_occupied(center, max_distance_m).unwrap();
        assert_eq!(answer.map(|nearest| (nearest.distance_m, nearest.voxel)), nearest);
    }
}

/// Sensor models in which one miss lowers the log-odds much, hardly, or raises them.
fn models() -> [SensorModel; 4] {
    let plain = LogOdds::default();
    [
        SensorModel::LogOdds(plain),
        SensorModel::LogOdds(LogOdds { miss: -0.02, ..plain }),
        SensorModel::LogOdds(LogOdds { min: 0.3, ..plain }),
        SensorModel::Iwlo(Iwlo { adaptive: true, ..Iwlo::default() }),
    ]
}

#[test]
fn occupied_voxels_of_a_map_on_disk_are_those_of_its_tables_in_their_order() {
    let folder = TempDir::new().unwrap();
    let iwlo = SensorModel::Iwlo(Iwlo::default());
    for (name, config) in [
        ("octomap", config()),
        ("compact", config().with_storage(Storage::Compact)),
        ("rare", config().with_sensor_model(iwlo).with_storage(Storage::Compact)),
    ] {
        let path = folder.path().join(name);
        let mut mapper = OutOfCoreTileMapper::create(&path, config).unwrap();
        for seed in 0..5 {
            mapper.insert_scan(&random_scan(&mut Random(seed), [0.2, 0.1, -0.3], 60)).unwrap();
        }
        mapper.flush().unwrap();
        let region = Aabb { min: [-1.55, -2.0, -3.0], max: [2.0, 1.51, 0.4] };
        let grid = mapper.config().grid;
        let mut count = 0;
        for threads in [1, 5] {
            // With some of the tiles in memory.
            let reader = MapReader::open(&path, 100_000).unwrap();
            reader.occupancy_at([0.0; 3]).unwrap();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for least in [None, Some(0.0), Some(0.3), Some(0.999), Some(1.0)] {
                for region in [None, Some(&region)] {
                    let mut expected = Vec::new();
                    for tile in reader.tiles() {
                        let tile = tile.unwrap();
                        let from = match least {
                            None => reader.config().occupied_log_odds(),
                            Some(0.0) => f64::NEG_INFINITY,
                            Some(1.0) => f64::INFINITY,
                            Some(least) => (least / (1.0_f64 - least)).ln(),
                        };
                        expected.extend(tile.voxels().filter(|voxel| {
                            voxel.evidence.log_odds >= from
                                && region.is_none_or(|region| region.contains(grid.center_m(voxel.index)))
                        }));
                    }
                    let mut found = Vec::new();
                    pool.install(|| reader.for_each_occupied(least, region, |voxel| found.push(voxel)))
                        .unwrap();
                    assert!(found == expected, "{name} {threads} {least:?} {region:?}");
                    count += found.len();
                }
            }
        }
        assert!(count > 10_000, "{count}");
    }
}

/// Compares rays, nearest and occupied voxels with a search over all voxels.
fn check_by_every_voxel(map: &impl MapView, random: &mut Random) {
    let (grid, occupied_from) = (map.config().grid, map.config().occupied_log_odds());
    let log_odds = |(bits, _): (u64, i32)| f64::from_bits(bits);
    let all: HashMap<VoxelIndex, f64> =
        voxels_of(map).into_iter().map(|(voxel, evidence)| (voxel, log_odds(evidence))).collect();
    let mut occupied: Vec<VoxelIndex> =
        all.iter().filter(|(_, log_odds)| **log_odds >= occupied_from).map(|(voxel, _)| *voxel).collect();
    let mut listed: Vec<VoxelIndex> =
        map.all_occupied_voxels(None).unwrap().iter().map(|voxel| voxel.index).collect();
    let mut in_region = Vec::new();
    let region = Aabb { min: [-100.0; 3], max: [100.0; 3] };
    map.for_each_occupied(None, Some(&region), |voxel| in_region.push(voxel.index)).unwrap();
    [&mut occupied, &mut listed, &mut in_region].into_iter().for_each(|voxels| voxels.sort_unstable());
    assert_eq!((&listed, &in_region), (&occupied, &occupied));
    for number in 0..60 {
        let origin = random.point([0.0; 3], 4.0);
        let direction = random.point([0.0; 3], 1.0);
        let unknown = if number % 4 == 0 { UnknownAs::Obstacle } else { UnknownAs::Free };
        let query = RayQuery { origin, direction, max_range_m: Some(9.0), unknown };
        let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
        let unit = grid.to_voxel_units(direction.map(|d| d / length));
        let mut walk = RayWalk::along(grid.to_voxel_units(origin), grid.voxel_of(origin).unwrap(), unit);
        let stopped = loop {
            if walk.entry_time() > 9.0 {
                break None;
            }
            let log_odds = all.get(&walk.voxel());
            if log_odds.map_or(unknown == UnknownAs::Obstacle, |log_odds| *log_odds >= occupied_from) {
                break Some((walk.voxel(), walk.entry_time()));
            }
            walk.advance();
        };
        let answer = map.cast_ray(&query).unwrap();
        assert_eq!(answer.map(|hit| (hit.voxel, hit.distance_m)), stopped, "{query:?}");
        let end = std::array::from_fn(|k| origin[k] + 2.0 * direction[k]);
        let [from, to] =
            [origin, end].map(|point| (grid.to_voxel_units(point), grid.voxel_of(point).unwrap()));
        let mut walk = RayWalk::between(from.0, from.1, to.0, to.1);
        let stopped = loop {
            let log_odds = all.get(&walk.voxel());
            if log_odds.map_or(unknown == UnknownAs::Obstacle, |log_odds| *log_odds >= occupied_from) {
                break Some(walk.voxel());
            }
            if walk.is_at_end() {
                break None;
            }
            walk.advance();
        };
        let answer = map.cast_segment(origin, end, unknown).unwrap();
        assert_eq!(answer.map(|hit| hit.voxel), stopped, "{origin:?} to {end:?}");
        let distance =
            |v: &VoxelIndex| (0..3).map(|k| (grid.center_m(*v)[k] - origin[k]).powi(2)).sum::<f64>().sqrt();
        let nearest = occupied.iter().map(|v| (distance(v), *v)).filter(|(distance, _)| *distance <= 2.0);
        let nearest = nearest.min_by(|a, b| a.partial_cmp(b).unwrap());
        let answer = map.nearest_occupied(origin, 2.0).unwrap();
        assert_eq!(answer.map(|hit| (hit.distance_m, hit.voxel)), nearest);
    }
}

#[test]
fn rays_skip_only_free_space() {
    let mut random = Random(70);
    for (number, model) in models().into_iter().enumerate() {
        for threshold in [0.2, 0.4, 0.485, 0.4878, 0.5, 0.7, 0.95] {
            let folder = TempDir::new().unwrap();
            // Tiles of three blocks of bricks and a fraction along each edge.
            let mut config = MapConfig::new(0.1, 10.0).unwrap();
            (config.sensor_model, config.occupancy_threshold) = (model, threshold);
            config.rays.insert_mode = if number % 2 == 0 { InsertMode::PerScan } else { InsertMode::PerRay };
            let storage = if threshold < 0.49 { Storage::Compact } else { Storage::OctoMap };
            let path = folder.path().join("map");
            let disk = MapPath::on(UnsyncedDisk::shared(), &path);
            let mut mapper = OutOfCoreTileMapper::create(disk, config.with_storage(storage)).unwrap();
            for seed in 0..3 {
                let from = random.point([0.0; 3], 2.0);
                mapper.insert_scan(&random_scan(&mut Random(seed), from, 60)).unwrap();
            }
            // As built, with summaries of every brick, and as loaded from disk.
            check_by_every_voxel(&mapper, &mut random);
            mapper.flush().unwrap();
            check_by_every_voxel(&mapper, &mut random);
            drop(mapper);
            check_by_every_voxel(&MapReader::open(&path, 1 << 30).unwrap(), &mut random);
        }
    }
}

#[test]
fn results_of_many_points_are_in_their_order() {
    let folder = TempDir::new().unwrap();
    let (map, mut out_of_core) = maps(&folder);
    out_of_core.flush().unwrap();
    let mut random = Random(70);
    // More points of a tile than are queried at a time, and more than are grouped at a time.
    let mut points: Vec<_> = (0..70_000).map(|_| random.point([0.0; 3], 4.0)).collect();
    points[7] = [f64::NAN; 3];
    points[8] = [1e300, 0.0, 0.0];
    let occupied = map.all_occupied_voxels(None).unwrap();
    points.extend(occupied.iter().map(|voxel| map.config().grid.center_m(voxel.index)));
    let reader = MapReader::open(folder.path().join("map"), 100_000).unwrap();
    let live = out_of_core.reader().unwrap();
    let one_by_one: Vec<_> = points.iter().map(|&point| map.occupancy_at(point).unwrap()).collect();
    assert!(one_by_one.iter().any(Occupancy::is_occupied) && one_by_one.contains(&Occupancy::Unknown));
    let evidence: Vec<_> =
        points.iter().map(|&point| map.voxel_at(point).unwrap().map(|voxel| voxel.evidence)).collect();
    let mut in_order: Vec<usize> = (0..points.len()).collect();
    in_order.sort_by_key(|&number| map.config().grid.tile_of(points[number]));
    for order in [(0..points.len()).collect(), in_order] {
        let points: Vec<_> = order.iter().map(|&number| points[number]).collect();
        let expected: Vec<_> = order.iter().map(|&number| one_by_one[number]).collect();
        assert!(map.occupancy_at_points(&points).unwrap() == expected);
        assert!(out_of_core.occupancy_at_points(&points).unwrap() == expected);
        assert!(reader.occupancy_at_points(&points).unwrap() == expected);
        assert!(live.occupancy_at_points(&points).unwrap() == expected);
        let expected: Vec<_> = order.iter().map(|&number| evidence[number]).collect();
        assert!(map.evidence_at_points(&points).unwrap() == expected);
        assert!(out_of_core.evidence_at_points(&points).unwrap() == expected);
        assert!(reader.evidence_at_points(&points).unwrap() == expected);
    }
    assert!(out_of_core.evidence_at_points(&[]).unwrap().is_empty());
    assert_eq!(out_of_core.evidence_at_points(&[[f64::NAN; 3]; 2]).unwrap(), [None, None]);
    assert_eq!(map.evidence_at_points(&[[f64::NAN; 3]; 2]).unwrap(), [None, None]);
}

#[test]
fn the_merged_octree_has_every_voxel_and_rejects_voxels_beyond_octomaps_keys() {
    let folder = TempDir::new().unwrap();
    let (mut map, out_of_core) = maps(&folder);
    let tree = out_of_core.merged_octree(None, 1 << 20).unwrap();
    let voxels = voxels_of(&map);
    assert_eq!(tree.expanded_leaf_count(), voxels.len() as u64);
    for (voxel, (bits, _)) in &voxels {
        let code: MortonCode = VoxelKey::from_index(*voxel).morton();
        assert_eq!(tree.get(code, 16), Some(f64::from_bits(*bits) as f32));
    }
    assert!(out_of_core.merged_octree(None, 10).unwrap_err().to_string().contains("limit of 10"));
    map.insert_scan(&random_scan(&mut Random(1), [4000.0, 0.0, 0.0], 5)).unwrap();
    let message = map.merged_octree(None, 1 << 20).unwrap_err().to_string();
    assert!(message.contains("`region`"), "{message}");
    let region = Aabb { min: [-9.0; 3], max: [9.0; 3] };
    assert_eq!(map.merged_octree(Some(&region), 1 << 20).unwrap().expanded_leaf_count(), voxels.len() as u64);
}

#[test]
fn invalid_queries_are_errors_with_a_reason() {
    let map = InMemoryMapper::new(config()).unwrap();
    let query =
        RayQuery { origin: [0.0; 3], direction: [0.0; 3], max_range_m: None, unknown: UnknownAs::Free };
    assert!(map.cast_ray(&query).unwrap_err().to_string().starts_with("direction"));
    assert!(map.cast_ray(&RayQuery { origin: [f64::NAN; 3], ..query }).is_err());
    assert_eq!(map.cast_ray(&RayQuery { direction: [1.0; 3], ..query }).unwrap(), None);
    assert!(map.occupancy_at_depth([0.0; 3], 17).is_err() && map.occupancy_at_depth([0.0; 3], 0).is_err());
    assert!(map.nearest_occupied([0.0; 3], f64::NAN).is_err());
    let endless = Shape::Sphere { center: [0.0; 3], radius_m: f64::INFINITY };
    assert!(map.collision(&endless, UnknownAs::Free).is_err());
    let huge = Shape::Sphere { center: [0.0; 3], radius_m: 1e6 };
    assert!(map.collision(&huge, UnknownAs::Obstacle).unwrap_err().to_string().contains("limit"));
    assert_eq!(map.collision(&huge, UnknownAs::Free).unwrap(), None);
    for (from, to) in [([f64::NAN, 0.0, 1.0], [2.0, 0.0, 1.0]), ([0.0; 3], [0.0, f64::INFINITY, 0.0])] {
        let swept = Shape::SweptSphere { from, to, radius_m: 0.3 };
        assert!(map.collision(&swept, UnknownAs::Free).unwrap_err().to_string().contains("not finite"));
    }
    for unknown in [UnknownAs::Free, UnknownAs::Obstacle] {
        let swapped = Shape::Box(Aabb { min: [0.0, 1.0, 0.0], max: [1.0, 0.5, 1.0] });
        let message = map.collision(&swapped, unknown).unwrap_err().to_string();
        assert!(message.contains("below the lower one"), "{message}");
    }
}

#[test]
fn a_ray_with_a_tiny_component_of_its_direction_ends_and_hits_the_wall() {
    let mut map = InMemoryMapper::new(config()).unwrap();
    // A wall of one layer of voxels in front of a sensor that is on a border of voxels.
    let wall = (-5..5).map(|y| [2.05, 0.1 * f64::from(y) + 0.05, 0.05]).collect();
    map.insert_scan(&Scan { origin: [0.05, 0.05, 0.05], points: wall, intensities: None }).unwrap();
    for slow in [-1e-310, -f64::from_bits(1), 1e-310, -1e-300] {
        for max_range_m in [None, Some(5.0)] {
            let (origin, direction) = ([0.05, 0.0, 0.05], [1.0, slow, 0.0]);
            let query = RayQuery { origin, direction, max_range_m, unknown: UnknownAs::Free };
            let hit = map.cast_ray(&query).unwrap().expect("the wall");
            assert_eq!(hit.voxel, [20, if slow < 0.0 { -1 } else { 0 }, 0], "{slow}");
        }
    }
    let scan = Scan { origin: [0.0; 3], points: vec![[1.05, -1e-310, 0.0]], intensities: None };
    for insert_mode in [InsertMode::PerScan, InsertMode::PerRay] {
        let config = config().with_insert_mode(insert_mode);
        let mut map = InMemoryMapper::new(config.clone()).unwrap();
        map.insert_scan(&scan).unwrap();
        let mut naive = ReferenceMap::new(&config);
        naive.insert_scan(&scan);
        assert_eq!(voxels_of(&map), naive.voxels);
        assert_eq!(naive.voxels.len(), 12);
    }
}

#[test]
fn nearest_loads_each_tile_of_free_space_once() {
    let folder = TempDir::new().unwrap();
    let config = config().with_range(0.0, 30.0).with_cache_tiles(1);
    let mut map = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
    // Only free space.
    let scan = Scan { origin: [0.05; 3], points: vec![[100.0, 0.05, 0.05]], intensities: None };
    map.insert_scan(&scan).unwrap();
    map.flush().unwrap();
    let tiles = map.tile_indices().len() as u64;
    assert_eq!(map.nearest_occupied([0.5; 3], f64::INFINITY).unwrap(), None);
    let loads = map.statistics().io.loads;
    assert!(tiles > 20 && loads < 10 * tiles, "{loads} loads of {tiles} tiles");
}

#[test]
fn a_tile_filled_by_a_pruned_cube_fits_into_memory() {
    // One leaf of 2^45 voxels, below the root.
    let header = "# Octomap OcTree binary file\nid OcTree\nsize 2\nres 0.01\ndata\n";
    let file = [header.as_bytes(), &[1, 0]].concat();
    let map = OctreeMap::of(read(&*file).unwrap()).unwrap();
    assert_eq!(map.config().grid.voxels_per_tile_edge(), 400);
    assert!(matches!(map.occupancy_at([-1.0; 3]).unwrap(), Occupancy::Free(_)));
    assert!(matches!(map.occupancy_at([1.0; 3]).unwrap(), Occupancy::Unknown));
}

/// Computes columns from every voxel of the map.
fn naive_columns(map: &impl MapView, region: &Aabb, heights_m: [f64; 2]) -> BTreeMap<[i32; 2], Column> {
    let (grid, occupied_from) = (map.config().grid, map.config().occupied_log_odds());
    let half_m = 0.5 * grid.resolution_m();
    let mut columns = BTreeMap::new();
    for (voxel @ [x, y, _], (bits, _)) in voxels_of(map) {
        let center_m @ [_, _, z_m] = grid.center_m(voxel);
        if !region.contains(center_m) {
            continue;
        }
        let column = columns.entry([x, y]).or_insert(Column::Unknown);
        if z_m + half_m > heights_m[0] && z_m - half_m < heights_m[1] {
            let is_occupied = f64::from_bits(bits) >= occupied_from || *column == Column::Occupied;
            *column = if is_occupied { Column::Occupied } else { Column::Free };
        }
    }
    columns
}

#[test]
fn columns_from_above_are_those_of_every_voxel() {
    let folder = TempDir::new().unwrap();
    let (in_memory, out_of_core) = maps(&folder);
    let mut random = Random(70);
    let mut found = [0; 3];
    for number in 0..60 {
        let reach_m = random.between(0.1, 6.0);
        let corner = random.point([0.0; 3], 4.0);
        let region = match number {
            0 => Aabb { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] },
            // Borders through voxel centers.
            1..10 => Aabb { min: [-1.05, -0.95, -2.05], max: [1.05, 1.15, 0.05] },
            _ => Aabb { min: corner, max: corner.map(|at| at + reach_m) },
        };
        let from_m = random.between(-3.0, 2.0);
        let heights_m = match number % 3 {
            0 => [f64::NEG_INFINITY, f64::INFINITY],
            1 => [from_m, from_m + random.between(0.0, 2.0)],
            _ => [-0.5, 0.3],
        };
        let naive = naive_columns(&in_memory, &region, heights_m);
        let columns = in_memory.columns_in(&region, heights_m).unwrap();
        assert_eq!(out_of_core.columns_in(&region, heights_m).unwrap(), columns);
        let ([x, y], [width, height]) = (columns.first(), columns.size());
        let along = |k: usize| naive.keys().map(move |column| column[k]);
        let least = [0, 1].map(|k| along(k).min().unwrap_or(0));
        let size = [0, 1].map(|k| along(k).max().map_or(0, |most| (most - least[k]) as usize + 1));
        assert_eq!(([x, y], [width, height]), (least, size), "{region:?}");
        assert_eq!(columns.states().len(), width * height);
        for (number, &state) in columns.states().iter().enumerate() {
            let column = [x + (number % width) as i32, y + (number / width) as i32];
            assert_eq!(state, naive.get(&column).copied().unwrap_or(Column::Unknown), "{column:?}");
            found[state as usize] += 1;
        }
    }
    assert!(found.iter().all(|count| *count > 100), "{found:?}");
}
