use std::collections::{BTreeMap, BTreeSet};
use testkit::memory_folder::memory_folder;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, voxels_of};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::scan::PointBatch;
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::space::{MortonCode, TileIndex, VoxelIndex, VoxelKey};
use voxtile::tile::{OctreeStatistics, VoxelCacheCounts};
use voxtile::{Clearing, Guard, InMemoryMapper, InsertMode, MapConfig, MapPath, MapQueries, MapView, Mapper};
use voxtile::{OutOfCoreTileMapper, VoxelCacheConfig, VoxelCacheMode};
use voxtile_simulation::Survey;

/// Every mode, with caches that hold nothing, little, and any number of voxels.
fn modes() -> Vec<VoxelCacheMode> {
    let shapes =
        [(1, Some(1)), (2, Some(64)), (4, None)].map(|(tau, buckets)| VoxelCacheConfig::new(tau, buckets));
    let cached =
        shapes.into_iter().flat_map(|shape| [VoxelCacheMode::Serial(shape), VoxelCacheMode::Parallel(shape)]);
    [VoxelCacheMode::Off].into_iter().chain(cached).collect()
}

/// Small tiles, so that a scan of a few metres touches many.
fn config() -> MapConfig {
    MapConfig::new(0.1, 1.6).unwrap().with_range(0.5, 3.0)
}

/// Returns the maximum log-odds of the known voxels in every node of a depth, by the lowest voxel's index over the
/// node's size.
fn maxima(reference: &ReferenceMap, depth: u8) -> BTreeMap<VoxelIndex, f32> {
    let mut maxima = BTreeMap::new();
    for (voxel, &(bits, _)) in &reference.voxels {
        let log_odds = f64::from_bits(bits) as f32;
        let max = maxima.entry(voxel.map(|index| index >> (16 - depth))).or_insert(log_odds);
        *max = max.max(log_odds);
    }
    maxima
}

/// Compares some nodes of a depth with the naive maxima.
fn assert_coarse_answers(mapper: &impl Mapper, reference: &ReferenceMap, depth: u8, step: usize) {
    for (node, max) in maxima(reference, depth).into_iter().step_by(step) {
        let point_m = mapper.config().grid.center_m(node.map(|index| index << (16 - depth)));
        let answer = mapper.occupancy_at_depth(point_m, depth).unwrap().probability();
        if depth == 16 {
            // At the finest depth the answer is that of the voxel itself.
            let exact = f64::from_bits(reference.voxels[&node].0);
            assert_eq!(answer, Some(voxtile::maths::sigmoid(exact)), "voxel {node:?}");
            continue;
        }
        assert_eq!(answer, Some(voxtile::maths::sigmoid(f64::from(max))), "node {node:?} of depth {depth}");
    }
}

/// Inserts a seeded drive with coarse queries in between.
fn drive(mapper: &mut impl Mapper, reference: &mut ReferenceMap, seed: u64) {
    let mut random = Random(seed);
    for step in 0..6 {
        let scan = random_scan(&mut random, [1.5 * f64::from(step % 3), -2.0, 0.3], 30);
        mapper.insert_scan(&scan).unwrap();
        reference.insert_scan(&scan);
        for depth in [1, 10, 12, 13, 15, 16] {
            assert_coarse_answers(mapper, reference, depth, 17);
        }
        if step == 3 {
            mapper.sync_octrees();
        }
    }
}

#[test]
fn every_mode_equals_the_naive_map_for_all_threads_and_mappers() {
    for threads in [1, 2, 4] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for (number, mode) in modes().into_iter().enumerate() {
            let insert_mode = [InsertMode::PerRay, InsertMode::PerScan][number % 2];
            let clearing = (number % 4 == 1).then(|| Clearing::Guarded(Guard::default()));
            let config =
                config().with_insert_mode(insert_mode).with_clearing(clearing).with_voxel_cache(mode);
            pool.install(|| {
                let mut reference = ReferenceMap::new(&config);
                let mut in_memory = InMemoryMapper::new(config.clone()).unwrap();
                drive(&mut in_memory, &mut reference, 3);
                assert_eq!(voxels_of(&in_memory), reference.voxels, "{mode:?}");

                let folder = memory_folder();
                let path = folder.path().join("map");
                let config = config.clone().with_cache_tiles(3).with_write_buffer_bytes(3000);
                let mut reference = ReferenceMap::new(&config);
                let mut mapper =
                    OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config.clone())
                        .unwrap();
                drive(&mut mapper, &mut reference, 3);
                mapper.flush().unwrap();
                assert_eq!(mapper.digest().unwrap(), in_memory.digest().unwrap(), "{mode:?}");
                drop(mapper);
                let mut mapper =
                    OutOfCoreTileMapper::open(MapPath::on(UnsyncedDisk::shared(), &path), config).unwrap();
                drive(&mut mapper, &mut reference, 4);
                assert_eq!(voxels_of(&mapper), reference.voxels, "{mode:?}");
            });
        }
    }
}

/// A scan of a lidar, with rays enough for several threads.
#[test]
fn the_map_of_a_street_is_the_same_with_any_octree() {
    let scans: Vec<_> = Survey::street(3).take(1).collect();
    for insert_mode in [InsertMode::PerScan, InsertMode::PerRay] {
        for model in [SensorModel::default(), SensorModel::Iwlo(Iwlo::default())] {
            let config =
                MapConfig::new(0.5, 8.0).unwrap().with_sensor_model(model).with_insert_mode(insert_mode);
            let digest = |config: MapConfig| {
                let mut mapper = InMemoryMapper::new(config).unwrap();
                let reports: Vec<_> = scans.iter().map(|scan| mapper.insert_scan(scan).unwrap()).collect();
                (reports, mapper.digest().unwrap())
            };
            let expected = digest(config.clone());
            for mode in modes() {
                assert_eq!(
                    digest(config.clone().with_voxel_cache(mode)),
                    expected,
                    "{mode:?}, {insert_mode:?}"
                );
            }
        }
    }
}

/// Runs one random life of a map with little memory, and compares it with the naive one.
fn live(seed: u64, mode: VoxelCacheMode) {
    let folder = memory_folder();
    let path = folder.path().join("map");
    let insert_mode = [InsertMode::PerScan, InsertMode::PerRay][seed as usize % 2];
    let config = config()
        .with_insert_mode(insert_mode)
        .with_voxel_cache(mode)
        .with_cache_tiles(1 + seed as usize * 7 % 40)
        .with_write_buffer_bytes(seed as usize % 3 * 4000);
    let mut random = Random(seed);
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config.clone()).unwrap();
    let mut reference = ReferenceMap::new(&config);
    for _ in 0..40 {
        match random.below(10) {
            0..4 => {
                let center = [random.between(-3.0, 3.0), 0.0, 0.0];
                let scan = random_scan(&mut random, center, 12);
                mapper.insert_scan(&scan).unwrap();
                reference.insert_scan(&scan);
            }
            4 => {
                let points: Vec<_> = (0..20).map(|_| random.point([0.0; 3], 2.0)).collect();
                let is_occupied: Vec<_> = points.iter().map(|_| random.below(2) == 0).collect();
                let batch = PointBatch { points: &points, intensities: None, is_occupied: &is_occupied };
                mapper.batch_update(&batch).unwrap();
                reference.batch_update(&batch);
            }
            5 => mapper.sync_octrees(),
            6 => mapper.flush().unwrap(),
            7 => {
                mapper.flush().unwrap();
                drop(mapper);
                mapper =
                    OutOfCoreTileMapper::open(MapPath::on(UnsyncedDisk::shared(), &path), config.clone())
                        .unwrap();
            }
            _ => assert_coarse_answers(&mapper, &reference, 1 + random.below(16) as u8, 29),
        }
    }
    assert_eq!(voxels_of(&mapper), reference.voxels, "seed {seed}, {mode:?}");
}

#[test]
fn random_lives_of_a_map_have_the_naive_maxima() {
    for (number, mode) in modes().into_iter().enumerate() {
        for seed in 0..4 {
            live(10 * number as u64 + seed, mode);
        }
    }
}

/// A cache as in section 4.2 of the paper, for the voxels of one tile.
#[derive(Default)]
struct NaiveCache {
    buckets: BTreeMap<u64, Vec<MortonCode>>,
    /// Counts since the last update of the octree.
    counts: VoxelCacheCounts,
}

impl NaiveCache {
    fn put(&mut self, code: MortonCode, buckets: u64) {
        let bucket = self.buckets.entry(code.0 % buckets).or_default();
        if bucket.contains(&code) {
            self.counts.hits += 1;
        } else {
            self.counts.misses += 1;
            bucket.push(code);
        }
    }

    fn evict(&mut self, tau: usize) {
        for bucket in self.buckets.values_mut().filter(|bucket| bucket.len() > tau) {
            self.counts.evictions += bucket.drain(..bucket.len() - tau).count() as u64;
        }
    }
}

#[test]
fn hits_misses_and_evictions_are_those_of_the_papers_stream_of_updates() {
    for (tau, buckets) in [(1, 1), (1, 16), (2, 64), (4, 128)] {
        let shape = VoxelCacheConfig::new(tau, buckets as usize);
        for mode in [VoxelCacheMode::Serial(shape), VoxelCacheMode::Parallel(shape)] {
            let config = config().with_insert_mode(InsertMode::PerRay).with_voxel_cache(mode);
            let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
            let mut reference = ReferenceMap::new(&config);
            let mut caches: BTreeMap<TileIndex, NaiveCache> = BTreeMap::new();
            let mut random = Random(21);
            for _ in 0..6 {
                let scan = random_scan(&mut random, [0.0; 3], 40);
                mapper.insert_scan(&scan).unwrap();
                reference.insert_scan(&scan);
                for voxel in std::mem::take(&mut reference.updated) {
                    let cache = caches.entry(config.grid.tile_of_voxel(voxel)).or_default();
                    cache.put(VoxelKey::from_index(voxel).morton(), buckets);
                }
                caches.values_mut().for_each(|cache| cache.evict(tau));
            }
            let mut expected = VoxelCacheCounts::default();
            caches.values().for_each(|cache| expected += cache.counts);
            assert!(
                expected.hits > 1000 && expected.misses > 1000 && expected.evictions > 50,
                "{expected:?}"
            );
            let statistics = mapper.statistics();
            assert_eq!((statistics.octrees.voxel_cache, statistics.cached.voxel_cache), (expected, expected));
            let rate = expected.hits as f64 / (expected.hits + expected.misses) as f64;
            assert_eq!(statistics.octrees.voxel_cache.hit_rate(), rate);

            mapper.sync_octrees();
            let OctreeStatistics { voxel_cache, voxels_written, queue, .. } = mapper.statistics().octrees;
            let cached: usize = caches.values().flat_map(|cache| cache.buckets.values()).map(Vec::len).sum();
            assert_eq!(voxel_cache.drained, cached as u64);
            assert_eq!(voxels_written, voxel_cache.evictions + voxel_cache.drained);
            let sent = if matches!(mode, VoxelCacheMode::Parallel(_)) { expected.evictions } else { 0 };
            assert_eq!(queue.voxels_in, sent);
            assert!(queue.peak_voxels <= queue.limit_voxels && queue.peak_batches <= queue.batches_in);
        }
    }
}

#[test]
fn without_a_cache_every_update_is_written_and_views_of_bricks_count_no_work() {
    for insert_mode in [InsertMode::PerScan, InsertMode::PerRay] {
        let config = config().with_insert_mode(insert_mode);
        let mut reference = ReferenceMap::new(&config);
        let mut bricks = InMemoryMapper::new(config.clone()).unwrap();
        let mut straight = InMemoryMapper::new(config.with_voxel_cache(VoxelCacheMode::Off)).unwrap();
        let mut random = Random(2);
        for _ in 0..3 {
            let scan = random_scan(&mut random, [0.0; 3], 40);
            bricks.insert_scan(&scan).unwrap();
            straight.insert_scan(&scan).unwrap();
            reference.insert_scan(&scan);
        }
        assert_eq!(bricks.statistics().octrees, OctreeStatistics::default());
        let work = straight.statistics().octrees;
        assert_eq!(work.voxels_written, reference.updated.len() as u64);
        assert_eq!(work.voxel_cache, VoxelCacheCounts::default());
        assert!(work.times.octree_update_ns > 0 && work.times.table_update_ns > 0);
        assert_eq!(work.times.cache_insertion_ns, 0);
    }
}

#[test]
fn a_cache_without_a_fixed_size_holds_the_voxels_that_scans_repeat() {
    let config = config().with_voxel_cache(VoxelCacheMode::Serial(VoxelCacheConfig::default()));
    let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
    let mut random = Random(8);
    let mut seen: BTreeSet<VoxelIndex> = BTreeSet::new();
    for _ in 0..3 {
        let mut reference = ReferenceMap::new(&config);
        let scan = random_scan(&mut random, [0.0; 3], 400);
        reference.insert_scan(&scan);
        let before = mapper.statistics().octrees.voxel_cache;
        mapper.insert_scan(&scan).unwrap();
        let counts = mapper.statistics().octrees.voxel_cache;
        let known = reference.voxels.keys().filter(|voxel| seen.contains(*voxel)).count() as u64;
        assert!(
            (counts.hits - before.hits) * 100 >= known * 95,
            "{counts:?} after {before:?}, {known} known"
        );
        seen.extend(reference.voxels.keys());
    }
}

/// Mappers can be moved to another thread and dropped there.
#[test]
fn a_mapper_with_a_worker_moves_between_threads() {
    let mode = VoxelCacheMode::Parallel(VoxelCacheConfig::new(1, 1));
    let mut mapper = InMemoryMapper::new(config().with_voxel_cache(mode)).unwrap();
    let scan = random_scan(&mut Random(1), [0.0; 3], 50);
    let mapper = std::thread::spawn(move || {
        mapper.insert_scan(&scan).unwrap();
        mapper
    });
    drop(mapper.join().unwrap());
}
