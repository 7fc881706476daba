use testkit::memory_folder::memory_folder;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::{
    InsertMode, MapConfig, MapPath, MapQueries, MapView, Mapper, MemoryLimit, OutOfCoreTileMapper,
    ScanPoints, Storage,
};

/// One random life of a map beside the naive one, which is set back to the last flush where the map crashes.
fn live(seed: u64, config: &MapConfig) {
    let folder = memory_folder();
    let path = folder.path().join("map");
    let mut random = Random(seed);
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config.clone()).unwrap();
    let mut reference = ReferenceMap::new(config);
    let most_tiles = match config.memory {
        MemoryLimit::Tiles { tiles, .. } => tiles,
        _ => usize::MAX,
    };
    let (mut scans, mut flushed): (u64, (Voxels, u64)) = (0, (Voxels::new(), 0));
    // As of the flush that goes on beside what comes next.
    let mut begun: Option<(Voxels, u64)> = None;
    for _ in 0..60 {
        match random.below(10) {
            0..5 => {
                let mut some = Vec::new();
                for _ in 0..1 + random.below(3) {
                    let center = [random.between(-3.0, 3.0), 0.0, 0.0];
                    some.push(random_scan(&mut random, center, 12));
                }
                let together: Vec<&dyn ScanPoints> = some.iter().map(|scan| scan as _).collect();
                mapper.insert_all(&together, &mut Vec::new()).unwrap();
                some.iter().for_each(|scan| reference.insert_scan(scan));
                scans += some.len() as u64;
            }
            5 | 6 => {
                let point = random.point([0.0; 3], 4.0);
                let voxel = config.grid.voxel_of(point).unwrap();
                let found = mapper.voxel_at(point).unwrap().map(|voxel| voxel.evidence);
                let found = found.map(|evidence| (evidence.log_odds.to_bits(), evidence.observation_count));
                assert_eq!(found, reference.voxels.get(&voxel).copied(), "seed {seed}");
            }
            7 if random.below(2) == 0 => {
                mapper.begin_flush().unwrap();
                begun = Some((reference.voxels.clone(), scans));
            }
            7 => {
                mapper.flush().unwrap();
                (flushed, begun) = ((reference.voxels.clone(), scans), None);
            }
            8 => {
                // Whatever was evicted since the last flush is on disk, and must not count.
                drop(mapper);
                // What was begun is finished.
                flushed = begun.take().unwrap_or(flushed);
                mapper =
                    OutOfCoreTileMapper::open(MapPath::on(UnsyncedDisk::shared(), &path), config.clone())
                        .unwrap();
                (reference.voxels, scans) = flushed.clone();
            }
            _ => assert_eq!(voxels_of(&mapper), reference.voxels, "seed {seed}"),
        }
        assert!(mapper.cached_tile_indices().len() <= most_tiles);
        assert_eq!(mapper.scan_number(), scans, "seed {seed}");
    }
    assert_eq!(voxels_of(&mapper), reference.voxels, "seed {seed}");
}

#[test]
fn any_life_of_a_map_equals_the_naive_map_as_of_then() {
    let config = MapConfig::new(0.2, 1.6).unwrap();
    for seed in 0..12 {
        let mode = if seed % 3 == 0 { InsertMode::PerRay } else { InsertMode::PerScan };
        let mut config = config
            .clone()
            .with_insert_mode(mode)
            .with_cache_tiles(1 + (seed as usize * 5) % 17)
            .with_write_buffer_bytes((seed as usize % 4) * 3000);
        if seed % 2 == 1 {
            config = config.with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
        }
        if seed % 4 >= 2 {
            config = config.with_storage(Storage::Compact);
        }
        live(seed, &config);
        // From nothing but what a scan needs to a few of the map's tiles.
        let bytes = [0, 3_000, 30_000, 100_000, 300_000][seed as usize % 5];
        live(seed, &config.with_tight_memory_bytes(bytes));
    }
}
