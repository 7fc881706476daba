use std::collections::BTreeMap;
use std::io::Cursor;
use tempfile::TempDir;
use testkit::random_scans::{Random, random_scan};
use voxtile::mapper::{MapView, OutOfCoreTileMapper};
use voxtile::octree::{
    BrickValues, BtPruning, Octree, OctreeFormat, OctreeStream, StreamOutcome, write_bt, write_ot,
};
use voxtile::query::OctreeExport;
use voxtile::scan::PointBatch;
use voxtile::space::{Aabb, MortonCode, Point};
use voxtile::{Error, InMemoryMapper, MapConfig, MapQueries, MapReader, Mapper, Result};

const FORMATS: [OctreeFormat; 2] = [OctreeFormat::Bt, OctreeFormat::Ot];

/// Returns the file of the tree in memory.
fn whole(map: &impl MapQueries, format: OctreeFormat, region: Option<&Aabb>) -> Vec<u8> {
    let tree = map.merged_octree(region, u64::MAX).unwrap();
    let (config, mut bytes) = (map.config(), Vec::new());
    let resolution_m = config.grid.resolution_m();
    match format {
        OctreeFormat::Bt => write_bt(&tree, resolution_m, config.occupied_log_odds() as f32, &mut bytes),
        _ => write_ot(&tree, resolution_m, &mut bytes),
    }
    .unwrap();
    bytes
}

fn streamed(
    map: &impl MapQueries,
    format: OctreeFormat,
    region: Option<&Aabb>,
    memory_bytes: usize,
) -> std::result::Result<(u64, Vec<u8>), Box<dyn std::error::Error>> {
    let mut bytes = Vec::new();
    // The spool contains remains of an earlier attempt.
    let mut spool = Cursor::new(vec![7; 100]);
    let export = OctreeExport { format, region, origin: [0; 3], memory_bytes };
    let voxels = map.write_octree::<Box<dyn std::error::Error>>(&export, &mut spool, &mut bytes)?;
    Ok((voxels, bytes))
}

/// Compares the streamed files of a map with those of its whole tree, with any memory.
fn check(map: &impl MapQueries, region: Option<&Aabb>) {
    let mut count = 0;
    match region {
        Some(region) => map.for_each_voxel_in(region, |_| count += 1).unwrap(),
        None => map.for_each_occupied(Some(0.0), None, |_| count += 1).unwrap(),
    }
    for format in FORMATS {
        let expected = whole(map, format, region);
        for memory_bytes in [0, 3_000, 100_000, usize::MAX] {
            let (voxels, bytes) = streamed(map, format, region, memory_bytes).unwrap();
            assert!(bytes == expected, "{format:?} with {memory_bytes} bytes of memory");
            assert_eq!(voxels, count);
        }
    }
}

fn config() -> MapConfig {
    // Tiles of 11 voxels: no tile is aligned with a brick.
    MapConfig::new(0.1, 1.1).unwrap().with_range(0.0, 5.0)
}

#[test]
fn the_file_of_a_map_is_that_of_its_whole_tree() {
    let mut random = Random(31);
    let mut map = InMemoryMapper::new(config()).unwrap();
    check(&map, None);
    for round in 0..3 {
        let center = [0.5 - f64::from(round), 0.0, 0.3];
        map.insert_scan(&random_scan(&mut random, center, 60)).unwrap();
        check(&map, None);
        let corner = random.point(center, 2.0);
        check(&map, Some(&Aabb { min: corner, max: corner.map(|x| x + 1.234) }));
    }
}

#[test]
fn an_export_includes_unsaved_updates_and_evicts_no_tile() {
    let folder = TempDir::new().unwrap();
    let mut random = Random(32);
    let small = config().with_cache_tiles(60);
    let mut map = OutOfCoreTileMapper::create(folder.path().join("map"), small).unwrap();
    let mut naive = InMemoryMapper::new(config()).unwrap();
    for round in 0..4 {
        let scan = random_scan(&mut random, [0.3 * f64::from(round), -0.2, 0.1], 50);
        map.insert_scan(&scan).unwrap();
        naive.insert_scan(&scan).unwrap();
        if round == 1 {
            map.flush().unwrap();
        }
    }
    let before = (map.statistics(), map.cached_tile_indices());
    assert!(before.0.buffered_tiles > 0 && before.0.dirty_tiles > 0);
    for format in FORMATS {
        let (_, bytes) = streamed(&map, format, None, 10_000).unwrap();
        assert!(bytes == whole(&naive, format, None), "{format:?}");
    }
    assert_eq!(map.digest().unwrap(), naive.digest().unwrap());
    assert_eq!(map.all_occupied_voxels(None).unwrap(), naive.all_occupied_voxels(None).unwrap());
    let after = map.statistics();
    assert_eq!((after.buffered_updates, map.cached_tile_indices()), (before.0.buffered_updates, before.1));
    assert_eq!((after.dirty_tiles, after.io.saves), (before.0.dirty_tiles, before.0.io.saves));
    map.flush().unwrap();
    check(&MapReader::open(folder.path().join("map"), 0).unwrap(), None);
}

fn update(map: &mut impl Mapper, voxels: impl IntoIterator<Item = ([i32; 3], u32)>) {
    for (voxel, hits) in voxels {
        let points = vec![map.config().grid.center_m(voxel); hits as usize];
        let is_occupied = vec![true; hits as usize];
        map.batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &is_occupied })
            .unwrap();
    }
}

fn cube(min: [i32; 3], edge: i32) -> impl Iterator<Item = [i32; 3]> {
    (0..edge.pow(3)).map(move |k| {
        let offset = [k % edge, k / edge % edge, k / edge / edge];
        std::array::from_fn(|axis| min[axis] + offset[axis])
    })
}

#[test]
fn single_voxels_and_cubes_that_are_pruned_whole() {
    for voxel in [[0; 3], [-1; 3], [32767; 3], [-32768; 3], [5, -7, 1234]] {
        let mut map = InMemoryMapper::new(config()).unwrap();
        update(&mut map, [(voxel, 1)]);
        check(&map, None);
    }
    // Cubes of one value over several tiles and blocks, and a single other voxel.
    let mut map = InMemoryMapper::new(config()).unwrap();
    update(&mut map, cube([-32, 0, -32], 32).map(|voxel| (voxel, 1)));
    check(&map, None);
    update(&mut map, [([-1, 31, -1], 1)]);
    check(&map, None);
}

#[test]
fn a_file_is_pruned_as_far_as_by_octomap() {
    // Cubes of 2 voxels with one value each. OctoMap's pruning by state begins at the voxels and finds nothing there,
    // although nodes above could be pruned.
    let mut map = InMemoryMapper::new(config()).unwrap();
    let value = |voxel: [i32; 3]| {
        1 + voxel.iter().zip([1, 2, 4]).map(|(k, bit)| (k >> 1 & 1) as u32 * bit).sum::<u32>()
    };
    for min in [[0; 3], [-40, 8, 16]] {
        update(&mut map, cube(min, 4).map(|voxel| (voxel, value(voxel).min(6))));
    }
    check(&map, None);
    // Once OctoMap finds something to prune among voxels, it prunes everything.
    update(&mut map, cube([64; 3], 2).map(|voxel| (voxel, 1 + (voxel[0] & 1) as u32)));
    check(&map, None);
}

#[test]
fn voxels_beyond_octomaps_keys_are_an_error_without_output() {
    let mut map = InMemoryMapper::new(config()).unwrap();
    update(&mut map, [([32768, 0, 0], 1), ([32767, 0, 0], 1), ([3, 4, 5], 1)]);
    for format in FORMATS {
        let error = streamed(&map, format, None, 1000).unwrap_err();
        assert!(matches!(error.downcast_ref(), Some(Error::InvalidArgument { .. })), "{error}");
        assert!(error.to_string().contains("`origin` 2000 0 0"), "{error}");
    }
    let inside = Aabb { min: [-1.0; 3], max: [3276.8, 1.0, 1.0] };
    check(&map, Some(&inside));
    let nowhere = Aabb { min: [5_000.0; 3], max: [6_000.0; 3] };
    check(&map, Some(&nowhere));
}

#[test]
fn a_file_with_an_origin_is_that_of_the_map_moved_by_whole_voxels() {
    let mut random = Random(32);
    let far = [63_781_370, -41_820_013, 1_003];
    for shift in [[8, -16, 4_096], [1, 0, -3], far, [2_000_000_000, -2_000_000_000, 17], [0, 0, 40_000]] {
        let mut voxels: BTreeMap<[i32; 3], u32> = BTreeMap::new();
        // Random voxels, a cube that can be pruned at its old position, and one that can be pruned at its new position.
        for _ in 0..400 {
            voxels.insert(std::array::from_fn(|_| random.below(60) as i32 - 30), 1 + random.below(3) as u32);
        }
        voxels.extend(cube([-32, 0, 64], 8).map(|voxel| (voxel, 2)));
        voxels.extend(cube(shift.map(|k: i32| 80 - (k & 7)), 8).map(|voxel| (voxel, 1)));
        let moved = |voxel: [i32; 3]| -> [i32; 3] { std::array::from_fn(|k| voxel[k] + shift[k]) };
        let mut near = InMemoryMapper::new(config()).unwrap();
        let mut away = InMemoryMapper::new(config()).unwrap();
        update(&mut near, voxels.iter().map(|(&voxel, &hits)| (voxel, hits)));
        update(&mut away, voxels.iter().map(|(&voxel, &hits)| (moved(voxel), hits)));
        for format in FORMATS {
            let (count, expected) = streamed(&near, format, None, usize::MAX).unwrap();
            assert_eq!(count, voxels.len() as u64);
            for memory_bytes in [0, 3_000, usize::MAX] {
                let export = OctreeExport { format, region: None, origin: shift, memory_bytes };
                let (mut spool, mut bytes) = (Cursor::new(Vec::new()), Vec::new());
                away.write_octree::<Box<dyn std::error::Error>>(&export, &mut spool, &mut bytes).unwrap();
                assert!(
                    bytes == expected,
                    "{format:?} moved by {shift:?} with {memory_bytes} bytes of memory"
                );
            }
        }
    }
}

/// Any division of a tree into blocks gives the same bytes.
#[test]
fn blocks_of_any_size_are_the_whole_tree() {
    let mut random = Random(33);
    for round in 0..60 {
        let mut voxels = BTreeMap::new();
        for _ in 0..random.below(6) {
            let base =
                [0, 0x1234_5678_9a00, 0x1234_5678_0000, MortonCode::END - 4096][random.below(4) as usize];
            let value = [1.5_f32, -2.0, 0.0, -0.0][random.below(4) as usize];
            let first = base + random.below(4096 - 700);
            let dense = random.below(2) == 0;
            voxels.extend((first..first + random.below(700)).map(|code| {
                let value = if dense { value } else { random.below(3) as f32 - 1.0 };
                (MortonCode(code), value)
            }));
        }
        let tree = Octree::from_sorted(voxels.iter().map(|(&code, &value)| (code, value)));
        let (mut bt, mut ot) = (Vec::new(), Vec::new());
        write_bt(&tree, 0.05, 0.0, &mut bt).unwrap();
        write_ot(&tree, 0.05, &mut ot).unwrap();
        let seed = random.next();
        assert!(in_blocks(&voxels, OctreeFormat::Bt, seed) == bt, "round {round}");
        assert!(in_blocks(&voxels, OctreeFormat::Ot, seed) == ot, "round {round}");
    }
}

fn in_blocks(voxels: &BTreeMap<MortonCode, f32>, format: OctreeFormat, seed: u64) -> Vec<u8> {
    let mut pruning = BtPruning::default();
    for _ in 0..2 {
        let (mut bytes, mut spool) = (Vec::new(), Cursor::new(Vec::new()));
        let mut stream = match format {
            OctreeFormat::Bt => OctreeStream::bt(0.0, pruning, &mut spool),
            _ => OctreeStream::ot(&mut spool),
        };
        add_blocks(&mut stream, voxels, MortonCode(0), 0, &mut Random(seed));
        match stream.finish(0.05, &mut bytes).unwrap() {
            StreamOutcome::Written { voxels: count, .. } => {
                assert_eq!(count, voxels.len() as u64);
                return bytes;
            }
            StreamOutcome::Again(further) => pruning = further,
        }
    }
    panic!("a stream with a given depth of pruning must be complete");
}

fn add_blocks(
    stream: &mut OctreeStream<&mut Cursor<Vec<u8>>>,
    voxels: &BTreeMap<MortonCode, f32>,
    first: MortonCode,
    depth: u8,
    random: &mut Random,
) {
    let inside = || voxels.range(first..MortonCode(first.0 + MortonCode::span(depth)));
    if inside().next().is_none() {
        return;
    }
    if depth < 13 && random.below(12) > 0 {
        for child in 0..8 {
            let first = MortonCode(first.0 + child * MortonCode::span(depth + 1));
            add_blocks(stream, voxels, first, depth + 1, random);
        }
        return;
    }
    let mut values = BrickValues::default();
    // Each brick in two parts, as on the border of two tiles.
    for part in 0..2 {
        let mine: Vec<_> = inside().filter(|(code, _)| code.0 / 3 % 2 == part).collect();
        for brick in mine.chunk_by(|a, b| a.0.brick() == b.0.brick()) {
            values.begin(brick[0].0.brick());
            brick.iter().for_each(|(code, value)| values.add(code.place_in_brick(), **value));
            values.end();
        }
    }
    stream.add_block(first, depth, &mut values).unwrap();
}

/// An unreadable tile is an error, and no output is written.
#[test]
fn a_damaged_tile_ends_the_export() -> Result<()> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("map");
    let mut map = OutOfCoreTileMapper::create(&path, config())?;
    let origin: Point = [0.05; 3];
    map.batch_update(&PointBatch { points: &[origin], intensities: None, is_occupied: &[true] })?;
    map.flush()?;
    let table = map.tile_folder(map.tile_indices()[0]).join("iwlo_meta.bin");
    drop(map);
    let mut bytes = std::fs::read(&table).unwrap();
    bytes[20] ^= 1;
    std::fs::write(&table, bytes).unwrap();
    let error = streamed(&MapReader::open(&path, 0)?, OctreeFormat::Ot, None, 1000).unwrap_err();
    assert!(matches!(error.downcast_ref(), Some(Error::Damaged { .. })), "{error}");
    Ok(())
}
