use testkit::random_scans::{Random, random_scan};
use voxtile::scan::PointBatch;
use voxtile::{Aabb, InMemoryMapper, MapConfig, Mapper, Point, Storage};

/// Tile sizes in metres for voxels of 0.1 m: 5, 30 and 100 voxels.
pub const TILE_SIZES_M: [f64; 3] = [0.5, 3.0, 10.0];

pub fn config(tile_size_m: f64) -> MapConfig {
    MapConfig::new(0.1, tile_size_m).unwrap()
}

/// Inserts two epochs of a scene: scans, and boxes whose voxels are occupied, free or not observed in each epoch.
pub fn fill(map: &mut impl Mapper, seed: u64, epoch: u64) {
    // The border of the blocks at 12.8 m is inside too.
    let center = [0.3, 12.4, -0.2];
    for number in 0..2 {
        let random = &mut Random(seed * 100 + number * epoch);
        let scan = voxtile::Scan { intensities: None, ..random_scan(random, center, 20) };
        map.insert_scan(&scan).unwrap();
    }
    let [places, states] = &mut [Random(seed), Random(seed * 100 + epoch)];
    for _ in 0..25 {
        let (middle, count) = (places.point(center, 1.2), 100 + places.below(150));
        let points: Vec<Point> = (0..count).map(|_| places.point(middle, 0.25)).collect();
        for _ in 0..1 + states.below(4) {
            let is_occupied = vec![states.below(2) == 0; points.len()];
            let batch = PointBatch { points: &points, intensities: None, is_occupied: &is_occupied };
            map.batch_update(&batch).unwrap();
        }
    }
}

pub fn random_map(seed: u64, epoch: u64, tile_size_m: f64) -> InMemoryMapper {
    let mut map = InMemoryMapper::new(config(tile_size_m)).unwrap();
    fill(&mut map, seed, epoch);
    map
}

/// A box of up to a few metres, or none.
pub fn random_region(random: &mut Random) -> Option<Aabb> {
    let center = [0.3, 12.4, -0.2];
    (random.below(2) == 0).then(|| Aabb::from_corners(random.point(center, 3.0), random.point(center, 3.0)))
}

pub fn storage_of(case: u64) -> Storage {
    if case.is_multiple_of(2) { Storage::OctoMap } else { Storage::Compact }
}
