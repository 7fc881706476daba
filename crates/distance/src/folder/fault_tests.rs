//! Every operation on the files of a field fails once.

use super::compute::{FieldOptions, compute_field_on};
use super::field_disk::{FieldDisk, FsDisk};
use super::reader::FieldReader;
use crate::options::{DistanceOptions, UnknownRule};
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use tempfile::NamedTempFile;
use testkit::memory_folder::memory_folder;
use voxtile::mapper::MapReader;
use voxtile::{MapConfig, MapOptions, Mapper, Result, Scan};

/// Fails from its operation number `first` on, `count` times. A failed write leaves half of the bytes.
#[derive(Debug)]
struct FailingDisk {
    first: u64,
    count: u64,
    kind: ErrorKind,
    done: AtomicU64,
}

impl FailingDisk {
    fn new(first: u64, count: u64, kind: ErrorKind) -> Arc<Self> {
        Arc::new(Self { first, count, kind, done: AtomicU64::new(0) })
    }

    fn check(&self) -> io::Result<()> {
        let number = self.done.fetch_add(1, Relaxed);
        let fails = number.checked_sub(self.first).is_some_and(|after| after < self.count);
        if fails { Err(io::Error::from(self.kind)) } else { Ok(()) }
    }

    fn has_failed(&self) -> bool {
        self.done.load(Relaxed) > self.first
    }
}

impl FieldDisk for FailingDisk {
    fn create_folder(&self, path: &Path) -> io::Result<()> {
        self.check().and_then(|()| FsDisk.create_folder(path))
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<String>> {
        self.check().and_then(|()| FsDisk.list(folder))
    }

    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        self.check().and_then(|()| FsDisk.read(path))
    }

    fn create(&self, folder: &Path) -> io::Result<NamedTempFile> {
        self.check().and_then(|()| FsDisk.create(folder))
    }

    fn write(&self, file: &mut NamedTempFile, bytes: &[u8]) -> io::Result<()> {
        let checked = self.check();
        let end = if checked.is_ok() { bytes.len() } else { bytes.len() / 2 };
        FsDisk.write(file, &bytes[..end]).and(checked)
    }

    fn sync(&self, path: &Path) -> io::Result<()> {
        self.check().and_then(|()| FsDisk.sync(path))
    }

    fn rename(&self, file: NamedTempFile, to: &Path) -> io::Result<()> {
        self.check().and_then(|()| FsDisk.rename(file, to))
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        self.check().and_then(|()| FsDisk.remove(path))
    }
}

fn map(folder: &Path) -> MapReader {
    let config = MapConfig::new(0.1, 1.0).unwrap();
    let mut map = MapOptions::new().config(config).create_if_missing(true).open(folder).unwrap();
    let points = (0..12).map(|k| [0.2 * f64::from(k), 1.05, 0.05]).collect();
    map.insert_scan(&Scan { points, ..Scan::default() }).unwrap();
    map.flush().unwrap();
    MapReader::open(folder, 1 << 20).unwrap()
}

fn compute(map: &MapReader, folder: &Path, cap_m: f64, disk: Arc<dyn FieldDisk>) -> Result<()> {
    // One tile at a time.
    let options =
        FieldOptions::new(DistanceOptions::new(cap_m).with_unknown(UnknownRule::Free)).with_memory(0);
    compute_field_on(disk, map, folder, &options, &|_, _| {}).map(drop)
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for folder in [folder.to_owned(), folder.join("tiles")] {
        for name in FsDisk.list(&folder).unwrap_or_default() {
            if let Ok(bytes) = fs::read(folder.join(&name)) {
                files.insert(name, bytes);
            }
        }
    }
    files
}

/// Reads all tiles of a field; returns its cap.
fn read_all(folder: &Path) -> Result<f64> {
    let field = FieldReader::open(folder, 1 << 20)?;
    for tile in field.tile_indices() {
        field.voxel(field.grid().voxels_of_tile(tile).min)?;
    }
    Ok(field.options().max_distance_m)
}

#[test]
fn after_each_failed_operation_the_field_is_readable_and_the_next_run_completes_it() {
    let folder = memory_folder();
    let map = map(&folder.path().join("map"));
    let expected = folder.path().join("expected");
    compute(&map, &expected, 0.4, Arc::new(FsDisk)).unwrap();
    let mut failures = 0;
    for (has_earlier, count, kind) in [
        (false, 1, ErrorKind::Other),
        (true, 1, ErrorKind::Other),
        (false, u64::MAX, ErrorKind::StorageFull),
        (true, u64::MAX, ErrorKind::StorageFull),
    ] {
        for first in 0.. {
            let field = folder.path().join(format!("field {has_earlier} {count} {first}"));
            if has_earlier {
                compute(&map, &field, 0.3, Arc::new(FsDisk)).unwrap();
            }
            let disk = FailingDisk::new(first, count, kind);
            let result = compute(&map, &field, 0.4, disk.clone());
            match &result {
                Ok(()) => assert!(files(&field) == files(&expected), "operation {first}"),
                Err(error) => {
                    failures += 1;
                    let message = format!("{error:#}");
                    assert!(message.contains(field.to_str().unwrap()), "operation {first}: {message}");
                    // The earlier field or the new one, or a message that there is none.
                    match read_all(&field) {
                        Ok(cap_m) => assert!(cap_m == 0.4 || has_earlier && cap_m == 0.3, "{cap_m}"),
                        Err(error) => {
                            let message = error.to_string();
                            assert!(!has_earlier && message.contains("no distance field here"), "{message}");
                        }
                    }
                    compute(&map, &field, 0.4, Arc::new(FsDisk)).unwrap();
                    assert!(files(&field) == files(&expected), "after operation {first}");
                }
            }
            assert_eq!(read_all(&field).unwrap(), 0.4);
            fs::remove_dir_all(&field).unwrap();
            if !disk.has_failed() {
                break;
            }
        }
    }
    assert!(failures > 60, "{failures}");
}
