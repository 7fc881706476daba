use super::random_maps::{open, path};
use crate::harness::{Content, Taken, all_layers, keeping_scans, new_poses, replay};
use std::collections::BTreeSet;
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::random_scans::Random;
use testkit::support::message_of;
use voxtile::integrity::verify;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{
    CopyScans, Merged, NewPoses, Part, Prefer, Remap, crop, join, make_shard, merge, move_shard, remap,
};
use voxtile::store::{KeptRecord, SegmentPlace};
use voxtile::{
    Aabb, Layers, MapConfig, MapPath, MapReader, MapView, Mapper, OutOfCoreTileMapper, Result, Storage,
    TileBox, TileIndex,
};

const ID: [u8; 16] = [7; 16];
const SCANS: u64 = 12;

fn at(disk: &FaultyDisk, name: &str) -> MapPath {
    MapPath::on(disk.shared(), path(name))
}

/// Writes a map of these scans; it numbers the others, but does not have them.
fn build(disk: &FaultyDisk, name: &str, config: &MapConfig, scans: &[Taken], keeps: impl Fn(usize) -> bool) {
    let mut mapper = OutOfCoreTileMapper::create_as(at(disk, name), config.clone(), ID).unwrap();
    let mut skipped = 0;
    for (number, scan) in scans.iter().enumerate() {
        if !keeps(number) {
            skipped += 1;
            continue;
        }
        mapper.skip_scans(std::mem::take(&mut skipped));
        scan.insert_into(&mut mapper).unwrap();
        if number % 5 == 4 {
            mapper.flush().unwrap();
        }
    }
    mapper.flush().unwrap();
}

fn records(disk: &FaultyDisk, name: &str) -> Vec<KeptRecord> {
    let mut kept = open(disk, &path(name)).unwrap().kept_scans().unwrap();
    let mut records = Vec::new();
    while let Some(record) = kept.next_record().unwrap() {
        // Segments are divided differently.
        records.push(KeptRecord { place: SegmentPlace::default(), ..record });
    }
    records
}

fn content(config: &MapConfig, scans: &[Taken]) -> Content {
    use crate::harness::{Act, State};
    // The seeds of the acts are those of the scans.
    assert_eq!(scans.len() as u64, SCANS);
    State::default().after(&Act::Scans(0..SCANS), config).now
}

/// Columns of tiles that partition space.
fn columns() -> [TileBox; 3] {
    let (low, high) = (i32::MIN, i32::MAX - 1);
    [[low, 0], [1, 1], [2, high]]
        .map(|[first, last]| TileBox::new(TileIndex::new(first, low, low), TileIndex::new(last, high, high)))
}

fn move_all(disk: &FaultyDisk, name: &str, content: &Content, seed: u64) -> Result<()> {
    let scans = KeptSummary::read(at(disk, name))?;
    let poses = NewPoses::Moving(new_poses(&content.scans, seed, None));
    remap(&scans, &poses, &Remap::new(replay()), |_, _| ()).map(drop)
}

fn is_whole(disk: &FaultyDisk, name: &str) -> bool {
    verify(at(disk, name), |_| (), |_, _| ()).unwrap().is_whole()
}

#[test]
fn shards_that_keep_their_scans_join_to_the_map_of_one_build() {
    for (seed, storage, layers) in [
        (1, Storage::OctoMap, Layers::NONE),
        (2, Storage::Compact, all_layers()),
        (3, Storage::Compact, Layers::NONE),
    ] {
        let mut random = Random(seed);
        let disk = FaultyDisk::new(Fault::None);
        let config = keeping_scans().with_storage(storage).with_layers(layers);
        let scans: Vec<_> = (0..SCANS).map(Taken::new).collect();
        build(&disk, "whole", &config, &scans, |_| true);
        let whole = records(&disk, "whole");
        let mut shards = Vec::new();
        for (k, column) in columns().into_iter().enumerate() {
            let (name, place) = (format!("local_{k}"), format!("shard_{k}"));
            // Scans that do not reach a column may be in its shard, like those between two visits.
            let others: BTreeSet<usize> = (0..scans.len()).filter(|_| random.below(4) == 0).collect();
            let reaches = |number: usize| whole[number].tiles.iter().any(|tile| column.contains(*tile));
            let is_alone = |number: usize| whole[number].tiles.is_empty() && k == 0;
            build(&disk, &name, &config.clone().with_region(column), &scans, |number| {
                reaches(number) || is_alone(number) || others.contains(&number)
            });
            match k {
                1 => make_shard(&open(&disk, &path(&name)).unwrap(), path(&place), ID, |_, _| {}).unwrap(),
                _ => move_shard(at(&disk, &name), path(&place), ID, |_, _| {}).unwrap(),
            };
            assert!(is_whole(&disk, &place), "{place}");
            shards.push(at(&disk, &place));
        }
        join(&shards, path("joined"), |_, _| {}).unwrap();
        assert!(is_whole(&disk, "joined"));
        assert_eq!(records(&disk, "joined"), whole);
        let mut expected = content(&config, &scans);
        assert!(expected.is_of(&open(&disk, &path("joined")).unwrap()), "{storage:?}");
        for name in ["joined", "whole"] {
            move_all(&disk, name, &expected, 9).unwrap();
        }
        for (number, pose) in new_poses(&expected.scans, 9, None) {
            expected.scans.get_mut(&number).unwrap().move_to(pose);
        }
        assert_eq!(records(&disk, "joined"), records(&disk, "whole"));
        let [joined, whole] = ["joined", "whole"].map(|name| open(&disk, &path(name)).unwrap());
        assert!(testkit::reference_map::voxels_of(&joined) == testkit::reference_map::voxels_of(&whole));
    }
}

#[test]
fn shards_with_other_scans_or_without_some_are_an_error_without_output() {
    let disk = FaultyDisk::new(Fault::None);
    let config = keeping_scans();
    let mut scans: Vec<_> = (0..SCANS).map(Taken::new).collect();
    let [west, middle, _] = columns();
    build(&disk, "west", &config.clone().with_region(west), &scans, |number| number != 7);
    build(&disk, "middle", &config.clone().with_region(middle), &scans, |number| number > 3 && number != 7);
    build(&disk, "none", &config.clone().with_region(middle).with_kept_scans(false), &scans, |_| true);
    scans[5].intensities[0] += 1.0;
    build(&disk, "other", &config.with_region(middle), &scans, |number| number > 3);
    for (other, words) in [("middle", "scan 8"), ("other", "other: its entry 6"), ("none", "the scans")] {
        let shards = ["west", other].map(|name| at(&disk, name));
        let error = message_of(join(&shards, path("joined"), |_, _| {}));
        assert!(error.contains(words), "{error}");
        assert!(disk.files().into_keys().all(|file| !file.starts_with(path("joined"))));
    }
}

/// Only numbers far apart close a shard between two visits.
#[test]
fn shards_that_are_visited_twice_are_opened_again() {
    let disk = FaultyDisk::new(Fault::None);
    let config = keeping_scans();
    let scans: Vec<_> = (0..700).map(|number| Taken::new(if number % 350 == 0 { 3 } else { 0 })).collect();
    let [west, middle, east] = columns();
    build(&disk, "west", &config.clone().with_region(west), &scans, |_| true);
    for (name, column) in [("middle", middle), ("east", east)] {
        build(&disk, name, &config.clone().with_region(column), &scans, |number| number % 350 == 0);
    }
    build(&disk, "whole", &config, &scans, |_| true);
    let shards = ["west", "middle", "east"].map(|name| at(&disk, name));
    join(&shards, path("joined"), |_, _| {}).unwrap();
    assert_eq!(records(&disk, "joined"), records(&disk, "whole"));
}

fn merged(disk: &FaultyDisk, output: &str, names: &[&str], prefer: Option<Prefer>) -> Merged {
    let maps: Vec<MapReader> = names.iter().map(|name| open(disk, &path(name)).unwrap()).collect();
    merge(&maps, path(output), prefer, |_, _| {}).unwrap()
}

#[test]
fn merged_maps_keep_the_scans_of_both_if_their_evidence_is_added() {
    let disk = FaultyDisk::new(Fault::None);
    let config = keeping_scans();
    let scans: Vec<_> = (0..SCANS).map(Taken::new).collect();
    let half = scans.len() / 2;
    for (name, scans) in [("a", &scans[..half]), ("b", &scans[half..]), ("whole", &scans[..])] {
        let mut mapper = OutOfCoreTileMapper::create(at(&disk, name), config.clone()).unwrap();
        scans.iter().for_each(|scan| scan.insert_into(&mut mapper).unwrap());
        mapper.flush().unwrap();
    }
    assert!(merged(&disk, "merged", &["a", "b"], None).keeps_scans);
    assert!(is_whole(&disk, "merged"));
    assert_eq!(records(&disk, "merged"), records(&disk, "whole"));
    let content = content(&config, &scans);
    for name in ["merged", "whole"] {
        move_all(&disk, name, &content, 5).unwrap();
    }
    let [of_merged, of_whole] = ["merged", "whole"].map(|name| open(&disk, &path(name)).unwrap());
    assert!(testkit::reference_map::voxels_of(&of_merged) == testkit::reference_map::voxels_of(&of_whole));
    // With a preference, a part of the evidence of the scans is not in the map.
    assert!(!merged(&disk, "first", &["a", "b"], Some(Prefer::First)).keeps_scans);
    // Both have the scans of `a`.
    assert!(!merged(&disk, "twice", &["a", "a"], None).keeps_scans);
}

#[test]
fn a_cropped_map_keeps_the_scans_that_reach_it() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let disk = FaultyDisk::new(Fault::None);
        let config = keeping_scans().with_storage(storage);
        let scans: Vec<_> = (0..SCANS).map(Taken::new).collect();
        build(&disk, "whole", &config, &scans, |_| true);
        let whole = records(&disk, "whole");
        // Tiles 2 and 3 along x.
        let part = Aabb { min: [6.4, -99.0, -99.0], max: [12.8, 99.0, 99.0] };
        crop(
            &open(&disk, &path("whole")).unwrap(),
            &Part::Inside(part),
            CopyScans::Yes,
            path("part"),
            |_, _| {},
        )
        .unwrap();
        assert!(is_whole(&disk, "part"));
        let kept = records(&disk, "part");
        let reaches = |scan: &&KeptRecord| scan.tiles.iter().any(|tile| (2..4).contains(&tile.x));
        let expected: Vec<_> = whole.iter().filter(reaches).cloned().collect();
        let numbers = |scans: &[KeptRecord]| scans.iter().map(|scan| scan.number).collect::<Vec<_>>();
        assert_eq!(numbers(&kept), numbers(&expected));
        assert!(kept.len() > 2 && kept.len() < scans.len(), "{}", kept.len());
        assert!(kept.iter().flat_map(|scan| &scan.tiles).all(|tile| (2..4).contains(&tile.x)));

        // Scans moved within the part change it as they change the whole.
        let all = content(&config, &scans);
        let mut moved = all.clone();
        moved.scans.retain(|number, _| numbers(&kept).contains(number));
        for name in ["whole", "part"] {
            move_all(&disk, name, &moved, 4).unwrap();
        }
        let remapped = open(&disk, &path("whole")).unwrap();
        crop(&remapped, &Part::Inside(part), CopyScans::No, path("expected"), |_, _| {}).unwrap();
        let [part, expected] = ["part", "expected"].map(|name| open(&disk, &path(name)).unwrap());
        assert_eq!(part.tile_indices(), expected.tile_indices());
        assert!(testkit::reference_map::voxels_of(&part) == testkit::reference_map::voxels_of(&expected));
        let outside = Part::Outside(Aabb { min: [0.0; 3], max: [1.0; 3] });
        let refused =
            crop(&open(&disk, &path("whole")).unwrap(), &outside, CopyScans::Yes, path("none"), |_, _| {});
        assert!(message_of(refused).starts_with("scans"));
    }
}
