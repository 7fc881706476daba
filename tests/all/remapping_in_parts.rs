use crate::harness::{
    Act, EVERY_CRASH, Job, Left, State, all_layers, at, config, digest_of, faults, is_whole, keeping_scans,
    map, name, new_marks, new_poses, perform, replay, scans, sweep,
};
use std::path::PathBuf;
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::support::message_of;
use voxtile::operations::{
    NewMarks, NewPoses, PointsInBox, Remap, Replay, ReplayPart, ScanChange, ScanSelection, mark_moving,
    move_shard, remap, remove_found_points, remove_scans, replay_columns, replay_part,
};
use voxtile::scan::{MovingMarks, ScanPoints, Stop};
use voxtile::store::{SegmentPlace, TileStore};
use voxtile::{Aabb, Clearing, Error, MapPath, MapReader, Result, Storage, TileBox};

type Parts = Vec<(Option<PathBuf>, String)>;

/// Replays all columns, each on another disk path as other processes would, and returns them in text form.
fn parts(disk: &FaultyDisk, change: &ScanChange, tiles: u32) -> Result<Parts> {
    let columns = replay_columns(&scans(disk)?, change, &replay(), tiles)?;
    let mut parts = Vec::new();
    for (number, index) in columns.into_iter().enumerate() {
        let (local, place) =
            (PathBuf::from(format!("/local/{number}")), PathBuf::from(format!("/parts/{number}")));
        let local = MapPath::on(disk.shared(), local);
        let region = TileBox::of_column(index, tiles);
        let part = replay_part(&scans(disk)?, change, &replay(), region, local.clone(), |_, _| ())?;
        let is_there = MapReader::open(local.clone(), 0).is_ok();
        if is_there {
            let id = TileStore::open_read_only(disk.shared(), map())?.map_id().unwrap();
            move_shard(local, &place, id, |_, _| ())?;
        }
        parts.push((is_there.then_some(place), serde_json::to_string(&part).unwrap()));
    }
    Ok(parts)
}

fn with_parts(disk: &FaultyDisk, parts: &Parts) -> Replay {
    let open = |(shard, part): &(Option<PathBuf>, String)| {
        let part: ReplayPart = serde_json::from_str(part).unwrap();
        (shard.as_ref().map(|shard| MapPath::on(disk.shared(), shard)), part)
    };
    replay().with_parts(parts.iter().map(open).collect::<Vec<_>>())
}

/// Changes the map in one process, or with finished parts.
fn apply(disk: &FaultyDisk, change: &ScanChange, how: Replay) -> Result<()> {
    match change {
        ScanChange::Move(poses, tolerance) => {
            let how = Remap::new(how).with_tolerance(*tolerance);
            remap(&scans(disk)?, poses, &how, |_, _| ()).map(drop)
        }
        ScanChange::Remove(selection) => remove_scans(at(disk), selection, false, &how, |_, _| ()).map(drop),
        ScanChange::RemovePoints(found) => {
            remove_found_points(&scans(disk)?, found, &how, |_, _| ()).map(drop)
        }
        ScanChange::Mark(marks) => {
            let (marks, of_scan) = (marks.clone(), marks.clone());
            let of_scan = move |number| of_scan.of_scan(number);
            mark_moving(&scans(disk)?, marks.numbers().to_vec(), of_scan, &how, |_, _| ()).map(drop)
        }
        other => panic!("{other:?}"),
    }
}

/// Records without the places of points and marks, and digest.
fn seen(disk: &FaultyDisk) -> (String, String) {
    let mut kept = MapReader::open(at(disk), 0).unwrap().kept_scans().unwrap();
    let mut records = String::new();
    while let Some(mut record) = kept.next_record().unwrap() {
        let scan = kept.open(record.clone()).unwrap();
        (record.place, record.moving) = (SegmentPlace::default(), None);
        let mut points = Vec::new();
        scan.for_each_own_chunk(0..scan.len(), &mut |some, _| {
            points.extend_from_slice(some);
            true
        })
        .unwrap();
        records += &format!("{record:?} {points:?} {:?}\n", scan.moving());
    }
    (records, digest_of(disk, None).unwrap().to_string())
}

/// A map of twelve scans, some of which have marks, and its state.
fn map_of_twelve(seed: u64) -> (FaultyDisk, State) {
    let storage = [Storage::OctoMap, Storage::Compact][seed as usize % 2];
    let clearing = [Clearing::default(), Clearing::guarded()][seed as usize / 2 % 2];
    let config = keeping_scans().with_storage(storage).with_clearing(clearing);
    let config = if seed.is_multiple_of(3) { config.with_layers(all_layers()) } else { config };
    let disk = FaultyDisk::new(Fault::None);
    let disk = if seed.is_multiple_of(4) { disk.without_links() } else { disk };
    let mut state = State::default();
    for act in [Act::Scans(0..12), Act::Mark { seed, rest: Some(2) }] {
        perform(&disk, &config, &state, &act).unwrap();
        state = state.after(&act, &config);
    }
    (disk, state)
}

fn move_scans(state: &State, seed: u64) -> ScanChange {
    // One scan of twelve moves, or three, or all.
    let rest = [None, Some(1), Some(seed % 4)][seed as usize % 3];
    let mut poses = new_poses(&state.now.scans, seed, rest);
    if seed % 3 == 1 {
        poses.truncate(1);
    }
    ScanChange::Move(NewPoses::Moving(poses), None)
}

fn mark(state: &State, seed: u64) -> ScanChange {
    let marks = new_marks(&state.now.scans, seed, [None, Some(2), Some(seed % 4)][seed as usize % 3]);
    let numbers: Vec<_> = marks.keys().copied().collect();
    let of_scan = move |number: u64| Ok(MovingMarks::new(marks[&number].iter().copied()));
    ScanChange::Mark(NewMarks::new(numbers, of_scan))
}

fn remove(_: &State, seed: u64) -> ScanChange {
    let (first, last) = [(4, 4), (1, 8), (10, 40)][seed as usize % 3];
    ScanChange::Remove(ScanSelection::Numbers(first, last))
}

/// Two searches, as by two processes.
fn remove_points(disk: &FaultyDisk, seed: u64) -> ScanChange {
    let low = [-9.0, -0.4 * (seed % 5) as f64, f64::NEG_INFINITY];
    let region = Aabb { min: low, max: [0.3 + 0.7 * (seed % 3) as f64, f64::INFINITY, 0.1] };
    let search =
        |numbers| PointsInBox::search(&scans(disk).unwrap(), &region, numbers, &Stop::default()).unwrap();
    let text = serde_json::to_string(&[search(6..=40), search(1..=5)]).unwrap();
    let searches: Vec<PointsInBox> = serde_json::from_str(&text).unwrap();
    ScanChange::RemovePoints(PointsInBox::joined(searches).unwrap())
}

#[test]
fn changes_in_parts_equal_those_in_a_process() {
    for kind in 0..4 {
        let mut shards = [0; 2];
        for seed in 0..12 {
            let (disk, state) = map_of_twelve(seed);
            let change = match kind {
                0 => move_scans(&state, seed),
                1 => mark(&state, seed),
                2 => remove(&state, seed),
                _ => remove_points(&disk, seed),
            };
            let other = disk.copy();
            let digest_before = digest_of(&disk, None).unwrap();
            apply(&other, &change, replay()).unwrap();
            let parts = parts(&disk, &change, 1 + seed as u32 % 3).unwrap();
            apply(&disk, &change, with_parts(&disk, &parts).with_keep_as(name("before"))).unwrap();
            assert!(seen(&disk) == seen(&other), "{kind} {seed}");
            assert!(is_whole(&disk), "{kind} {seed}");
            assert_eq!(digest_of(&disk, Some("before")).unwrap(), digest_before, "{kind} {seed}");
            shards[0] += parts.iter().filter(|(shard, _)| shard.is_some()).count();
            shards[1] += parts.len();
            if kind == 0 || kind == 2 {
                // The change is done now.
                apply(&disk, &change, with_parts(&disk, &parts)).unwrap();
                assert_eq!(seen(&disk), seen(&other), "{kind} {seed}");
            }
        }
        assert!(shards[0] > 30 && shards[1] >= shards[0], "{kind}: {shards:?}");
    }
}

#[test]
fn parts_of_another_map_or_state_are_refused() {
    let (disk, state) = map_of_twelve(1);
    let changes = [move_scans(&state, 4), mark(&state, 2), remove(&state, 0), remove_points(&disk, 0)];
    for (kind, change) in changes.into_iter().enumerate() {
        let disk = disk.copy();
        let parts = parts(&disk, &change, 2).unwrap();
        let whole = seen(&disk);
        let refused = |given: &Parts| {
            let message = message_of(apply(&disk, &change, with_parts(&disk, given)));
            assert_eq!(seen(&disk), whole, "{kind}");
            message
        };
        // A part of another map.
        let foreign = MapPath::on(disk.shared(), "/parts/foreign");
        voxtile::OutOfCoreTileMapper::create(foreign, config()).unwrap();
        let mut with_foreign = parts.clone();
        let far_away = r#"{"flush_number":NUMBER,"replaced":[],"changed":[],
            "region":[[90,90,0],[90,90,0]],"scans_mapped":0,"updates_mapped":0}"#;
        let far_away = far_away.replace("NUMBER", &scans(&disk).unwrap().flush_number().to_string());
        with_foreign.push((Some("/parts/foreign".into()), far_away.clone()));
        let message = refused(&with_foreign);
        assert!(message.contains("no part of a replay"), "{message}");
        // A part twice.
        let message = refused(&[&parts[..], &parts[..1]].concat());
        assert!(message.contains("overlap"), "{message}");
        // A part is missing, or its text.
        let at_first = parts.iter().position(|(shard, _)| shard.is_some()).unwrap();
        let (mut fewer, mut textless) = (parts.clone(), parts.clone());
        fewer.remove(at_first);
        textless[at_first].1 = far_away.clone();
        for given in [fewer, textless] {
            let message = refused(&given);
            assert!(message.contains("pass all parts") || message.contains("no part replaces"), "{message}");
        }
        // A shard is lost: its tiles must not become empty.
        let mut without_shard = parts.clone();
        without_shard[at_first].0 = None;
        let message = refused(&without_shard);
        assert!(message.contains("is missing"), "{message}");
        // There are no parts of an estimate.
        let message = message_of(apply(&disk, &change, with_parts(&disk, &parts).with_dry_run(true)));
        assert!(message.contains("parts"), "{message}");
        // A flush since the scans were read.
        let summary = scans(&disk).unwrap();
        perform(&disk, &keeping_scans(), &state, &Act::Scans(12..13)).unwrap();
        let late = MapPath::on(disk.shared(), "/late");
        let found = replay_part(&summary, &change, &replay(), TileBox::of_column([0, 0], 2), late, |_, _| ());
        assert!(matches!(found, Err(Error::Changed { .. })), "{kind}: {found:?}");
        let found = match &change {
            // Points that were found since are not searched.
            ScanChange::RemovePoints(found) => {
                let rest =
                    PointsInBox::search(&scans(&disk).unwrap(), &found.region(), 13..=13, &Stop::default());
                let message = message_of(PointsInBox::joined([found.clone(), rest.unwrap()]));
                assert!(message.contains("different flushes"), "{message}");
                apply(&disk, &change, with_parts(&disk, &parts))
            }
            change => apply(&disk, change, with_parts(&disk, &parts)),
        };
        assert!(matches!(found, Err(Error::Changed { .. })), "{kind}: {found:?}");
    }
}

#[test]
fn searches_of_points_must_be_of_all_scans_and_one_box() {
    let (disk, _) = map_of_twelve(1);
    let summary = scans(&disk).unwrap();
    let region = Aabb { min: [-9.0; 3], max: [9.0; 3] };
    let search =
        |region: &Aabb, numbers| PointsInBox::search(&summary, region, numbers, &Stop::default()).unwrap();
    let remove = |searches: Vec<PointsInBox>| {
        let found = PointsInBox::joined(searches)?;
        remove_found_points(&summary, &found, &replay(), |_, _| ())
    };
    let before = seen(&disk);
    let message = message_of(remove(vec![search(&region, 1..=5), search(&region, 7..=12)]));
    assert!(message.contains("scan 6 was not searched"), "{message}");
    let other = Aabb { min: [-8.0; 3], ..region };
    let message = message_of(remove(vec![search(&region, 1..=5), search(&other, 6..=12)]));
    assert!(message.contains("different boxes"), "{message}");
    let text = serde_json::to_string(&search(&region, 1..=12)).unwrap().replace("[12,", "[55,");
    let message = message_of(remove(vec![serde_json::from_str(&text).unwrap()]));
    assert!(message.contains("no scan 55"), "{message}");
    assert!(PointsInBox::joined([]).is_err());
    assert_eq!(seen(&disk), before);
    remove(vec![search(&region, 1..=12)]).unwrap();
}

#[test]
fn joining_parts_is_atomic() {
    for (seed, kind) in [(8, 0), (7, 2), (5, 3)] {
        let (start, state) = map_of_twelve(seed);
        let change = match kind {
            0 => move_scans(&state, seed),
            2 => remove(&state, seed),
            _ => remove_points(&start, seed),
        };
        let made = parts(&start, &change, 2).unwrap();
        let work = move |disk: &FaultyDisk| match &change {
            // A repeated call searches again, and finds no points.
            ScanChange::RemovePoints(found) => {
                let again = PointsInBox::search(&scans(disk)?, &found.region(), 1..=40, &Stop::default())?;
                apply(disk, &ScanChange::RemovePoints(again), with_parts(disk, &made))
            }
            change => apply(disk, change, with_parts(disk, &made)),
        };
        let job = Job::new(start, map(), work, |disk| digest_of(disk, None).unwrap().to_string());
        let kinds: [fn(u64) -> Fault; 3] = [Fault::Fails, Fault::LosesSync, Fault::IsFull];
        sweep(&job, faults(&job, &kinds, 6), &[Left::Dropped, Left::Shuffled(7), Left::Mended]);
        let crashes = faults(&job, &[Fault::Crashes], 5);
        sweep(&job, crashes, &[&EVERY_CRASH[..], &[Left::Killed]].concat());
    }
}
