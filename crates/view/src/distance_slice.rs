//! Distances of a layer of voxels to the nearest obstacle, around a point.

use super::response::gzip;
use voxtile::mapper::MapView;
use voxtile::scan::Stop;
use voxtile::space::{Aabb, VoxelBox};
use voxtile::{Error, Point, Result};
use voxtile_distance::{DistanceOptions, MapDistances, VoxelDistance};
use voxtile_pipeline::AnyMap;

/// Maximum number of voxels along x and along y.
const MAX_EDGE: i32 = 1024;
/// Voxels along an edge of the squares that are computed at a time, so that the memory is at most about 100 MiB.
const SQUARE_EDGE: i32 = 256;

/// Length of the header of a response in bytes.
const HEADER_BYTES: usize = 56;

/// Value of an unknown voxel.
const UNKNOWN: u8 = 0;
/// Value of an obstacle.
const OBSTACLE: u8 = 1;
/// Value of a distance of almost 0; that of the cap is 255.
const NEAREST: u8 = 2;

/// Returns the distances in the layer of a point, compressed with gzip, as `docs/view.md` describes. Distances near
/// damaged tiles are unknown.
///
/// # Errors
///
/// Fails if the cap is invalid, a tile cannot be read, or with `Error::Stopped`.
pub fn distance_slice(map: &AnyMap, around: Point, max_distance_m: f64, stop: &Stop) -> Result<Vec<u8>> {
    let (grid, options) = (map.config().grid, DistanceOptions::new(max_distance_m));
    let voxels = layer_around(map, around);
    let [width, height] = [0, 1].map(|k| (voxels.end[k] - voxels.min[k]) as usize);
    let mut values = vec![UNKNOWN; width * height];
    let starts = |k: usize| (voxels.min[k]..voxels.end[k]).step_by(SQUARE_EDGE as usize);
    for (x, y) in starts(0).flat_map(|x| starts(1).map(move |y| (x, y))) {
        stop.check()?;
        let end = |from: i32, k: usize| from.saturating_add(SQUARE_EDGE).min(voxels.end[k]);
        let [min, max] = [[x, y, voxels.min[2]], [end(x, 0), end(y, 1), voxels.end[2]]]
            .map(|corner| corner.map(|k| f64::from(k) * grid.resolution_m()));
        let field = match map.distance_field(&Aabb { min, max }, options) {
            Ok(field) => field,
            // The page reports damaged tiles. The square remains unknown.
            Err(Error::Damaged { .. }) => continue,
            Err(error) => return Err(error),
        };
        let VoxelBox { min, end } = field.voxel_box().intersection(&voxels);
        for (y, x) in (min[1]..end[1]).flat_map(|y| (min[0]..end[0]).map(move |x| (y, x))) {
            let at = (y - voxels.min[1]) as usize * width + (x - voxels.min[0]) as usize;
            values[at] = value_of(field.voxel([x, y, voxels.min[2]]), max_distance_m / grid.resolution_m());
        }
    }
    let mut bytes = Vec::with_capacity(HEADER_BYTES + values.len());
    bytes.extend(b"VXD1");
    bytes.extend([width, height, 0].iter().flat_map(|&number| (number as u32).to_le_bytes()));
    bytes.extend(voxels.min.iter().flat_map(|&k| grid.corner_m(k).to_le_bytes()));
    bytes.extend(grid.resolution_m().to_le_bytes());
    bytes.extend(max_distance_m.to_le_bytes());
    bytes.extend(values);
    Ok(gzip(&bytes))
}

/// Returns the voxels of the map's tiles in the layer of a point, at most [`MAX_EDGE`] around it along x and y.
fn layer_around(map: &AnyMap, around: Point) -> VoxelBox {
    let grid = map.config().grid;
    let nothing = VoxelBox { min: [0; 3], end: [0; 3] };
    let (Some(center), Some(tiles)) = (grid.voxel_of(around), map.tile_bounds()) else { return nothing };
    let half = [MAX_EDGE / 2, MAX_EDGE / 2, 0];
    let wanted = VoxelBox {
        min: std::array::from_fn(|k| center[k].saturating_sub(half[k])),
        end: std::array::from_fn(|k| center[k].saturating_add(half[k].max(1))),
    };
    let layer = grid.voxels_of_tiles(tiles).intersection(&wanted);
    if layer.is_empty() { nothing } else { layer }
}

/// Returns the byte of a distance; `cap` is in voxels.
fn value_of(distance: VoxelDistance, cap: f64) -> u8 {
    if distance.is_unknown() {
        return UNKNOWN;
    }
    let Some(squared) = distance.squared_voxels() else { return u8::MAX };
    if squared <= 0 {
        return OBSTACLE;
    }
    let share = (f64::from(squared).sqrt() / cap).min(1.0);
    NEAREST + (f64::from(u8::MAX - NEAREST) * share).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::read::GzDecoder;
    use std::io::Read;
    use voxtile::mapper::OutOfCoreTileMapper;
    use voxtile::{MapConfig, MapReader, Mapper, Scan};

    fn map_of(points: Vec<Point>) -> (tempfile::TempDir, AnyMap) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map");
        let mut map = OutOfCoreTileMapper::create(&path, MapConfig::new(0.1, 2.0).unwrap()).unwrap();
        map.insert_scan(&Scan { points, ..Scan::default() }).unwrap();
        map.flush().unwrap();
        drop(map);
        let map = MapReader::open(&path, 1 << 20).unwrap();
        (folder, AnyMap::Map(Box::new(map)))
    }

    /// Returns the size, the lower corner in metres, and the values.
    fn slice(map: &AnyMap, around: Point, cap_m: f64) -> ([usize; 2], [f64; 3], Vec<u8>) {
        let mut bytes = Vec::new();
        let gzip = distance_slice(map, around, cap_m, &Stop::default()).unwrap();
        GzDecoder::new(&gzip[..]).read_to_end(&mut bytes).unwrap();
        assert!(bytes.starts_with(b"VXD1"));
        let size = [4, 8].map(|at| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize);
        let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        assert_eq!([number(40), number(48)], [0.1, cap_m]);
        (size, [16, 24, 32].map(number), bytes.split_off(HEADER_BYTES))
    }

    #[test]
    fn values_are_those_of_the_field() {
        // Wider than a square and than the limit.
        let points = (0..400).map(|k| [0.2 * f64::from(k) + 30.05, 3.05, f64::from(k % 7) * 0.1 - 0.35]);
        let (_folder, map) = map_of(points.chain([[-60.05, -8.05, 0.05]]).collect());
        let region = Aabb { min: [-70.0, -10.0, -0.1], max: [75.0, 5.0, 0.2] };
        for (around, cap_m) in [([20.0, 0.0, 0.05], 2.0), ([-40.0, 1.0, 0.05], 0.5)] {
            let field = map.distance_field(&region, DistanceOptions::new(cap_m)).unwrap();
            let ([width, height], corner_m, values) = slice(&map, around, cap_m);
            assert!(width == 1024 || around[0] < 0.0 && width > 600, "{width}");
            let low = corner_m.map(|k| (k / 0.1).round() as i32);
            let (mut known, mut obstacles) = (0, 0);
            for (at, &value) in values.iter().enumerate() {
                let voxel = [low[0] + (at % width) as i32, low[1] + (at / width) as i32, low[2]];
                let expected = field.voxel(voxel);
                assert_eq!(value == UNKNOWN, expected.is_unknown(), "{voxel:?}");
                assert_eq!(value == OBSTACLE, expected.squared_voxels() == Some(0), "{voxel:?}");
                if value > OBSTACLE {
                    let distance_m = expected.in_metres(0.1).capped_m(cap_m).unwrap();
                    let shown_m = f64::from(value - NEAREST) / 253.0 * cap_m;
                    assert!((distance_m - shown_m).abs() <= 0.5 * cap_m / 253.0 + 1e-9, "{voxel:?}");
                }
                known += usize::from(value != UNKNOWN);
                obstacles += usize::from(value == OBSTACLE);
            }
            assert!(known > 100 && values.len() == width * height && (around[0] < 0.0 || obstacles > 10));
        }
    }

    #[test]
    fn surroundings_of_a_damaged_tile_are_unknown() {
        let (folder, map) = map_of((0..70).map(|k| [0.5 * f64::from(k) - 2.0, 3.05, 0.05]).collect());
        let (_, _, whole) = slice(&map, [16.0, 0.0, 0.05], 0.5);
        let tile = folder.path().join("map/tile_1_1_0");
        for entry in std::fs::read_dir(&tile).unwrap() {
            std::fs::write(entry.unwrap().path(), "damage").unwrap();
        }
        let map = MapReader::open(folder.path().join("map"), 1 << 20).unwrap();
        let (_, _, values) = slice(&AnyMap::Map(Box::new(map)), [16.0, 0.0, 0.05], 0.5);
        assert!(values.iter().zip(&whole).all(|(value, whole)| *value == UNKNOWN || value == whole));
        let known = |values: &[u8]| values.iter().filter(|value| **value != UNKNOWN).count();
        assert!((1..known(&whole)).contains(&known(&values)));
    }

    #[test]
    fn places_outside_of_the_map_have_no_voxels() {
        let (_folder, map) = map_of(vec![[1.0, 0.0, 0.0]]);
        for around in [[0.0, 0.0, 50.0], [1e4, 0.0, 0.0], [1e300; 3], [f64::NAN; 3]] {
            let (size, _, values) = slice(&map, around, 1.0);
            assert!(size == [0, 0] && values.is_empty(), "{around:?}");
        }
    }

    #[test]
    fn invalid_caps_fail_and_a_stop_ends_the_work() {
        let (_folder, map) = map_of(vec![[1.0, 0.0, 0.0]]);
        for cap_m in [0.0, -1.0, f64::NAN, 1e9] {
            assert!(distance_slice(&map, [0.0; 3], cap_m, &Stop::default()).is_err(), "{cap_m}");
        }
        let stop = Stop::default();
        stop.set();
        let stopped = distance_slice(&map, [0.0; 3], 1.0, &stop);
        assert!(matches!(stopped, Err(voxtile::Error::Stopped)));
    }
}
