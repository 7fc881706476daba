use testkit::random_scans::{Random, random_scan};
use voxtile::scan::PointBatch;
use voxtile::space::VoxelBox;
use voxtile::{Aabb, Grid, InMemoryMapper, MapConfig, Mapper, Point, VoxelIndex};
use voxtile_distance::{DistanceOptions, UnknownRule};

/// Tile sizes in metres for voxels of 0.1 m: 2, 5 and 100 voxels.
pub const TILE_SIZES_M: [f64; 3] = [0.2, 0.5, 10.0];

pub fn config(tile_size_m: f64) -> MapConfig {
    MapConfig::new(0.1, tile_size_m).unwrap()
}

/// Adds a scan and single voxels.
pub fn grow(map: &mut impl Mapper, random: &mut Random, center: Point) {
    let scan = voxtile::Scan { intensities: None, ..random_scan(random, center, 12) };
    map.insert_scan(&scan).unwrap();
    let count = random.below(60);
    let points: Vec<Point> = (0..count).map(|_| random.point(center, 2.5)).collect();
    let is_occupied: Vec<bool> = points.iter().map(|_| random.below(4) != 0).collect();
    map.batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &is_occupied }).unwrap();
}

pub fn random_map(random: &mut Random, tile_size_m: f64) -> InMemoryMapper {
    let mut map = InMemoryMapper::new(config(tile_size_m)).unwrap();
    for _ in 0..1 + random.below(3) {
        grow(&mut map, random, [0.3, -0.4, 0.2]);
    }
    map
}

pub fn random_options(random: &mut Random) -> DistanceOptions {
    let cap_m = [0.1, 0.15, 0.3, 0.5, 0.7][random.below(5) as usize];
    let rules = [UnknownRule::Unknown, UnknownRule::Free, UnknownRule::Obstacle];
    DistanceOptions::new(cap_m).with_unknown(rules[random.below(3) as usize]).with_sign(random.below(2) == 0)
}

/// A box of up to a few metres around the map, wider than a voxel.
pub fn random_region(random: &mut Random) -> Aabb {
    let region = Aabb::from_corners(random.point([0.0; 3], 4.0), random.point([0.0; 3], 4.0));
    Aabb { max: region.max.map(|k| k + 0.2), ..region }
}

pub fn voxels_of(voxels: &VoxelBox) -> impl Iterator<Item = VoxelIndex> {
    let VoxelBox { min, end } = *voxels;
    (min[2]..end[2])
        .flat_map(move |z| (min[1]..end[1]).flat_map(move |y| (min[0]..end[0]).map(move |x| [x, y, z])))
}

/// A few random voxels of a box.
pub fn sample(random: &mut Random, voxels: &VoxelBox, count: usize) -> Vec<VoxelIndex> {
    if voxels.is_empty() {
        return Vec::new();
    }
    let mut pick = |k: usize| voxels.min[k] + random.below((voxels.end[k] - voxels.min[k]) as u64) as i32;
    (0..count).map(|_| [pick(0), pick(1), pick(2)]).collect()
}

pub fn centers_box(grid: &Grid, voxels: &VoxelBox) -> Aabb {
    let edge_m = |k: i32| f64::from(k) * grid.resolution_m();
    Aabb { min: voxels.min.map(edge_m), max: voxels.end.map(edge_m) }
}
