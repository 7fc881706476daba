use crate::harness::{EVERY_CRASH, Job, Left, faults, sweep};
use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk};
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

#[test]
fn after_any_fault_there_is_no_map_or_the_complete_map() {
    let written = write(&FaultyDisk::new(Fault::None), &source()).unwrap();
    assert_eq!(written.tiles, source().tile_indices().len() as u64);
    let state = |disk: &FaultyDisk| match MapReader::open(MapPath::on(disk.shared(), folder()), 0) {
        Err(Error::NoMap { .. }) => None,
        opened => Some(opened.unwrap().digest().unwrap()),
    };
    let work = |disk: &FaultyDisk| write(disk, &source()).map(drop);
    let job = Job::new(FaultyDisk::new(Fault::None), folder(), work, state).tidy();
    let kinds: [fn(u64) -> Fault; 3] = [Fault::Fails, Fault::LosesSync, Fault::IsFull];
    sweep(&job, faults(&job, &kinds, 2), &[Left::Dropped, Left::Mended]);
    sweep(&job, faults(&job, &[Fault::Crashes], 2), &[&EVERY_CRASH[..], &[Left::Killed]].concat());
}

#[test]
fn foreign_files_are_kept_and_prevent_a_new_map() {
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
fn a_second_writer_is_locked_out_and_tiles_must_be_in_order() {
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
