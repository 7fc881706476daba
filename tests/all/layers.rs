//! Layers: compared with naive sums for all mappers, storages, memory limits and operations.

use crate::harness::all_layers;
use rayon::ThreadPoolBuilder;
use std::time::Duration;
use testkit::attributed_scan::AttributedScan;
use testkit::random_scans::Random;
use testkit::reference_layers::{LayerSums, layers_of};
use testkit::reference_map::{ReferenceMap, voxels_of};
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::integrity::{repair, verify};
use voxtile::operations::{
    CopyScans, Decay, MaxAge, Part, Prefer, Replay, ScanSelection, clear, convert, crop, decay, diff,
    forget_old, merge, rebuild, remove_points, remove_scans,
};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::{
    Aabb, Error, InMemoryMapper, InsertMode, Layers, MapConfig, MapPath, MapQueries, MapReader, MapView,
    Mapper, OutOfCoreTileMapper, PointAttributes, ScanPoints, Stop, Storage, TileBox, VoxelIndex,
};

fn scans(seed: u64, count: usize, points: usize) -> Vec<AttributedScan> {
    let mut random = Random(seed);
    (0..count).map(|_| AttributedScan::random(&mut random, [0.5; 3], points)).collect()
}

/// Sums over the points that hit a voxel.
fn naive(config: &MapConfig, scans: &[AttributedScan]) -> LayerSums {
    let mut map = ReferenceMap::new(config);
    scans.iter().for_each(|scan| map.insert_attributed(scan));
    if let Some(region) = config.rays.region {
        map.layers.retain(|voxel, _| region.contains(config.grid.tile_of_voxel(*voxel)));
    }
    map.layers
}

fn config() -> MapConfig {
    MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 5.0).with_layers(all_layers())
}

/// Each layer alone, none, and all of them with different rays, models and tiles.
fn configs() -> Vec<MapConfig> {
    let with = |set: fn(&mut Layers)| {
        let mut layers = Layers::NONE;
        set(&mut layers);
        config().with_layers(layers)
    };
    let mut configs = vec![
        with(|_| {}),
        with(|layers| layers.colour = true),
        with(|layers| layers.intensity_max = Some(1.0)),
        with(|layers| layers.class = true),
        with(|layers| layers.time = true),
        with(|layers| layers.shape = true),
        config().with_insert_mode(InsertMode::PerRay),
        config().with_sensor_model(SensorModel::Iwlo(Iwlo::default())),
        MapConfig::new(0.4, 0.8).unwrap().with_layers(all_layers()),
        MapConfig::new(0.4, 40.0).unwrap().with_layers(all_layers()),
    ];
    let tile = config().grid.tile_of([0.5; 3]).unwrap();
    configs.push(config().with_region(TileBox::new(tile, tile)));
    configs
}

fn at(folder: &tempfile::TempDir, name: &str) -> MapPath {
    MapPath::on(UnsyncedDisk::shared(), folder.path().join(name))
}

fn build(path: MapPath, config: &MapConfig, scans: &[AttributedScan]) -> OutOfCoreTileMapper {
    let mut mapper = OutOfCoreTileMapper::create(path, config.clone()).unwrap();
    for scan in scans {
        mapper.insert_points(&scan.points()).unwrap();
    }
    mapper.flush().unwrap();
    mapper
}

#[test]
fn layers_equal_naive_sums_for_all_mappers() {
    for (seed, config) in (0..).zip(configs()) {
        let scans = scans(seed, 5, 120);
        let expected = naive(&config, &scans);
        let mut in_memory = InMemoryMapper::new(config.clone()).unwrap();
        for scan in &scans {
            in_memory.insert_points(&scan.points()).unwrap();
        }
        assert!(layers_of(&in_memory) == expected, "{config:?}");
        let digest = in_memory.layer_digest().unwrap();
        let evidence = in_memory.digest().unwrap();
        for (storage, bytes) in [
            (Storage::Compact, None),
            (Storage::OctoMap, Some(60_000)),
            (Storage::Compact, Some(60_000)),
            (Storage::OctoMap, Some(0)),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let mut config = config.clone().with_storage(storage);
            if let Some(bytes) = bytes {
                config = config.with_tight_memory_bytes(bytes);
            }
            let mapper = build(at(&folder, "map"), &config, &scans);
            assert_eq!((mapper.layer_digest().unwrap(), mapper.digest().unwrap()), (digest, evidence));
            drop(mapper);
            let map = MapReader::open(at(&folder, "map"), 0).unwrap();
            assert_eq!(map.config().layers(), config.layers());
            assert!(layers_of(&map) == expected, "{config:?}");
            let mut findings = Vec::new();
            verify(at(&folder, "map"), |finding| findings.push(finding.clone()), |_, _| {}).unwrap();
            assert!(findings.is_empty(), "{findings:?}");
        }
    }
}

#[test]
fn layers_do_not_depend_on_threads_order_or_batches() {
    let config = config();
    let scans = scans(77, 9, 300);
    let digest = {
        let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
        for scan in scans.iter().rev() {
            mapper.insert_points(&scan.points()).unwrap();
        }
        mapper.layer_digest().unwrap()
    };
    let all: Vec<_> = scans.iter().map(AttributedScan::points).collect();
    let all: Vec<&dyn ScanPoints> = all.iter().map(|scan| scan as _).collect();
    for (threads, bytes) in [(1, None), (3, None), (8, Some(40 << 20)), (2, Some(60_000))] {
        let folder = tempfile::tempdir().unwrap();
        let mut config = config.clone();
        if let Some(bytes) = bytes {
            config = config.with_tight_memory_bytes(bytes);
        }
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut mapper = OutOfCoreTileMapper::create(at(&folder, "map"), config).unwrap();
        pool.install(|| mapper.insert_all(&all, &mut Vec::new())).unwrap();
        assert_eq!(mapper.layer_digest().unwrap(), digest, "{threads} threads, {bytes:?} bytes");
    }
}

#[test]
fn hits_without_rays_are_counted_once_each() {
    let config = MapConfig::new(0.4, 3.2).unwrap().with_layers(all_layers());
    let scans = scans(5, 2, 400);
    let folder = tempfile::tempdir().unwrap();
    let mut digests = Vec::new();
    for (name, bytes) in [("whole", 1 << 30), ("parts", 40_000)] {
        let config = config.clone().with_tight_memory_bytes(bytes);
        let mut mapper = OutOfCoreTileMapper::create(at(&folder, name), config).unwrap();
        for scan in &scans {
            mapper.insert_hits(&scan.points()).unwrap();
        }
        mapper.flush().unwrap();
        let points: u64 = layers_of(&mapper).values().map(|layers| layers.points).sum();
        // All finite points in range hit, also those at the origin.
        let hits = |scan: &AttributedScan| {
            scan.scan.points.iter().filter(|point| config_voxel(**point)).count() as u64
        };
        assert_eq!(points, scans.iter().map(hits).sum::<u64>());
        digests.push(mapper.layer_digest().unwrap());
    }
    assert_eq!(digests[0], digests[1]);
}

fn config_voxel(point: [f64; 3]) -> bool {
    MapConfig::new(0.4, 3.2).unwrap().grid.voxel_of(point).is_some()
}

#[test]
fn occupied_voxels_without_a_recent_hit_are_forgotten() {
    let (mut forgotten, mut without, mut removed) = (0, 0, 0);
    for seed in 0..8 {
        let folder = tempfile::tempdir().unwrap();
        let storage = if seed % 2 == 0 { Storage::OctoMap } else { Storage::Compact };
        let config = MapConfig::new(0.4, 0.8).unwrap().with_range(0.0, 5.0).with_layers(all_layers());
        drop(build(at(&folder, "map"), &config.with_storage(storage), &scans(seed, 6, 60)));
        let open = || MapReader::open(at(&folder, "map"), 0).unwrap();
        let (layers, before) = (layers_of(&open()), voxels_of(&open()));
        let last_ns = |voxel: &VoxelIndex| layers.get(voxel)?.time.map(|time| time.last_ns);
        let mut times: Vec<i64> = layers.keys().filter_map(last_ns).collect();
        times.sort_unstable();
        let newest = times[times.len() - 1];
        // Without a time of their own, ages count from the last hit.
        let (oldest, now) = match seed {
            0..4 => (times[times.len() * 2 / 3], None),
            4 => (newest, None),
            _ => (newest.saturating_add(1), Some(newest.saturating_add(5))),
        };
        let age = Duration::from_nanos(now.unwrap_or(newest).abs_diff(oldest));
        let rule = now.map_or(MaxAge::new(age), |now| MaxAge::new(age).with_now(now));
        let found = forget_old(at(&folder, "map"), &rule, |_, _| {}).unwrap();
        let is_occupied = |bits: u64| f64::from_bits(bits) >= 0.0;
        let mut expected = before.clone();
        expected.retain(|voxel, (bits, _)| {
            !is_occupied(*bits) || last_ns(voxel).is_none_or(|last_ns| last_ns >= oldest)
        });
        assert!(voxels_of(&open()) == expected, "seed {seed}: {found:?}");
        let left: LayerSums = layers
            .iter()
            .filter(|(voxel, _)| expected.contains_key(*voxel))
            .map(|(k, v)| (*k, v.clone()))
            .collect();
        assert!(layers_of(&open()) == left);
        let timeless =
            |(voxel, (bits, _)): &(&VoxelIndex, &(u64, i32))| is_occupied(*bits) && last_ns(voxel).is_none();
        assert_eq!(found.voxels_without_time, before.iter().filter(timeless).count() as u64);
        assert_eq!((found.oldest_ns, found.voxels), (Some(oldest), expected.len() as u64));
        assert_eq!(found.voxels_forgotten, (before.len() - expected.len()) as u64);
        assert_eq!(found.tiles, open().tile_indices().len() as u64);
        forgotten += found.voxels_forgotten;
        without += found.voxels_without_time;
        removed += found.tiles_removed;
    }
    assert!(forgotten > 100 && removed > 0, "{forgotten} {without} {removed}");
    let folder = tempfile::tempdir().unwrap();
    let plain = MapConfig::new(0.4, 3.2).unwrap();
    drop(build(at(&folder, "map"), &plain, &scans(1, 1, 20)));
    let refused = forget_old(at(&folder, "map"), &MaxAge::new(Duration::ZERO), |_, _| {}).unwrap_err();
    assert!(refused.to_string().contains("--layers time"), "{refused}");
}

#[test]
fn operations_keep_add_and_drop_layers() {
    let folder = tempfile::tempdir().unwrap();
    let scans = scans(11, 6, 200);
    let config = config();
    drop(build(at(&folder, "a"), &config, &scans[..4]));
    drop(build(at(&folder, "b"), &config, &scans[4..]));
    let open = |name: &str| MapReader::open(at(&folder, name), 0).unwrap();
    let path = |name: &str| folder.path().join(name);

    let maps = [open("a"), open("b")];
    merge(&maps, path("sum"), None, |_, _| {}).unwrap();
    assert!(layers_of(&open("sum")) == naive(&config, &scans));
    let (a, b) = (layers_of(&maps[0]), layers_of(&maps[1]));
    let evidence = maps.each_ref().map(voxels_of);
    for (prefer, wins) in [(Prefer::First, 0), (Prefer::Last, 1)] {
        let name = format!("preferred{wins}");
        merge(&maps, path(&name), Some(prefer), |_, _| {}).unwrap();
        let (first, other) = if wins == 0 { (&a, &b) } else { (&b, &a) };
        let mut expected = first.clone();
        let unseen = other.iter().filter(|(voxel, _)| !evidence[wins].contains_key(*voxel));
        expected.extend(unseen.map(|(voxel, made)| (*voxel, made.clone())));
        assert!(layers_of(&open(&name)) == expected, "{prefer:?}");
    }

    let region = Aabb { min: [-1.0, -2.0, -3.0], max: [2.0, 0.9, 1.1] };
    let center = |voxel: &VoxelIndex| voxel.map(|k| (f64::from(k) + 0.5) * 0.4);
    let is_in = |voxel: &VoxelIndex| {
        let center = center(voxel);
        (0..3).all(|k| region.min[k] <= center[k] && center[k] < region.max[k])
    };
    crop(&open("a"), &Part::Inside(region), CopyScans::No, path("cropped"), |_, _| {}).unwrap();
    let expected: LayerSums = a.clone().into_iter().filter(|(voxel, _)| is_in(voxel)).collect();
    assert!(layers_of(&open("cropped")) == expected);
    clear(at(&folder, "b"), &Part::Inside(region), |_, _| {}).unwrap();
    let expected: LayerSums = b.into_iter().filter(|(voxel, _)| !is_in(voxel)).collect();
    assert!(layers_of(&open("b")) == expected);

    let compact = convert(&open("a"), path("compact"), Storage::Compact, CopyScans::Yes, |_, _| {});
    compact.unwrap();
    assert!(layers_of(&open("compact")) == a);
    let fading = Decay::new(2.0).with_scans(3).with_forget_below(0.3);
    decay(at(&folder, "a"), &fading, |_, _| {}).unwrap();
    let left = voxels_of(&open("a"));
    let expected: LayerSums = a.into_iter().filter(|(voxel, _)| left.contains_key(voxel)).collect();
    assert!(layers_of(&open("a")) == expected);
}

#[test]
fn diff_counts_voxels_with_other_sums() {
    let folder = tempfile::tempdir().unwrap();
    let scans = scans(31, 4, 80);
    let read = |name, config: &MapConfig, scans| {
        build(at(&folder, name), config, scans);
        MapReader::open(at(&folder, name), 1 << 20).unwrap()
    };
    let differences = |a: &MapReader, b: &MapReader| {
        let mut of_tiles = 0;
        let diff = diff(a, b, |tile| of_tiles += tile.voxels.layers, |_, _| {}).unwrap();
        assert_eq!(diff.voxels.layers, of_tiles);
        of_tiles
    };
    let (sums_a, sums_b) = (naive(&config(), &scans[..3]), naive(&config(), &scans[1..]));
    let lost = sums_a.keys().filter(|voxel| !sums_b.contains_key(*voxel)).count();
    let other = sums_b.iter().filter(|(voxel, made)| sums_a.get(*voxel) != Some(made)).count();
    assert!(lost > 0 && other > 0);
    let a = read("a", &config(), &scans[..3]);
    let b = read("b", &config(), &scans[1..]);
    assert_eq!(differences(&a, &b), (lost + other) as u64);
    assert_eq!(differences(&a, &a), 0);
    let without = read("without", &config().with_layers(Layers::NONE), &scans);
    assert_eq!(differences(&a, &without), 0);
}

#[test]
fn maps_state_their_layers() {
    let folder = tempfile::tempdir().unwrap();
    let scans = scans(3, 2, 60);
    drop(build(at(&folder, "map"), &config(), &scans));
    let text = std::fs::read_to_string(folder.path().join("map/metadata.json")).unwrap();
    assert!(text.contains("\"version\": \"1.2\"") && text.contains("\"intensity_max\": 255.0"), "{text}");
    // Without a wish the map's own layers are used; others are refused.
    let open =
        |layers: Option<Layers>| OutOfCoreTileMapper::open(at(&folder, "map"), config().with_layers(layers));
    assert_eq!(open(None).unwrap().config().layers(), all_layers());
    assert!(matches!(open(Some(Layers::NONE)), Err(Error::Mismatch { what: "layers", .. })));
    // Its tiles have them, too.
    let before = layers_of(&MapReader::open(at(&folder, "map"), 0).unwrap());
    std::fs::remove_file(folder.path().join("map/metadata.json")).unwrap();
    std::fs::remove_file(folder.path().join("map/commits.log")).unwrap();
    repair(at(&folder, "map"), |_| {}, |_, _| {}).unwrap();
    let map = MapReader::open(at(&folder, "map"), 0).unwrap();
    assert_eq!(map.config().layers(), all_layers());
    assert!(layers_of(&map) == before);
    // A map without layers has the files of earlier versions.
    drop(build(at(&folder, "plain"), &config().with_layers(Layers::NONE), &scans));
    let text = std::fs::read_to_string(folder.path().join("plain/metadata.json")).unwrap();
    assert!(text.contains("\"version\": \"1.0\"") && !text.contains("layers"), "{text}");
}

#[test]
fn layers_follow_kept_scans() {
    let folder = tempfile::tempdir().unwrap();
    let config = config().with_kept_scans(true);
    let mut scans = scans(21, 6, 150);
    scans.iter_mut().for_each(|scan| scan.retain(|point| point.iter().all(|x| x.abs() < 1e3)));
    drop(build(at(&folder, "map"), &config, &scans));
    let open = |name: &str| MapReader::open(at(&folder, name), 0).unwrap();

    // Rebuilt with other tiles.
    let mut other = MapConfig::new(0.4, 6.4).unwrap().with_layers(all_layers());
    other.rays = config.rays;
    rebuild(&open("map"), folder.path().join("other"), other, |rays| *rays, &Stop::default(), |_, _| ())
        .unwrap();
    assert!(layers_of(&open("other")) == naive(&config, &scans));

    let how = Replay::default().with_memory(voxtile::MemoryLimit::tiles(3));
    let second = ScanSelection::Numbers(2, 2);
    remove_scans(at(&folder, "map"), &second, false, &how, |_, _| ()).unwrap();
    scans.remove(1);
    assert!(layers_of(&open("map")) == naive(&config, &scans));

    let region = Aabb { min: [0.0, -1.0, -5.0], max: [2.0, 3.0, 5.0] };
    remove_points(at(&folder, "map"), &region, &how, |_, _| ()).unwrap();
    let is_outside = |point: [f64; 3]| !(0..3).all(|k| region.min[k] <= point[k] && point[k] < region.max[k]);
    scans.iter_mut().for_each(|scan| scan.retain(is_outside));
    assert!(layers_of(&open("map")) == naive(&config, &scans));
    let mut findings = Vec::new();
    verify(at(&folder, "map"), |finding| findings.push(finding.clone()), |_, _| {}).unwrap();
    assert!(findings.is_empty(), "{findings:?}");
}

#[test]
fn rebuilt_maps_get_the_layers_that_kept_scans_fill() {
    let folder = tempfile::tempdir().unwrap();
    let few = Layers { colour: true, ..Layers::NONE };
    let config = config().with_kept_scans(true);
    let scans = scans(23, 6, 100);
    drop(build(at(&folder, "map"), &config.clone().with_layers(few), &scans));
    let map = MapReader::open(at(&folder, "map"), 0).unwrap();
    let rebuilt = |name: &str, layers: Layers| {
        let config = config.clone().with_layers(layers);
        rebuild(&map, folder.path().join(name), config, |rays| *rays, &Stop::default(), |_, _| ())
    };
    let made = rebuilt("all", all_layers()).unwrap();
    let all = MapReader::open(at(&folder, "all"), 0).unwrap();
    assert!(layers_of(&all) == naive(&config, &scans));
    let without =
        |lacks: &dyn Fn(&AttributedScan) -> bool| scans.iter().filter(|scan| lacks(scan)).count() as u64;
    let expected = [
        ("colour", without(&|scan| scan.attributes.colours.is_empty())),
        ("intensity", 0),
        ("class", without(&|scan| scan.attributes.classes.is_empty())),
        ("time", without(&|scan| scan.stamp_ns.is_none())),
    ];
    assert_eq!(made.scans_without.by_layer(), expected);
    rebuilt("none", Layers::NONE).unwrap();
    let none = MapReader::open(at(&folder, "none"), 0).unwrap();
    assert!(layers_of(&none).is_empty() && none.digest().unwrap() == map.digest().unwrap());
}

#[test]
fn layers_that_no_kept_scan_fills_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let config = config().with_layers(Layers::NONE).with_kept_scans(true);
    let mut scans = scans(24, 3, 100);
    for scan in &mut scans {
        scan.attributes = PointAttributes::default();
        scan.stamp_ns = None;
    }
    drop(build(at(&folder, "map"), &config, &scans));
    let map = MapReader::open(at(&folder, "map"), 0).unwrap();
    let rebuilt = |layers: Layers| {
        let config = config.clone().with_layers(layers);
        rebuild(&map, folder.path().join("new"), config, |rays| *rays, &Stop::default(), |_, _| ())
    };
    let error = rebuilt(all_layers()).unwrap_err().to_string();
    assert!(error.contains("nothing for colour, class, time"), "{error}");
    assert!(!folder.path().join("new").exists());
    let shape = Layers { shape: true, intensity_max: Some(255.0), ..Layers::NONE };
    rebuilt(shape).unwrap();
    let new = MapReader::open(at(&folder, "new"), 0).unwrap();
    assert!(layers_of(&new) == naive(&config.with_layers(shape), &scans));
}
