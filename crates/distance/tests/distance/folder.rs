use crate::naive::Naive;
use crate::random_map::{TILE_SIZES_M, centers_box, config, grow, random_options, random_region, sample};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use testkit::memory_folder::memory_folder;
use testkit::random_scans::Random;
use testkit::support::{cases, message_of};
use voxtile::mapper::{MapReader, MapView, OutOfCoreTileMapper};
use voxtile::scan::Stop;
use voxtile::space::VoxelBox;
use voxtile::{Aabb, Error, MapOptions, Mapper, Scan, TileIndex};
use voxtile_distance::{
    DistanceOptions, FieldOptions, FieldReader, FieldReport, MapDistances, UnknownRule, VoxelDistance,
    compute_field,
};

fn new_map(folder: &Path, tile_size_m: f64) -> OutOfCoreTileMapper {
    MapOptions::new().config(config(tile_size_m)).create_if_missing(true).open(folder).unwrap()
}

fn compute(map: &MapReader, folder: &Path, options: &FieldOptions) -> FieldReport {
    compute_field(map, folder, options, &|_, _| {}).unwrap()
}

fn open(folder: &Path) -> FieldReader {
    FieldReader::open(folder, 1 << 20).unwrap()
}

/// Content of all files of a field.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for folder in [folder.to_owned(), folder.join("tiles")] {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                files.insert(path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(path).unwrap());
            }
        }
    }
    files
}

/// A box of voxels a little larger than the map.
fn around(map: &impl MapView) -> VoxelBox {
    let grid = map.config().grid;
    let voxels = grid.voxels_of_tiles(map.tile_bounds().unwrap());
    VoxelBox { min: voxels.min.map(|k| (k - 12).max(-60)), end: voxels.end.map(|k| (k + 12).min(60)) }
}

#[test]
fn fields_of_random_maps_equal_the_brute_force_and_do_not_depend_on_memory_or_earlier_fields() {
    for case in 0..cases(12, 500) {
        let random = &mut Random(case);
        let folder = memory_folder();
        let path = |name: &str| folder.path().join(name);
        let mut map = new_map(&path("map"), TILE_SIZES_M[case as usize % 3]);
        let distances = random_options(random);
        // Maps of the smallest tiles have thousands of them.
        let region = match case % 3 {
            0 => Some(Aabb { min: random.point([0.0; 3], 0.5), max: random.point([1.5; 3], 0.5) }),
            _ => (random.below(3) == 0).then(|| random_region(random)),
        };
        let options = FieldOptions::new(distances).with_region(region).with_map_id(Some("id".to_owned()));
        for step in 0..2 {
            grow(&mut map, random, [0.3, -0.4, 0.2]);
            map.flush().unwrap();
            let reader = MapReader::open(path("map"), 1 << 20).unwrap();
            let report = compute(
                &reader,
                &path("field"),
                &options.clone().with_memory(random.below(1 << 22) as usize),
            );
            let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
            let at_once = path(&format!("field {step}"));
            pool.install(|| compute(&reader, &at_once, &options.clone().with_memory(1 << 28)));
            assert_eq!(report.tiles_kept + report.tiles_computed, report.tiles, "{report:?}");
            assert!(files(&path("field")) == files(&at_once), "case {case}, step {step}: {distances:?}");
            let field = open(&path("field"));
            assert_eq!(
                (field.options(), field.grid(), field.map_id()),
                (distances, reader.config().grid, Some("id"))
            );
            let naive = Naive::of(&reader, distances);
            let voxels = around(&reader);
            let of_map = reader.distance_field(&centers_box(&field.grid(), &voxels), distances).unwrap();
            let loaded = field.load(&centers_box(&field.grid(), &voxels)).unwrap();
            let tiles_of_region = region.map(|region| {
                let voxels = field.grid().voxels_in(&region);
                let last = voxels.end.map(|k| k - 1);
                [field.grid().tile_of_voxel(voxels.min), field.grid().tile_of_voxel(last)]
                    .map(TileIndex::to_array)
            });
            for voxel in sample(random, &voxels, 80) {
                let tile = field.grid().tile_of_voxel(voxel).to_array();
                let is_inside = tiles_of_region
                    .is_none_or(|[low, high]| (0..3).all(|k| low[k] <= tile[k] && tile[k] <= high[k]));
                let expected = if is_inside { naive.distance(voxel) } else { VoxelDistance::UNKNOWN };
                assert_eq!(
                    field.voxel(voxel).unwrap(),
                    expected,
                    "case {case}: {voxel:?} {distances:?} {region:?}"
                );
                assert_eq!(loaded.voxel(voxel), expected);
            }
            if region.is_none() {
                assert!(loaded.to_array() == of_map.to_array());
                let points: Vec<_> = (0..100).map(|_| random.point([0.0; 3], 3.0)).collect();
                assert_eq!(
                    field.distance_and_gradient_at(&points).unwrap(),
                    loaded.distance_and_gradient_at(&points)
                );
                let path = [random.point([0.0; 3], 2.0), random.point([0.0; 3], 2.0)];
                let clearance = field.clearance_along(&path, 0.1).unwrap();
                assert_eq!(clearance, loaded.clearance_along(&path, 0.1).unwrap());
            }
        }
    }
}

/// A map with obstacles near the origin and, 30 m away, near another place; returns the reader.
fn two_places(folder: &Path, tile_size_m: f64) -> MapReader {
    let mut map = new_map(folder, tile_size_m);
    let random = &mut Random(5);
    grow(&mut map, random, [0.0; 3]);
    grow(&mut map, random, [30.0, 0.0, 0.0]);
    map.flush().unwrap();
    MapReader::open(folder, 1 << 20).unwrap()
}

#[test]
fn only_tiles_within_the_cap_of_a_change_are_computed_again() {
    let folder = memory_folder();
    let (map_path, field_path) = (folder.path().join("map"), folder.path().join("field"));
    let reader = two_places(&map_path, 2.0);
    let options = FieldOptions::new(DistanceOptions::new(0.5).with_unknown(UnknownRule::Free));
    let first = compute(&reader, &field_path, &options);
    assert!(first.tiles_kept == 0 && first.tiles_computed == first.tiles && first.has_obstacles);
    assert_eq!(compute(&reader, &field_path, &options).tiles_kept, first.tiles);
    let mut map = new_map(&map_path, 2.0);
    map.insert_scan(&Scan { origin: [31.0, 0.0, 0.0], points: vec![[31.5, 0.0, 0.0]], intensities: None })
        .unwrap();
    map.flush().unwrap();
    let reader = MapReader::open(&map_path, 1 << 20).unwrap();
    let update = compute(&reader, &field_path, &options);
    assert!(update.tiles_computed > 0 && update.tiles_kept > first.tiles / 3, "{first:?} {update:?}");
    // Another cap needs all tiles again, and earlier files are removed.
    let other = FieldOptions::new(DistanceOptions::new(0.3).with_unknown(UnknownRule::Free));
    assert_eq!(compute(&reader, &field_path, &other).tiles_kept, 0);
    let fresh = folder.path().join("fresh");
    compute(&reader, &fresh, &other);
    assert!(files(&fresh) == files(&field_path));
}

#[test]
fn a_stopped_run_leaves_the_earlier_field_and_is_continued() {
    let folder = memory_folder();
    let (map_path, field_path) = (folder.path().join("map"), folder.path().join("field"));
    let reader = two_places(&map_path, 0.5);
    let first = FieldOptions::new(DistanceOptions::new(0.3)).with_memory(0);
    let second = FieldOptions::new(DistanceOptions::new(0.4)).with_memory(0);
    compute(&reader, &field_path, &first);
    let [of_first, fresh] = ["of first", "fresh"].map(|name| folder.path().join(name));
    compute(&reader, &of_first, &first);
    let all = compute(&reader, &fresh, &second).tiles;
    let mut already = 0;
    for moment in [0, 1, 2, all / 2, all - 1, all] {
        let stop = Stop::default();
        let progress = |done: u64, _: u64| {
            if done >= moment.saturating_sub(already) {
                stop.set();
            }
        };
        let stopped = compute_field(&reader, &field_path, &second.clone().with_stop(stop.clone()), &progress);
        assert!(matches!(stopped, Err(Error::Stopped)), "{moment}: {stopped:?}");
        already = already.max(moment);
        // The earlier field is complete.
        let field = open(&field_path);
        assert_eq!(field.options(), first.distances);
        let (before, found) = (files(&of_first), files(&field_path));
        assert!(before.iter().all(|(name, content)| found.get(name) == Some(content)));
    }
    fs::write(field_path.join("tiles/.voxtile-left"), "by a killed process").unwrap();
    let report = compute(&reader, &field_path, &second);
    assert!(report.tiles_kept >= all - 1 && files(&field_path) == files(&fresh), "{report:?}");
}

/// Paths of a field's tiles.
fn tile_paths(field: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<_> =
        fs::read_dir(field.join("tiles")).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// Distance of a voxel in every tile of a field.
fn read_all(field: &FieldReader) -> voxtile::Result<()> {
    let grid = field.grid();
    field.tile_indices().into_iter().try_for_each(|tile| field.voxel(grid.voxels_of_tile(tile).min).map(drop))
}

#[test]
fn damaged_tiles_of_a_field_are_named_and_computed_again() {
    let folder = memory_folder();
    let field_path = folder.path().join("field");
    let reader = two_places(&folder.path().join("map"), 0.5);
    let options = FieldOptions::new(DistanceOptions::new(0.3));
    compute(&reader, &field_path, &options);
    let whole = files(&field_path);
    let random = &mut Random(3);
    let paths = tile_paths(&field_path);
    for case in 0..40 {
        let path = &paths[random.below(paths.len() as u64) as usize];
        let mut bytes = fs::read(path).unwrap();
        let at = random.below(bytes.len() as u64) as usize;
        match case % 4 {
            0 => bytes.truncate(at),
            1 => bytes.extend([0; 9]),
            _ => bytes[at] ^= 1 << random.below(8),
        }
        if case == 7 {
            fs::remove_file(path).unwrap()
        } else {
            fs::write(path, bytes).unwrap()
        }
        let message = message_of(read_all(&open(&field_path)));
        assert!(message.contains(path.to_str().unwrap()), "{message}");
        let report = compute(&reader, &field_path, &options);
        assert_eq!((report.tiles_computed, report.damaged_field_tiles.len()), (1, 1), "{report:?}");
        assert!(report.damaged_field_tiles[0].contains(path.to_str().unwrap()), "{report:?}");
        assert!(files(&field_path) == whole);
    }
    let index = field_path.join("field.json");
    for broken in ["", "{}", "[1, 2", r#"{"format": 3}"#] {
        fs::write(&index, broken).unwrap();
        assert!(message_of(FieldReader::open(&field_path, 0)).contains("field.json"));
        let report = compute(&reader, &field_path, &options);
        assert!(report.damaged_field_tiles[0].contains("field.json") && files(&field_path) == whole);
    }
    // Wrong values are refused before anything is sized by them.
    let text = String::from_utf8(whole["field.json"].clone()).unwrap();
    for (from, to) in [
        (r#""tile_size_m":0.5"#, r#""tile_size_m":1e300"#),
        (r#""max_distance_m":0.3"#, r#""max_distance_m":1e9"#),
        (r#""version":1"#, r#""version":2"#),
    ] {
        assert!(text.contains(from), "{text}");
        fs::write(&index, text.replace(from, to)).unwrap();
        assert!(message_of(FieldReader::open(&field_path, 0)).contains("field.json"));
    }
}

#[test]
fn random_bytes_as_a_tile_of_a_field_are_an_error() {
    let folder = memory_folder();
    let field_path = folder.path().join("field");
    let reader = two_places(&folder.path().join("map"), 0.5);
    compute(&reader, &field_path, &FieldOptions::new(DistanceOptions::new(0.3)));
    let path = tile_paths(&field_path).remove(0);
    let whole = fs::read(&path).unwrap();
    let random = &mut Random(9);
    for _ in 0..200 {
        // A valid header and checksum around wrong content.
        let mut bytes = whole[..44].to_vec();
        let count = random.below(100);
        bytes.extend((0..count).map(|_| random.below(256) as u8));
        bytes[32..40].copy_from_slice(&count.to_le_bytes());
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&bytes[..40]);
        hasher.update(&bytes[44..]);
        bytes[40..44].copy_from_slice(&hasher.finalize().to_le_bytes());
        fs::write(&path, bytes).unwrap();
        assert!(message_of(read_all(&open(&field_path))).contains(path.to_str().unwrap()));
    }
}

/// The file of a tile's table in a map.
fn file_of_tile(map: &Path, tile: TileIndex) -> PathBuf {
    let folder = map.join(format!("tile_{}_{}_{}", tile.x, tile.y, tile.z));
    let names = ["tile.vxt", "iwlo_meta.bin"].map(|name| folder.join(name));
    names.into_iter().find(|path| path.is_file()).unwrap()
}

#[test]
fn surroundings_of_damaged_tiles_of_the_map_are_unknown() {
    let mut wrong = 0;
    for case in 0..9 {
        let random = &mut Random(40 + case);
        let folder = memory_folder();
        let (map_path, field_path) = (folder.path().join("map"), folder.path().join("field"));
        drop(two_places(&map_path, 1.0));
        let reader = MapReader::open(&map_path, 1 << 20).unwrap();
        let rule = [UnknownRule::Unknown, UnknownRule::Free, UnknownRule::Obstacle][case as usize % 3];
        let distances = DistanceOptions::new(0.7).with_unknown(rule).with_sign(random.below(2) == 0);
        let options = FieldOptions::new(distances);
        let grid = reader.config().grid;
        // Where unknown voxels are free, tiles without obstacles are not read.
        let has_obstacles = |tile: &TileIndex| reader.version_of_tile(*tile).unwrap().occupied > 0;
        let damaged = reader.tile_indices().into_iter().filter(has_obstacles).nth(3).unwrap();
        let naive = Naive::of(&reader, distances);
        let file = file_of_tile(&map_path, damaged);
        let whole = fs::read(&file).unwrap();
        fs::write(&file, &whole[..whole.len() / 2]).unwrap();
        let report = compute(&MapReader::open(&map_path, 1 << 20).unwrap(), &field_path, &options);
        assert_eq!(report.damaged_map_tiles.len(), 1, "{report:?}");
        assert!(report.damaged_map_tiles[0].contains(&damaged.to_string()), "{report:?}");
        let field = open(&field_path);
        assert_eq!(field.damaged_map_tiles(), [damaged]);
        let tile = grid.voxels_of_tile(damaged);
        let near = VoxelBox { min: tile.min.map(|k| k - 9), end: tile.end.map(|k| k + 9) };
        for voxel in sample(random, &near, 200) {
            let found = field.voxel(voxel).unwrap();
            // The definition: unknown where the damaged tile could change the distance, else the same as without damage.
            let truth = naive.distance(voxel);
            assert!(found == truth || found.is_unknown(), "{voxel:?}: {found:?}, {truth:?}");
            let to_tile: i32 =
                (0..3).map(|k| (tile.min[k] - voxel[k]).max(voxel[k] - tile.end[k] + 1).max(0).pow(2)).sum();
            let may_change = to_tile <= 49 && i32::from(truth.to_bits().unsigned_abs()) >= to_tile;
            if !may_change {
                assert_eq!(found, truth, "{voxel:?}");
            } else if truth.squared_voxels().is_none_or(|squared| i32::from(squared.unsigned_abs()) > to_tile)
            {
                wrong += 1;
            }
        }
        // Repaired, without a new version.
        fs::write(&file, &whole).unwrap();
        let report = compute(&MapReader::open(&map_path, 1 << 20).unwrap(), &field_path, &options);
        assert!(report.damaged_map_tiles.is_empty() && report.tiles_computed > 0 && report.tiles_kept > 0);
        let fresh = folder.path().join("fresh");
        compute(&MapReader::open(&map_path, 1 << 20).unwrap(), &fresh, &options);
        assert!(files(&field_path) == files(&fresh));
    }
    assert!(wrong > 50, "{wrong}");
}

#[test]
fn foreign_folders_are_refused_and_remain() {
    let folder = memory_folder();
    let map_path = folder.path().join("map");
    let reader = two_places(&map_path, 2.0);
    let options = FieldOptions::new(DistanceOptions::new(0.5));
    let attempt = |folder: &Path| message_of(compute_field(&reader, folder, &options, &|_, _| {}));
    let foreign = folder.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("file"), "content").unwrap();
    assert!(
        attempt(&foreign).contains("empty folder") && fs::read(foreign.join("file")).unwrap() == b"content"
    );
    assert!(attempt(&foreign.join("file")).contains("empty folder"));
    assert!(attempt(&map_path.join("field")).contains("inside the map"));
    assert!(attempt(&map_path).contains("content"), "{}", attempt(&map_path));
    assert!(message_of(FieldReader::open(&foreign, 0)).contains("voxtile distance"));
    let nothing = FieldOptions::new(DistanceOptions::new(0.5))
        .with_region(voxtile::Aabb { min: [0.01; 3], max: [0.02; 3] });
    let error = compute_field(&reader, &folder.path().join("empty"), &nothing, &|_, _| {});
    assert!(message_of(error).contains("no center"));
}

#[test]
fn two_processes_do_not_write_one_field() {
    let folder = memory_folder();
    let reader = two_places(&folder.path().join("map"), 2.0);
    let field_path = folder.path().join("field");
    let options = FieldOptions::new(DistanceOptions::new(0.5));
    let refused = AtomicU64::new(0);
    let progress = |_: u64, _: u64| {
        let message = message_of(compute_field(&reader, &field_path, &options, &|_, _| {}));
        assert!(message.contains("another process"), "{message}");
        refused.fetch_add(1, Relaxed);
    };
    compute_field(&reader, &field_path, &options, &progress).unwrap();
    assert!(refused.load(Relaxed) > 0);
}

#[test]
fn a_map_without_obstacles_is_reported() {
    let folder = memory_folder();
    let (map_path, field_path) = (folder.path().join("map"), folder.path().join("field"));
    let mut map = new_map(&map_path, 1.0);
    let batch = voxtile::scan::PointBatch { points: &[[0.05; 3]], intensities: None, is_occupied: &[false] };
    map.batch_update(&batch).unwrap();
    map.flush().unwrap();
    let reader = MapReader::open(&map_path, 1 << 20).unwrap();
    let report = compute(&reader, &field_path, &FieldOptions::new(DistanceOptions::new(0.5)));
    assert!(!report.has_obstacles);
    let field = open(&field_path);
    assert_eq!(field.voxel([0; 3]).unwrap(), VoxelDistance::BEYOND);
    assert_eq!(field.voxel([1; 3]).unwrap(), VoxelDistance::UNKNOWN);
    let free = FieldOptions::new(DistanceOptions::new(0.5).with_unknown(UnknownRule::Free));
    assert_eq!(compute(&reader, &field_path, &free).tiles, 0);
    assert_eq!(open(&field_path).voxel([1; 3]).unwrap(), VoxelDistance::BEYOND);
}
