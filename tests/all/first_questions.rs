//! The first query of a voxel in a tile on disk reads only a part of its file.

use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::random_scans::{Random, random_scan};
use voxtile::sensor::{Evidence, Iwlo, SensorModel};
use voxtile::space::{Aabb, TileIndex, VoxelIndex};
use voxtile::store::SnapshotName;
use voxtile::{
    Error, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper, Storage,
};

fn map() -> &'static Path {
    Path::new("/map")
}

fn config(storage: Storage) -> MapConfig {
    MapConfig::new(0.1, 3.2).unwrap().with_range(0.0, 3.0).with_storage(storage)
}

/// A map of some tiles, with a snapshot of the first flush.
fn small(storage: Storage, seed: u64) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), map()), config(storage)).unwrap();
    for k in 0..3 {
        let scan = random_scan(&mut Random(10 * seed + k), [k as f64, 0.0, 0.0], 60);
        mapper.insert_scan(&scan).unwrap();
        mapper.flush().unwrap();
        if k == 0 {
            mapper.snapshot(&SnapshotName::new("first").unwrap()).unwrap();
        }
    }
    drop(mapper);
    disk.copy()
}

/// A map with a tile whose file has several groups, too long to be read at once.
fn long() -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let model = SensorModel::Iwlo(Iwlo { sharpness: 1.0, ..Iwlo::default() });
    let config = MapConfig::new(0.1, 12.8)
        .unwrap()
        .with_range(0.0, 6.0)
        .with_storage(Storage::Compact)
        .with_sensor_model(model);
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), map()), config).unwrap();
    for k in 0..4 {
        mapper.insert_scan(&random_scan(&mut Random(k), [6.4; 3], 4000)).unwrap();
    }
    mapper.flush().unwrap();
    drop(mapper);
    disk.copy()
}

fn open(disk: &FaultyDisk) -> MapReader {
    MapReader::open(MapPath::on(disk.shared(), map()), 0).unwrap()
}

fn bits(evidence: Option<Evidence>) -> Option<(u64, i32)> {
    evidence.map(|evidence| (evidence.log_odds.to_bits(), evidence.observation_count))
}

fn any_voxel(random: &mut Random) -> VoxelIndex {
    std::array::from_fn(|_| random.below(90) as i32 - 35)
}

#[test]
fn the_first_query_equals_that_of_the_whole_tile_in_both_storages() {
    let mut random = Random(5);
    for (seed, storage) in [(1, Storage::Compact), (2, Storage::Compact), (3, Storage::OctoMap)] {
        let disk = small(storage, seed);
        let snapshot = || {
            let (map, name) = (MapPath::on(disk.shared(), map()), SnapshotName::new("first").unwrap());
            MapReader::open_snapshot(map, &name, 0).unwrap()
        };
        let mut observed = 0;
        for (whole, first) in
            [(open(&disk), &(|| open(&disk)) as &dyn Fn() -> MapReader), (snapshot(), &snapshot)]
        {
            let tiles: Vec<_> = whole.tiles().map(Result::unwrap).collect();
            let known: Vec<VoxelIndex> =
                tiles.iter().flat_map(|tile| tile.voxels().map(|voxel| voxel.index)).collect();
            for number in 0..150 {
                let voxel = match number % 2 {
                    0 => any_voxel(&mut random),
                    _ => known[random.below(known.len() as u64) as usize],
                };
                let tile = whole.tile(whole.config().grid.tile_of_voxel(voxel)).unwrap();
                let wanted = tile.as_ref().and_then(|tile| tile.evidence(voxel));
                let reader = first();
                assert_eq!(bits(reader.evidence(voxel).unwrap()), bits(wanted), "{voxel:?}");
                let io = reader.statistics().io;
                let is_loaded = tile.is_some() && storage == Storage::OctoMap;
                assert_eq!((io.loads, io.bytes_read > 0), (u64::from(is_loaded), tile.is_some()), "{io:?}");
                // The second query loads the tile; the results are the same.
                assert_eq!(bits(reader.evidence(voxel).unwrap()), bits(wanted), "{voxel:?}");
                assert_eq!(reader.statistics().io.loads, u64::from(tile.is_some()));
                observed += u64::from(wanted.is_some());
            }
        }
        assert!(observed >= 150, "{observed}");
    }
}

/// Path and content of a tile's table.
fn table(disk: &FaultyDisk, reader: &MapReader, voxel: VoxelIndex) -> (PathBuf, Vec<u8>) {
    let tile = reader.config().grid.tile_of_voxel(voxel);
    let path = map().join(format!("tile_{}_{}_{}/tile.vxt", tile.x, tile.y, tile.z));
    let bytes = disk.files().into_iter().find(|(of, _)| *of == path).unwrap().1;
    (path, bytes)
}

#[test]
fn damage_is_an_error_unless_it_is_in_an_unread_part() {
    let disk = small(Storage::Compact, 4);
    let whole = open(&disk);
    let tile = whole.tiles().map(Result::unwrap).max_by_key(|tile| tile.table().len()).unwrap();
    let known: Vec<_> = tile.voxels().map(|voxel| (voxel.index, voxel.evidence)).collect();
    let (path, bytes) = table(&disk, &whole, known[0].0);
    let mut refused = 0;
    let mut random = Random(6);
    for _ in 0..600 {
        let mut wrong = bytes.clone();
        wrong[random.below(bytes.len() as u64) as usize] ^= 1 << random.below(8);
        disk.put(&path, &wrong);
        let (voxel, wanted) = known[random.below(known.len() as u64) as usize];
        match open(&disk).evidence(voxel) {
            Ok(found) => assert_eq!(bits(found), bits(Some(wanted))),
            Err(error) => {
                assert!(matches!(error, Error::Damaged { .. }), "{error}");
                refused += 1;
            }
        }
    }
    assert!(refused > 100, "{refused}");
}

/// The file has the length that the log records, and valid checksums. Only the text of its parameters differs.
#[test]
fn a_file_that_differs_from_the_log_is_an_error() {
    let disk = small(Storage::Compact, 4);
    let reader = open(&disk);
    let voxel = [3, 2, 1];
    let (path, mut bytes) = table(&disk, &reader, voxel);
    let length = u32::from_le_bytes(bytes[60..64].try_into().unwrap()) as usize;
    // Flip a bit in the name of a JSON key of the parameters.
    bytes[72 + 3] ^= 1;
    let parameters = crc32fast::hash(&bytes[72..72 + length]);
    bytes[64..68].copy_from_slice(&parameters.to_le_bytes());
    let front = crc32fast::hash(&bytes[..68]);
    bytes[68..72].copy_from_slice(&front.to_le_bytes());
    disk.put(&path, &bytes);
    let error = open(&disk).evidence(voxel).unwrap_err();
    assert!(matches!(error, Error::Damaged { .. }), "{error}");
}

#[test]
fn only_a_part_of_a_long_file_is_read() {
    let disk = long();
    let whole = open(&disk);
    let tile = whole.tiles().map(Result::unwrap).max_by_key(|tile| tile.table().len()).unwrap();
    let known: Vec<_> = tile.voxels().map(|voxel| (voxel.index, voxel.evidence)).collect();
    let (path, bytes) = table(&disk, &whole, known[0].0);
    assert!(bytes.len() > 192 << 10, "{}", bytes.len());
    let mut random = Random(7);
    let mut read = Vec::new();
    for number in 0..300 {
        let voxel = match number % 3 {
            0 => std::array::from_fn(|_| random.below(128) as i32),
            _ => known[random.below(known.len() as u64) as usize].0,
        };
        let reader = open(&disk);
        assert_eq!(bits(reader.evidence(voxel).unwrap()), bits(tile.evidence(voxel)), "{voxel:?}");
        read.push(reader.statistics().io.bytes_read);
    }
    assert!(read.iter().all(|&read| read > 0 && read < bytes.len() as u64), "{read:?}");
    // Damage is an error, unless it is in a group that is not read.
    let [mut refused, mut answered] = [0; 2];
    for _ in 0..300 {
        let mut wrong = bytes.clone();
        let at = match random.below(3) {
            0 => random.below(2000),
            _ => random.below(bytes.len() as u64),
        };
        wrong[at as usize] ^= 1 << random.below(8);
        disk.put(&path, &wrong);
        let (voxel, wanted) = known[random.below(known.len() as u64) as usize];
        match open(&disk).evidence(voxel) {
            Ok(found) => {
                assert_eq!(bits(found), bits(Some(wanted)));
                answered += 1;
            }
            Err(error) => {
                assert!(matches!(error, Error::Damaged { .. }), "{error}");
                refused += 1;
            }
        }
    }
    assert!(refused > 40 && answered > 100, "{refused} {answered}");
    // Truncation is an error, unless it is after the group that is read.
    for _ in 0..100 {
        disk.put(&path, &bytes[..random.below(bytes.len() as u64) as usize]);
        let (voxel, wanted) = known[random.below(known.len() as u64) as usize];
        match open(&disk).evidence(voxel) {
            Ok(found) => assert_eq!(bits(found), bits(Some(wanted))),
            Err(error) => assert!(matches!(error, Error::Damaged { .. }), "{error}"),
        }
    }
}

#[test]
fn a_small_box_keeps_its_tiles_and_reads_no_neighbour() {
    let disk = small(Storage::Compact, 5);
    let reader = MapReader::open(MapPath::on(disk.shared(), map()), 64 << 20).unwrap();
    let tile = TileIndex::new(0, 0, 0);
    assert!(reader.has_tile(tile) && reader.has_tile(TileIndex::new(-1, 0, 0)));
    let region = Aabb { min: [0.0; 3], max: [3.2; 3] };
    let mut found = Vec::new();
    for _ in 0..3 {
        found.clear();
        reader.for_each_voxel_in(&region, |voxel| found.push(voxel.index)).unwrap();
        assert_eq!((reader.statistics().io.loads, reader.cached_tile_indices()), (1, vec![tile]));
    }
    let whole = reader.tile_uncached(tile).unwrap().unwrap();
    assert!(!found.is_empty() && found.iter().copied().eq(whole.voxels().map(|voxel| voxel.index)));
    let occupied = |region: &Aabb| -> Vec<VoxelIndex> {
        let mut voxels = Vec::new();
        reader.for_each_occupied(None, Some(region), |voxel| voxels.push(voxel.index)).unwrap();
        voxels
    };
    let wanted =
        whole.voxels().filter(|voxel| voxel.evidence.log_odds >= reader.config().occupied_log_odds());
    assert!(occupied(&region).into_iter().eq(wanted.map(|voxel| voxel.index)));
    assert_eq!(reader.statistics().io.loads, 1);
    // A box of many tiles leaves the memory as it is.
    let everywhere = Aabb { min: [-50.0; 3], max: [50.0; 3] };
    assert!(reader.tile_indices().len() > 8 && occupied(&everywhere).len() > occupied(&region).len());
    assert_eq!((reader.statistics().io.loads, reader.cached_tile_indices()), (1, vec![tile]));
}
