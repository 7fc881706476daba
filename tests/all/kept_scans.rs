//! Writes and repairs of kept scans: writers do not touch damaged files, and a failed sync loses no scan.

use crate::harness::{at, is_whole, keeping_scans as config, map, name};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use voxtile::integrity::{Repair, repair};
use voxtile::mapper::KeptScan;
use voxtile::operations::{delete_snapshot, snapshot};
use voxtile::scan::{AttributeSlices, PointBlocks, ScanPoints};
use voxtile::store::{CatalogEntry, KeptFrame, KeptRecord, SegmentPlace, TileStore};
use voxtile::{Error, MapReader, Mapper, OutOfCoreTileMapper, RayConfig, Result, ScanRef};

/// Returns the points of a scan, which contain its name.
fn points(name: u64) -> Vec<[f64; 3]> {
    (0..40).map(|number| [name as f64, 0.1 * f64::from(number), 0.5]).collect()
}

fn insert(mapper: &mut OutOfCoreTileMapper, name: u64) -> Result<()> {
    mapper.insert_points(&ScanRef::in_world([0.0; 3], &points(name))).map(drop)
}

/// A map whose catalog has four scans, each of another flush and in its own segment.
fn a_map() -> FaultyDisk {
    a_map_of(4)
}

fn a_map_of(scans: u64) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    for name in 1..=scans {
        let mut mapper = match name {
            1 => OutOfCoreTileMapper::create(at(&disk), config()),
            _ => OutOfCoreTileMapper::open(at(&disk), config()),
        }
        .unwrap();
        insert(&mut mapper, name).unwrap();
        mapper.flush().unwrap();
    }
    disk
}

fn kept_files(disk: &FaultyDisk) -> BTreeMap<PathBuf, Vec<u8>> {
    disk.files().into_iter().filter(|(path, _)| path.to_string_lossy().contains("kept_scans")).collect()
}

fn kept_points(disk: &FaultyDisk) -> Result<Vec<Vec<[f64; 3]>>> {
    let of_scan = |scan: Result<KeptScan>| {
        let (scan, mut points) = (scan?, Vec::new());
        scan.for_each_own_chunk(0..scan.len(), &mut |some, _| {
            points.extend_from_slice(some);
            true
        })?;
        Ok(points)
    };
    MapReader::open(at(disk), 0)?.kept_scans()?.map(of_scan).collect()
}

#[test]
fn a_writer_does_not_remove_or_truncate_data_after_damage() {
    let whole = a_map();
    let files = kept_files(&whole);
    let [(catalog, bytes)] = files
        .iter()
        .filter(|(path, _)| path.to_string_lossy().contains("catalog"))
        .collect::<Vec<_>>()
        .try_into()
        .unwrap();
    assert_eq!(files.len(), 5, "a catalog and four segments");
    let mut refused = 0;
    for offset in 0..bytes.len() {
        let disk = whole.copy();
        let mut damaged = bytes.clone();
        damaged[offset] ^= 0x20;
        disk.put(catalog, &damaged);
        let before = kept_files(&disk);
        let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
        assert_eq!(kept_files(&disk), before, "opening, a byte at {offset}");
        let inserted = insert(&mut mapper, 5).and_then(|()| mapper.flush());
        drop(mapper);
        match inserted {
            Ok(()) => assert_eq!(kept_points(&disk).unwrap().len(), 5, "a byte at {offset}"),
            Err(error) => {
                assert!(matches!(error, Error::Damaged { .. }), "a byte at {offset}: {error:#}");
                assert_eq!(kept_files(&disk), before, "inserting, a byte at {offset}");
                refused += 1;
            }
        }
        repair(at(&disk), |_| (), |_, _| ()).unwrap();
        let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
        insert(&mut mapper, 6).and_then(|()| mapper.flush()).unwrap();
    }
    assert!(refused > bytes.len() * 9 / 10, "{refused} of {}", bytes.len());
}

/// A store that keeps scans.
struct Writer {
    disk: FaultyDisk,
    store: TileStore,
    scan_number: u64,
}

impl Writer {
    fn new() -> Self {
        let disk = FaultyDisk::new(Fault::None);
        OutOfCoreTileMapper::create(at(&disk), config()).unwrap().flush().unwrap();
        let store = TileStore::open(disk.shared(), map()).unwrap();
        Self { disk, store, scan_number: 0 }
    }

    fn write(&mut self, name: u64) -> Result<SegmentPlace> {
        let archive = self.store.archive_mut();
        archive.begin_scan()?;
        let (mut blocks, put) = (PointBlocks::default(), &mut |block: &[u8]| archive.push_block(block));
        blocks.push(&points(name), None, AttributeSlices::default(), put)?;
        blocks.end(false, put)?;
        Ok(archive.end_scan())
    }

    fn note(&mut self, place: SegmentPlace) {
        self.scan_number += 1;
        self.store.archive_mut().note(CatalogEntry::Kept(Box::new(KeptRecord {
            number: self.scan_number,
            stamp_ns: None,
            frame: KeptFrame::World([0.0; 3]),
            rays: RayConfig::default(),
            points: 40,
            has_intensities: false,
            has_colours: false,
            has_classes: false,
            updates: 0,
            place,
            moving: None,
            sweep: None,
            body_from_sensor: None,
            tiles: Vec::new(),
        })));
    }

    fn commit(&mut self) -> Result<()> {
        self.store.commit(self.store.metadata().clone(), self.scan_number)
    }

    /// Commits until it succeeds, after this fault. Returns the number of failures.
    fn commit_after(&mut self, fault: Fault) -> usize {
        self.disk.set_fault(fault);
        let failed = (0..5).take_while(|_| self.commit().is_err()).count();
        self.disk.set_fault(Fault::None);
        failed
    }

    /// Checks the scans that are left after a power cut.
    fn check(&mut self, names: &[u64], what: &str) {
        self.commit().unwrap();
        let left = self.disk.after_crash(Unsynced::Dropped);
        let expected: Vec<_> = names.iter().map(|&name| points(name)).collect();
        let found = kept_points(&left).unwrap_or_else(|error| panic!("{what}: {error:#}"));
        assert_eq!(found, expected, "{what}");
        assert!(is_whole(&left), "{what}");
    }
}

#[test]
fn an_abandoned_scan_after_a_failed_sync_loses_no_other_scan() {
    let mut failed = 0;
    for change in 0..20 {
        let mut writer = Writer::new();
        let first = writer.write(1).unwrap();
        writer.note(first);
        writer.write(2).unwrap();
        failed += writer.commit_after(Fault::LosesSync(change));
        writer.store.archive_mut().give_up_scan();
        let third = writer.write(3).unwrap();
        writer.note(third);
        writer.check(&[1, 3], &format!("change {change} fails"));
    }
    assert!(failed > 0);
}

#[test]
fn a_scan_committed_after_a_failed_sync_is_durable() {
    let mut failed = 0;
    for change in 0..20 {
        let mut writer = Writer::new();
        let first = writer.write(1).unwrap();
        writer.note(first);
        let second = writer.write(2).unwrap();
        failed += writer.commit_after(Fault::LosesSync(change));
        writer.note(second);
        writer.check(&[1, 2], &format!("change {change} fails"));
    }
    assert!(failed > 0);
}

#[test]
fn a_partly_failed_copy_does_not_shift_later_scans() {
    let mut failed = 0;
    for change in 0..8 {
        for operation in 0..24 {
            let mut writer = Writer::new();
            let first = writer.write(1).unwrap();
            writer.note(first);
            writer.disk.set_fault(Fault::LosesSync(change));
            let _ = writer.commit();
            failed += writer.commit_after(Fault::Fails(operation));
            let second = writer.write(2).unwrap();
            writer.note(second);
            writer.check(&[1, 2], &format!("change {change} fails, then operation {operation}"));
        }
    }
    assert!(failed > 0);
}

/// A map with all scans of one flush in one segment, and the path of the segment.
fn one_segment(scans: u64) -> (FaultyDisk, PathBuf) {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    (1..=scans).for_each(|name| insert(&mut mapper, name).unwrap());
    mapper.flush().unwrap();
    (disk.copy(), map().join("kept_scans/segment.1"))
}

/// Returns path and length of the catalog.
fn catalog_of(disk: &FaultyDisk) -> (PathBuf, usize) {
    let files = kept_files(disk).into_iter();
    let mut catalogs = files.filter(|(path, _)| path.to_string_lossy().contains("kept_scans/catalog"));
    let (path, bytes) = catalogs.next().unwrap();
    assert!(catalogs.next().is_none());
    (path, bytes.len())
}

fn flip(disk: &FaultyDisk, path: &Path, offset: usize) {
    let mut bytes = disk.files()[path].clone();
    bytes[offset] ^= 1 << (offset % 8);
    disk.put(path, &bytes);
}

fn repaired(disk: &FaultyDisk, what: &str) -> Repair {
    let repaired = repair(at(disk), |_| (), |_, _| ()).unwrap_or_else(|error| panic!("{what}: {error:#}"));
    assert!(is_whole(disk), "{what}");
    repaired
}

/// Returns the names of the scans whose points the map keeps.
fn kept_names(disk: &FaultyDisk) -> Vec<u64> {
    kept_points(disk).unwrap().iter().map(|points| points[0][0] as u64).collect()
}

/// Runs two writers, each of which removes unneeded files.
fn continue_map(disk: &FaultyDisk) {
    for name in [8, 9] {
        let mut mapper = OutOfCoreTileMapper::open(at(disk), config()).unwrap();
        insert(&mut mapper, name).and_then(|()| mapper.flush()).unwrap();
    }
}

/// Whether each of these files still exists, under any name.
fn has_all(disk: &FaultyDisk, files: &BTreeMap<PathBuf, Vec<u8>>) -> bool {
    let left = disk.files();
    files.values().all(|bytes| left.values().any(|kept| kept == bytes))
}

fn in_quarantine(disk: &FaultyDisk, name: &str) -> usize {
    let quarantine = map().join("quarantine");
    let is_of = |path: &&PathBuf| path.starts_with(&quarantine) && path.to_string_lossy().contains(name);
    disk.files().keys().filter(is_of).count()
}

#[test]
fn a_flipped_bit_in_a_catalog_loses_at_most_one_scan_and_no_file() {
    let whole = a_map();
    let (catalog, bytes) = catalog_of(&whole);
    let mut lost = 0;
    for offset in 0..bytes {
        let disk = whole.copy();
        flip(&disk, &catalog, offset);
        let (files, what) = (kept_files(&disk), format!("a byte at {offset}"));
        let repaired = repaired(&disk, &what);
        let names = kept_names(&disk);
        assert_eq!(names.len() as u64 + repaired.scans_lost, 4, "{what}: {names:?}");
        assert!(repaired.scans_lost <= 1 && repaired.actions > 0, "{what}: {repaired:?}");
        lost += repaired.scans_lost;
        continue_map(&disk);
        assert!(has_all(&disk, &files), "{what}");
        assert_eq!(kept_names(&disk), [&names[..], &[8, 9]].concat(), "{what}");
    }
    assert!(lost as usize > bytes * 9 / 10, "{lost} of {bytes}");
}

#[test]
fn points_of_a_lost_record_are_kept_when_its_snapshot_is_deleted() {
    let disk = a_map_of(3);
    let name = name("s");
    snapshot(at(&disk), &name).unwrap();
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
    insert(&mut mapper, 4).and_then(|()| mapper.flush()).unwrap();
    drop(mapper);
    flip(&disk, &catalog_of(&disk).0, 60);
    let files = kept_files(&disk);
    assert_eq!(repaired(&disk, "").scans_lost, 1);
    continue_map(&disk);
    delete_snapshot(at(&disk), &name).unwrap();
    continue_map(&disk);
    assert!(has_all(&disk, &files));
    assert_eq!(kept_names(&disk), [2, 3, 4, 8, 9, 8, 9]);
}

#[test]
fn a_bad_sector_of_a_segment_loses_only_its_scan() {
    let (disk, segment) = one_segment(4);
    let second = one_segment(1).0.files()[&segment].len();
    disk.make_bytes_unreadable(&segment, second + 8..second + 9);
    let files = kept_files(&disk);
    assert_eq!(repaired(&disk, "").scans_lost, 1);
    assert_eq!(kept_names(&disk), [1, 3, 4]);
    continue_map(&disk);
    assert!(has_all(&disk, &files) && disk.files().contains_key(&segment));
    assert_eq!(in_quarantine(&disk, "segment"), 0);
}

#[test]
fn a_segment_is_quarantined_only_if_no_scan_needs_it() {
    let ends: Vec<_> = (0..=4).map(|scans| if scans == 0 { 0 } else { segment_bytes(scans) }).collect();
    for damaged in [vec![0, 1, 3], vec![0, 1, 2, 3]] {
        let (disk, segment) = one_segment(4);
        damaged.iter().for_each(|&scan: &usize| flip(&disk, &segment, ends[scan] + 9));
        let files = kept_files(&disk);
        assert_eq!(repaired(&disk, "").scans_lost, damaged.len() as u64);
        assert_eq!(kept_names(&disk).len(), 4 - damaged.len());
        continue_map(&disk);
        assert!(has_all(&disk, &files));
        assert_eq!(in_quarantine(&disk, "segment"), usize::from(damaged.len() == 4));
    }
}

fn segment_bytes(scans: u64) -> usize {
    let (disk, segment) = one_segment(scans);
    disk.files()[&segment].len()
}

#[test]
fn a_bad_sector_of_a_catalog_keeps_the_scans_before_it() {
    for disk in [a_map(), a_map().without_links()] {
        let (catalog, _) = catalog_of(&disk);
        let (_, two) = catalog_of(&a_map_of(2));
        disk.make_bytes_unreadable(&catalog, two + 20..two + 21);
        let files = kept_files(&disk);
        assert_eq!(repaired(&disk, "").scans_lost, 2);
        assert_eq!(kept_names(&disk), [1, 2]);
        continue_map(&disk);
        assert!(has_all(&disk, &files));
        assert_eq!(kept_names(&disk), [1, 2, 8, 9]);
    }
}

#[test]
fn an_interrupted_repair_of_kept_scans_loses_no_file() {
    let damaged = a_map();
    let (catalog, _) = catalog_of(&damaged);
    let (_, one) = catalog_of(&a_map_of(1));
    flip(&damaged, &catalog, one + 60);
    flip(&damaged, &map().join("kept_scans/segment.3"), 9);
    let files = kept_files(&damaged);
    let mut crashes = 0;
    for change in 0.. {
        let disk = damaged.copy();
        disk.set_fault(Fault::Crashes(change));
        let _ = repair(at(&disk), |_| (), |_, _| ());
        if !disk.has_crashed() {
            break;
        }
        crashes += 1;
        for unsynced in [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(change)] {
            let (disk, what) = (disk.after_crash(unsynced), format!("change {change}, {unsynced:?}"));
            // A writer between the two repairs does not remove files either.
            drop(TileStore::open(disk.shared(), map()).unwrap());
            assert!(has_all(&disk, &files), "{what}");
            repaired(&disk, &what);
            assert_eq!(kept_names(&disk), [1, 4], "{what}");
            continue_map(&disk);
            assert!(has_all(&disk, &files), "{what}");
        }
    }
    assert!(crashes > 10, "{crashes}");
}

/// Damages or removes metadata and log.
fn lose(disk: &FaultyDisk, is_missing: bool) {
    for name in ["metadata.json", "commits.log"] {
        match is_missing {
            true => disk.take(&map().join(name)),
            false => disk.put(&map().join(name), b"damaged"),
        }
    }
}

#[test]
fn a_repair_without_metadata_and_log_keeps_all_kept_scans() {
    for is_missing in [false, true] {
        let disk = a_map();
        let files = kept_files(&disk);
        lose(&disk, is_missing);
        assert_eq!(repaired(&disk, "").scans_lost, 4);
        assert_eq!(in_quarantine(&disk, "kept_scans"), files.len());
        assert!(kept_files(&disk).keys().all(|path| path.starts_with(map().join("quarantine"))));
        continue_map(&disk);
        assert!(has_all(&disk, &files));
        assert_eq!(kept_names(&disk), [8, 9]);
    }
}

/// Kept scans of snapshots are not moved.
#[test]
fn a_repair_without_metadata_and_log_keeps_the_kept_scans_of_snapshots() {
    let disk = a_map_of(3);
    let name = name("s");
    snapshot(at(&disk), &name).unwrap();
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
    insert(&mut mapper, 4).and_then(|()| mapper.flush()).unwrap();
    drop(mapper);
    let files = kept_files(&disk);
    lose(&disk, true);
    // With readable and with unreadable snapshots.
    for is_whole in [true, false] {
        let disk = disk.copy();
        if !is_whole {
            flip(&disk, &map().join("snapshots/s"), 60);
        }
        assert_eq!(repaired(&disk, "").scans_lost, 4);
        let moved = in_quarantine(&disk, "kept_scans");
        assert_eq!(moved, if is_whole { 1 } else { files.len() });
        continue_map(&disk);
        assert!(has_all(&disk, &files));
        if is_whole {
            let past = MapReader::open_snapshot(at(&disk), &name, 0).unwrap();
            assert_eq!(past.kept_scans().unwrap().count(), 3);
        }
    }
}

#[test]
fn an_interrupted_repair_without_metadata_and_log_loses_no_kept_scan() {
    let damaged = a_map();
    let files = kept_files(&damaged);
    lose(&damaged, false);
    let mut crashes = 0;
    for change in 0.. {
        let disk = damaged.copy();
        disk.set_fault(Fault::Crashes(change));
        let _ = repair(at(&disk), |_| (), |_, _| ());
        if !disk.has_crashed() {
            break;
        }
        crashes += 1;
        for unsynced in [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(change)] {
            let (disk, what) = (disk.after_crash(unsynced), format!("change {change}, {unsynced:?}"));
            drop(TileStore::open(disk.shared(), map()));
            repaired(&disk, &what);
            continue_map(&disk);
            assert!(has_all(&disk, &files), "{what}");
        }
    }
    assert!(crashes > 10, "{crashes}");
}
