use super::interruption::{Reached, Subject};
use std::fmt::Debug;
use std::path::PathBuf;
use testkit::faulty_disk::{Fault, FaultyDisk};
use voxtile::store::TileStore;
use voxtile::{Error, Result};

type Work = dyn Fn(&FaultyDisk) -> Result<()>;

/// One repeatable call that changes a map from state 0 to state 1, as observed by `look`.
pub struct Job<T> {
    start: FaultyDisk,
    map: PathBuf,
    work: Box<Work>,
    look: Box<dyn Fn(&FaultyDisk) -> T>,
    states: [T; 2],
    is_tidy: bool,
}

impl<T: PartialEq + Debug> Job<T> {
    pub fn new(
        start: FaultyDisk,
        map: impl Into<PathBuf>,
        work: impl Fn(&FaultyDisk) -> Result<()> + 'static,
        look: impl Fn(&FaultyDisk) -> T + 'static,
    ) -> Self {
        let done = start.copy();
        work(&done).unwrap();
        let states = [look(&start), look(&done)];
        assert_ne!(states[0], states[1]);
        Self { start, map: map.into(), work: Box::new(work), look: Box::new(look), states, is_tidy: false }
    }

    /// Also requires that a failed call removes the tiles that it has written.
    pub fn tidy(self) -> Self {
        Self { is_tidy: true, ..self }
    }
}

impl<T: PartialEq + Debug> Subject for Job<T> {
    fn disk(&self) -> FaultyDisk {
        self.start.copy()
    }

    fn run(&self, disk: &FaultyDisk, from: usize) -> Reached {
        let end = match (self.work)(disk) {
            // The map exists already. Opening it for writing completes the commit.
            Err(Error::AlreadyExists { .. }) if from == 1 => {
                TileStore::open(disk.shared(), &self.map).map(drop)
            }
            end => end,
        };
        Reached { states: if end.is_ok() { vec![1] } else { vec![0, 1] }, is_early: end.is_err(), end }
    }

    fn find(&self, disk: &FaultyDisk, among: &[usize], what: &str) -> usize {
        let seen = (self.look)(disk);
        let found = among.iter().copied().find(|&number| self.states[number] == seen);
        found.unwrap_or_else(|| panic!("{what}: {seen:?} is not one of the states {among:?}"))
    }

    fn check_refused(&self, disk: &FaultyDisk, fault: Fault) {
        let is_full = matches!(fault, Fault::IsFull(_));
        let was_there = self.start.files();
        let is_unused = |path: &PathBuf| {
            let text = path.to_string_lossy();
            let is_new_tile = text.contains("tile_") && !was_there.contains_key(path);
            text.contains(".unfinished") || (is_full && self.is_tidy && is_new_tile)
        };
        if is_full || matches!(fault, Fault::Fails(_)) {
            let left: Vec<_> = disk.files().into_keys().filter(is_unused).collect();
            assert!(left.is_empty(), "{fault:?}: {left:?}");
        }
    }

    fn check_end(&self, disk: &FaultyDisk, what: &str) {
        self.find(disk, &[1], what);
        let is_left = |path: &PathBuf| {
            let text = path.to_string_lossy();
            text.ends_with(".next") || text.contains("unfinished")
        };
        let left: Vec<_> = disk.files().into_keys().filter(is_left).collect();
        assert!(left.is_empty(), "{what}: {left:?}");
    }
}
