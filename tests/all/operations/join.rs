use super::random_maps::{config, disk, open, path, random_voxels, read_map, write_map};
use std::path::{Path, PathBuf};
use testkit::faulty_disk::FaultyDisk;
use testkit::random_scans::Random;
use testkit::reference_map::Voxels;
use voxtile::integrity::verify;
use voxtile::mapper::MapView;
use voxtile::operations::{self, WrittenMap, make_shard};
use voxtile::store::tile_of_folder;
use voxtile::{Error, MapConfig, MapPath, Result, Storage};

const ID: [u8; 16] = [7; 16];

fn join(disk: &FaultyDisk, pieces: &[PathBuf]) -> Result<WrittenMap> {
    let pieces: Vec<_> = pieces.iter().map(|piece| MapPath::on(disk.shared(), piece)).collect();
    voxtile::operations::join(&pieces, path("joined"), |_, _| {})
}

fn piece(disk: &FaultyDisk, map: &Path, id: [u8; 16]) -> Result<PathBuf> {
    let piece = map.with_extension("piece");
    make_shard(&open(disk, map)?, &piece, id, |_, _| {}).map(|_| piece)
}

fn damage(disk: &FaultyDisk, map: &Path) -> Vec<String> {
    let mut found = Vec::new();
    verify(MapPath::on(disk.shared(), map), |finding| found.push(finding.to_string()), |_, _| {}).unwrap();
    found
}

/// Returns the files of tiles.
fn tiles(disk: &FaultyDisk, map: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let is_of_tile = |file: &Path| {
        file.parent()
            .and_then(Path::file_name)
            .is_some_and(|name| tile_of_folder(&name.to_string_lossy()).is_some())
    };
    let own = disk.files().into_iter().filter(|(file, _)| file.starts_with(map) && is_of_tile(file));
    own.map(|(file, bytes)| (file.strip_prefix(map).unwrap().to_owned(), bytes)).collect()
}

#[test]
fn joined_shards_equal_a_merge_of_them() {
    let mut joined_pieces = 0;
    for seed in 0..60 {
        let mut random = Random(seed);
        let (mut disk, config) = (disk(), config(&mut random));
        if seed % 4 == 0 {
            disk = disk.without_links();
        }
        let voxels = random_voxels(&mut random, 400);
        let mut parts = vec![Voxels::new(); 1 + random.below(4) as usize];
        let turn = random.below(100) as i32;
        for (&voxel, &evidence) in &voxels {
            let tile = config.grid.tile_of_voxel(voxel);
            let number = (3 * tile.x + 5 * tile.y + 7 * tile.z + turn).rem_euclid(parts.len() as i32);
            parts[number as usize].insert(voxel, evidence);
        }
        let mut pieces = Vec::new();
        for (number, part) in parts.iter().enumerate() {
            let map = path(&number.to_string());
            write_map(&disk, &map, &config, part);
            pieces.push(piece(&disk, &map, ID).unwrap());
            disk.take(&map);
        }
        let written = join(&disk, &pieces).unwrap();
        write_map(&disk, &path("whole"), &config, &voxels);
        let whole = open(&disk, &path("whole")).unwrap();
        assert_eq!(read_map(&disk, &path("joined")), voxels, "seed {seed}");
        assert_eq!(damage(&disk, &path("joined")), Vec::<String>::new(), "seed {seed}");
        assert_eq!((written.tiles, written.voxels), (whole.tile_indices().len() as u64, voxels.len() as u64));
        // The shards differ only by the id, and the joined map does not need them.
        make_shard(&whole, path("same"), ID, |_, _| {}).unwrap();
        assert_eq!(tiles(&disk, &path("joined")), tiles(&disk, &path("same")), "seed {seed}");
        pieces.iter().for_each(|piece| disk.take(piece));
        assert_eq!(damage(&disk, &path("joined")), Vec::<String>::new(), "seed {seed}");
        assert_eq!(read_map(&disk, &path("joined")), voxels, "seed {seed}");
        joined_pieces += pieces.len();
    }
    assert!(joined_pieces > 120);
}

/// A disk with one map of a few tiles.
fn one_map(storage: Storage) -> FaultyDisk {
    let disk = disk();
    let config = MapConfig::new(0.5, 2.5).unwrap().with_storage(storage);
    write_map(&disk, &path("map"), &config, &random_voxels(&mut Random(3), 40));
    disk
}

#[test]
fn any_damaged_byte_of_a_map_is_found_before_it_becomes_a_shard() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let disk = one_map(storage);
        for (file, bytes) in tiles(&disk, &path("map")) {
            let place = path("map").join(&file);
            for at in 0..=bytes.len() {
                let mut wrong = bytes.clone();
                match wrong.get_mut(at) {
                    Some(byte) => *byte ^= 1 << (at % 8),
                    None => wrong.truncate(at - 1),
                }
                disk.put(&place, &wrong);
                let error = piece(&disk, &path("map"), ID).unwrap_err();
                assert!(matches!(error, Error::Damaged { .. }), "{}, byte {at}: {error:#}", place.display());
                assert!(error.path() == Some(&*place) && error.tile().is_some(), "{error:#}");
                assert!(disk.files().into_keys().all(|file| !file.starts_with(path("map.piece"))));
            }
            disk.put(&place, &bytes);
        }
        piece(&disk, &path("map"), ID).unwrap();
    }
}

#[test]
fn a_shard_with_a_missing_or_truncated_file_is_an_error_without_output() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let disk = one_map(storage);
        let piece = piece(&disk, &path("map"), ID).unwrap();
        for (file, bytes) in tiles(&disk, &piece) {
            let place = piece.join(&file);
            for is_missing in [true, false] {
                match is_missing {
                    true => disk.take(&place),
                    false => disk.put(&place, &bytes[..bytes.len() - 1]),
                }
                let error = join(&disk, std::slice::from_ref(&piece)).unwrap_err();
                assert!(matches!(error, Error::Damaged { .. }) && error.path() == Some(&*place), "{error:#}");
                assert!(disk.files().into_keys().all(|file| !file.starts_with(path("joined"))));
            }
            disk.put(&place, &bytes);
        }
        join(&disk, &[piece]).unwrap();
    }
}

fn move_shard(disk: &FaultyDisk, map: &Path, id: [u8; 16]) -> Result<PathBuf> {
    let piece = map.with_extension("moved");
    operations::move_shard(MapPath::on(disk.shared(), map), &piece, id, |_, _| {}).map(|_| piece)
}

#[test]
fn a_moved_map_equals_a_copied_shard() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let disk = one_map(storage);
        let copy = piece(&disk, &path("map"), ID).unwrap();
        let files = tiles(&disk, &copy);
        // The map has an id other than `ID`, so it is copied, too.
        let moved = move_shard(&disk, &path("map"), ID).unwrap();
        assert_eq!(tiles(&disk, &moved), files);
        assert_eq!(open(&disk, &moved).unwrap().metadata().ext.as_ref().unwrap().map_id, "07".repeat(16));
        assert!(!tiles(&disk, &path("map")).is_empty());
        disk.take(&moved);
        let moved = move_shard(&disk, &copy, ID).unwrap();
        assert_eq!(tiles(&disk, &moved), files);
        assert!(disk.files().into_keys().all(|file| !file.starts_with(&copy)));
        assert_eq!(damage(&disk, &moved), Vec::<String>::new());
        let taken = path("map.moved");
        let error = operations::move_shard(MapPath::on(disk.shared(), &moved), taken, ID, |_, _| {});
        assert!(matches!(error, Err(Error::AlreadyExists { .. })), "{error:?}");
        assert_eq!(tiles(&disk, &moved), files);
    }
}

#[test]
fn a_map_with_a_missing_or_truncated_file_is_not_moved() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let disk = one_map(storage);
        let map = piece(&disk, &path("map"), ID).unwrap();
        for (file, bytes) in tiles(&disk, &map) {
            let place = map.join(&file);
            for is_missing in [true, false] {
                match is_missing {
                    true => disk.take(&place),
                    false => disk.put(&place, &bytes[..bytes.len() - 1]),
                }
                let error = move_shard(&disk, &map, ID).unwrap_err();
                assert!(matches!(error, Error::Damaged { .. }) && error.path() == Some(&*place), "{error:#}");
                assert!(disk.files().into_keys().all(|file| !file.starts_with(path("map.moved"))));
            }
            disk.put(&place, &bytes);
        }
        move_shard(&disk, &map, ID).unwrap();
    }
}

#[test]
fn incompatible_shards_are_errors() {
    let disk = disk();
    let voxels = Voxels::from([([0, 0, 0], (0.85_f64.to_bits(), 1))]);
    let config = MapConfig::new(0.5, 2.5).unwrap();
    let make = |name: &str, config: &MapConfig, id| {
        write_map(&disk, &path(name), config, &voxels);
        piece(&disk, &path(name), id).unwrap()
    };
    let one = make("one", &config, ID);
    for (name, config, id, said) in [
        ("other", config.clone(), [8; 16], "the id"),
        ("coarse", MapConfig::new(0.25, 2.5).unwrap(), ID, "resolution"),
        ("compact", config.clone().with_storage(Storage::Compact), ID, "the storage"),
        ("same", config.clone(), ID, "so does another shard"),
    ] {
        let refused = join(&disk, &[one.clone(), make(name, &config, id)]).unwrap_err();
        assert!(refused.to_string().contains(said), "{refused}");
        assert!(refused.to_string().contains(name), "{refused}");
        assert!(disk.files().into_keys().all(|file| !file.starts_with(path("joined"))));
    }
    assert!(join(&disk, &[]).unwrap_err().to_string().starts_with("shards: "));
}
