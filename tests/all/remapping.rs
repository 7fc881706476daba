//! Maps that keep their scans: random lives against the naive map of the scans that are left, under the poses as of
//! now; faults and power cuts in the middle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use testkit::support::{message_of, some_of};
use voxtile::integrity::{Finding, Severity, repair, verify};
use voxtile::mapper::KeptSummary;
use voxtile::operations::{
    NewPoses, Part, Remap, RemapBeside, Rework, ScanSelection, clear, delete_snapshot, remap, remove_points,
    remove_scans, revert, snapshot,
};
use voxtile::scan::{PointBatch, ScanPoints, Stop};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::store::{SnapshotName, TileStore};
use voxtile::{
    Aabb, Error, InsertMode, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, MemoryLimit,
    OutOfCoreTileMapper, Pose, Result, Scan, ScanRef,
};

fn map() -> &'static Path {
    Path::new("/city/map")
}

fn at(disk: &FaultyDisk) -> MapPath {
    MapPath::on(disk.shared(), map())
}

fn scans(disk: &FaultyDisk) -> Result<KeptSummary> {
    KeptSummary::read(at(disk))
}

fn config() -> MapConfig {
    let config = MapConfig::new(0.4, 3.2).unwrap().with_range(0.3, 3.0).with_kept_scans(true);
    config.with_cache_tiles(2).with_write_buffer_bytes(600)
}

fn rework() -> Rework {
    Rework::default().with_memory(MemoryLimit::Bytes(MemoryLimit::least_bytes(&config().grid)))
}

/// A scan as it was measured, and where from.
#[derive(Clone, Debug)]
struct Taken {
    points: Vec<[f64; 3]>,
    intensities: Vec<f32>,
    pose: Pose,
}

impl Taken {
    fn new(seed: u64, points: usize) -> Self {
        let mut random = Random(seed);
        let scan = random_scan(&mut random, [0.0; 3], points);
        let mut points = scan.points;
        points.push([0.0; 3]);
        let mut intensities = scan.intensities.unwrap();
        intensities.push(-0.0);
        Self { points, intensities, pose: random_pose(&mut random, seed) }
    }

    fn in_world(&self) -> Scan {
        Scan::from_sensor_frame(&self.points, Some(self.intensities.clone()), self.pose)
    }

    fn bits(&self) -> (Vec<[u64; 3]>, Vec<u32>, [u64; 7]) {
        let points = self.points.iter().map(|point| point.map(f64::to_bits)).collect();
        let intensities = self.intensities.iter().map(|intensity| intensity.to_bits()).collect();
        (points, intensities, bits_of_pose(&self.pose))
    }
}

fn bits_of_pose(pose: &Pose) -> [u64; 7] {
    let ([x, y, z], [a, b, c, d]) = (pose.position_m(), pose.quaternion());
    [x, y, z, a, b, c, d].map(f64::to_bits)
}

/// Somewhere on a short drive; neighbours see the same places.
fn random_pose(random: &mut Random, number: u64) -> Pose {
    let along = [0.0, 3.0, 6.0, 9.0, 6.0, 3.0][number as usize % 6];
    let turn = random.between(-3.0, 3.0);
    let position = random.point([along, 0.0, 0.5], 0.3);
    Pose::from_quaternion(position, [0.1, 0.0, (turn / 2.0_f64).sin(), (turn / 2.0_f64).cos()]).unwrap()
}

/// What people do with a map, each in a process of its own.
#[derive(Clone, Debug)]
enum Act {
    /// Insert scans with these seeds and flush.
    Scans(std::ops::Range<u64>),
    /// Some scans get other poses: those whose number leaves this rest when it is divided by four, or all.
    Move {
        seed: u64,
        rest: Option<u64>,
    },
    /// The same while a mapper inserts scans with these seeds and flushes each.
    MoveBeside {
        seed: u64,
        rest: Option<u64>,
        meanwhile: std::ops::Range<u64>,
    },
    RemoveScans(u64, u64),
    RemovePoints(Aabb),
    Snapshot(&'static str),
    Delete(&'static str),
    Revert(&'static str),
}

/// Scans by their numbers, and the number of the last.
type Scans = (BTreeMap<u64, Taken>, u64);

#[derive(Clone, Debug, Default)]
struct State {
    scans: Scans,
    snapshots: BTreeMap<String, Scans>,
}

fn naive_map(config: &MapConfig, scans: &BTreeMap<u64, Taken>) -> Voxels {
    let mut map = ReferenceMap::new(config);
    scans.values().for_each(|scan| map.insert_scan(&scan.in_world()));
    map.voxels
}

fn new_poses(scans: &BTreeMap<u64, Taken>, seed: u64, rest: Option<u64>) -> Vec<(u64, Pose)> {
    let numbers = scans.keys().copied().filter(|number| rest.is_none_or(|rest| number % 4 == rest));
    numbers.map(|number| (number, random_pose(&mut Random(seed ^ number), number))).collect()
}

fn naive(mut state: State, act: &Act) -> State {
    let (scans, scan_number) = &mut state.scans;
    match act {
        Act::Scans(seeds) => {
            for seed in seeds.clone() {
                *scan_number += 1;
                scans.insert(*scan_number, Taken::new(seed, 5));
            }
        }
        Act::Move { seed, rest } => {
            for (number, pose) in new_poses(scans, *seed, *rest) {
                scans.get_mut(&number).unwrap().pose = pose;
            }
        }
        Act::MoveBeside { seed, rest, meanwhile } => {
            let moved = naive(state, &Act::Move { seed: *seed, rest: *rest });
            return naive(moved, &Act::Scans(meanwhile.clone()));
        }
        Act::RemoveScans(first, last) => scans.retain(|number, _| !(first..=last).contains(&number)),
        Act::RemovePoints(region) => {
            for scan in scans.values_mut() {
                let world = scan.in_world();
                let stays =
                    |point: &[f64; 3]| !(0..3).all(|k| region.min[k] <= point[k] && point[k] < region.max[k]);
                let kept: Vec<_> = (0..world.points.len()).filter(|&k| stays(&world.points[k])).collect();
                scan.points = kept.iter().map(|&k| scan.points[k]).collect();
                scan.intensities = kept.iter().map(|&k| scan.intensities[k]).collect();
            }
        }
        Act::Snapshot(name) => drop(state.snapshots.insert((*name).to_owned(), state.scans.clone())),
        Act::Delete(name) => assert!(state.snapshots.remove(*name).is_some()),
        Act::Revert(name) => state.scans = state.snapshots[*name].clone(),
    }
    state
}

fn name(name: &str) -> SnapshotName {
    SnapshotName::new(name).unwrap()
}

fn open_or_create(disk: &FaultyDisk, config: &MapConfig) -> Result<OutOfCoreTileMapper> {
    match OutOfCoreTileMapper::open(at(disk), config.clone()) {
        Err(Error::NoMap { .. }) => OutOfCoreTileMapper::create(at(disk), config.clone()),
        opened => opened,
    }
}

fn insert(mapper: &mut OutOfCoreTileMapper, scan: &Taken) -> Result<()> {
    let points = ScanRef::in_sensor(scan.pose, &scan.points).with_intensities(&scan.intensities)?;
    mapper.insert_points(&points).map(drop)
}

fn act(disk: &FaultyDisk, config: &MapConfig, before: &State, act: &Act) -> Result<()> {
    match act {
        Act::Scans(seeds) => {
            let mut mapper = open_or_create(disk, config)?;
            for seed in seeds.clone() {
                insert(&mut mapper, &Taken::new(seed, 5))?;
            }
            mapper.flush()
        }
        Act::Move { seed, rest } => {
            let poses = NewPoses::Numbered(new_poses(&before.scans.0, *seed, *rest));
            remap(&scans(disk)?, &poses, &Remap::new(rework()), |_, _| ()).map(drop)
        }
        Act::MoveBeside { seed, rest, meanwhile } => {
            let poses = NewPoses::Numbered(new_poses(&before.scans.0, *seed, *rest));
            let mut mapper = open_or_create(disk, config)?;
            let mut beside = RemapBeside::begin(&scans(disk)?, &poses, &Remap::new(rework()))?;
            for number in meanwhile.clone() {
                if number % 3 > 0 {
                    beside.follow(|_| ())?;
                }
                insert(&mut mapper, &Taken::new(number, 5))?;
                mapper.flush()?;
            }
            drop(mapper);
            beside.finish().map(drop)
        }
        Act::RemoveScans(first, last) => {
            let scans = ScanSelection::Numbers(*first, *last);
            remove_scans(at(disk), &scans, false, &rework(), |_, _| ()).map(drop)
        }
        Act::RemovePoints(region) => remove_points(at(disk), region, &rework(), |_, _| ()).map(drop),
        Act::Snapshot(of) => snapshot(at(disk), &name(of)),
        Act::Delete(of) => delete_snapshot(at(disk), &name(of)),
        Act::Revert(to) => revert(at(disk), &name(to), None, |_, _| ()).map(drop),
    }
}

fn is_as(reader: &MapReader, config: &MapConfig, scans: &Scans) -> bool {
    let is_kept = |taken: &BTreeMap<u64, Taken>| {
        let kept = reader.kept_scans().unwrap().map(|scan| {
            let scan = scan.unwrap();
            let (mut points, mut intensities) = (Vec::new(), Vec::new());
            scan.for_each_own_chunk(0..scan.len(), &mut |some, of_some| {
                points.extend_from_slice(some);
                intensities.extend_from_slice(of_some.unwrap());
                true
            })
            .unwrap();
            let pose = scan.world_from_sensor().unwrap();
            (scan.number(), Taken { points, intensities, pose }.bits())
        });
        kept.eq(taken.iter().map(|(number, scan)| (*number, scan.bits())))
    };
    let is_scan_number = reader.scan_number() == scans.1;
    is_scan_number && is_kept(&scans.0) && voxels_of(reader) == naive_map(config, &scans.0)
}

fn is_in_state(disk: &FaultyDisk, config: &MapConfig, state: &State) -> bool {
    let reader = match MapReader::open(at(disk), 0) {
        Err(Error::NoMap { .. }) => return state.scans.1 == 0,
        opened => opened.unwrap(),
    };
    let infos = voxtile::operations::snapshots(at(disk)).unwrap();
    let names: BTreeSet<_> = infos.iter().map(|info| info.name.clone()).collect();
    names.iter().eq(state.snapshots.keys())
        && is_as(&reader, config, &state.scans)
        && state.snapshots.iter().all(|(of, scans)| {
            is_as(&MapReader::open_snapshot(at(disk), &name(of), 0).unwrap(), config, scans)
        })
}

fn check_whole(disk: &FaultyDisk, what: &str) {
    let is_damage = |finding: &Finding| finding.severity == Severity::Damage;
    let found = |finding: &Finding| assert!(!is_damage(finding), "{what}: {finding}");
    verify(at(disk), found, |_, _| ()).unwrap();
}

fn region(low: f64, high: f64) -> Aabb {
    Aabb { min: [low, -1.0, -1.0], max: [high, 1.5, 1.5] }
}

fn a_life() -> Vec<Act> {
    vec![
        Act::Scans(0..5),
        Act::Move { seed: 7, rest: Some(1) },
        Act::Snapshot("a"),
        Act::RemoveScans(2, 3),
        Act::Scans(5..7),
        Act::RemovePoints(region(2.0, 4.0)),
        Act::Move { seed: 9, rest: None },
        Act::Revert("a"),
        Act::MoveBeside { seed: 3, rest: Some(2), meanwhile: 7..10 },
        Act::Delete("a"),
        Act::RemoveScans(6, 6),
        Act::Scans(10..11),
    ]
}

/// A life, and the naive state after each of its acts.
struct Life {
    acts: Vec<Act>,
    states: Vec<State>,
    config: MapConfig,
}

impl Life {
    fn new(acts: Vec<Act>, config: MapConfig) -> Self {
        let mut states = vec![State::default()];
        for act in &acts {
            states.push(naive(states.last().unwrap().clone(), act));
        }
        Self { acts, states, config }
    }

    fn live(&self, disk: &FaultyDisk, from: usize) -> std::result::Result<(), (usize, Error)> {
        for number in from..self.acts.len() {
            act(disk, &self.config, &self.states[number], &self.acts[number])
                .map_err(|error| (number, error))?;
        }
        Ok(())
    }

    /// Scans that were flushed before the commit of a remapping beside them are in the map; what is left of that act is
    /// done.
    fn redo_what_was_beside(&self, disk: &FaultyDisk, number: usize, what: &str) {
        let (before, Act::MoveBeside { seed, rest, meanwhile }) = (&self.states[number], &self.acts[number])
        else {
            return;
        };
        for next in meanwhile.start + 1..=meanwhile.end {
            let with_some = naive(before.clone(), &Act::Scans(meanwhile.start..next));
            if is_in_state(disk, &self.config, &with_some) {
                check_whole(disk, what);
                let poses = new_poses(&before.scans.0, *seed, *rest);
                let mut mapper = open_or_create(disk, &self.config).unwrap();
                let mut beside = RemapBeside::begin(
                    &scans(disk).unwrap(),
                    &NewPoses::Numbered(poses),
                    &Remap::new(rework()),
                )
                .unwrap();
                (next..meanwhile.end).for_each(|seed| insert(&mut mapper, &Taken::new(seed, 5)).unwrap());
                mapper.flush().unwrap();
                drop(mapper);
                beside.follow(|_| ()).unwrap();
                beside.finish().unwrap();
                return;
            }
        }
    }

    /// The map is in the state before an act or after it, whole, and life goes on to the same end.
    fn check_after_crash(&self, disk: &FaultyDisk, number: usize, what: &str) {
        self.redo_what_was_beside(disk, number, what);
        let found = [number, number + 1]
            .into_iter()
            .find(|&number| is_in_state(disk, &self.config, &self.states[number]));
        let from =
            found.unwrap_or_else(|| panic!("{what}: neither before nor after {:?}", self.acts[number]));
        if from > 0 {
            check_whole(disk, what);
        }
        self.live(disk, from)
            .unwrap_or_else(|(number, error)| panic!("{what}: then {:?}: {error:#}", self.acts[number]));
        RemapBeside::remove_leftovers(at(disk)).unwrap();
        assert!(is_in_state(disk, &self.config, self.states.last().unwrap()), "{what}: another end");
        check_files(disk, what);
    }
}

/// Nothing lies around beside the map or among the kept scans: one catalog, and no more points than there are.
fn check_files(disk: &FaultyDisk, what: &str) {
    drop(TileStore::open(disk.shared(), map()).unwrap());
    let files = disk.files();
    assert!(files.keys().all(|path| path.starts_with(map())), "{what}: {:?}", files.keys());
    let catalogs = files.keys().filter(|path| path.to_string_lossy().contains("kept_scans/catalog")).count();
    let snapshots = voxtile::operations::snapshots(at(disk)).unwrap().len();
    assert!((1..=1 + snapshots).contains(&catalogs), "{what}: {catalogs} catalogs");
    check_whole(disk, what);
}

fn random_acts(random: &mut Random) -> Vec<Act> {
    let (mut acts, mut snapshots) = (vec![Act::Scans(0..4)], Vec::new());
    for step in 1..12 {
        let act = match random.below(8) {
            0 => Act::Scans(10 * step..10 * step + 1 + random.below(3)),
            1 | 2 => Act::MoveBeside {
                seed: random.next(),
                rest: Some(random.below(5)).filter(|&rest| rest < 4),
                meanwhile: 10 * step..10 * step + random.below(5),
            },
            3 => Act::Move { seed: random.next(), rest: Some(random.below(4)) },
            4 => Act::Move { seed: random.next(), rest: None },
            5 => Act::RemovePoints(region(random.between(-2.0, 8.0), 9.0)),
            6 => {
                let name = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l"][step as usize];
                snapshots.push(name);
                Act::Snapshot(name)
            }
            _ => match snapshots.len() {
                0 => Act::Scans(10 * step..10 * step + 2),
                all => Act::Revert(snapshots[random.below(all as u64) as usize]),
            },
        };
        acts.push(act);
        let state = Life::new(acts.clone(), config()).states.pop().unwrap();
        let scans: Vec<_> = state.scans.0.keys().copied().collect();
        if scans.len() > 3 && random.below(3) == 0 {
            let first = scans[random.below(scans.len() as u64 - 1) as usize];
            acts.push(Act::RemoveScans(first, first + random.below(2)));
        }
    }
    acts
}

#[test]
fn random_lives_are_the_naive_map_of_the_scans_that_are_left() {
    let mut configs = Vec::new();
    for sensor_model in [SensorModel::default(), SensorModel::Iwlo(Iwlo::default())] {
        for insert_mode in [InsertMode::PerScan, InsertMode::PerRay] {
            configs.push(config().with_sensor_model(sensor_model).with_insert_mode(insert_mode));
        }
    }
    for seed in 0..24 {
        let life = Life::new(random_acts(&mut Random(seed)), configs[seed as usize % 4].clone());
        let disk = FaultyDisk::new(Fault::None);
        for (number, action) in life.acts.iter().enumerate() {
            act(&disk, &life.config, &life.states[number], action)
                .unwrap_or_else(|error| panic!("seed {seed}, {action:?}: {error:#}"));
            let is_right = is_in_state(&disk, &life.config, &life.states[number + 1]);
            assert!(is_right, "seed {seed}, {action:?} of {:?}", life.acts);
        }
        check_files(&disk, &format!("seed {seed}"));
    }
}

#[test]
fn an_operation_fails_and_the_next_attempt_goes() {
    let life = Life::new(a_life(), config());
    let undisturbed = FaultyDisk::new(Fault::None);
    life.live(&undisturbed, 0).unwrap();
    println!("{} operations", undisturbed.operations());
    for at in some_of(0..undisturbed.operations(), 12) {
        let disk = FaultyDisk::new(Fault::Fails(at));
        if let Err((number, _)) = life.live(&disk, 0) {
            life.check_after_crash(&disk.after_kill(), number, &format!("operation {at} fails"));
        }
    }
}

#[test]
fn the_power_goes_at_every_change() {
    let life = Life::new(a_life(), config());
    let undisturbed = FaultyDisk::new(Fault::None);
    life.live(&undisturbed, 0).unwrap();
    println!("{} changes", undisturbed.changes());
    for at in some_of(0..undisturbed.changes(), 12) {
        let disk = FaultyDisk::new(Fault::Crashes(at));
        let lived = life.live(&disk, 0);
        assert!(disk.has_crashed());
        let number = lived.map_or_else(|(number, _)| number, |()| life.acts.len() - 1);
        for unsynced in [Unsynced::Shuffled(31 * at), Unsynced::Dropped, Unsynced::Kept] {
            let left = disk.after_crash(unsynced);
            life.check_after_crash(&left, number, &format!("crash at {at}, {unsynced:?}"));
        }
    }
}

fn a_map_with_kept_scans() -> (FaultyDisk, State) {
    let disk = FaultyDisk::new(Fault::None);
    let state = naive(State::default(), &Act::Scans(0..5));
    act(&disk, &config(), &State::default(), &Act::Scans(0..5)).unwrap();
    (disk, state)
}

/// Whatever byte of the kept scans is damaged: it is found, or it is none that counts; and then nothing is changed.
#[test]
fn damage_among_kept_scans_is_named_and_nothing_is_changed() {
    let (whole, state) = a_map_with_kept_scans();
    let files = whole.files();
    let kept = files.iter().filter(|(path, _)| path.to_string_lossy().contains("kept_scans"));
    let mut found = 0;
    for (path, bytes) in kept {
        for offset in (0..bytes.len()).step_by(7) {
            let disk = whole.copy();
            let mut damaged = bytes.clone();
            damaged[offset] ^= 0x20;
            disk.put(path, &damaged);
            let what = format!("{} at {offset}", path.display());
            let mut findings = Vec::new();
            verify(at(&disk), |finding| findings.push(finding.to_string()), |_, _| ()).unwrap();
            let poses = NewPoses::Numbered(new_poses(&state.scans.0, 3, None));
            let before = disk.files();
            let remapped =
                scans(&disk).and_then(|scans| remap(&scans, &poses, &Remap::new(rework()), |_, _| ()));
            match remapped {
                Ok(_) => {
                    let moved = naive(state.clone(), &Act::Move { seed: 3, rest: None });
                    assert!(findings.is_empty() && is_in_state(&disk, &config(), &moved), "{what}");
                }
                Err(error) => {
                    found += 1;
                    assert!(matches!(error, Error::Damaged { .. }), "{what}: {error:#}");
                    assert!(!findings.is_empty(), "{what}: {error:#} was not found before");
                    assert!(format!("{error:#}").contains("kept_scans"), "{what}: {error:#}");
                    let tables = |files: &BTreeMap<std::path::PathBuf, Vec<u8>>| {
                        let tables =
                            files.iter().filter(|(path, _)| path.to_string_lossy().contains("tile_"));
                        tables.map(|(path, bytes)| (path.clone(), bytes.clone())).collect::<Vec<_>>()
                    };
                    assert_eq!(tables(&before), tables(&disk.files()), "{what}");
                }
            }
            // What is left is a map like any other, whose scans are not all kept.
            repair(at(&disk), |_| (), |_, _| ()).unwrap();
            check_whole(&disk, &what);
        }
    }
    assert!(found > 100, "{found}");
}

#[test]
fn segments_and_catalogs_that_are_missing_are_damage() {
    let (whole, state) = a_map_with_kept_scans();
    let names: Vec<_> = whole.files().into_keys().collect();
    let names = names.iter().filter(|path| path.to_string_lossy().contains("kept_scans"));
    for path in names {
        let disk = whole.copy();
        disk.take(path);
        let poses = NewPoses::Numbered(new_poses(&state.scans.0, 3, None));
        let message = message_of(
            scans(&disk).and_then(|scans| remap(&scans, &poses, &Remap::new(rework()), |_, _| ())),
        );
        assert!(message.contains("missing"), "{message}");
        let mut damage = 0;
        verify(at(&disk), |_| damage += 1, |_, _| ()).unwrap();
        assert!(damage > 0);
        repair(at(&disk), |_| (), |_, _| ()).unwrap();
        check_whole(&disk, "repaired");
        let reader = MapReader::open(at(&disk), 0).unwrap();
        assert_eq!(voxels_of(&reader), naive_map(&config(), &state.scans.0));
    }
}

#[test]
fn what_is_no_scan_is_named_and_refused() {
    let refused = |disk: &FaultyDisk| {
        let poses = NewPoses::Numbered(vec![(1, Pose::identity())]);
        message_of(scans(disk).and_then(|scans| remap(&scans, &poses, &Remap::new(rework()), |_, _| ())))
    };
    let (disk, _) = a_map_with_kept_scans();
    clear(at(&disk), &Part::Inside(region(0.0, 1.0)), |_, _| ()).unwrap();
    assert!(refused(&disk).contains("a change that is no scan: clear"), "{}", refused(&disk));

    let (disk, _) = a_map_with_kept_scans();
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
    let batch = PointBatch { points: &[[0.1; 3]], intensities: Some(&[9.0]), is_occupied: &[true] };
    mapper.batch_update(&batch).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    assert!(refused(&disk).contains("number 6, which is no scan"), "{}", refused(&disk));

    // Scans from before, and a map without any.
    let disk = FaultyDisk::new(Fault::None);
    let without = config().with_kept_scans(false);
    act(&disk, &without, &State::default(), &Act::Scans(0..2)).unwrap();
    assert!(refused(&disk).contains("keeps no scans"), "{}", refused(&disk));
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
    insert(&mut mapper, &Taken::new(3, 5)).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    assert!(refused(&disk).contains("scan 1, whose points are not kept"), "{}", refused(&disk));
    assert_eq!(MapReader::open(at(&disk), 0).unwrap().scans().unwrap().len(), 3);

    // In the world frame there is no pose that could change.
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    mapper.insert_scan(&Taken::new(3, 5).in_world()).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    assert!(refused(&disk).contains("scan 1 has its points in the world frame"), "{}", refused(&disk));
    let region = region(-9.0, 9.0);
    let removed = remove_points(at(&disk), &region, &rework(), |_, _| ()).unwrap();
    assert!(removed.points_removed > 0);
}

#[test]
fn new_poses_that_do_not_fit_are_named() {
    let (disk, _) = a_map_with_kept_scans();
    let wrong = |poses: NewPoses| {
        message_of(scans(&disk).and_then(|scans| remap(&scans, &poses, &Remap::new(rework()), |_, _| ())))
    };
    let identity = Pose::identity();
    let message = wrong(NewPoses::InOrder(vec![identity; 3]));
    assert!(message.contains("3 poses for 5 scans: none from scan 4 of the map on"), "{message}");
    let message = wrong(NewPoses::InOrder(vec![identity; 7]));
    assert!(message.contains("7 poses for 5 scans: 2 too many"), "{message}");
    let message = wrong(NewPoses::Numbered(vec![(2, identity), (9, identity)]));
    assert!(message.contains("no scan with the number 9"), "{message}");
    let message = wrong(NewPoses::Numbered(vec![(2, identity), (2, identity)]));
    assert!(message.contains("two poses for scan 2"), "{message}");
    let mut isometry = *identity.isometry();
    isometry.translation.vector.y = f64::NAN;
    let message = wrong(NewPoses::Numbered(vec![(4, isometry.into())]));
    assert!(message.contains("the pose of scan 4 is not finite"), "{message}");
}

#[test]
fn scans_that_hardly_move_are_left_alone_and_told() {
    let (disk, state) = a_map_with_kept_scans();
    let digest = MapReader::open(at(&disk), 0).unwrap().digest().unwrap();
    let moved = |by_m: f64| {
        let poses = state.scans.0.iter().map(|(&number, scan)| {
            let mut isometry = *scan.pose.isometry();
            isometry.translation.vector.x += by_m * number as f64;
            (number, isometry.into())
        });
        NewPoses::Numbered(poses.collect())
    };
    let how = Remap::new(rework()).with_tolerance((0.045, 0.01));
    let remapped = remap(&scans(&disk).unwrap(), &moved(0.01), &how, |_, _| ()).unwrap();
    assert_eq!((remapped.scans_within_tolerance, remapped.mapped.scans_changed), (4, 1), "{remapped:?}");
    let left_m = remapped.largest_move_left_m;
    assert!((left_m - 0.04).abs() < 1e-9 && (remapped.largest_move_m - 0.05).abs() < 1e-9);
    assert!(MapReader::open(at(&disk), 0).unwrap().digest().unwrap() != digest);
    let wide = Remap::new(rework().with_dry_run(true)).with_tolerance((9.0, 9.0));
    assert_eq!(
        remap(&scans(&disk).unwrap(), &moved(0.02), &wide, |_, _| ()).unwrap().mapped.scans_changed,
        0
    );
}

/// The same scans in little memory, and a request to stop in the middle.
#[test]
fn a_dry_run_and_a_stop_change_nothing() {
    let (disk, state) = a_map_with_kept_scans();
    let poses = NewPoses::Numbered(new_poses(&state.scans.0, 5, Some(1)));
    let before = disk.files();
    let dry = Remap::new(rework().with_dry_run(true));
    let told = remap(&scans(&disk).unwrap(), &poses, &dry, |_, _| ()).unwrap().mapped;
    assert!(told.estimated_s.is_some() && told.scans_changed == 2 && told.tiles_mapped > 0, "{told:?}");
    let is_lock = |path: &std::path::PathBuf| path.ends_with("writer.lock");
    let without_lock = |files: BTreeMap<std::path::PathBuf, Vec<u8>>| {
        files.into_iter().filter(|(path, _)| !is_lock(path)).collect::<Vec<_>>()
    };
    assert!(without_lock(before) == without_lock(disk.files()));
    let stop = Stop::default();
    let how = Remap::new(rework().with_stop(stop.clone()));
    let stopped = remap(&scans(&disk).unwrap(), &poses, &how, |done, _| {
        if done == 1 {
            stop.set()
        }
    });
    assert!(matches!(stopped, Err(Error::Stopped)));
    assert!(is_in_state(&disk, &config(), &state));
    check_whole(&disk, "stopped");
    let done = remap(&scans(&disk).unwrap(), &poses, &Remap::new(rework()), |_, _| ()).unwrap().mapped;
    assert_eq!((done.tiles_mapped > 0, done.scans_changed), (true, 2));
}

#[test]
fn scans_are_removed_by_time_and_by_input_and_snapshots_are_told() {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    for (input, seeds) in [("first", 0..3), ("second", 3..5)] {
        mapper.begin_input(input).unwrap();
        seeds.for_each(|seed| insert(&mut mapper, &Taken::new(seed, 5)).unwrap());
    }
    mapper.snapshot(&name("old")).unwrap();
    drop(mapper);
    let remove = |scans: ScanSelection, from_snapshots| {
        remove_scans(at(&disk), &scans, from_snapshots, &rework(), |_, _| ())
    };
    assert!(message_of(remove(ScanSelection::Time(0, 9), false)).contains("the map keeps none"));
    let message = message_of(remove(ScanSelection::Input("third".to_owned()), false));
    assert!(message.contains("it has first, second"), "{message}");
    let removed = remove(ScanSelection::Input("second".to_owned()), false).unwrap();
    assert_eq!((removed.scans_removed, removed.snapshots_with_them.len()), (2, 1));
    let reader = MapReader::open(at(&disk), 0).unwrap();
    let left: BTreeMap<_, _> = (0..3).map(|seed| (seed + 1, Taken::new(seed, 5))).collect();
    assert!(is_as(&reader, &config(), &(left, 5)));
    // Their numbers stay theirs: the next scan is the sixth.
    drop(reader);
    let mut mapper = OutOfCoreTileMapper::open(at(&disk), config()).unwrap();
    insert(&mut mapper, &Taken::new(7, 5)).unwrap();
    assert_eq!(mapper.scan_number(), 6);
    mapper.flush().unwrap();
    drop(mapper);
    let removed = remove(ScanSelection::Numbers(1, 1), true).unwrap();
    assert_eq!(removed.snapshots_deleted, [name("old")]);
    check_files(&disk, "nothing is left of them");
}

/// A map of five scans of two inputs, which two snapshots hold, too.
fn a_map_with_snapshots() -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config()).unwrap();
    for (input, seeds) in [("first", 0..3), ("second", 3..5)] {
        mapper.begin_input(input).unwrap();
        for seed in seeds {
            let Taken { points, intensities, pose } = Taken::new(seed, 5);
            let scan = ScanRef::in_sensor(pose, &points).with_stamp_ns(seed as i64);
            mapper.insert_points(&scan.with_intensities(&intensities).unwrap()).unwrap();
        }
        mapper.snapshot(&name(input)).unwrap();
    }
    mapper.snapshot(&name("third")).unwrap();
    drop(mapper);
    disk.copy()
}

fn snapshot_names(disk: &FaultyDisk) -> Vec<String> {
    let mut names: Vec<_> =
        voxtile::operations::snapshots(at(disk)).unwrap().into_iter().map(|info| info.name).collect();
    names.sort_unstable();
    names
}

/// What is gone from the map is still found in snapshots, however it is selected.
#[test]
fn scans_that_the_map_has_no_more_are_removed_from_its_snapshots() {
    let selections =
        [ScanSelection::Numbers(4, 5), ScanSelection::Time(3, 4), ScanSelection::Input("second".to_owned())];
    for scans in selections {
        let disk = a_map_with_snapshots();
        let remove =
            |from_snapshots, how: &Rework| remove_scans(at(&disk), &scans, from_snapshots, how, |_, _| ());
        let removed = remove(false, &rework()).unwrap();
        assert_eq!((removed.scans_removed, removed.snapshots_with_them.len()), (2, 2), "{scans:?}");
        // The map does not keep the times of removed scans.
        let is_told = !matches!(scans, ScanSelection::Time(..));
        match remove(false, &rework()) {
            Ok(removed) => assert!(is_told && removed.scans_removed == 0, "{scans:?}"),
            refused => assert!(!is_told && message_of(refused).contains("the map keeps none"), "{scans:?}"),
        }
        let told = remove(true, &rework().with_dry_run(true)).unwrap();
        assert_eq!((told.scans_removed, told.snapshots_with_them.len()), (0, 2), "{scans:?}");
        // The one that is to keep them does.
        let kept = remove(true, &rework().with_keep_as(name("third"))).unwrap();
        assert_eq!(kept.snapshots_deleted, [name("second")], "{scans:?}");
        assert_eq!(kept.snapshots_with_them, [name("third")], "{scans:?}");
        assert_eq!(remove(true, &rework()).unwrap().snapshots_deleted, [name("third")], "{scans:?}");
        assert_eq!(snapshot_names(&disk), ["first"], "{scans:?}");
        match remove(true, &rework()) {
            Ok(removed) => assert!(is_told && removed.snapshots_deleted.is_empty(), "{scans:?}"),
            refused => assert!(!is_told && message_of(refused).contains("the map keeps none"), "{scans:?}"),
        }
        check_files(&disk, "removed");
    }
}

/// A map that has changed by something else since is not mapped again, and its snapshots go.
#[test]
fn snapshots_go_whatever_has_become_of_the_map() {
    let disk = a_map_with_snapshots();
    let scans = ScanSelection::Numbers(4, 5);
    remove_scans(at(&disk), &scans, false, &rework(), |_, _| ()).unwrap();
    clear(at(&disk), &Part::Inside(region(0.0, 1.0)), |_, _| ()).unwrap();
    let removed = remove_scans(at(&disk), &scans, true, &rework(), |_, _| ()).unwrap();
    assert_eq!(removed.snapshots_deleted, [name("second"), name("third")]);
}

#[test]
fn a_snapshot_that_cannot_be_read_is_told_after_the_others_are_gone() {
    let disk = a_map_with_snapshots();
    disk.put(&map().join("snapshots/second"), b"nothing");
    let scans = ScanSelection::Numbers(4, 5);
    let remove = || remove_scans(at(&disk), &scans, true, &rework(), |_, _| ());
    let is_told = |message: &str| message.contains("snapshots/second") && message.contains("may hold some");
    let removed = remove().unwrap();
    let [failed] = &*removed.snapshots_failed else { panic!("{removed:?}") };
    assert!(is_told(&failed.reason) && failed.name == name("second"), "{failed:?}");
    assert_eq!(removed.snapshots_deleted, [name("third")]);
    // Nothing else is left to do.
    let message = message_of(remove());
    assert!(is_told(&message), "{message}");
    assert_eq!(snapshot_names(&disk), ["first", "second"]);
    assert_eq!(MapReader::open(at(&disk), 0).unwrap().scans().unwrap().len(), 3);
    delete_snapshot(at(&disk), &name("second")).unwrap();
    let removed = remove().unwrap();
    assert_eq!((removed.scans_removed, removed.snapshots_deleted.len()), (0, 0));
}

/// Whatever fails and wherever the process is killed: the same call does the rest.
#[test]
fn a_removal_that_ended_between_map_and_snapshots_is_completed() {
    let start = a_map_with_snapshots();
    let remove = |disk: &FaultyDisk| {
        let scans = ScanSelection::Numbers(4, 5);
        remove_scans(at(disk), &scans, true, &rework(), |_, _| ()).map(drop)
    };
    let undisturbed = start.copy();
    remove(&undisturbed).unwrap();
    let left = snapshot_names(&undisturbed);
    let fails = some_of(0..undisturbed.operations(), 3).map(Fault::Fails);
    for fault in fails.chain(some_of(0..undisturbed.changes(), 2).map(Fault::Crashes)) {
        let disk = start.copy();
        disk.set_fault(fault);
        let _ = remove(&disk);
        let disk = disk.after_kill();
        remove(&disk).unwrap_or_else(|error| panic!("{fault:?}: {error:#}"));
        assert_eq!(snapshot_names(&disk), left, "{fault:?}");
        assert_eq!(MapReader::open(at(&disk), 0).unwrap().scans().unwrap().len(), 3, "{fault:?}");
        check_files(&disk, &format!("{fault:?}"));
    }
}
