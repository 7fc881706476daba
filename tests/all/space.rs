use tempfile::TempDir;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::scan::PointBatch;
use voxtile::space::{Point, TileIndex};
use voxtile::{InMemoryMapper, MapConfig, MapPath, MapQueries, MapReader, Mapper, OutOfCoreTileMapper, Scan};

#[test]
fn far_negative_and_border_tiles_are_read_back_exactly() {
    // Origin, UTM, ECEF, the wrap of the 16-bit keys at 0.1 m, and the far corner of OctoMap's range.
    let centers: [Point; 6] = [
        [0.0, -0.0, 0.0],
        [515_400.0, 4_918_360.0, 2_330.0],
        [-2_694_045.0, -4_293_642.0, 3_857_878.0],
        [3276.8, -3276.8, 3276.8],
        [6553.6, 9830.4, -6553.6],
        [-1e7, 1e7, -1e7],
    ];
    let folder = TempDir::new().unwrap();
    let config = MapConfig::new(0.1, 1.6).unwrap().with_cache_tiles(3).with_write_buffer_bytes(10_000);
    let path = folder.path().join("map");
    let mut mapper =
        OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config.clone()).unwrap();
    let mut reference = ReferenceMap::new(&config);
    let mut random = Random(17);
    for center in centers {
        let scan = random_scan(&mut random, center, 20);
        mapper.insert_scan(&scan).unwrap();
        reference.insert_scan(&scan);
    }
    mapper.flush().unwrap();
    let reader = MapReader::open(&path, 1 << 20).unwrap();
    assert_eq!(voxels_of(&reader), reference.voxels);
    for (voxel, (bits, count)) in reference.voxels.iter().step_by(97) {
        let found = reader.voxel_at(config.grid.center_m(*voxel)).unwrap().unwrap();
        assert_eq!((found.index, found.evidence.log_odds.to_bits()), (*voxel, *bits));
        assert_eq!(found.evidence.observation_count, *count);
    }
}

#[test]
fn a_dyadic_scan_shifted_by_whole_tiles_gives_the_shifted_voxels() {
    let config = MapConfig::new(0.125, 4.0).unwrap();
    let mut random = Random(4);
    let mut dyadic = |range: u64| (random.below(range) as f64 - range as f64 / 2.0) / 64.0;
    let origin = [dyadic(256), dyadic(256), dyadic(256)];
    let points = (0..300).map(|_| [dyadic(2048), dyadic(2048), dyadic(1024)]).collect();
    let scan = Scan { origin, points, intensities: None };
    let map = |scan: &Scan| -> Voxels {
        let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
        mapper.insert_scan(scan).unwrap();
        voxels_of(&mapper)
    };
    let original = map(&scan);
    let tiles = [131_072, -524_288, 1];
    let shifted_map = map(&scan.translated(tiles.map(|tiles| f64::from(tiles) * 4.0)));
    let shifted: Voxels = original
        .into_iter()
        .map(|(voxel, evidence)| (std::array::from_fn(|k| voxel[k] + tiles[k] * 32), evidence))
        .collect();
    assert_eq!(shifted_map, shifted);
}

#[test]
fn minus_zero_and_tile_borders_belong_to_one_tile() {
    let config = MapConfig::new(0.5, 2.0).unwrap();
    let mut mapper = InMemoryMapper::new(config).unwrap();
    let points = [[-0.0, 0.0, 2.0], [0.0, -0.0, 1.9999], [-1e-300, 0.0, -2.0]];
    mapper.batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &[true; 3] }).unwrap();
    let tiles: Vec<TileIndex> = voxtile::MapView::tile_indices(&mapper);
    assert_eq!(tiles, [TileIndex::new(-1, 0, -1), TileIndex::new(0, 0, 0), TileIndex::new(0, 0, 1)]);
}

#[test]
fn tiles_of_two_voxels_and_of_a_thousand_give_the_same_evidence() {
    let scans: Vec<Scan> = (0..3).map(|k| random_scan(&mut Random(k), [0.3, -0.2, 0.1], 30)).collect();
    let evidence = |tile_size_m: f64| {
        let mut mapper = InMemoryMapper::new(MapConfig::new(0.1, tile_size_m).unwrap()).unwrap();
        for scan in &scans {
            mapper.insert_scan(scan).unwrap();
        }
        voxels_of(&mapper)
    };
    let reference = evidence(10.0);
    assert!([0.2, 0.3, 0.7, 102.4].into_iter().all(|tile_size_m| evidence(tile_size_m) == reference));
}
