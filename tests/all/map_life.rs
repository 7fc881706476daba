use std::collections::BTreeMap;
use std::path::Path;
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use testkit::support::some_of;
use voxtile::integrity::{Finding, Severity, Verification, verify};
use voxtile::operations::{delete_snapshot, revert, snapshot};
use voxtile::space::TileIndex;
use voxtile::store::{SnapshotName, TileStore, tile_of_folder};
use voxtile::{
    Error, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper, Result, Scan,
};

fn map() -> &'static Path {
    Path::new("/city/map")
}

fn config() -> MapConfig {
    MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 3.0).with_cache_tiles(2).with_write_buffer_bytes(600)
}

/// What people do with a map, each in a process of its own.
#[derive(Clone, Debug)]
enum Act {
    /// Insert these scans and flush.
    Scans(std::ops::Range<u64>),
    /// Take every so many-th tile out of the map.
    Remove(usize),
    Snapshot(&'static str),
    Delete(&'static str),
    Revert(&'static str),
}

fn scan(number: u64) -> Scan {
    let x = [0.0, 3.0, 6.0, 3.0][number as usize % 4];
    random_scan(&mut Random(number), [x, 0.0, 0.0], 4)
}

/// What a map is after an act.
#[derive(Clone, Debug, Default, PartialEq)]
struct State {
    voxels: Voxels,
    scan_number: u64,
    /// Voxels and scan number of each snapshot.
    snapshots: BTreeMap<String, (Voxels, u64)>,
}

/// A life, and the naive map after each of its acts.
struct Life {
    acts: Vec<Act>,
    states: Vec<State>,
}

impl Life {
    fn new(acts: Vec<Act>) -> Self {
        let mut states = vec![State::default()];
        for act in &acts {
            states.push(naive(states.last().unwrap().clone(), act));
        }
        Self { acts, states }
    }

    /// The number of the state that a map is in, among these.
    fn state_of(&self, disk: &FaultyDisk, among: &[usize], what: &str) -> usize {
        let reader = match MapReader::open(MapPath::on(disk.shared(), map()), 0) {
            Err(Error::NoMap { .. }) if among.contains(&0) => return 0,
            opened => opened.unwrap_or_else(|error| panic!("{what}: {error:#}")),
        };
        let found = state_seen(disk, &reader);
        let number = among.iter().copied().find(|&number| self.states[number] == found);
        number.unwrap_or_else(|| panic!("{what}: none of the states {among:?}"))
    }

    /// Acts from a state to the end; how far it came, if something failed.
    fn live(&self, disk: &FaultyDisk, from: usize) -> std::result::Result<(), (usize, Error)> {
        for (number, action) in self.acts.iter().enumerate().skip(from) {
            act(disk, action).map_err(|error| (number, error))?;
        }
        Ok(())
    }

    /// The act in which the power went; what comes after the commit of the last one fails without an error.
    fn live_until_crash(&self, disk: &FaultyDisk, from: usize) -> usize {
        let lived = self.live(disk, from);
        assert!(disk.has_crashed());
        lived.map_or_else(|(number, _)| number, |()| self.acts.len() - 1)
    }

    fn undisturbed(&self) -> FaultyDisk {
        let disk = FaultyDisk::new(Fault::None);
        self.live(&disk, 0).unwrap();
        disk
    }

    /// What a crash in an act left is the map before or after it, whole, and life goes on to the same end.
    fn check_after_crash(&self, disk: &FaultyDisk, number: usize, what: &str) {
        self.check_among(disk, &[number, number + 1], what);
    }

    fn check_among(&self, disk: &FaultyDisk, among: &[usize], what: &str) {
        let from = self.state_of(disk, among, what);
        if from > 0 {
            check_whole(disk, what);
        }
        self.live(disk, from)
            .unwrap_or_else(|(number, error)| panic!("{what}: then act {number}: {error:#}"));
        self.check_end(disk, what);
    }

    fn check_end(&self, disk: &FaultyDisk, what: &str) {
        // What a crash in the last act left goes when the map is opened.
        drop(OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config()).unwrap());
        self.state_of(disk, &[self.acts.len()], what);
        check_files(disk, what);
    }
}

fn name(name: &str) -> SnapshotName {
    SnapshotName::new(name).unwrap()
}

fn state_seen(disk: &FaultyDisk, reader: &MapReader) -> State {
    let (voxels, scan_number) = (voxels_of(reader), reader.scan_number());
    let open = |name| MapReader::open_snapshot(MapPath::on(disk.shared(), map()), &name, 0).unwrap();
    let infos = voxtile::operations::snapshots(MapPath::on(disk.shared(), map())).unwrap().into_iter();
    let readers = infos.map(|info| open(name(&info.name)));
    let snapshots = readers.map(|reader| {
        let name = reader.snapshot().unwrap().to_string();
        (name, (voxels_of(&reader), reader.scan_number()))
    });
    State { voxels, scan_number, snapshots: snapshots.collect() }
}

fn check_whole(disk: &FaultyDisk, what: &str) -> Verification {
    let is_damage = |finding: &Finding| finding.severity == Severity::Damage;
    let found = |finding: &Finding| assert!(!is_damage(finding), "{what}: {finding}");
    verify(MapPath::on(disk.shared(), map()), found, |_, _| ()).unwrap()
}

/// Nothing is damaged, and nothing lies around.
fn check_files(disk: &FaultyDisk, what: &str) {
    assert_eq!(check_whole(disk, what).notes, 0, "{what}");
    let reader = MapReader::open(MapPath::on(disk.shared(), map()), 0).unwrap();
    let tiles = reader.tile_indices();
    for path in disk.files().into_keys() {
        let folder = path.parent().and_then(|folder| folder.file_name()?.to_str()).unwrap();
        let is_of_tile = tile_of_folder(folder).is_none_or(|tile| tiles.binary_search(&tile).is_ok())
            || path.to_string_lossy().contains(".flush");
        assert!(is_of_tile, "{what}: {}", path.display());
    }
}

fn is_removed(every: usize, tile: TileIndex) -> bool {
    (tile.x + tile.y + tile.z).rem_euclid(every as i32) == 0
}

fn naive(before: State, act: &Act) -> State {
    let grid = config().grid;
    let mut map = ReferenceMap::new(&config());
    map.voxels = before.voxels.clone();
    match act {
        Act::Scans(numbers) => {
            numbers.clone().for_each(|number| map.insert_scan(&scan(number)));
            let scan_number = before.scan_number + numbers.end - numbers.start;
            State { voxels: map.voxels, scan_number, ..before }
        }
        Act::Remove(every) => {
            map.voxels.retain(|&voxel, _| !is_removed(*every, grid.tile_of_voxel(voxel)));
            State { voxels: map.voxels, ..before }
        }
        Act::Snapshot(name) => {
            let mut after = before;
            after.snapshots.insert((*name).to_owned(), (map.voxels.clone(), after.scan_number));
            State { voxels: map.voxels, ..after }
        }
        Act::Delete(name) => {
            let mut after = State { voxels: map.voxels, ..before };
            assert!(after.snapshots.remove(*name).is_some());
            after
        }
        Act::Revert(name) => {
            let (voxels, scan_number) = before.snapshots[*name].clone();
            State { voxels, scan_number, ..before }
        }
    }
}

fn act(disk: &FaultyDisk, act: &Act) -> Result<()> {
    match act {
        Act::Scans(numbers) => {
            let mut mapper = match OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), config()) {
                Err(Error::NoMap { .. }) => {
                    OutOfCoreTileMapper::create(MapPath::on(disk.shared(), map()), config())
                }
                opened => opened,
            }?;
            for number in numbers.clone() {
                mapper.insert_scan(&scan(number))?;
            }
            mapper.flush()
        }
        Act::Remove(every) => {
            let mut store = TileStore::open(disk.shared(), map())?;
            for tile in store.tiles().iter().filter(|tile| is_removed(*every, *tile)).collect::<Vec<_>>() {
                store.remove(tile)?;
            }
            store.commit(store.metadata().clone(), store.commits().scan_number)
        }
        Act::Snapshot(of) => snapshot(MapPath::on(disk.shared(), map()), &name(of)),
        Act::Delete(of) => delete_snapshot(MapPath::on(disk.shared(), map()), &name(of)),
        Act::Revert(to) => revert(MapPath::on(disk.shared(), map()), &name(to), None, |_, _| ()).map(drop),
    }
}

/// Tiles go and come again, and at the end all of them go.
fn removals() -> Life {
    Life::new(vec![
        Act::Scans(0..3),
        Act::Remove(2),
        Act::Scans(3..5),
        Act::Remove(3),
        Act::Scans(0..1),
        Act::Remove(1),
    ])
}

/// Snapshots that share tiles, of tiles that go, and again; reverts to each; and none at the end.
fn snapshots() -> Life {
    Life::new(vec![
        Act::Scans(0..2),
        Act::Snapshot("a"),
        Act::Scans(2..3),
        Act::Snapshot("b"),
        Act::Remove(2),
        Act::Scans(3..4),
        Act::Revert("a"),
        Act::Scans(4..5),
        Act::Delete("a"),
        Act::Snapshot("c"),
        Act::Revert("b"),
        Act::Delete("b"),
        Act::Scans(5..6),
        Act::Delete("c"),
        // Nothing that it sees has changed until it is gone.
        Act::Snapshot("d"),
        Act::Delete("d"),
        Act::Scans(6..8),
    ])
}

fn every_operation_fails(life: &Life, disk: impl Fn(Fault) -> FaultyDisk) {
    let undisturbed = disk(Fault::None);
    life.live(&undisturbed, 0).unwrap();
    life.check_end(&undisturbed, "undisturbed");
    println!("{} operations", undisturbed.operations());
    for at in some_of(0..undisturbed.operations(), 4) {
        let disk = disk(Fault::Fails(at));
        if let Err((number, _)) = life.live(&disk, 0) {
            let left = disk.after_kill();
            life.check_after_crash(&left, number, &format!("operation {at} fails"));
        }
    }
}

fn the_power_goes(life: &Life, disk: impl Fn(Fault) -> FaultyDisk) {
    let undisturbed = disk(Fault::None);
    life.live(&undisturbed, 0).unwrap();
    println!("{} changes", undisturbed.changes());
    for at in some_of(0..undisturbed.changes(), 6) {
        let disk = disk(Fault::Crashes(at));
        let number = life.live_until_crash(&disk, 0);
        let shuffled = (0..3).map(|seed| Unsynced::Shuffled(31 * at + seed));
        for unsynced in shuffled.chain([Unsynced::Dropped, Unsynced::Kept]) {
            let left = disk.after_crash(unsynced);
            life.check_after_crash(&left, number, &format!("crash at {at}, {unsynced:?}"));
        }
    }
}

fn the_power_goes_after_a_kill(life: &Life) {
    for at in some_of(0..life.undisturbed().changes(), 8) {
        let disk = FaultyDisk::new(Fault::Crashes(at));
        let number = life.live_until_crash(&disk, 0);
        for again in [0, 1, 2, 3, 5, at % 17, 7 + at % 29] {
            let killed = disk.after_kill();
            let from = life.state_of(&killed, &[number, number + 1], "killed");
            killed.set_fault(Fault::Crashes(again));
            let lived = life.live(&killed, from);
            if !killed.has_crashed() {
                continue;
            }
            let reached = lived.map_or_else(|(number, _)| number, |()| life.acts.len() - 1);
            let mut among = vec![reached, reached + 1];
            if reached == from {
                // What the killed process could not make durable, nobody else may have had the time to.
                among.extend([number, number + 1]);
            }
            let left = killed.after_crash(Unsynced::Shuffled(again));
            life.check_among(&left, &among, &format!("killed at {at}, crash {again} later"));
        }
    }
}

#[test]
fn an_operation_of_a_removal_fails_and_the_next_attempt_goes() {
    every_operation_fails(&removals(), FaultyDisk::new);
}

#[test]
fn the_power_goes_at_every_change_of_removals() {
    the_power_goes(&removals(), FaultyDisk::new);
}

#[test]
fn the_power_goes_some_time_after_a_kill_among_removals() {
    the_power_goes_after_a_kill(&removals());
}

#[test]
fn an_operation_of_a_snapshot_fails_and_the_next_attempt_goes() {
    every_operation_fails(&snapshots(), FaultyDisk::new);
    every_operation_fails(&snapshots(), |fault| FaultyDisk::new(fault).without_links());
}

#[test]
fn the_power_goes_at_every_change_of_snapshots() {
    the_power_goes(&snapshots(), FaultyDisk::new);
}

#[test]
fn the_power_goes_at_every_change_of_snapshots_where_files_have_one_name() {
    the_power_goes(&snapshots(), |fault| FaultyDisk::new(fault).without_links());
}

#[test]
fn the_power_goes_some_time_after_a_kill_among_snapshots() {
    the_power_goes_after_a_kill(&snapshots());
}

/// A reader from before goes on seeing what was removed.
#[test]
fn a_reader_goes_on_seeing_removed_tiles() {
    let life = removals();
    let disk = FaultyDisk::new(Fault::None);
    for (number, action) in life.acts.iter().enumerate() {
        let reader = MapReader::open(MapPath::on(disk.shared(), map()), 0);
        let digest = reader.as_ref().ok().map(|reader| reader.digest().unwrap());
        act(&disk, action).unwrap();
        if let Ok(reader) = reader {
            assert_eq!(voxels_of(&reader), life.states[number].voxels, "a reader across act {number}");
            assert_eq!(reader.digest().ok(), digest);
        }
    }
}

/// What is staged and not committed leaves the map as it was.
#[test]
fn a_removal_counts_from_the_commit_on() {
    let life = removals();
    let disk = FaultyDisk::new(Fault::None);
    act(&disk, &life.acts[0]).unwrap();
    let mut store = TileStore::open(disk.shared(), map()).unwrap();
    let tiles: Vec<_> = store.tiles().iter().collect();
    for &tile in &tiles {
        store.remove(tile).unwrap();
        assert!(!store.tiles().contains(tile) && store.tables().open(tile).unwrap().is_none());
    }
    assert_eq!(store.tiles().iter().count(), 0);
    drop(store);
    assert_eq!(life.state_of(&disk, &[1], "not committed"), 1);
}
