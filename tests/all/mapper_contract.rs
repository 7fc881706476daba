use std::collections::BTreeMap;
use testkit::memory_folder::memory_folder;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, voxels_of};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::mapper::{InMemoryMapper, MapReader, MapView, Mapper, OutOfCoreTileMapper};
use voxtile::query::{MapQueries, Queries};
use voxtile::scan::PointBatch;
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::space::{TileIndex, VoxelKey};
use voxtile::{Clearing, Guard, InsertMode, MapConfig, MapPath, Storage, VoxelCacheConfig, VoxelCacheMode};
use voxtile_simulation::Survey;

/// Small tiles, so that a scan of a few metres touches several.
fn config() -> MapConfig {
    MapConfig::new(0.1, 1.6).unwrap()
}

fn configs() -> Vec<MapConfig> {
    let mut configs = Vec::new();
    for sensor_model in [SensorModel::default(), SensorModel::Iwlo(Iwlo::default())] {
        for insert_mode in [InsertMode::PerScan, InsertMode::PerRay] {
            let config = config().with_sensor_model(sensor_model).with_insert_mode(insert_mode);
            configs.push(config.with_range(0.5, 3.0));
        }
        let guarded = config().with_sensor_model(sensor_model).with_range(0.5, 3.0);
        configs.push(guarded.with_clearing(Clearing::Guarded(Guard::default())));
    }
    configs
}

/// Inserts the scans and batches of a seeded drive with revisits.
fn drive(mapper: &mut impl Mapper, reference: &mut ReferenceMap, seed: u64, steps: usize) {
    let mut random = Random(seed);
    for step in 0..steps {
        let center = [1.5 * f64::from((step % 4) as u8), -2.0, 0.3];
        let scan = random_scan(&mut random, center, 60);
        if step % 3 == 2 {
            let is_occupied: Vec<bool> = scan.points.iter().map(|_| random.below(2) == 0).collect();
            let intensities = scan.intensities.as_deref();
            let batch = PointBatch { points: &scan.points, intensities, is_occupied: &is_occupied };
            mapper.batch_update(&batch).unwrap();
            reference.batch_update(&batch);
        } else {
            let report = mapper.insert_scan(&scan).unwrap();
            assert_eq!(report.points, 60);
            reference.insert_scan(&scan);
        }
        assert_eq!(mapper.scan_number(), step as u64 + 1);
    }
}

#[test]
fn in_memory_equals_the_naive_map() {
    for (seed, config) in configs().into_iter().enumerate() {
        let mut reference = ReferenceMap::new(&config);
        let mut mapper = InMemoryMapper::new(config).unwrap();
        drive(&mut mapper, &mut reference, seed as u64, 24);
        assert!(reference.voxels.len() > 1000);
        assert_eq!(voxels_of(&mapper), reference.voxels);
    }
}

#[test]
fn out_of_core_equals_the_naive_map_for_any_cache_and_after_flush_and_reopen() {
    for (seed, config) in configs().into_iter().enumerate() {
        let mut digests = Vec::new();
        use Storage::{Compact, OctoMap};
        let kinds = [(1, 0, OctoMap), (1, 1 << 20, Compact), (3, 20_000, OctoMap), (10_000, 0, Compact)];
        for (cache_tiles, write_buffer_bytes, storage) in kinds {
            let folder = memory_folder();
            let config =
                config.clone().with_cache_tiles(cache_tiles).with_write_buffer_bytes(write_buffer_bytes);
            let config = config.with_storage(storage);
            let mut reference = ReferenceMap::new(&config);
            let mut mapper = OutOfCoreTileMapper::create(
                MapPath::on(UnsyncedDisk::shared(), folder.path().join("map")),
                config.clone(),
            )
            .unwrap();
            drive(&mut mapper, &mut reference, seed as u64, 12);
            assert_eq!(voxels_of(&mapper), reference.voxels, "before flush");
            assert!(mapper.cached_tile_indices().len() <= cache_tiles);
            if cache_tiles == 3 {
                // Some updates are still in the write buffer.
                assert_coarse_answers_are_maxima(&mapper);
            }
            let unsaved = mapper.digest().unwrap();
            mapper.flush().unwrap();
            assert_eq!(voxels_of(&mapper), reference.voxels, "after flush");
            drop(mapper);

            let mut mapper = OutOfCoreTileMapper::open(
                MapPath::on(UnsyncedDisk::shared(), folder.path().join("map")),
                config.clone().with_storage(OctoMap),
            )
            .unwrap();
            // A map keeps its storage, although another one was requested.
            assert_eq!(mapper.config().storage, storage);
            assert_eq!(mapper.digest().unwrap(), unsaved);
            assert_eq!(mapper.scan_number(), 12);
            let mut random = Random(99);
            for _ in 0..4 {
                let scan = random_scan(&mut random, [3.0, -2.0, 0.0], 40);
                mapper.insert_scan(&scan).unwrap();
                reference.insert_scan(&scan);
            }
            assert_eq!(voxels_of(&mapper), reference.voxels, "after reopening");
            mapper.flush().unwrap();
            let reader = MapReader::open(folder.path().join("map"), 20_000).unwrap();
            assert_eq!(voxels_of(&reader), reference.voxels, "by a reader");
            assert_eq!(reader.voxel_counts().unwrap().0, reference.voxels.len() as u64);
            digests.push(reader.digest().unwrap());
        }
        assert!(digests.windows(2).all(|pair| pair[0] == pair[1]));
    }
}

/// Rays that leave the window around the sensor, in which updates are collected in dense pages.
#[test]
fn very_distant_points_are_mapped_like_others() {
    for mode in [InsertMode::PerScan, InsertMode::PerRay] {
        let config = MapConfig::new(0.1, 10.0).unwrap().with_insert_mode(mode);
        let mut scan = random_scan(&mut Random(5), [0.05, 0.0, 1.0], 50);
        scan.points.extend([[1500.3, 900.1, 40.7], [1500.3, 900.1, 40.7], [-1.0, -2100.0, 0.2]]);
        scan.intensities = None;
        let mut reference = ReferenceMap::new(&config);
        let mut mapper = InMemoryMapper::new(config).unwrap();
        for _ in 0..2 {
            reference.insert_scan(&scan);
            mapper.insert_scan(&scan).unwrap();
        }
        assert_eq!(voxels_of(&mapper), reference.voxels, "{mode:?}");
    }
}

/// Enough rays for several threads, in all modes.
#[test]
fn maps_do_not_depend_on_the_number_of_threads() {
    let scans: Vec<_> = Survey::street(3).take(2).collect();
    for mode in [InsertMode::PerScan, InsertMode::PerRay] {
        for model in [SensorModel::default(), SensorModel::Iwlo(Iwlo::default())] {
            let config = MapConfig::new(0.5, 8.0).unwrap().with_sensor_model(model).with_insert_mode(mode);
            let build = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
                    let reports = scans.iter().map(|scan| mapper.insert_scan(scan).unwrap());
                    (reports.collect::<Vec<_>>(), mapper.digest().unwrap())
                })
            };
            let alone = build(1);
            for threads in [2, 4] {
                assert_eq!(build(threads), alone, "{mode:?}, {threads} threads");
            }
            let mut reference = ReferenceMap::new(&config);
            scans.iter().for_each(|scan| reference.insert_scan(scan));
            let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
            for scan in &scans {
                mapper.insert_scan(scan).unwrap();
            }
            assert_eq!(voxels_of(&mapper), reference.voxels, "{mode:?}");
        }
    }
}

#[test]
fn all_forms_of_octrees_agree_and_coarse_answers_are_the_maxima_of_the_table() {
    let mut digests = Vec::new();
    let mut nodes = Vec::new();
    let cached = [(1, Some(1)), (2, Some(64)), (4, None), (16, Some(4096))];
    let cached = cached.map(|(tau, buckets)| {
        config().with_voxel_cache(VoxelCacheMode::Serial(VoxelCacheConfig::new(tau, buckets)))
    });
    for config in cached.into_iter().chain([config()]) {
        let mut mapper = InMemoryMapper::new(config).unwrap();
        let mut random = Random(5);
        for step in 0..10 {
            mapper.insert_scan(&random_scan(&mut random, [0.0, 0.0, 0.0], 50)).unwrap();
            if step == 6 {
                mapper.sync_octrees();
            }
            assert_coarse_answers_are_maxima(&mapper);
        }
        digests.push(mapper.digest().unwrap());
        mapper.sync_octrees();
        nodes.push(mapper.statistics().cached.octree_nodes);
    }
    assert!(digests.windows(2).all(|pair| pair[0] == pair[1]));
    assert!(nodes.windows(2).all(|pair| pair[0] == pair[1]), "{nodes:?}");
}

fn assert_coarse_answers_are_maxima(view: &impl MapView) {
    for depth in [1, 9, 11, 13, 14, 15, 16] {
        let mut maxima: BTreeMap<[i32; 3], f32> = BTreeMap::new();
        for (voxel, (bits, _)) in voxels_of(view) {
            let log_odds = f64::from_bits(bits) as f32;
            let max = maxima.entry(voxel.map(|index| index >> (16 - depth))).or_insert(log_odds);
            *max = max.max(log_odds);
        }
        for (node, max) in maxima.into_iter().step_by(7) {
            let first = node.map(|index| index << (16 - depth));
            // The center of the node, whose voxel may be known or unknown.
            let point = view.config().grid.center_m(first.map(|index| index + (1 << (16 - depth)) / 2));
            let answer = view.occupancy_at_depth(point, depth as u8).unwrap().probability();
            if depth == 16 {
                // At the finest depth the answer is that of the voxel itself.
                assert_eq!(answer, view.occupancy_at(point).unwrap().probability(), "node {node:?}");
                continue;
            }
            assert_eq!(answer, Some(voxtile::maths::sigmoid(f64::from(max))), "depth {depth}, node {node:?}");
        }
    }
}

#[test]
fn a_failed_call_changes_nothing_and_uses_no_scan_number() {
    let config = config().with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
    let mut mapper = InMemoryMapper::new(config).unwrap();
    let mut random = Random(1);
    let mut scan = random_scan(&mut random, [0.0; 3], 30);
    mapper.insert_scan(&scan).unwrap();
    let before = mapper.digest().unwrap();
    scan.intensities.as_mut().unwrap().pop();
    assert!(mapper.insert_scan(&scan).unwrap_err().to_string().contains("29 for 30 points"));
    scan.intensities = None;
    assert!(mapper.insert_scan(&scan).unwrap_err().to_string().contains("needs an intensity"));
    scan.origin[1] = f64::NAN;
    assert!(mapper.insert_scan(&scan).is_err());
    let batch = PointBatch { points: &scan.points, intensities: Some(&[1.0; 30]), is_occupied: &[true; 3] };
    assert!(mapper.batch_update(&batch).unwrap_err().to_string().contains("is_occupied"));
    assert_eq!((mapper.scan_number(), mapper.digest().unwrap()), (1, before));
}

#[test]
fn every_cause_of_a_skipped_point_is_counted() {
    let config = config().with_sensor_model(SensorModel::Iwlo(Iwlo::default())).with_range(1.0, None);
    let mut mapper = InMemoryMapper::new(config).unwrap();
    let origin = [0.25; 3];
    let points = vec![
        [f64::NAN; 3],
        [f64::INFINITY; 3],
        origin,
        [0.3; 3],
        [1e12, 0.0, 0.0],
        [2e5, 0.0, 0.0],
        [2.0; 3],
        [3.0; 3],
    ];
    let intensities = Some(vec![90.0, 90.0, 90.0, 90.0, 90.0, 90.0, f32::NAN, 90.0]);
    let report = mapper.insert_scan(&voxtile::Scan { origin, points, intensities }).unwrap();
    let skipped = report.skipped;
    assert_eq!((skipped.not_finite, skipped.no_return, skipped.too_near), (2, 1, 1));
    assert_eq!((skipped.out_of_range, skipped.ray_too_long, skipped.no_intensity), (1, 1, 1));
    assert_eq!((skipped.total(), report.hits), (7, 1));
}

#[test]
fn an_echo_without_weight_does_not_update_its_voxel() {
    let config = config().with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
    let mut mapper = InMemoryMapper::new(config).unwrap();
    let scan =
        voxtile::Scan { origin: [0.05; 3], points: vec![[0.55, 0.05, 0.05]], intensities: Some(vec![20.0]) };
    let report = mapper.insert_scan(&scan).unwrap();
    assert_eq!((report.hits, report.misses), (0, 5));
    assert!(mapper.voxel_at([0.55, 0.05, 0.05]).unwrap().is_none());
}

#[test]
fn dirty_and_saved_tiles_are_reported() {
    let folder = memory_folder();
    let config = config().with_cache_tiles(2);
    let mut mapper = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
    let points: Vec<_> = (0..5).map(|k| [1.6 * f64::from(k) + 0.6, 0.6, 0.6]).collect();
    mapper.batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &[true; 5] }).unwrap();
    assert!(mapper.is_dirty());
    let tile = |x| TileIndex::new(x, 0, 0);
    assert!((0..5).all(|x| mapper.is_tile_dirty(tile(x))));
    assert!(mapper.reload(tile(0), false).is_err());
    mapper.flush().unwrap();
    assert_eq!(mapper.take_saved_tiles(), (0..5).map(tile).collect::<Vec<_>>());
    assert_eq!(mapper.take_saved_tiles(), []);
    assert!(!mapper.is_dirty() && !(0..5).any(|x| mapper.is_tile_dirty(tile(x))));
    assert!(mapper.reload(tile(0), false).unwrap());
    assert!(!mapper.reload(tile(77), false).unwrap());
    assert_eq!(mapper.preload([tile(3), tile(4), tile(77)]).unwrap(), 2);
    assert_eq!(mapper.cached_tile_indices(), [tile(3), tile(4)]);
    assert!(mapper.tile_folder(tile(3)).join("octree.bt").is_file());
    assert_eq!(mapper.cached_occupied_voxels(None).unwrap().len(), 2);
    assert_eq!(mapper.all_occupied_voxels(None).unwrap().len(), 5);
}

#[test]
fn tiles_in_use_are_not_evicted() {
    let folder = memory_folder();
    let config = config().with_cache_tiles(2);
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), folder.path().join("map")), config)
            .unwrap();
    let points: Vec<_> = (0..5).map(|k| [1.6 * f64::from(k) + 0.6, 0.6, 0.6]).collect();
    mapper.batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &[true; 5] }).unwrap();
    mapper.flush().unwrap();
    let tile = |x| TileIndex::new(x, 0, 0);
    let held = mapper.tile(tile(0)).unwrap().unwrap();
    for x in 1..5 {
        assert_eq!(mapper.tile(tile(x)).unwrap().unwrap().table().len(), 1);
    }
    assert_eq!(mapper.cached_tile_indices(), [tile(0), tile(4)]);
    // All tiles are in use, so the cache exceeds its limit by one.
    let others = [mapper.tile(tile(4)).unwrap(), mapper.tile(tile(3)).unwrap()];
    assert_eq!(mapper.cached_tile_indices().len(), 3);
    assert_eq!((held.table().len(), others.len()), (1, 2));
}

#[test]
fn keys_on_disk_are_octomaps_and_in_morton_order() {
    let folder = memory_folder();
    let mut mapper = OutOfCoreTileMapper::create(folder.path().join("map"), config()).unwrap();
    mapper.insert_scan(&random_scan(&mut Random(3), [0.6; 3], 50)).unwrap();
    mapper.flush().unwrap();
    let path = mapper.tile_folder(TileIndex::new(0, 0, 0)).join("iwlo_meta.bin");
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(bytes[0..8], [0x4f, 0x4c, 0x57, 0x49, 1, 0, 0, 0]);
    let count = u64::from_le_bytes(bytes[8..16].try_into().unwrap()) as usize;
    let parameters = u32::from_le_bytes(std::array::from_fn(|k| bytes[16 + 18 * count + 60 + k])) as usize;
    assert_eq!(bytes.len(), 16 + 18 * count + 72 + parameters);
    let mut previous = None;
    for entry in bytes[16..16 + 18 * count].chunks(18) {
        let key: [u16; 3] = std::array::from_fn(|k| u16::from_le_bytes([entry[2 * k], entry[2 * k + 1]]));
        assert!(key.iter().all(|key| (32768..32768 + 16).contains(key)), "{key:?}");
        let code = VoxelKey(key).morton();
        assert!(previous < Some(code));
        previous = Some(code);
    }
}

/// The lowest tile is cut off at the lowest voxel index, and the next tile begins at its end.
#[test]
fn points_at_the_end_of_all_indices_are_in_their_own_tiles() {
    let config = MapConfig::new(0.1, 10.0).unwrap();
    let lowest = f64::from(i32::MIN) * 0.1;
    let mut points = vec![[lowest + 0.05, 5.05, 5.05], [lowest + 5.8, 5.05, 5.05]];
    for _ in 0..2 {
        let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
        mapper
            .batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &[true; 2] })
            .unwrap();
        assert_eq!(mapper.tile_indices().len(), 2);
        for &point in &points {
            let voxel = mapper.voxel_at(point).unwrap().unwrap();
            assert_eq!(voxel.evidence.observation_count, 1);
        }
        assert_eq!(mapper.all_occupied_voxels(None).unwrap().len(), 2);
        points.reverse();
    }
}
