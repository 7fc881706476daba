//! Random lives of a mapper compared with the naive map, which is reset to the last flush after a crash.

use crate::harness::{all_layers, name};
use std::collections::BTreeMap;
use std::path::Path;
use testkit::attributed_scan::AttributedScan;
use testkit::memory_folder::memory_folder;
use testkit::random_scans::Random;
use testkit::reference_layers::{LayerSums, layers_of};
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use testkit::support::cases;
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::integrity::verify;
use voxtile::operations::{CopyScans, Part, Prefer, clear, crop, delete_snapshot, merge, revert, snapshots};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::store::TileStore;
use voxtile::{
    Aabb, Grid, InsertMode, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, MemoryLimit,
    OutOfCoreTileMapper, ScanPoints, Storage, VoxelIndex,
};

/// Content of a naive map.
#[derive(Clone, Debug, Default, PartialEq)]
struct Content {
    voxels: Voxels,
    layers: LayerSums,
    /// Number of scans.
    scans: u64,
}

impl Content {
    fn of(reference: &ReferenceMap, scans: u64) -> Self {
        Self { voxels: reference.voxels.clone(), layers: reference.layers.clone(), scans }
    }

    fn of_map(map: &impl MapView, scans: u64) -> Self {
        Self { voxels: voxels_of(map), layers: layers_of(map), scans }
    }

    fn retain(&mut self, keeps: impl Fn(VoxelIndex) -> bool) {
        self.voxels.retain(|&voxel, _| keeps(voxel));
        self.layers.retain(|&voxel, _| keeps(voxel));
    }
}

/// Runs one random life of a map.
fn live(seed: u64, config: &MapConfig) {
    let folder = memory_folder();
    let path = folder.path().join("map");
    let at = || MapPath::on(UnsyncedDisk::shared(), &path);
    let open = || OutOfCoreTileMapper::open(at(), config.clone()).unwrap();
    let mut random = Random(seed);
    let mut mapper = OutOfCoreTileMapper::create(at(), config.clone()).unwrap();
    let mut reference = ReferenceMap::new(config);
    let most_tiles = match config.memory {
        MemoryLimit::Tiles { tiles, .. } => tiles,
        _ => usize::MAX,
    };
    let (mut scans, mut flushed) = (0, Content::default());
    let mut kept: BTreeMap<&str, Content> = BTreeMap::new();
    // Content at the start of the background flush.
    let mut begun: Option<Content> = None;
    for step in 0..80 {
        let what = format!("seed {seed}, step {step}");
        let snapshot = ["a", "b", "c"][random.below(3) as usize];
        let is_kept = kept.contains_key(snapshot);
        match random.below(16) {
            0..6 => {
                let mut some = Vec::new();
                for _ in 0..1 + random.below(3) {
                    let center = [random.between(-3.0, 3.0), 0.0, 0.0];
                    some.push(AttributedScan::random(&mut random, center, 12));
                }
                let points: Vec<_> = some.iter().map(AttributedScan::points).collect();
                let together: Vec<&dyn ScanPoints> = points.iter().map(|scan| scan as _).collect();
                mapper.insert_all(&together, &mut Vec::new()).unwrap();
                some.iter().for_each(|scan| reference.insert_attributed(scan));
                scans += some.len() as u64;
            }
            6 | 7 => {
                let point = random.point([0.0; 3], 4.0);
                let voxel = config.grid.voxel_of(point).unwrap();
                let found = mapper.voxel_at(point).unwrap().map(|voxel| voxel.evidence);
                let found = found.map(|evidence| (evidence.log_odds.to_bits(), evidence.observation_count));
                assert_eq!(found, reference.voxels.get(&voxel).copied(), "{what}");
                assert_eq!(mapper.layers_at(point).unwrap(), reference.layers.get(&voxel).cloned(), "{what}");
            }
            8 => assert_eq!(Content::of_map(&mapper, scans), Content::of(&reference, scans), "{what}"),
            9 => {
                mapper.begin_flush().unwrap();
                begun = Some(Content::of(&reference, scans));
            }
            10 => {
                mapper.flush().unwrap();
                (flushed, begun) = (Content::of(&reference, scans), None);
            }
            11 | 12 if !is_kept => {
                mapper.snapshot(&name(snapshot)).unwrap();
                (flushed, begun) = (Content::of(&reference, scans), None);
                kept.insert(snapshot, flushed.clone());
            }
            choice => {
                // Tiles evicted since the last flush are on disk, but must not count.
                drop(mapper);
                // Dropping the mapper completes a background flush.
                flushed = begun.take().unwrap_or(flushed);
                match choice {
                    12 => {
                        delete_snapshot(at(), &name(snapshot)).unwrap();
                        kept.remove(snapshot);
                    }
                    13 if is_kept => {
                        revert(at(), &name(snapshot), None, |_, _| ()).unwrap();
                        flushed = kept[snapshot].clone();
                    }
                    14 if random.below(2) == 0 => {
                        let mut store = TileStore::open(UnsyncedDisk::shared(), &path).unwrap();
                        let gone: Vec<_> = store.tiles().iter().filter(|tile| tile.x % 2 == 0).collect();
                        gone.iter().for_each(|tile| store.remove(*tile).unwrap());
                        store.commit(store.metadata().clone(), store.commits().scan_number).unwrap();
                        flushed.retain(|voxel| config.grid.tile_of_voxel(voxel).x % 2 != 0);
                    }
                    14 => {
                        let region = random_region(&mut random);
                        clear(at(), &Part::Inside(region), |_, _| ()).unwrap();
                        flushed.retain(|voxel| !is_in(config, &region, voxel));
                    }
                    15 if is_kept => {
                        let region = random_region(&mut random);
                        check_derived_maps(&path, (snapshot, &kept[snapshot]), &flushed, &region, &what);
                    }
                    _ => {}
                }
                let Content { voxels, layers, scans: of_flush } = flushed.clone();
                (reference.voxels, reference.layers, scans) = (voxels, layers, of_flush);
                mapper = open();
            }
        }
        assert!(mapper.cached_tile_indices().len() <= most_tiles, "{what}");
        assert_eq!(mapper.scan_number(), scans, "{what}");
        if step % 16 == 0 {
            check_snapshots(&path, &kept, &what);
        }
    }
    mapper.flush().unwrap();
    assert_eq!(Content::of_map(&mapper, scans), Content::of(&reference, scans), "seed {seed}");
    drop(mapper);
    check_snapshots(&path, &kept, "at the end");
    drop(open());
    let verification = verify(at(), |finding| panic!("seed {seed}: {finding}"), |_, _| ()).unwrap();
    assert_eq!(verification.snapshots, kept.len() as u64);
}

fn random_region(random: &mut Random) -> Aabb {
    let min = random.point([-1.0; 3], 2.0);
    Aabb { min, max: min.map(|low| low + random.between(0.8, 4.0)) }
}

fn is_in(config: &MapConfig, region: &Aabb, voxel: VoxelIndex) -> bool {
    let center = config.grid.center_m(voxel);
    (0..3).all(|k| region.min[k] <= center[k] && center[k] < region.max[k])
}

/// Crops the map, and merges it with a snapshot.
fn check_derived_maps(
    path: &Path,
    (snapshot, kept): (&str, &Content),
    now: &Content,
    region: &Aabb,
    what: &str,
) {
    let folder = memory_folder();
    let at = |path: &Path| MapPath::on(UnsyncedDisk::shared(), path);
    let map = MapReader::open(at(path), 1 << 20).unwrap();
    let before = MapReader::open_snapshot(at(path), &name(snapshot), 1 << 20).unwrap();
    let config = map.config().clone();
    let content_of =
        |name: &str| Content::of_map(&MapReader::open(at(&folder.path().join(name)), 0).unwrap(), 0);

    crop(&map, &Part::Inside(*region), CopyScans::No, folder.path().join("cropped"), |_, _| ()).unwrap();
    let mut cropped = Content { scans: 0, ..now.clone() };
    cropped.retain(|voxel| is_in(&config, region, voxel));
    assert_eq!(content_of("cropped"), cropped, "{what}");

    let both = [map, before];
    merge(&both, folder.path().join("merged"), Some(Prefer::Last), |_, _| ()).unwrap();
    let mut merged = Content { scans: 0, ..now.clone() };
    merged.retain(|voxel| !kept.voxels.contains_key(&voxel));
    merged.voxels.extend(kept.voxels.clone());
    merged.layers.extend(kept.layers.clone());
    assert_eq!(content_of("merged"), merged, "{what}");

    if matches!(config.sensor_model, SensorModel::LogOdds(_)) {
        merge(&both, folder.path().join("sum"), None, |_, _| ()).unwrap();
        let mut sums = now.layers.clone();
        kept.layers.iter().for_each(|(voxel, more)| sums.entry(*voxel).or_default().add(more));
        assert_eq!(content_of("sum").layers, sums, "{what}");
    }
}

fn check_snapshots(path: &Path, kept: &BTreeMap<&str, Content>, what: &str) {
    let at = || MapPath::on(UnsyncedDisk::shared(), path);
    let infos = snapshots(at()).unwrap();
    assert_eq!(infos.len(), kept.len(), "{what}");
    for (of, content) in kept {
        let reader = MapReader::open_snapshot(at(), &name(of), 1 << 20).unwrap();
        assert_eq!(Content::of_map(&reader, reader.scan_number()), *content, "{what}: {of}");
        let numbers = reader.scans().unwrap().into_iter().map(|scan| scan.number);
        assert!(numbers.eq(1..=content.scans), "{what}: {of}");
        let info = infos.iter().find(|info| info.name == *of).unwrap();
        let voxels = content.voxels.len() as u64;
        assert_eq!((info.voxels, info.scan_number), (voxels, content.scans), "{what}: {of}");
    }
}

#[test]
fn random_lives_of_a_map_equal_the_naive_map() {
    let config = MapConfig::new(0.2, 1.6).unwrap();
    for seed in 0..cases(8, 60) {
        let mode = if seed % 3 == 0 { InsertMode::PerRay } else { InsertMode::PerScan };
        let mut config = config
            .clone()
            .with_insert_mode(mode)
            .with_cache_tiles(1 + (seed as usize * 5) % 17)
            .with_write_buffer_bytes((seed as usize % 4) * 3000);
        if seed % 2 == 1 {
            config = config.with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
        }
        if seed % 8 < 4 {
            // Larger voxels, which several scans hit.
            config.grid = Grid::new(0.8, 6.4).unwrap();
            config = config.with_layers(all_layers());
        }
        if seed % 4 >= 2 {
            config = config.with_storage(Storage::Compact);
        }
        live(seed, &config);
        // From the minimum for a scan to a few tiles of the map.
        let bytes = [0, 3_000, 30_000, 100_000, 300_000][seed as usize % 5];
        live(seed, &config.with_tight_memory_bytes(bytes));
    }
}
