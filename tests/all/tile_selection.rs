use std::path::PathBuf;
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use voxtile::query::MapQueries;
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::store::InputRecord;
use voxtile::{
    Aabb, Clearing, Error, Guard, InMemoryMapper, InsertMode, MapConfig, MapOptions, MapPath, MapReader,
    MapView, Mapper, OutOfCoreTileMapper, TileBox, TileIndex, TileSelection,
};
use voxtile_simulation::Survey;

fn configs() -> Vec<MapConfig> {
    let mut configs = Vec::new();
    for sensor_model in [SensorModel::default(), SensorModel::Iwlo(Iwlo::default())] {
        for insert_mode in [InsertMode::PerScan, InsertMode::PerRay] {
            let config = MapConfig::new(0.1, 1.6).unwrap().with_sensor_model(sensor_model);
            configs.push(config.with_insert_mode(insert_mode).with_range(0.5, 3.0));
        }
        let guarded = MapConfig::new(0.1, 1.6).unwrap().with_sensor_model(sensor_model).with_range(0.5, 3.0);
        configs.push(guarded.with_clearing(Clearing::Guarded(Guard::new(8).unwrap())));
    }
    configs
}

/// Returns some tiles around the drive, or a box of tiles.
fn random_selection(random: &mut Random) -> TileSelection {
    let [low, high] = [0, 0].map(|_| [0; 3].map(|_: i32| random.below(7) as i32 - 3));
    let corners = TileBox::new(
        std::array::from_fn(|k| low[k].min(high[k])).into(),
        std::array::from_fn(|k| low[k].max(high[k])).into(),
    );
    match random.below(3) {
        0 => corners.into(),
        _ => corners.tiles().filter(|_| random.below(3) == 0).collect(),
    }
}

/// Inserts a scan into the naive map, but only in the selected tiles.
fn insert_in(reference: &mut ReferenceMap, scan: &voxtile::Scan, tiles: &TileSelection) {
    let before = reference.voxels.clone();
    reference.insert_scan(scan);
    let grid = reference.config.grid;
    let is_selected = |voxel: &[i32; 3]| tiles.contains(grid.tile_of_voxel(*voxel));
    let outside = before.into_iter().filter(|(voxel, _)| !is_selected(voxel));
    reference.voxels.retain(|voxel, _| is_selected(voxel));
    reference.voxels.extend(outside);
}

#[test]
fn scans_in_selected_tiles_equal_the_naive_map_of_these_tiles() {
    for (seed, config) in (0..).zip(configs()) {
        let disk = FaultyDisk::new(Fault::None);
        let path = MapPath::on(disk.shared(), "map");
        let tight = config.clone().with_cache_tiles(2).with_write_buffer_bytes(20_000);
        let mut on_disk = OutOfCoreTileMapper::create(path, tight).unwrap();
        let mut in_memory = InMemoryMapper::new(config.clone()).unwrap();
        let mut reference = ReferenceMap::new(&config);
        let mut random = Random(seed);
        let mut selected = 0;
        for step in 0..30 {
            let center = [1.5 * f64::from((step % 4) as u8), -2.0, 0.3];
            let scan = random_scan(&mut random, center, 60);
            let reports = if step % 4 == 0 {
                reference.insert_scan(&scan);
                [in_memory.insert_scan(&scan).unwrap(), on_disk.insert_scan(&scan).unwrap()]
            } else {
                let tiles = random_selection(&mut random);
                let before = reference.voxels.len();
                insert_in(&mut reference, &scan, &tiles);
                selected += reference.voxels.len() - before;
                [
                    in_memory.insert_points_in(&scan, &tiles).unwrap(),
                    on_disk.insert_points_in(&scan, &tiles).unwrap(),
                ]
            };
            assert_eq!(reports[0], reports[1]);
            assert_eq!(reports[0].points, 60);
            assert!(voxels_of(&in_memory) == reference.voxels, "{seed} {step}");
        }
        assert!(selected > 300, "{selected}");
        assert!(voxels_of(&on_disk) == reference.voxels, "{seed}");
        on_disk.flush().unwrap();
        assert_eq!(on_disk.digest().unwrap(), in_memory.digest().unwrap());
    }
}

/// Returns boxes that partition space. Their faces are not at tile borders.
fn regions() -> Vec<Aabb> {
    let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
    let region = |min, max| Aabb { min, max };
    vec![
        region([low, low, low], [3.3, high, high]),
        region([3.3, low, low], [high, -4.0, high]),
        region([3.3, -4.0, low], [high, high, 0.77]),
        region([3.3, -4.0, 0.77], [high, high, high]),
    ]
}

#[test]
fn maps_of_regions_that_partition_space_merge_to_the_whole_map() {
    let scans: Vec<_> = Survey::street(3).take(4).collect();
    for sensor_model in [SensorModel::default(), SensorModel::Iwlo(Iwlo::default())] {
        for insert_mode in [InsertMode::PerScan, InsertMode::PerRay] {
            let config = MapConfig::new(0.2, 5.0).unwrap().with_sensor_model(sensor_model);
            let config = config.with_insert_mode(insert_mode).with_range(0.0, 30.0);
            let scan = |mut scan: voxtile::Scan| {
                scan.intensities = Some((0..scan.points.len()).map(|k| (k % 256) as f32).collect());
                scan
            };
            let scans: Vec<_> = scans.iter().cloned().map(scan).collect();
            let mut whole = InMemoryMapper::new(config.clone()).unwrap();
            for scan in &scans {
                whole.insert_scan(scan).unwrap();
            }

            let disk = FaultyDisk::new(Fault::None);
            let mut maps = Vec::new();
            for (number, region) in regions().iter().enumerate() {
                let tiles = TileBox::with_centers_in(region, &config.grid).unwrap();
                let path = PathBuf::from(format!("map_{number}"));
                let config = config.clone().with_region(tiles);
                let mut mapper =
                    OutOfCoreTileMapper::create(MapPath::on(disk.shared(), &path), config).unwrap();
                for scan in &scans {
                    mapper.insert_scan(scan).unwrap();
                }
                mapper.flush().unwrap();
                maps.push(MapReader::open(MapPath::on(disk.shared(), &path), 1 << 20).unwrap());
            }
            assert!(maps.iter().all(|map| map.voxel_counts().unwrap().0 > 1000));
            let merged = voxtile::operations::merge(&maps, "merged", None, |_, _| {}).unwrap();
            assert_eq!(merged.common_voxels, 0);
            let merged = MapReader::open(MapPath::on(disk.shared(), "merged"), 1 << 20).unwrap();
            assert_eq!(merged.digest().unwrap(), whole.digest().unwrap());
            assert_eq!(merged.config().rays.region, None);
        }
    }
}

#[test]
fn a_map_of_a_region_stores_it_and_refuses_another() {
    let disk = FaultyDisk::new(Fault::None);
    let region = TileBox::new([0, -1, -1].into(), [1, 0, 0].into());
    let config = MapConfig::new(0.1, 1.6).unwrap().with_region(region);
    let path = || MapPath::on(disk.shared(), "map");
    let mut random = Random(5);
    let scan = random_scan(&mut random, [1.0, -0.2, 0.1], 200);
    let mut mapper = MapOptions::new().config(config.clone()).create_if_missing(true).open(path()).unwrap();
    mapper.insert_scan(&scan).unwrap();
    mapper.flush().unwrap();
    drop(mapper);

    let found = MapReader::open(path(), 0).unwrap();
    assert_eq!(found.config().rays.region, Some(region));
    let mut reference = ReferenceMap::new(&config);
    reference.insert_scan(&scan);
    let is_inside = |voxel: &[i32; 3]| region.contains(config.grid.tile_of_voxel(*voxel));
    let inside: Voxels =
        reference.voxels.iter().filter(|(voxel, _)| is_inside(voxel)).map(|(v, e)| (*v, *e)).collect();
    assert!(!inside.is_empty() && inside.len() < reference.voxels.len());
    assert!(voxels_of(&found) == inside);

    let mut mapper = OutOfCoreTileMapper::open(path(), config.clone()).unwrap();
    mapper.check_rays(&InputRecord::default()).unwrap();
    // A selection applies within the region.
    let tiles = [TileIndex::new(0, 0, 0), TileIndex::new(-1, 0, 0)].into_iter().collect();
    mapper.insert_points_in(&scan, &tiles).unwrap();
    insert_in(&mut reference, &scan, &tiles);
    reference.voxels.retain(|voxel, _| is_inside(voxel));
    assert!(voxels_of(&mapper) == reference.voxels);
    drop(mapper);
    for other in [None, Some(TileBox::new([0, -1, -1].into(), [1, 0, 1].into()))] {
        let mapper = OutOfCoreTileMapper::open(path(), config.clone().with_region(other)).unwrap();
        let refused = mapper.check_rays(&InputRecord::default()).unwrap_err();
        assert!(matches!(refused, Error::Mismatch { .. }));
        assert!(refused.to_string().contains("tiles (0, -1, -1) to (1, 0, 0)"), "{refused}");
    }
}
