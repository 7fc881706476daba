use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use voxtile::operations::{MapWriter, WrittenMap};
use voxtile::space::TileIndex;
use voxtile::tile::Table;
use voxtile::{Error, InMemoryMapper, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, Result};

fn folder() -> PathBuf {
    PathBuf::from("/city/new")
}

fn source() -> InMemoryMapper {
    let mut mapper = InMemoryMapper::new(MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 3.0)).unwrap();
    let mut random = Random(3);
    for x in [0.0, 3.0] {
        mapper.insert_scan(&random_scan(&mut random, [x, 0.0, 0.0], 4)).unwrap();
    }
    mapper
}

fn write(disk: &FaultyDisk, source: &InMemoryMapper) -> Result<WrittenMap> {
    let mut writer = MapWriter::create(MapPath::on(disk.shared(), folder()), source.config())?;
    for tile in source.tiles() {
        let tile = tile?;
        writer.put(tile.index(), tile.table())?;
    }
    writer.finish()
}

/// Whether the map is there; if so it must be whole.
fn is_there(disk: &FaultyDisk, source: &InMemoryMapper, what: &str) -> bool {
    match MapReader::open(MapPath::on(disk.shared(), folder()), 0) {
        Ok(reader) => {
            assert_eq!(reader.digest().unwrap(), source.digest().unwrap(), "{what}");
            true
        }
        Err(Error::NoMap { .. }) => false,
        Err(error) => panic!("{what}: {error:#}"),
    }
}

/// Makes the map where it is not there, whatever an attempt left.
fn again(disk: &FaultyDisk, source: &InMemoryMapper, what: &str) {
    let was_there = is_there(disk, source, what);
    match write(disk, source) {
        Ok(_) => assert!(!was_there, "{what}"),
        Err(Error::AlreadyExists { .. }) => assert!(was_there, "{what}"),
        Err(error) => panic!("{what}: {error:#}"),
    }
    assert!(is_there(disk, source, what), "{what}");
    let left = disk.files();
    assert!(left.keys().all(|path| path.starts_with(folder())), "{what}: {:?}", left.keys());
    assert!(left.keys().all(|path| !path.to_string_lossy().ends_with(".next")), "{what}");
}

#[test]
fn whatever_fails_and_wherever_the_power_goes_there_is_no_map_or_the_whole_one() {
    let source = source();
    let disk = FaultyDisk::new(Fault::None);
    let written = write(&disk, &source).unwrap();
    assert_eq!(written.tiles, source.tile_indices().len() as u64);
    assert!(is_there(&disk, &source, "undisturbed"));
    let (operations, changes) = (disk.operations(), disk.changes());
    println!("{operations} operations, {changes} of them changes");
    let faults = (0..operations).map(Fault::Fails);
    let faults = faults.chain((0..changes).map(Fault::LosesSync));
    let (mut none, mut whole) = (0, 0);
    for fault in faults.chain((0..changes).map(Fault::IsFull)) {
        let disk = FaultyDisk::new(fault);
        let written = write(&disk, &source);
        disk.make_room();
        let what = format!("{fault:?}");
        match is_there(&disk, &source, &what) {
            true => whole += 1,
            false => none += 1,
        }
        assert!(written.is_err() || is_there(&disk.after_crash(Unsynced::Dropped), &source, &what), "{what}");
        again(&disk, &source, &what);
    }
    assert!(none > 100 && whole > 0, "{none} {whole}");
    for at in 0..changes {
        let disk = FaultyDisk::new(Fault::Crashes(at));
        let written = write(&disk, &source);
        for unsynced in
            [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(at), Unsynced::Shuffled(at + 99)]
        {
            let what = format!("crash at {at}, {unsynced:?}");
            let left = disk.after_crash(unsynced);
            assert!(written.is_err() || is_there(&left, &source, &what), "{what}");
            again(&left, &source, &what);
        }
        again(&disk.after_kill(), &source, &format!("killed at {at}"));
    }
}

#[test]
fn what_is_not_of_a_map_stays_and_is_in_the_way() {
    let source = source();
    let disk = FaultyDisk::new(Fault::None);
    write(&disk, &source).unwrap();
    let refused = |disk: &FaultyDisk| matches!(write(disk, &source), Err(Error::AlreadyExists { .. }));
    assert!(refused(&disk), "a map");
    let disk = FaultyDisk::new(Fault::None);
    drop(MapWriter::create(MapPath::on(disk.shared(), folder()), source.config()).unwrap());
    assert!(disk.files().is_empty(), "{:?}", disk.files().keys());
    let stray = Path::new("/city/new.unfinished/notes.txt");
    voxtile::store::Disk::create_folder(&disk, stray.parent().unwrap()).unwrap();
    disk.put(stray, b"mine");
    assert!(refused(&disk));
    assert_eq!(disk.files()[stray], b"mine");
}

#[test]
fn nobody_else_makes_the_same_map_meanwhile_and_tiles_come_in_order() {
    let source = source();
    let disk = FaultyDisk::new(Fault::None);
    let mut writer = MapWriter::create(MapPath::on(disk.shared(), folder()), source.config()).unwrap();
    assert!(matches!(write(&disk, &source), Err(Error::Locked { .. })));
    let tile = source.tile_uncached(source.tile_indices()[1]).unwrap().unwrap();
    writer.put(tile.index(), tile.table()).unwrap();
    for wrong in [tile.index(), source.tile_indices()[0]] {
        assert!(matches!(writer.put(wrong, tile.table()), Err(Error::InvalidArgument { .. })));
    }
    writer.put(TileIndex::new(i32::MAX, 0, 0), &Table::default()).unwrap();
    assert_eq!(writer.finish().unwrap().tiles, 1);
    let reader = MapReader::open(MapPath::on(disk.shared(), folder()), 0).unwrap();
    assert_eq!(reader.tile_indices(), [tile.index()]);
    assert_eq!(reader.scan_number(), 0);
}
