//! Sequences of operations in separate processes, compared with the naive map: undisturbed random ones, and some with a
//! fault or a crash at every operation.

use crate::harness::{
    Act, EVERY_CRASH, Left, Life, Subject, all_layers, at, check_files, config, faults, keeping_scans, map,
    perform, sweep, sweep_after_kills,
};
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::random_scans::Random;
use testkit::reference_map::voxels_of;
use testkit::support::cases;
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::store::TileStore;
use voxtile::{Aabb, Clearing, Grid, Guard, InsertMode, MapConfig, MapQueries, MapReader};

/// Tiles are removed, cleared in part and created again, and at the end all are removed.
fn removals() -> Life {
    let acts = vec![
        Act::Scans(0..3),
        Act::RemoveTiles(2),
        Act::Scans(3..5),
        Act::RemoveTiles(3),
        Act::Clear(region(1.0, 5.0)),
        Act::Scans(0..1),
        Act::RemoveTiles(1),
    ];
    Life::new(config(), acts)
}

/// Snapshots that share tiles, of removed and new tiles; reverts to each; none at the end.
fn snapshots() -> Life {
    let acts = vec![
        Act::Scans(0..2),
        Act::Snapshot("a"),
        Act::Scans(2..3),
        Act::Snapshot("b"),
        Act::RemoveTiles(2),
        Act::Scans(3..4),
        Act::Revert("a"),
        Act::Scans(4..5),
        Act::Delete("a"),
        Act::Snapshot("c"),
        Act::Revert("b"),
        Act::Delete("b"),
        Act::Scans(5..6),
        Act::Delete("c"),
        // The map does not change during the life of this snapshot.
        Act::Snapshot("d"),
        Act::Delete("d"),
        Act::Scans(6..8),
    ];
    Life::new(config(), acts)
}

/// Scans are moved, marked and removed, before and after a snapshot.
fn replays() -> Life {
    let acts = vec![
        Act::Scans(0..5),
        Act::Move { seed: 7, rest: Some(1) },
        Act::Snapshot("a"),
        Act::RemoveScans(2, 3),
        Act::Mark { seed: 5, rest: None },
        Act::Scans(5..7),
        Act::RemovePoints(region(2.0, 4.0)),
        Act::Move { seed: 9, rest: None },
        Act::Revert("a"),
        Act::MoveOnline { seed: 3, rest: Some(2), meanwhile: 7..10 },
        Act::Delete("a"),
        Act::Mark { seed: 6, rest: Some(2) },
        Act::RemoveScans(6, 6),
        Act::Scans(10..11),
    ];
    Life::new(keeping_scans(), acts)
}

/// The same acts on a map with all layers.
fn with_layers(life: Life) -> Life {
    Life::new(layered(life.config), life.acts)
}

/// A map with all layers, of larger voxels that several scans hit.
fn layered(mut config: MapConfig) -> MapConfig {
    config.grid = Grid::new(1.6, 6.4).unwrap();
    config.with_layers(all_layers())
}

fn region(low: f64, high: f64) -> Aabb {
    Aabb { min: [low, -1.0, -1.0], max: [high, 1.5, 1.5] }
}

fn every_operation_fails(life: &Life, one_in: u64) {
    sweep(life, faults(life, &[Fault::Fails], one_in), &[Left::Killed]);
}

fn check_power_cuts(life: &Life, one_in: u64) {
    sweep(life, faults(life, &[Fault::Crashes], one_in), &EVERY_CRASH);
}

fn check_power_cuts_after_kills(life: &Life, one_in: u64) {
    sweep_after_kills(life, one_in, |at| vec![0, 1, 2, 3, 5, at % 17, 7 + at % 29]);
}

#[test]
fn the_next_process_continues_after_a_failed_operation() {
    every_operation_fails(&removals(), 8);
    every_operation_fails(&snapshots(), 32);
    every_operation_fails(&snapshots().without_links(), 48);
    every_operation_fails(&replays(), 48);
}

#[test]
fn power_cuts_at_every_change_of_removals() {
    check_power_cuts(&removals(), 8);
}

#[test]
fn power_cuts_at_every_change_of_snapshots() {
    check_power_cuts(&snapshots(), 16);
}

#[test]
fn power_cuts_at_every_change_of_snapshots_without_hard_links() {
    check_power_cuts(&snapshots().without_links(), 24);
}

#[test]
fn power_cuts_at_every_change_of_replays() {
    check_power_cuts(&replays(), 48);
}

#[test]
fn power_cuts_some_time_after_a_kill() {
    check_power_cuts_after_kills(&removals(), 16);
    check_power_cuts_after_kills(&snapshots(), 64);
    check_power_cuts_after_kills(&replays(), 192);
}

#[test]
fn layers_survive_faults_and_power_cuts_with_their_voxels() {
    for (life, one_in) in [(removals(), 48), (snapshots(), 160), (replays(), 320)] {
        let life = with_layers(life);
        every_operation_fails(&life, 2 * one_in);
        check_power_cuts(&life, one_in);
        check_power_cuts_after_kills(&life, 4 * one_in);
    }
}

fn random_acts(random: &mut Random) -> Vec<Act> {
    let (mut acts, mut snapshots) = (vec![Act::Scans(0..4)], Vec::new());
    for step in 1..12 {
        let act = match random.below(10) {
            0 => Act::Scans(10 * step..10 * step + 1 + random.below(3)),
            1 | 2 => Act::MoveOnline {
                seed: random.next(),
                rest: Some(random.below(5)).filter(|&rest| rest < 4),
                meanwhile: 10 * step..10 * step + random.below(5),
            },
            3 => Act::Move { seed: random.next(), rest: Some(random.below(4)) },
            4 => Act::Move { seed: random.next(), rest: None },
            5 => Act::RemovePoints(region(random.between(-2.0, 8.0), 9.0)),
            6 => Act::Mark { seed: random.next(), rest: Some(random.below(4)) },
            7 => Act::Mark { seed: random.next(), rest: None },
            8 => {
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
        let state = Life::new(keeping_scans(), acts.clone()).states.pop().unwrap();
        let scans: Vec<_> = state.now.scans.keys().copied().collect();
        if scans.len() > 3 && random.below(3) == 0 {
            let first = scans[random.below(scans.len() as u64 - 1) as usize];
            acts.push(Act::RemoveScans(first, first + random.below(2)));
        }
    }
    acts
}

#[test]
fn random_lives_equal_the_naive_map_of_the_remaining_scans() {
    let mut configs = Vec::new();
    for sensor_model in [SensorModel::default(), SensorModel::Iwlo(Iwlo::default())] {
        for insert_mode in [InsertMode::PerScan, InsertMode::PerRay] {
            configs.push(keeping_scans().with_sensor_model(sensor_model).with_insert_mode(insert_mode));
        }
        let guarded = keeping_scans().with_sensor_model(sensor_model);
        configs.push(guarded.with_clearing(Clearing::Guarded(Guard::default())));
    }
    let layered = configs.iter().cloned().map(layered);
    configs.extend(layered.collect::<Vec<_>>());
    for seed in 0..cases(12, 48) {
        let life = Life::new(configs[seed as usize % configs.len()].clone(), random_acts(&mut Random(seed)));
        let disk = life.disk();
        for (number, act) in life.acts.iter().enumerate() {
            perform(&disk, &life.config, &life.states[number], act)
                .unwrap_or_else(|error| panic!("seed {seed}, {act:?}: {error:#}"));
            assert!(life.states[number + 1].is_on(&disk), "seed {seed}, {act:?} of {:?}", life.acts);
        }
        check_files(&disk, &format!("seed {seed}"));
    }
}

#[test]
fn an_open_reader_sees_removed_tiles() {
    let (life, disk) = (removals(), FaultyDisk::new(Fault::None));
    for (number, act) in life.acts.iter().enumerate() {
        let reader = MapReader::open(at(&disk), 0);
        let digest = reader.as_ref().ok().map(|reader| reader.digest().unwrap());
        perform(&disk, &life.config, &life.states[number], act).unwrap();
        if let Ok(reader) = reader {
            assert_eq!(voxels_of(&reader), life.states[number].now.voxels, "a reader across act {number}");
            assert_eq!(reader.digest().ok(), digest);
        }
    }
}

/// A staged removal without a commit does not change the map.
#[test]
fn a_removal_takes_effect_with_the_commit() {
    let (life, disk) = (removals(), FaultyDisk::new(Fault::None));
    perform(&disk, &life.config, &life.states[0], &life.acts[0]).unwrap();
    let mut store = TileStore::open(disk.shared(), map()).unwrap();
    let tiles: Vec<_> = store.tiles().iter().collect();
    for &tile in &tiles {
        store.remove(tile).unwrap();
        assert!(!store.tiles().contains(tile) && store.tables().open(tile).unwrap().is_none());
    }
    assert_eq!(store.tiles().iter().count(), 0);
    drop(store);
    assert_eq!(life.find(&disk, &[1], "not committed"), 1);
}
