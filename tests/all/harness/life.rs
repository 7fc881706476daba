use super::acts::{Act, perform};
use super::interruption::{Reached, Subject};
use super::map::{at, damage_in, map, open_or_create, replay, scans, snapshot_names};
use super::model::State;
use super::scans::{Taken, new_poses};
use std::collections::BTreeSet;
use std::path::PathBuf;
use testkit::faulty_disk::{Fault, FaultyDisk};
use voxtile::integrity::verify;
use voxtile::operations::{NewPoses, OnlineRemap, Remap};
use voxtile::store::{TileStore, tile_of_folder};
use voxtile::{MapConfig, MapReader, MapView, Mapper};

/// A sequence of acts, each in a process of its own, and the naive map after each of them.
pub struct Life {
    pub acts: Vec<Act>,
    pub states: Vec<State>,
    pub config: MapConfig,
    has_links: bool,
}

impl Life {
    pub fn new(config: MapConfig, acts: Vec<Act>) -> Self {
        let mut states = vec![State::default()];
        for act in &acts {
            states.push(states.last().unwrap().after(act, &config));
        }
        Self { acts, states, config, has_links: true }
    }

    /// The same on a file system without hard links.
    pub fn without_links(self) -> Self {
        Self { has_links: false, ..self }
    }

    /// An interrupted online remap leaves the map with the scans that were flushed during it. Inserts the remaining
    /// scans and repeats the remap.
    fn complete_online_remap(&self, disk: &FaultyDisk, number: usize, what: &str) {
        let (before, Some(Act::MoveOnline { seed, rest, meanwhile })) =
            (&self.states[number], self.acts.get(number))
        else {
            return;
        };
        for next in meanwhile.start + 1..=meanwhile.end {
            if before.after(&Act::Scans(meanwhile.start..next), &self.config).is_on(disk) {
                assert_eq!(damage_in(disk), BTreeSet::new(), "{what}");
                let poses = NewPoses::Moving(new_poses(&before.now.scans, *seed, *rest));
                let mut mapper = open_or_create(disk, &self.config).unwrap();
                let mut online =
                    OnlineRemap::begin(&scans(disk).unwrap(), &poses, &Remap::new(replay())).unwrap();
                (next..meanwhile.end).for_each(|seed| Taken::new(seed).insert_into(&mut mapper).unwrap());
                mapper.flush().unwrap();
                drop(mapper);
                online.follow(|_| ()).unwrap();
                online.finish().unwrap();
                return;
            }
        }
    }
}

/// State `n` is the state after `n` acts.
impl Subject for Life {
    fn disk(&self) -> FaultyDisk {
        let disk = FaultyDisk::new(Fault::None);
        if self.has_links { disk } else { disk.without_links() }
    }

    fn run(&self, disk: &FaultyDisk, from: usize) -> Reached {
        for number in from..self.acts.len() {
            let performed = perform(disk, &self.config, &self.states[number], &self.acts[number]);
            if performed.is_err() {
                let (states, is_early) = (vec![number, number + 1], number == from);
                return Reached { states, is_early, end: performed };
            }
        }
        Reached { states: vec![self.acts.len()], is_early: from == self.acts.len(), end: Ok(()) }
    }

    fn find(&self, disk: &FaultyDisk, among: &[usize], what: &str) -> usize {
        among.iter().for_each(|&number| self.complete_online_remap(disk, number, what));
        let found = among.iter().copied().find(|&number| self.states[number].is_on(disk));
        let found =
            found.unwrap_or_else(|| panic!("{what}: none of the states {among:?} of {:?}", self.acts));
        if found > 0 {
            assert_eq!(damage_in(disk), BTreeSet::new(), "{what}");
        }
        found
    }

    fn check_end(&self, disk: &FaultyDisk, what: &str) {
        OnlineRemap::remove_leftovers(at(disk)).unwrap();
        // Opening the map removes the leftovers of a crash.
        drop(TileStore::open(disk.shared(), map()).unwrap());
        assert!(self.states.last().unwrap().is_on(disk), "{what}: wrong final state");
        check_files(disk, what);
    }
}

/// Panics if the map is damaged, or if it has unneeded files.
pub fn check_files(disk: &FaultyDisk, what: &str) {
    let mut found = Vec::new();
    verify(at(disk), |finding| found.push(finding.clone()), |_, _| ()).unwrap();
    assert!(found.is_empty(), "{what}: {found:?}");
    let tiles = MapReader::open(at(disk), 0).unwrap().tile_indices();
    let is_of_map = |path: &PathBuf| {
        let folder = path.parent().and_then(|folder| folder.file_name()?.to_str()).unwrap();
        let is_of_tile = tile_of_folder(folder).is_none_or(|tile| tiles.binary_search(&tile).is_ok());
        path.starts_with(map()) && (is_of_tile || path.to_string_lossy().contains(".flush"))
    };
    let files = disk.files();
    let strays: Vec<_> = files.keys().filter(|path| !is_of_map(path)).collect();
    assert!(strays.is_empty(), "{what}: {strays:?}");
    let is_catalog = |path: &&PathBuf| path.to_string_lossy().contains("kept_scans/catalog");
    let catalogs = files.keys().filter(is_catalog).count();
    assert!(catalogs <= 1 + snapshot_names(disk).len(), "{what}: {catalogs} catalogs");
}
