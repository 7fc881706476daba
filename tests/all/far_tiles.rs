//! Maps with large distances between tiles: rays cross the empty space in few steps and hit the same voxels.

use std::time::{Duration, Instant};
use tempfile::TempDir;
use testkit::random_scans::Random;
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::mapper::{MapStatistics, TileRef};
use voxtile::query::UnknownAs;
use voxtile::scan::PointBatch;
use voxtile::space::{Grid, LAST_VOXEL_INDEX, TileBox, TileIndex};
use voxtile::{
    InMemoryMapper, MapConfig, MapPath, MapReader, MapView, Mapper, OutOfCoreTileMapper, Point, Queries,
    RayQuery, Scan,
};
use voxtile_local::{LocalMap, LocalParameters};
use voxtile_share::VoxelSet;

/// A map without an index of empty space: queries look up every tile.
struct TileByTile<'a>(&'a InMemoryMapper);

impl MapView for TileByTile<'_> {
    fn config(&self) -> &MapConfig {
        self.0.config()
    }
    fn scan_number(&self) -> u64 {
        self.0.scan_number()
    }
    fn tile_indices(&self) -> Vec<TileIndex> {
        self.0.tile_indices()
    }
    fn tile_bounds(&self) -> Option<TileBox> {
        self.0.tile_bounds()
    }
    fn has_tile(&self, index: TileIndex) -> bool {
        self.0.has_tile(index)
    }
    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        self.0.cached_tile_indices()
    }
    fn tile(&self, index: TileIndex) -> voxtile::Result<Option<TileRef<'_>>> {
        self.0.tile(index)
    }
    fn tile_uncached(&self, index: TileIndex) -> voxtile::Result<Option<TileRef<'_>>> {
        self.0.tile_uncached(index)
    }
    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.0.voxels_of_tile_hint(index)
    }
    fn statistics(&self) -> MapStatistics {
        self.0.statistics()
    }
}

/// Inserts occupied points.
fn occupy(map: &mut impl Mapper, points: &[Point]) {
    let (intensities, is_occupied) = (None, vec![true; points.len()]);
    map.batch_update(&PointBatch { points, intensities, is_occupied: &is_occupied }).unwrap();
}

#[test]
fn rays_through_empty_space_hit_the_voxels_of_a_tile_by_tile_search() {
    let mut random = Random(7);
    for round in 0..12 {
        let config = MapConfig::new(1.0, 2.0).unwrap();
        let grid = config.grid;
        let (mut map, mut set) = (InMemoryMapper::new(config).unwrap(), VoxelSet::new(grid));
        // Clusters of voxels, some of them close to each other.
        let far_m = [40.0, 600.0, 9000.0][round % 3];
        let mut points = Vec::new();
        for _ in 0..=random.below(5) {
            let center = random.point([0.0; 3], far_m);
            points.extend((0..=random.below(30)).map(|_| random.point(center, 8.0)));
        }
        occupy(&mut map, &points);
        for &point in &points {
            set.put(grid.voxel_of(point).unwrap(), true);
        }
        let mut hits = 0;
        for number in 0..60 {
            let near = points[random.below(points.len() as u64) as usize];
            let origin = match number % 2 {
                0 => random.point([0.0; 3], far_m),
                _ => random.point(near, 3.0),
            };
            let target = points[random.below(points.len() as u64) as usize];
            let direction = match number % 3 {
                0 => random.point([0.0; 3], 1.0),
                // Along an axis and through the corners of tiles, where many crossings are ties.
                1 => [target[0].round() - origin[0].round(), 0.0, target[2].round() - origin[2].round()],
                _ => std::array::from_fn(|k| grid.center_m(grid.voxel_of(target).unwrap())[k] - origin[k]),
            };
            if direction == [0.0; 3] {
                continue;
            }
            let origin = if number % 3 == 1 { origin.map(f64::round) } else { origin };
            let max_range_m = (number % 4 == 0).then_some(0.7 * far_m);
            let query = RayQuery { origin, direction, max_range_m, unknown: UnknownAs::Free };
            let hit = map.cast_ray(&query).unwrap();
            assert_eq!(hit, TileByTile(&map).cast_ray(&query).unwrap(), "{query:?}");
            let of_set = set.cast_ray(&query).unwrap();
            let found = |hit: voxtile::Hit| (hit.voxel, hit.distance_m.to_bits());
            assert_eq!(hit.map(found), of_set.map(found), "{query:?}");
            hits += u32::from(hit.is_some());
        }
        assert!(hits > 5, "{hits}");
    }
}

/// Casts rays to a wall 400,000 km away, past it, and along all axes.
fn check_far(map: &dyn Queries, wall: &[Point]) {
    let begun = Instant::now();
    let ray = |origin: Point, direction: Point| {
        let query = RayQuery { origin, direction, max_range_m: None, unknown: UnknownAs::Free };
        map.cast_ray(&query).unwrap()
    };
    for (number, &point) in wall.iter().enumerate() {
        let origin = [3.25, -7.75 + number as f64, 1.25];
        let center = map.grid().center_m(map.grid().voxel_of(point).unwrap());
        let hit = ray(origin, std::array::from_fn(|k| center[k] - origin[k])).expect("the wall");
        assert_eq!(Some(hit.voxel), map.grid().voxel_of(point));
        let back = ray(std::array::from_fn(|k| center[k] - 2.0), origin.map(|k| -k));
        assert!(back.is_none_or(|hit| hit.voxel != map.grid().voxel_of(point).unwrap()));
        for direction in [[1.0, 0.3, 0.2], [-1.0, -0.1, 0.9], [1.0, 1.0, 1.0], [0.9, 0.31, -0.0002]] {
            ray(origin, direction);
        }
    }
    let took = begun.elapsed();
    assert!(took < Duration::from_secs(3), "{took:?}");
}

#[test]
fn rays_are_fast_with_a_very_distant_tile() {
    let wall: Vec<Point> = (0..20).map(|k| [4e8, 1.2e8 + 3.0 * f64::from(k), -3e7]).collect();
    let near: Vec<Point> = (0..20).map(|k| [5.0, f64::from(k) * 0.5, 9.0]).collect();
    let config = MapConfig::new(0.5, 10.0).unwrap();
    let mut in_memory = InMemoryMapper::new(config.clone()).unwrap();
    let folder = TempDir::new().unwrap();
    let path = MapPath::on(UnsyncedDisk::shared(), folder.path().join("map"));
    let mut out_of_core = OutOfCoreTileMapper::create(path.clone(), config.clone()).unwrap();
    let reader = out_of_core.reader().unwrap();
    for points in [&near, &wall] {
        occupy(&mut in_memory, points);
        occupy(&mut out_of_core, points);
    }
    out_of_core.flush().unwrap();
    let on_disk = MapReader::open(path, 1 << 20).unwrap();
    let maps: [&dyn Queries; 4] = [&in_memory, &out_of_core, &reader, &on_disk];
    for map in maps {
        check_far(map, &wall);
    }
    let grid = config.grid;
    let mut set = VoxelSet::new(grid);
    for &point in near.iter().chain(&wall) {
        set.put(grid.voxel_of(point).unwrap(), true);
    }
    check_far(&set, &wall);
    let mut local = LocalMap::new(0.5, LocalParameters::passive_perception()).unwrap();
    for points in [&near, &wall] {
        let origin = points[0].map(|k| k - 2.0);
        local.insert_scan(&Scan { origin, points: points.clone(), intensities: None }).unwrap();
    }
    check_far(&*local.reader().view(), &wall);
}

/// There are so many tiles, so far apart, that the index of empty space drops its finest levels.
#[test]
fn rays_are_fast_with_thousands_of_scattered_tiles() {
    let mut random = Random(11);
    let mut points: Vec<Point> = (0..5000).map(|_| random.point([0.0; 3], 4e8)).collect();
    let wall: Vec<Point> = (0..10).map(|k| [4.2e8, 1.2e8 + 3.0 * f64::from(k), -3e7]).collect();
    points.extend(&wall);
    let mut map = InMemoryMapper::new(MapConfig::new(0.5, 10.0).unwrap()).unwrap();
    occupy(&mut map, &points);
    check_far(&map, &wall);
}

#[test]
fn rays_end_at_the_last_voxels() {
    let grid = Grid::new(1.0, 4.0).unwrap();
    let last = grid.center_m([LAST_VOXEL_INDEX; 3]);
    let mut map = InMemoryMapper::new(MapConfig::new(1.0, 4.0).unwrap()).unwrap();
    occupy(&mut map, &[last, [0.5; 3], grid.center_m([i32::MIN; 3])]);
    let begun = Instant::now();
    for slow in [0.0, 1e-310, -1e-310, f64::from_bits(1), 1e-300, 1e-12] {
        for direction in [[1.0, slow, 0.0], [slow, -1.0, slow], [0.0, slow, 1.0], [-1.0, -slow, -1.0]] {
            for origin in [[3.5; 3], last.map(|k| k - 2.0), [last[0], 0.5, last[2] - 2.0]] {
                let query = RayQuery { origin, direction, max_range_m: None, unknown: UnknownAs::Free };
                // At the last voxel index of an axis, a ray can still advance along the others.
                let hit = map.cast_ray(&query).unwrap();
                assert!(
                    hit.is_none_or(|hit| slow.abs() > 1e-309 && hit.voxel != [0; 3]),
                    "{query:?} {hit:?}"
                );
            }
        }
    }
    assert!(begun.elapsed() < Duration::from_secs(3));
}

#[test]
fn voxels_crossed_at_infinite_distance_are_no_hits() {
    let config = MapConfig::new(1.0, 4.0).unwrap();
    let (mut map, mut set) = (InMemoryMapper::new(config.clone()).unwrap(), VoxelSet::new(config.grid));
    let voxel = [LAST_VOXEL_INDEX - 1, 100, 0];
    occupy(&mut map, &[config.grid.center_m(voxel)]);
    set.put(voxel, true);
    let direction = [1.0, 1e-310, 0.0];
    let query = RayQuery { origin: [3.5, 0.5, 0.5], direction, max_range_m: None, unknown: UnknownAs::Free };
    let maps: [&dyn Queries; 2] = [&map, &set];
    for map in maps {
        assert_eq!(map.cast_ray(&query).unwrap().map(|hit| hit.distance_m), None);
    }
}
