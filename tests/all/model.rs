//! Random lives of a mapper compared with the naive map, which is reset to the last flush after a crash.

use crate::harness::name;
use std::collections::BTreeMap;
use std::path::Path;
use testkit::memory_folder::memory_folder;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use testkit::support::cases;
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::integrity::verify;
use voxtile::operations::{delete_snapshot, revert, snapshots};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::store::TileStore;
use voxtile::{
    InsertMode, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, MemoryLimit, OutOfCoreTileMapper,
    ScanPoints, Storage,
};

/// Voxels, and the number of scans.
type Content = (Voxels, u64);

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
                    some.push(random_scan(&mut random, center, 12));
                }
                let together: Vec<&dyn ScanPoints> = some.iter().map(|scan| scan as _).collect();
                mapper.insert_all(&together, &mut Vec::new()).unwrap();
                some.iter().for_each(|scan| reference.insert_scan(scan));
                scans += some.len() as u64;
            }
            6 | 7 => {
                let point = random.point([0.0; 3], 4.0);
                let voxel = config.grid.voxel_of(point).unwrap();
                let found = mapper.voxel_at(point).unwrap().map(|voxel| voxel.evidence);
                let found = found.map(|evidence| (evidence.log_odds.to_bits(), evidence.observation_count));
                assert_eq!(found, reference.voxels.get(&voxel).copied(), "{what}");
            }
            8 => assert_eq!(voxels_of(&mapper), reference.voxels, "{what}"),
            9 => {
                mapper.begin_flush().unwrap();
                begun = Some((reference.voxels.clone(), scans));
            }
            10 => {
                mapper.flush().unwrap();
                (flushed, begun) = ((reference.voxels.clone(), scans), None);
            }
            11 | 12 if !is_kept => {
                mapper.snapshot(&name(snapshot)).unwrap();
                (flushed, begun) = ((reference.voxels.clone(), scans), None);
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
                    14 => {
                        let mut store = TileStore::open(UnsyncedDisk::shared(), &path).unwrap();
                        let gone: Vec<_> = store.tiles().iter().filter(|tile| tile.x % 2 == 0).collect();
                        gone.iter().for_each(|tile| store.remove(*tile).unwrap());
                        store.commit(store.metadata().clone(), store.commits().scan_number).unwrap();
                        flushed.0.retain(|&voxel, _| config.grid.tile_of_voxel(voxel).x % 2 != 0);
                    }
                    _ => {}
                }
                (reference.voxels, scans) = flushed.clone();
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
    assert_eq!(voxels_of(&mapper), reference.voxels, "seed {seed}");
    drop(mapper);
    check_snapshots(&path, &kept, "at the end");
    drop(open());
    let verification = verify(at(), |finding| panic!("seed {seed}: {finding}"), |_, _| ()).unwrap();
    assert_eq!(verification.snapshots, kept.len() as u64);
}

fn check_snapshots(path: &Path, kept: &BTreeMap<&str, Content>, what: &str) {
    let at = || MapPath::on(UnsyncedDisk::shared(), path);
    let infos = snapshots(at()).unwrap();
    assert_eq!(infos.len(), kept.len(), "{what}");
    for (of, (voxels, scans)) in kept {
        let reader = MapReader::open_snapshot(at(), &name(of), 1 << 20).unwrap();
        assert_eq!((&voxels_of(&reader), reader.scan_number()), (voxels, *scans), "{what}: {of}");
        let numbers = reader.scans().unwrap().into_iter().map(|scan| scan.number);
        assert!(numbers.eq(1..=*scans), "{what}: {of}");
        let info = infos.iter().find(|info| info.name == *of).unwrap();
        assert_eq!((info.voxels, info.scan_number), (voxels.len() as u64, *scans), "{what}: {of}");
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
        if seed % 4 >= 2 {
            config = config.with_storage(Storage::Compact);
        }
        live(seed, &config);
        // From the minimum for a scan to a few tiles of the map.
        let bytes = [0, 3_000, 30_000, 100_000, 300_000][seed as usize % 5];
        live(seed, &config.with_tight_memory_bytes(bytes));
    }
}
