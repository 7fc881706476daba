//! A small map, and queries that tests run on its folder and on its copy in a bucket.

use std::path::{Path, PathBuf};
use testkit::random_scans::{Random, random_scan};
use voxtile::integrity::verify;
use voxtile::{MapConfig, MapQueries, MapReader, Mapper, OutOfCoreTileMapper, Scan, Storage};
use voxtile_bucket::{Bucket, BucketDisk, PushOptions, Pushed, push};

pub const KEEP: PushOptions = PushOptions { prunes: false, replaces: false, resends: false };
pub const PRUNE: PushOptions = PushOptions { prunes: true, ..KEEP };
pub const REPLACE: PushOptions = PushOptions { replaces: true, ..KEEP };
pub const RESEND: PushOptions = PushOptions { resends: true, ..KEEP };

pub fn config(storage: Storage) -> MapConfig {
    MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 3.0).with_storage(storage)
}

pub fn scan_at(seed: u64, x: f64) -> Scan {
    random_scan(&mut Random(seed), [x, 0.0, 0.0], 20)
}

/// Returns a mapper of a new map with some scans, flushed.
pub fn city(map: &Path, storage: Storage, keeps_scans: bool) -> OutOfCoreTileMapper {
    let mut config = config(storage);
    config.keeps_scans = keeps_scans;
    let mut mapper = OutOfCoreTileMapper::create(map, config).unwrap();
    for number in 0..12 {
        mapper.insert_scan(&scan_at(number, 5.0 * number as f64)).unwrap();
    }
    mapper.flush().unwrap();
    mapper
}

pub fn digest(map: &Path) -> String {
    MapReader::open(map, 1 << 20).unwrap().digest().unwrap().to_string()
}

pub fn open(bucket: &Bucket) -> voxtile::Result<MapReader> {
    MapReader::open(BucketDisk::open(bucket.clone())?.into_map_path(), 1 << 20)
}

pub fn digest_there(bucket: &Bucket) -> voxtile::Result<String> {
    Ok(open(bucket)?.digest()?.to_string())
}

pub fn push_now(map: &Path, bucket: &Bucket) -> Pushed {
    push(map, bucket, KEEP, |_, _| {}).unwrap()
}

/// Returns all files of a map except the lock.
pub fn files_of(map: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![map.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if !path.ends_with("writer.lock") {
                files.push((path.strip_prefix(map).unwrap().to_owned(), std::fs::read(path).unwrap()));
            }
        }
    }
    files.sort();
    files
}

pub fn assert_whole(map: &Path) {
    let found = verify(map, |finding| panic!("{finding}"), |_, _| {}).unwrap();
    assert!(found.is_whole());
}

/// Adds scans to a map, with a flush after each.
pub fn add_scans(map: &Path, seed: u64, flushes: u64) {
    let mut mapper = OutOfCoreTileMapper::open(map, config(Storage::OctoMap)).unwrap();
    for number in 0..flushes {
        mapper.insert_scan(&scan_at(seed + number, 20.0)).unwrap();
        mapper.flush().unwrap();
    }
}

pub fn message_of<T: std::fmt::Debug>(outcome: voxtile::Result<T>) -> String {
    format!("{:#}", anyhow::Error::from(outcome.unwrap_err()))
}
