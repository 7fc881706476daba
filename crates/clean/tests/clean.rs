//! Marks of a simulated street: what is found, and that the result depends on the scans alone.

use std::path::Path;
use tempfile::TempDir;
use testkit::reference_map::{ReferenceMap, voxels_of};
use voxtile::mapper::KeptSummary;
use voxtile::operations::{Replay, ScanChange, join, replay_columns, replay_part, snapshot};
use voxtile::scan::{Scan, ScanPoints, ScanRef, Stop};
use voxtile::{
    Aabb, Clearing, Error, MapConfig, MapPath, MapQueries, MapReader, Mapper, MemoryLimit,
    OutOfCoreTileMapper, Pose, SnapshotName, TileBox,
};
use voxtile_clean::{
    AllMarks, Clean, Cleaned, FoundMarks, Order, SearchMaps, clean, clean_found, count_column, map_column,
    search_columns, undo,
};

/// A corridor along x, 6 m wide, with floor and walls. Something of 0.5 x 0.5 x 1.7 m moves across it; another thing
/// stands for the first half of the scans and leaves.
struct Corridor {
    scans: usize,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Part {
    Surface,
    Walker,
    Leaver,
}

impl Corridor {
    fn bodies(&self, scan: usize) -> Vec<(Aabb, Part)> {
        let body = |x: f64, y: f64| Aabb { min: [x, y, 0.0], max: [x + 0.5, y + 0.5, 1.7] };
        let walker = (body(3.0 + 0.4 * scan as f64, -1.0), Part::Walker);
        let leaver = (body(5.0, 1.0), Part::Leaver);
        if scan < self.scans / 2 { vec![walker, leaver] } else { vec![walker] }
    }

    /// Casts a ray: its length, and what it hits.
    fn cast(&self, scan: usize, origin: [f64; 3], way: [f64; 3]) -> (f64, Part) {
        let plane = |axis: usize, at: f64| (at - origin[axis]) / way[axis];
        let planes =
            [plane(2, 0.0), plane(1, -3.0), plane(1, 3.0), plane(2, 3.0), plane(0, 20.0), plane(0, -5.0)];
        let nearest = planes.into_iter().filter(|t| *t > 0.0).fold(f64::INFINITY, f64::min);
        let mut found = (nearest, Part::Surface);
        for (body, part) in self.bodies(scan) {
            let spans = [0, 1, 2].map(|k| {
                let [a, b] = [(body.min[k] - origin[k]) / way[k], (body.max[k] - origin[k]) / way[k]];
                (a.min(b), a.max(b))
            });
            let enter = spans.iter().fold(0.0, |t, span| span.0.max(t));
            let leave = spans.iter().fold(f64::INFINITY, |t, span| span.1.min(t));
            if enter < leave && enter > 0.0 && enter < found.0 {
                found = (enter, part);
            }
        }
        found
    }

    fn scan(&self, number: usize) -> (Scan, Vec<Part>) {
        let origin = [0.13 + 0.05 * number as f64, 0.21, 1.03];
        let (mut points, mut parts) = (Vec::new(), Vec::new());
        for column in 0..360 {
            let azimuth = f64::from(column).to_radians() + 0.0007;
            for beam in 0..40 {
                let up = (f64::from(beam) * 1.5 - 38.0).to_radians() + 0.0003;
                let way = [up.cos() * azimuth.cos(), up.cos() * azimuth.sin(), up.sin()];
                let (distance, part) = self.cast(number, origin, way);
                points.push([0, 1, 2].map(|k| origin[k] + distance * way[k]));
                parts.push(part);
            }
        }
        (Scan { origin, points, intensities: None }, parts)
    }

    fn config() -> MapConfig {
        MapConfig::new(0.2, 3.2).unwrap().with_kept_scans(true).with_clearing(Clearing::guarded())
    }

    fn build(&self, map: &Path) {
        let mut mapper = OutOfCoreTileMapper::create(map, Self::config()).unwrap();
        for number in 0..self.scans {
            mapper.insert_scan(&self.scan(number).0).unwrap();
        }
        mapper.flush().unwrap();
    }
}

fn run(map: &Path, how: &Clean) -> Cleaned {
    clean(map, how, |_, _, _| ()).unwrap()
}

fn digest(map: &Path) -> String {
    MapReader::open(map, 0).unwrap().digest().unwrap().to_string()
}

/// The marks of all scans.
fn marks(map: &Path) -> Vec<Vec<bool>> {
    let reader = MapReader::open(map, 0).unwrap();
    let scans = reader.kept_scans().unwrap().map(|scan| {
        let scan = scan.unwrap();
        scan.moving().map_or(vec![false; scan.len()], |marks| marks.iter().collect())
    });
    scans.collect()
}

/// Share of the marked points of a part.
fn share(corridor: &Corridor, marks: &[Vec<bool>], part: Part) -> f64 {
    let (mut all, mut marked) = (0, 0);
    for (number, marks) in marks.iter().enumerate() {
        for (of, is_marked) in corridor.scan(number).1.iter().zip(marks) {
            all += usize::from(*of == part);
            marked += usize::from(*of == part && *is_marked);
        }
    }
    marked as f64 / all as f64
}

#[test]
fn moving_things_are_marked_and_surfaces_are_not() {
    let (folder, corridor) = (TempDir::new().unwrap(), Corridor { scans: 24 });
    let map = &folder.path().join("map");
    corridor.build(map);
    let before = digest(map);
    let keep_as: SnapshotName = "before".parse().unwrap();
    let cleaned = run(map, &Clean::new(Replay::default().with_keep_as(keep_as.clone())));
    let found = marks(map);
    assert_eq!(cleaned.points_changed, found.iter().flatten().filter(|is| **is).count() as u64);
    assert_eq!(cleaned.points, 24 * 360 * 40);
    for (part, range) in [(Part::Surface, 0.0..0.002), (Part::Walker, 0.7..1.01), (Part::Leaver, 0.6..1.01)] {
        let share = share(&corridor, &found, part);
        assert!(range.contains(&share), "{part:?}: {share}");
    }

    // The map is that of rays without these hits.
    let mut naive = ReferenceMap::new(&Corridor::config());
    for (number, marks) in found.iter().enumerate() {
        naive.insert_marked(&corridor.scan(number).0, marks);
    }
    assert!(voxels_of(&MapReader::open(map, 0).unwrap()) == naive.voxels);

    // The result is the same from a map that has marks, and `undo` restores the map.
    let after = digest(map);
    assert_eq!(run(map, &Clean::default()).points_changed, cleaned.points_changed);
    assert_eq!((digest(map), marks(map)), (after, found));
    let undone = undo(map, &Replay::default(), |_, _, _| ()).unwrap();
    assert_eq!((undone.points_changed, digest(map)), (cleaned.points_changed, before.clone()));
    assert!(KeptSummary::read(map).unwrap().scans().iter().all(|scan| scan.moving_points == 0));
    let past = MapReader::open_snapshot(map, &keep_as, 0).unwrap();
    assert_eq!(past.digest().unwrap().to_string(), before);
    assert_eq!(undo(map, &Replay::default(), |_, _, _| ()).unwrap().points_changed, 0);
}

#[test]
fn the_result_does_not_depend_on_memory_and_threads() {
    let (folder, corridor) = (TempDir::new().unwrap(), Corridor { scans: 12 });
    let mut results = Vec::new();
    let least = MemoryLimit::min_bytes(&Corridor::config().grid);
    for (threads, memory) in
        [(1, MemoryLimit::Default), (3, MemoryLimit::Bytes(least)), (2, MemoryLimit::Bytes(64 << 20))]
    {
        let map = &folder.path().join(threads.to_string());
        corridor.build(map);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let how = Clean::new(Replay::default().with_memory(memory)).with_parked_scans(5);
        pool.install(|| run(map, &how));
        results.push((digest(map), marks(map)));
    }
    assert!(results.iter().all(|result| *result == results[0]));
}

#[test]
fn parked_things_and_other_regions_are_not_marked() {
    let (folder, corridor) = (TempDir::new().unwrap(), Corridor { scans: 24 });
    let map = &folder.path().join("map");
    corridor.build(map);
    run(map, &Clean::default().with_parked_scans(8));
    let found = marks(map);
    let (leaver, walker) = (share(&corridor, &found, Part::Leaver), share(&corridor, &found, Part::Walker));
    assert!(leaver < 0.1 && walker > 0.7, "{leaver} {walker}");
    let names: Vec<_> = folder.path().read_dir().unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["map"], "a temporary folder remains");

    let region = Aabb { min: [4.0, 0.0, -1.0], max: [6.0, 3.0, 3.0] };
    run(map, &Clean::default().with_region(region));
    for (number, marks) in marks(map).iter().enumerate() {
        let (scan, _) = corridor.scan(number);
        assert!(
            scan.points.iter().zip(marks).all(|(point, is_marked)| !is_marked || region.contains(*point))
        );
    }
}

#[test]
fn a_dry_run_and_a_stop_change_nothing() {
    let (folder, corridor) = (TempDir::new().unwrap(), Corridor { scans: 8 });
    let map = &folder.path().join("map");
    corridor.build(map);
    let before = digest(map);
    let dry = Clean::new(Replay::default().with_dry_run(true));
    let planned = run(map, &dry);
    assert!(planned.points_changed > 0 && planned.replayed.estimated_s.is_some());
    assert_eq!(digest(map), before);
    let stop = Stop::default();
    stop.set();
    let stopped = clean(map, &Clean::new(Replay::default().with_stop(stop)), |_, _, _| ());
    assert!(matches!(stopped, Err(Error::Stopped)));
    assert_eq!(digest(map), before);
    assert_eq!(run(map, &Clean::default()).points_changed, planned.points_changed);
    // The same marks again change nothing, also in a dry run.
    let marked = digest(map);
    for how in [&dry, &Clean::default()] {
        let again = run(map, how);
        assert_eq!((again.points_changed, again.replayed.scans_changed), (planned.points_changed, 0));
        assert_eq!(digest(map), marked);
    }
    let after: SnapshotName = "after".parse().unwrap();
    snapshot(map, &after).unwrap();

    // What a replay would refuse is refused before the search.
    undo(map, &Replay::default(), |_, _, _| ()).unwrap();
    let small = Replay::default().with_memory(MemoryLimit::Bytes(1 << 20));
    for how in [Replay::default().with_keep_as(after), small] {
        clean(map, &Clean::new(how), |phase, _, _| panic!("{phase:?}")).unwrap_err();
    }
    let _writer = OutOfCoreTileMapper::open(map, Corridor::config()).unwrap();
    let locked = clean(map, &dry, |phase, _, _| panic!("{phase:?}")).unwrap_err();
    assert!(matches!(locked, Error::Locked { .. }), "{locked}");
}

#[test]
fn maps_without_kept_scans_and_scans_of_invalid_points_are_no_panic() {
    let folder = TempDir::new().unwrap();
    let map = &folder.path().join("map");
    let config = MapConfig::new(0.2, 3.2).unwrap();
    let odd = [[f64::NAN; 3], [1e300, 0.0, 0.0], [0.0; 3], [f64::INFINITY, 1.0, 2.0], [1.0, 1.0, 1.0]];
    let insert = |config: &MapConfig, map: &Path| {
        let mut mapper = OutOfCoreTileMapper::create(map, config.clone()).unwrap();
        let pose = Pose::from_quaternion([0.5; 3], [0.0, 0.0, 0.0, 1.0]).unwrap();
        mapper.insert_points(&ScanRef::in_sensor(pose, &odd)).unwrap();
        mapper.insert_points(&ScanRef::in_sensor(pose, &[[0.0_f64; 3]; 0])).unwrap();
        mapper.flush().unwrap();
    };
    insert(&config, map);
    let refused = clean(map, &Clean::default(), |_, _, _| ()).unwrap_err();
    assert!(refused.to_string().contains("keeps no scans"), "{refused}");
    let kept = &folder.path().join("kept");
    insert(&config.with_kept_scans(true), kept);
    assert_eq!(run(kept, &Clean::default()).points_changed, 0);
    assert!(matches!(
        clean(folder.path().join("none"), &Clean::default(), |_, _, _| ()),
        Err(Error::NoMap { .. })
    ));
}

/// Cleans a map as several processes do.
fn run_in_parts(map: &Path, how: &Clean, tiles: u32) -> Cleaned {
    let work = map.with_added_extension("work");
    std::fs::create_dir(&work).unwrap();
    let columns = search_columns(map, tiles).unwrap();
    let joined = |name: &str, make: &dyn Fn(TileBox, &Path)| {
        let shards: Vec<_> =
            columns.iter().enumerate().map(|(number, _)| work.join(format!("{name}-{number}"))).collect();
        columns
            .iter()
            .zip(&shards)
            .for_each(|(&column, shard)| make(TileBox::of_column(column, tiles), shard));
        let shards: Vec<MapPath> = shards.into_iter().map(MapPath::from).collect();
        join(&shards, work.join(name), |_, _| ()).unwrap();
        MapPath::from(work.join(name))
    };
    let mapped = |name, order| {
        joined(name, &|region, shard| map_column(map, order, region, shard, [7; 16], &how.replay).unwrap())
    };
    let scans = KeptSummary::read(map).unwrap();
    let has_marks = scans.scans().iter().any(|scan| scan.moving_points > 0);
    let mut maps = SearchMaps {
        reversed: mapped("reversed", Order::Reverse),
        unmarked: has_marks.then(|| mapped("unmarked", Order::Forward)),
        counts: None,
    };
    if how.parked_scans.is_some() {
        let count = |region, shard: &Path| {
            count_column(map, &maps, region, shard, [8; 16], &how.replay).unwrap();
        };
        let counts = joined("counts", &count);
        maps.counts = Some(counts);
    }
    let search = |numbers: std::ops::RangeInclusive<u64>| {
        let file = work.join(format!("{}.marks", numbers.start()));
        let found = FoundMarks::search(map, &maps, how, numbers, &file).unwrap();
        (file, found)
    };
    let found = vec![search(1..=3), search(4..=4), search(5..=90)];
    let refused = AllMarks::of(&scans, map, &found[1..]).unwrap_err();
    assert!(refused.to_string().contains("scan 1 was not searched"), "{refused}");
    let all = AllMarks::of(&scans, map, &found).unwrap();
    let change = ScanChange::Mark(all.new_marks());
    let columns = replay_columns(&scans, &change, &how.replay, tiles).unwrap();
    let parts = columns.into_iter().enumerate().map(|(number, column)| {
        let shard = work.join(format!("part-{number}"));
        let region = TileBox::of_column(column, tiles);
        let part = replay_part(&scans, &change, &how.replay, region, &shard, |_, _| ()).unwrap();
        (shard.exists().then(|| MapPath::from(shard)), part)
    });
    let parts: Vec<_> = parts.collect();
    let cleaned = clean_found(&scans, &all, &how.replay.clone().with_parts(parts)).unwrap();
    std::fs::remove_dir_all(work).unwrap();
    cleaned
}

#[test]
fn parts_of_several_processes_make_the_map_of_one() {
    let (folder, corridor) = (TempDir::new().unwrap(), Corridor { scans: 12 });
    let [one, other] = ["one", "other"].map(|name| folder.path().join(name));
    corridor.build(&one);
    corridor.build(&other);
    let east = Aabb { min: [4.0, -9.0, -9.0], max: [9.0; 3] };
    let options = [
        (Clean::default(), 2),
        (Clean::default().with_parked_scans(4), 3),
        (Clean::default().with_region(east), 1),
        (Clean::default().with_parked_scans(1), 64),
    ];
    let least = MemoryLimit::min_bytes(&Corridor::config().grid);
    for (number, (how, tiles)) in options.into_iter().enumerate() {
        let wanted = run(&one, &how);
        let replay = Replay::default().with_memory(MemoryLimit::Bytes([least, 64 << 20][number % 2]));
        let found = run_in_parts(
            &other,
            &Clean::new(replay).with_region(how.region).with_parked_scans(how.parked_scans),
            tiles,
        );
        assert_eq!((found.points, found.points_changed), (wanted.points, wanted.points_changed), "{number}");
        assert!(marks(&one) == marks(&other), "{number}");
        assert_eq!(digest(&one), digest(&other), "{number}");
    }
}
