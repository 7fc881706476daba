use crate::harness::{
    Act, EVERY_CRASH, Job, Left, State, all_layers, at, config, digest_of, faults, is_whole, keeping_scans,
    map, name, new_poses, perform, replay, scans, sweep,
};
use std::path::PathBuf;
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::support::message_of;
use voxtile::operations::{
    NewPoses, Remap, RemapPart, join_remap, move_shard, remap, remap_columns, remap_part,
};
use voxtile::store::{SegmentPlace, TileStore};
use voxtile::{Error, MapPath, MapReader, Result, Storage, TileBox};

/// Replays all columns, each on another disk path as other processes would, and returns them in text form.
fn parts(disk: &FaultyDisk, poses: &NewPoses, tiles: u32) -> Result<Vec<(Option<PathBuf>, String)>> {
    let how = Remap::new(replay());
    let columns = remap_columns(&scans(disk)?, poses, &how, tiles)?;
    let mut parts = Vec::new();
    for (number, index) in columns.into_iter().enumerate() {
        let (local, place) =
            (PathBuf::from(format!("/local/{number}")), PathBuf::from(format!("/parts/{number}")));
        let local = MapPath::on(disk.shared(), local);
        let part = remap_part(
            &scans(disk)?,
            poses,
            &how,
            TileBox::of_column(index, tiles),
            local.clone(),
            |_, _| (),
        )?;
        let is_there = MapReader::open(local.clone(), 0).is_ok();
        if is_there {
            let id = TileStore::open_read_only(disk.shared(), map())?.map_id().unwrap();
            move_shard(local, &place, id, |_, _| ())?;
        }
        parts.push((is_there.then_some(place), serde_json::to_string(&part).unwrap()));
    }
    Ok(parts)
}

fn join(disk: &FaultyDisk, poses: &NewPoses, parts: &[(Option<PathBuf>, String)], how: &Remap) -> Result<()> {
    let open = |(shard, part): &(Option<PathBuf>, String)| {
        let part: RemapPart = serde_json::from_str(part).unwrap();
        (shard.as_ref().map(|shard| MapPath::on(disk.shared(), shard)), part)
    };
    let parts: Vec<_> = parts.iter().map(open).collect();
    join_remap(&scans(disk)?, poses, how, &parts).map(drop)
}

/// Records without the places of points, and digest.
fn seen(disk: &FaultyDisk) -> (String, String) {
    let mut kept = MapReader::open(at(disk), 0).unwrap().kept_scans().unwrap();
    let mut records = String::new();
    while let Some(mut record) = kept.next_record().unwrap() {
        record.place = SegmentPlace::default();
        records += &format!("{record:?}\n");
    }
    (records, digest_of(disk, None).unwrap().to_string())
}

#[test]
fn a_remap_in_parts_equals_one_in_a_process() {
    let mut shards = [0; 2];
    for seed in 0..12 {
        let storage = [Storage::OctoMap, Storage::Compact][seed as usize % 2];
        let config = keeping_scans().with_storage(storage);
        let config = if seed % 3 == 0 { config.with_layers(all_layers()) } else { config };
        let disk = if seed % 4 == 0 {
            FaultyDisk::new(Fault::None).without_links()
        } else {
            FaultyDisk::new(Fault::None)
        };
        let (before, act) = (State::default(), Act::Scans(0..12));
        perform(&disk, &config, &before, &act).unwrap();
        let state = before.after(&act, &config);
        // One scan of twelve moves, or three, or all.
        let rest = [None, Some(1), Some(seed % 4)][seed as usize % 3];
        let mut poses = new_poses(&state.now.scans, seed, rest);
        if seed % 3 == 1 {
            poses.truncate(1);
        }
        let poses = NewPoses::Moving(poses);
        let other = disk.copy();
        remap(&scans(&other).unwrap(), &poses, &Remap::new(replay()), |_, _| ()).unwrap();
        let tiles = 1 + seed as u32 % 3;
        let parts = parts(&disk, &poses, tiles).unwrap();
        let how = Remap::new(replay().with_keep_as(name("before")));
        let digest_before = digest_of(&disk, None).unwrap();
        join(&disk, &poses, &parts, &how).unwrap();
        assert_eq!(seen(&disk), seen(&other), "{seed}");
        assert!(is_whole(&disk), "{seed}");
        assert_eq!(digest_of(&disk, Some("before")).unwrap(), digest_before, "{seed}");
        shards[0] += parts.iter().filter(|(shard, _)| shard.is_some()).count();
        shards[1] += parts.len();
        // The scans have these poses now.
        join(&disk, &poses, &parts, &Remap::new(replay())).unwrap();
        assert_eq!(seen(&disk), seen(&other), "{seed}");
    }
    assert!(shards[0] > 30 && shards[1] > shards[0], "{shards:?}");
}

#[test]
fn parts_of_another_map_or_state_are_refused() {
    let disk = FaultyDisk::new(Fault::None);
    let (before, act) = (State::default(), Act::Scans(0..6));
    perform(&disk, &keeping_scans(), &before, &act).unwrap();
    let state = before.after(&act, &keeping_scans());
    let poses = NewPoses::Moving(new_poses(&state.now.scans, 4, None));
    let parts = parts(&disk, &poses, 2).unwrap();
    let how = Remap::new(replay());
    let summary = scans(&disk).unwrap();
    let whole = seen(&disk);
    // A part of another map.
    let foreign = MapPath::on(disk.shared(), "/parts/foreign");
    voxtile::OutOfCoreTileMapper::create(foreign, config()).unwrap();
    let mut with_foreign = parts.clone();
    let far_away =
        r#"{"replaced":[],"moved":[],"region":[[90,90,0],[90,90,0]],"scans_mapped":0,"updates_mapped":0}"#;
    with_foreign.push((Some("/parts/foreign".into()), far_away.to_owned()));
    let message = message_of(join(&disk, &poses, &with_foreign, &how));
    assert!(message.contains("no part of a remap"), "{message}");
    assert_eq!(seen(&disk), whole);
    // A part twice.
    let twice = [&parts[..], &parts[..1]].concat();
    let message = message_of(join(&disk, &poses, &twice, &how));
    assert!(message.contains("overlap"), "{message}");
    // A part is missing, or its text.
    let at_first = parts.iter().position(|(shard, _)| shard.is_some()).unwrap();
    let (mut fewer, mut textless) = (parts.clone(), parts.clone());
    fewer.remove(at_first);
    textless[at_first].1 = far_away.to_owned();
    for given in [fewer, textless] {
        let message = message_of(join(&disk, &poses, &given, &how));
        assert!(message.contains("pass all parts") || message.contains("no part replaces"), "{message}");
        assert_eq!(seen(&disk), whole);
    }
    // A flush since the scans were read.
    perform(&disk, &keeping_scans(), &state, &Act::Scans(6..7)).unwrap();
    let first: Vec<_> = parts.iter().map(|_| (None, RemapPart::default())).collect();
    assert!(matches!(join_remap(&summary, &poses, &how, &first), Err(Error::Changed { .. })));
    let late = MapPath::on(disk.shared(), "/late");
    let found = remap_part(&summary, &poses, &how, TileBox::of_column([0, 0], 2), late, |_, _| ());
    assert!(matches!(found, Err(Error::Changed { .. })));
}

#[test]
fn joining_a_remap_is_atomic() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let start = FaultyDisk::new(Fault::None);
        let config = keeping_scans().with_storage(storage);
        let (before, act) = (State::default(), Act::Scans(0..5));
        perform(&start, &config, &before, &act).unwrap();
        let state = before.after(&act, &config);
        let poses = NewPoses::Moving(new_poses(&state.now.scans, 8, Some(1)));
        let made = parts(&start, &poses, 2).unwrap();
        let work = move |disk: &FaultyDisk| join(disk, &poses, &made, &Remap::new(replay()));
        let job = Job::new(start, map(), work, |disk| digest_of(disk, None).unwrap().to_string());
        let kinds: [fn(u64) -> Fault; 3] = [Fault::Fails, Fault::LosesSync, Fault::IsFull];
        sweep(&job, faults(&job, &kinds, 6), &[Left::Dropped, Left::Shuffled(7), Left::Mended]);
        let crashes = faults(&job, &[Fault::Crashes], 5);
        sweep(&job, crashes, &[&EVERY_CRASH[..], &[Left::Killed]].concat());
    }
}
