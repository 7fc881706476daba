use super::random_maps::{config, disk, open, path, random_voxels, read_map, write_map};
use std::collections::BTreeSet;
use std::path::PathBuf;
use testkit::faulty_disk::FaultyDisk;
use testkit::random_scans::Random;
use testkit::reference_map::Voxels;
use voxtile::mapper::MapView;
use voxtile::operations::{Merged, Prefer};
use voxtile::sensor::{Iwlo, LogOdds, SensorModel};
use voxtile::{Error, MapConfig, MapPath, MapReader, Result};

/// Merges the maps voxel by voxel, as plainly as possible.
fn naive(maps: &[Voxels], prefer: Option<Prefer>) -> Voxels {
    let mut merged = Voxels::new();
    for &voxel in maps.iter().flat_map(|map| map.keys()) {
        let known: Vec<(f64, i32)> = maps
            .iter()
            .filter_map(|map| map.get(&voxel))
            .map(|&(bits, count)| (f64::from_bits(bits), count))
            .collect();
        let (log_odds, count) = match prefer {
            Some(Prefer::First) => known[0],
            Some(Prefer::Last) => known[known.len() - 1],
            Some(Prefer::MoreObserved) => {
                let most = known.iter().map(|&(_, count)| count).max().unwrap();
                *known.iter().find(|&&(_, count)| count == most).unwrap()
            }
            None => {
                let LogOdds { min, max, .. } = LogOdds::default();
                let mut log_odds = known[0].0;
                let mut count = i64::from(known[0].1);
                for &(next, next_count) in &known[1..] {
                    log_odds += next;
                    count += i64::from(next_count);
                }
                let log_odds = if log_odds < min {
                    min
                } else if log_odds > max {
                    max
                } else {
                    log_odds
                };
                (log_odds, count.min(i64::from(i32::MAX)) as i32)
            }
        };
        merged.insert(voxel, (log_odds.to_bits(), count));
    }
    merged
}

fn merge(disk: &FaultyDisk, maps: &[PathBuf], prefer: Option<Prefer>) -> Result<Merged> {
    let maps = maps.iter().map(|map| open(disk, map)).collect::<Result<Vec<_>>>()?;
    voxtile::operations::merge(&maps, path("merged"), prefer, |_, _| {})
}

fn have_common_tile(config: &MapConfig, maps: &[Voxels]) -> bool {
    let tiles =
        |map: &Voxels| -> BTreeSet<_> { map.keys().map(|voxel| config.grid.tile_of_voxel(*voxel)).collect() };
    let tiles: Vec<_> = maps.iter().map(tiles).collect();
    (0..maps.len()).any(|k| tiles[..k].iter().any(|others| !others.is_disjoint(&tiles[k])))
}

#[test]
fn a_merge_equals_the_naive_merge_for_two_to_five_maps_and_every_preference() {
    let mut max_maps = 0;
    for seed in 0..60 {
        let mut random = Random(seed);
        let config = config(&mut random);
        let count = 2 + random.below(4) as usize;
        let maps: Vec<Voxels> = (0..count).map(|_| random_voxels(&mut random, 200)).collect();
        let paths: Vec<PathBuf> = (0..count).map(|k| path(&format!("map {k}"))).collect();
        for prefer in [None, Some(Prefer::First), Some(Prefer::Last), Some(Prefer::MoreObserved)] {
            let disk = disk();
            for (path, voxels) in paths.iter().zip(&maps) {
                write_map(&disk, path, &config, voxels);
            }
            let before = disk.files();
            // With the IWLO model, maps with a common tile need a preference. Without a common tile, any preference
            // gives the same result.
            let needs_choice = config.sensor_model.needs_intensity() && prefer.is_none();
            let merged = match merge(&disk, &paths, prefer) {
                Err(Error::InvalidArgument { reason, .. })
                    if needs_choice && have_common_tile(&config, &maps) =>
                {
                    assert!(reason.contains("iwlo") && reason.contains("`prefer`"), "{reason}");
                    continue;
                }
                merged => merged.unwrap_or_else(|error| panic!("seed {seed}: {error:#}")),
            };
            let expected = naive(&maps, if needs_choice { Some(Prefer::Last) } else { prefer });
            assert_eq!(read_map(&disk, &path("merged")), expected, "seed {seed}, {prefer:?}");
            assert!(!(needs_choice && have_common_tile(&config, &maps)), "seed {seed}");
            assert_eq!(merged.written.voxels, expected.len() as u64);
            let in_several = expected
                .keys()
                .filter(|voxel| maps.iter().filter(|map| map.contains_key(*voxel)).count() > 1);
            assert_eq!(merged.common_voxels, in_several.count() as u64);
            assert!(merged.related.is_empty());
            let reader = MapReader::open(MapPath::on(disk.shared(), path("merged")), 0).unwrap();
            assert_eq!(reader.scan_number(), 0);
            assert_eq!(reader.config().storage, config.storage);
            let after = disk.files();
            assert!(before.iter().all(|(path, bytes)| after[path] == *bytes), "the maps are unchanged");
            max_maps = max_maps.max(count);
        }
    }
    assert_eq!(max_maps, 5);
}

/// Returns two maps in which the voxel (1, 2, 3) was observed as occupied once.
fn two(a: &MapConfig, b: &MapConfig) -> (FaultyDisk, [PathBuf; 2]) {
    let (disk, maps) = (disk(), [path("a"), path("b")]);
    let voxels = Voxels::from([([1, 2, 3], (0.85_f64.to_bits(), 1))]);
    write_map(&disk, &maps[0], a, &voxels);
    write_map(&disk, &maps[1], b, &voxels);
    (disk, maps)
}

fn refusal(a: &MapConfig, b: &MapConfig, prefer: Option<Prefer>) -> String {
    let (disk, maps) = two(a, b);
    let refused = merge(&disk, &maps, prefer).expect_err("must be refused");
    assert!(
        disk.files()
            .keys()
            .all(|path| !path.starts_with("/maps/merged") && !path.to_string_lossy().contains("unfinished"))
    );
    refused.to_string()
}

#[test]
fn incompatible_maps_are_refused_and_the_difference_is_named() {
    let usual = MapConfig::new(0.5, 2.5).unwrap();
    let finer = MapConfig::new(0.25, 2.5).unwrap();
    let larger = MapConfig::new(0.5, 5.0).unwrap();
    let stronger =
        usual.clone().with_sensor_model(SensorModel::LogOdds(LogOdds { hit: 2.0, ..LogOdds::default() }));
    let iwlo = usual.clone().with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
    let mut stricter = usual.clone();
    stricter.occupancy_threshold = 0.7;
    for prefer in [None, Some(Prefer::First)] {
        let message = refusal(&usual, &finer, prefer);
        assert!(message.contains("/maps/b") && message.contains("resolution 0.25 m, not 0.5 m"), "{message}");
        let message = refusal(&usual, &larger, prefer);
        assert!(message.contains("tile size 5 m, not 2.5 m"), "{message}");
    }
    for (other, what) in [(&stronger, "hit 2,"), (&iwlo, "iwlo"), (&stricter, "0.7")] {
        let message = refusal(&usual, other, None);
        assert!(
            message.contains("/maps/b") && message.contains(what) && message.contains("`prefer`"),
            "{message}"
        );
        let (disk, maps) = two(&usual, other);
        merge(&disk, &maps, Some(Prefer::Last)).unwrap();
        let reader = MapReader::open(MapPath::on(disk.shared(), path("merged")), 0).unwrap();
        assert_eq!(reader.config().sensor_model, usual.sensor_model);
    }
    let (disk, maps) = two(&usual, &usual);
    assert!(merge(&disk, &maps[..1], None).unwrap_err().to_string().contains("two maps"));
    let nowhere = [maps[0].clone(), path("nowhere")];
    assert!(matches!(merge(&disk, &nowhere, None), Err(Error::NoMap { .. })));
}

#[test]
fn maps_with_a_common_history_are_named() {
    let usual = MapConfig::new(0.5, 2.5).unwrap();
    let (disk, [a, b]) = two(&usual, &usual);
    let merged = merge(&disk, &[a.clone(), b, a], None).unwrap();
    assert_eq!(merged.related, [(0, 2)]);
    assert!(merged.is_added);
    let twice = 0.85 + 0.85 + 0.85;
    assert_eq!(read_map(&disk, &path("merged")), Voxels::from([([1, 2, 3], (f64::to_bits(twice), 3))]));
}

#[test]
fn a_damaged_tile_is_named_and_no_map_is_written() {
    let usual = MapConfig::new(0.5, 2.5).unwrap();
    let (disk, maps) = two(&usual, &usual);
    let table =
        disk.files().into_keys().find(|path| path.ends_with("iwlo_meta.bin") && path.starts_with(&maps[1]));
    let table = table.unwrap();
    let mut bytes = disk.files()[&table].clone();
    bytes[20] ^= 1;
    disk.put(&table, &bytes);
    let error = merge(&disk, &maps, None).unwrap_err();
    assert!(matches!(&error, Error::Damaged { path, .. } if *path == table), "{error:#}");
    assert!(disk.files().keys().all(|path| path.starts_with(&maps[0]) || path.starts_with(&maps[1])));
}

/// The result has the coordinate reference system of the maps that have one. Maps with different systems are
/// incompatible in any order.
#[test]
fn a_merge_keeps_the_coordinate_reference_system_of_its_maps() {
    let systems = [None, Some("EPSG:25832"), Some("EPSG:25833")];
    let disk = disk();
    for (k, crs) in systems.into_iter().enumerate() {
        let mut random = Random(k as u64);
        let mut config = MapConfig::new(0.1, 1.0).unwrap();
        config.crs = crs.map(str::to_owned);
        write_map(&disk, &path(&format!("map {k}")), &config, &random_voxels(&mut random, 20));
    }
    let crs_of = |maps: &[usize]| {
        let disk = disk.copy();
        let maps: Vec<PathBuf> = maps.iter().map(|k| path(&format!("map {k}"))).collect();
        merge(&disk, &maps, None).map(|_| open(&disk, &path("merged")).unwrap().config().crs.clone())
    };
    for maps in [[0, 1], [1, 0]] {
        assert_eq!(crs_of(&maps).unwrap().as_deref(), systems[1]);
    }
    for maps in [&[0, 1, 2][..], &[1, 0, 2], &[1, 2]] {
        assert!(matches!(crs_of(maps), Err(Error::Mismatch { .. })), "{maps:?}");
    }
    let [one, other] = [1, 2].map(|k| open(&disk, &path(&format!("map {k}"))).unwrap());
    let found = voxtile::operations::diff(&one, &other, |_| {}, |_, _| {});
    assert!(matches!(found, Err(Error::Mismatch { .. })));
}

#[test]
fn maps_without_a_common_tile_need_no_preference_for_any_model() {
    let (disk, mut random) = (disk(), Random(3));
    let grid = MapConfig::new(0.1, 1.0).unwrap();
    let strict = LogOdds::from_probabilities(0.6, 0.45, 0.2, 0.9).unwrap();
    let models = [SensorModel::default(), SensorModel::LogOdds(strict), SensorModel::Iwlo(Iwlo::default())];
    let all: Vec<Voxels> = (0..3)
        .map(|k| {
            let voxels = random_voxels(&mut random, 20).into_iter();
            voxels.map(|([x, y, z], evidence)| ([x + 1000 * k, y, z], evidence)).collect()
        })
        .collect();
    let paths: Vec<PathBuf> = (0..3).map(|k| path(&format!("map {k}"))).collect();
    for ((to, voxels), model) in paths.iter().zip(&all).zip(models) {
        write_map(&disk, to, &grid.clone().with_sensor_model(model), voxels);
    }
    for first in 0..3 {
        let disk = disk.copy();
        let mut maps = paths.clone();
        maps.rotate_left(first);
        merge(&disk, &maps, None).unwrap();
        let expected: Voxels = all.iter().flatten().map(|(voxel, evidence)| (*voxel, *evidence)).collect();
        assert!(read_map(&disk, &path("merged")) == expected, "{first}");
    }
}
