use super::random_maps::{open, path};
use crate::harness::{EVERY_CRASH, Job, Left, faults, make_foreign, sweep};
use std::sync::Arc;
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::random_scans::{Random, random_scan};
use voxtile::operations::{self, CopyScans, Decay, Part};
use voxtile::scan::Stop;
use voxtile::space::Aabb;
use voxtile::store::{TileStore, UnsyncedDisk};
use voxtile::{
    Error, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper, Result, Storage,
};

/// A disk with two maps, `a` and `b`.
fn two_maps(storage: Storage) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let config = MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 3.0).with_storage(storage);
    for (name, seed) in [("a", 1), ("b", 2)] {
        let mut mapper =
            OutOfCoreTileMapper::create(MapPath::on(disk.shared(), path(name)), config.clone()).unwrap();
        let mut random = Random(seed);
        for x in [0.0, 3.0] {
            mapper.insert_scan(&random_scan(&mut random, [x, 0.0, 0.0], 4)).unwrap();
            mapper.flush().unwrap();
        }
    }
    disk.copy()
}

/// An operation that can be repeated after a failure.
type Work = fn(&FaultyDisk) -> Result<()>;

fn region() -> Aabb {
    Aabb { min: [-1.0, -1.0, -1.0], max: [4.1, 4.0, 4.0] }
}

fn merge(disk: &FaultyDisk) -> Result<()> {
    let maps = [open(disk, &path("a"))?, open(disk, &path("b"))?];
    operations::merge(&maps, path("out"), None, |_, _| {}).map(drop)
}

fn crop(disk: &FaultyDisk) -> Result<()> {
    operations::crop(&open(disk, &path("a"))?, &Part::Inside(region()), CopyScans::No, path("out"), |_, _| {})
        .map(drop)
}

const ID: [u8; 16] = [7; 16];

fn make_shard(disk: &FaultyDisk) -> Result<()> {
    operations::make_shard(&open(disk, &path("a"))?, path("out"), ID, |_, _| {}).map(drop)
}

/// Writes a map without syncs and moves it to its place, as a task of a distributed build does.
fn move_shard(disk: &FaultyDisk) -> Result<()> {
    disk.take(&path("local"));
    let made = make_local(disk).and_then(|()| {
        operations::move_shard(MapPath::on(disk.shared(), path("local")), path("out"), ID, |_, _| {})
    });
    // A task removes its folder at the end.
    disk.take(&path("local"));
    disk.take(&path("local.unfinished"));
    made.map(drop)
}

fn make_local(disk: &FaultyDisk) -> Result<()> {
    let config = open(disk, &path("a"))?.config().clone();
    let unsynced = Arc::new(UnsyncedDisk::of(disk.shared()));
    let mut mapper = OutOfCoreTileMapper::create_as(MapPath::on(unsynced, path("local")), config, ID)?;
    mapper.insert_scan(&random_scan(&mut Random(7), [1.0, 0.0, 0.0], 4))?;
    mapper.flush()?;
    mapper.insert_scan(&random_scan(&mut Random(8), [3.0, 0.0, 0.0], 4))?;
    mapper.flush()
}

/// Like [`move_shard`], for a crop of another map.
fn move_crop(disk: &FaultyDisk) -> Result<()> {
    disk.take(&path("local"));
    let crop = open(disk, &path("a")).and_then(|map| {
        operations::crop_shard(&map, &Part::Inside(region()), false, path("local"), ID, |_, _| {})
    });
    let made = crop.and_then(|_| {
        operations::move_shard(MapPath::on(disk.shared(), path("local")), path("out"), ID, |_, _| {})
    });
    disk.take(&path("local"));
    disk.take(&path("local.unfinished"));
    made.map(drop)
}

/// A disk with two shards of `a`.
fn two_shards(storage: Storage) -> FaultyDisk {
    let disk = two_maps(storage);
    // The upper bound along x is a border between tiles.
    let west = Aabb { min: [-100.0; 3], max: [3.2, 100.0, 100.0] };
    for (name, part) in [("inside", Part::Inside(west)), ("outside", Part::Outside(west))] {
        operations::crop(&open(&disk, &path("a")).unwrap(), &part, CopyScans::No, path("crop"), |_, _| {})
            .unwrap();
        operations::make_shard(&open(&disk, &path("crop")).unwrap(), path(name), ID, |_, _| {}).unwrap();
        disk.take(&path("crop"));
    }
    disk.copy()
}

fn join(disk: &FaultyDisk) -> Result<()> {
    let shards = ["inside", "outside"].map(|name| MapPath::on(disk.shared(), path(name)));
    operations::join(&shards, path("out"), |_, _| {}).map(drop)
}

/// Replaces the tiles of one map by those of the other, unless that is already done.
fn replace_tiles(disk: &FaultyDisk) -> Result<()> {
    const OF_FLUSH: u64 = 2;
    if open(disk, &path("a"))?.flush_number() > OF_FLUSH {
        // Opening the map for writing completes the commit.
        return TileStore::open(disk.shared(), &path("a")).map(drop);
    }
    let map = MapPath::on(disk.shared(), path("a"));
    operations::replace_tiles(map, &[open(disk, &path("b"))?], OF_FLUSH, 3, None, |_, _| {}).map(drop)
}

/// A disk with a map of the same scans that keeps them.
fn a_map_with_kept_scans(storage: Storage) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let config = MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 3.0).with_storage(storage);
    let config = config.with_kept_scans(true);
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), path("a")), config).unwrap();
    let mut random = Random(1);
    for x in [0.0, 3.0] {
        mapper.insert_scan(&random_scan(&mut random, [x, 0.0, 0.0], 4)).unwrap();
    }
    mapper.flush().unwrap();
    drop(mapper);
    disk.copy()
}

/// Rebuilds a map with memory for one tile, so that tiles are written before the end.
fn rebuild(disk: &FaultyDisk) -> Result<()> {
    let map = open(disk, &path("a"))?;
    let config = MapConfig::new(0.2, 3.2)?.with_range(0.0, 3.0).with_storage(map.config().storage);
    let config = config.with_kept_scans(true).with_cache_tiles(1).with_write_buffer_bytes(600);
    let output = MapPath::on(disk.shared(), path("out"));
    operations::rebuild(&map, output, config, |rays| *rays, &Stop::default(), |_, _| ()).map(drop)
}

fn clear(disk: &FaultyDisk) -> Result<()> {
    operations::clear(MapPath::on(disk.shared(), path("a")), &Part::Outside(region()), |_, _| {}).map(drop)
}

fn decay(disk: &FaultyDisk) -> Result<()> {
    operations::decay(
        MapPath::on(disk.shared(), path("a")),
        &Decay::new(2.0).with_forget_below(0.25),
        |_, _| {},
    )
    .map(drop)
}

/// Returns the digest of a map, or `None` if there is no map. Panics if the map is damaged.
fn digest(disk: &FaultyDisk, name: &str) -> Option<voxtile::Digest> {
    match MapReader::open(MapPath::on(disk.shared(), path(name)), 0) {
        Ok(reader) => Some(reader.digest().unwrap_or_else(|error| panic!("{name}: {error:#}"))),
        Err(Error::NoMap { .. }) => None,
        Err(error) => panic!("{name}: {error:#}"),
    }
}

/// Checks that `work` is atomic under faults and power cuts, and that repeating it succeeds.
fn check(storage: Storage, name: &'static str, work: Work) {
    check_from(two_maps(storage), name, work);
}

fn check_from(start: FaultyDisk, name: &'static str, work: Work) {
    // A map of the original format is converted by the repeated call.
    let is_own = start.files().contains_key(&path("a").join("commits.log"));
    let job = Job::new(start, path(name), work, move |disk| digest(disk, name));
    let job = if is_own { job.tidy() } else { job };
    let kinds: [fn(u64) -> Fault; 4] = [Fault::Fails, Fault::LosesSync, Fault::IsFull, Fault::IsReadOnly];
    sweep(&job, faults(&job, &kinds, 8), &[Left::Dropped, Left::Shuffled(7), Left::Mended]);
    let crashes = faults(&job, &[Fault::Crashes], 6);
    sweep(&job, crashes, &[&EVERY_CRASH[..], &[Left::Killed]].concat());
}

#[test]
fn a_merge_is_atomic() {
    check(Storage::OctoMap, "out", merge);
    check(Storage::Compact, "out", merge);
}

#[test]
fn a_shard_is_atomic() {
    check(Storage::OctoMap, "out", make_shard);
    check(Storage::Compact, "out", make_shard);
}

#[test]
fn a_move_of_a_shard_is_atomic_and_durable() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        check(storage, "out", move_shard);
        check(storage, "out", move_crop);
    }
}

#[test]
fn a_join_is_atomic() {
    check_from(two_shards(Storage::OctoMap), "out", join);
    check_from(two_shards(Storage::Compact), "out", join);
    check_from(two_shards(Storage::Compact).without_links(), "out", join);
}

#[test]
fn a_rebuild_is_atomic() {
    check_from(a_map_with_kept_scans(Storage::OctoMap), "out", rebuild);
    check_from(a_map_with_kept_scans(Storage::Compact), "out", rebuild);
}

/// A stop leaves no files, and no partial map.
#[test]
fn a_stopped_rebuild_leaves_no_map() {
    let disk = a_map_with_kept_scans(Storage::Compact);
    let map = open(&disk, &path("a")).unwrap();
    let (stop, output) = (Stop::default(), MapPath::on(disk.shared(), path("out")));
    let config = map.config().clone();
    let made = operations::rebuild(
        &map,
        output,
        config,
        |rays| *rays,
        &stop,
        |done, all| {
            assert_eq!((done, all), (1, 2));
            stop.set();
        },
    );
    assert!(matches!(made, Err(Error::Stopped)), "{made:?}");
    assert!(disk.files().keys().all(|file| file.starts_with(path("a"))), "{:?}", disk.files().keys());
}

#[test]
fn a_crop_is_atomic() {
    check(Storage::OctoMap, "out", crop);
}

#[test]
fn a_replacement_of_tiles_is_atomic() {
    check(Storage::OctoMap, "a", replace_tiles);
    check(Storage::Compact, "a", replace_tiles);
}

#[test]
fn a_clear_is_atomic() {
    check(Storage::OctoMap, "a", clear);
    check(Storage::Compact, "a", clear);
}

#[test]
fn a_decay_is_atomic_and_applied_once() {
    check(Storage::OctoMap, "a", decay);
    check(Storage::Compact, "a", decay);
}

/// The same maps in the original format.
fn foreign() -> FaultyDisk {
    let disk = two_maps(Storage::OctoMap);
    ["a", "b"].iter().for_each(|name| make_foreign(&disk, &path(name)));
    disk
}

#[test]
fn maps_of_the_original_format_are_cropped_and_cleared() {
    check_from(foreign(), "a", clear);
    let disk = foreign();
    crop(&disk).unwrap();
    clear(&disk).unwrap();
    // Both results have the same voxels. The crop is a new map; the other map was changed in place.
    assert_eq!(digest(&disk, "out"), digest(&disk, "a"));
    disk.take(&path("out"));
    // `a` has been converted to voxtile's format, `b` has not.
    assert!(merge(&disk).unwrap_err().to_string().contains("original format"));
}
