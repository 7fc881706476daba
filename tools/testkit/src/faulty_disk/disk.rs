use super::content::Content;
use super::fault::{Fault, Unsynced};
use super::names::{Entry, Inode, Names};
use super::state::{BeforeLock, State};
use crate::random_scans::Random;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};
use voxtile::store::Disk;

/// A disk in memory that fails or loses power at the operation it is told to.
///
/// It keeps what programs see apart from what is on the medium. A file's content gets there by a sync of the file, a
/// name by a sync of its folder; a rename gets there as a whole or not at all.
#[derive(Clone, Debug)]
pub struct FaultyDisk {
    state: Arc<Mutex<State>>,
}

impl FaultyDisk {
    /// An empty disk with a folder `/`.
    pub fn new(fault: Fault) -> Self {
        let names = Names::from([(PathBuf::from("/"), Entry::Folder)]);
        Self::of(names, HashMap::new(), fault)
    }

    fn of(names: Names, contents: HashMap<Inode, Content>, fault: Fault) -> Self {
        let next_inode = contents.keys().max().map_or(0, |inode| inode + 1);
        let state = State {
            contents,
            names_on_medium: names.clone(),
            names,
            unsynced_names: Vec::new(),
            next_inode,
            fault,
            stays: matches!(fault, Fault::Breaks(_)),
            operations: 0,
            changes: 0,
            renames: 0,
            refused_names: BTreeSet::new(),
            has_room: true,
            has_links: true,
            crashed: false,
            broken: BTreeSet::new(),
            unreadable: BTreeMap::new(),
            opened: BTreeMap::new(),
            before_lock: None,
        };
        Self { state: Arc::new(Mutex::new(state)) }
    }

    /// As the mapper takes it.
    pub fn shared(&self) -> Arc<dyn Disk> {
        Arc::new(self.clone())
    }

    /// Number of operations so far.
    pub fn operations(&self) -> u64 {
        self.state().operations
    }

    /// Number of operations so far that change something.
    pub fn changes(&self) -> u64 {
        self.state().changes
    }

    /// Number of renames so far.
    pub fn renames(&self) -> u64 {
        self.state().renames
    }

    /// How often a file was opened to be read from its beginning.
    pub fn times_opened(&self, path: &Path) -> u64 {
        self.state().opened.get(path).copied().unwrap_or_default()
    }

    /// Lets something happen once, before the next lock is taken: what another process does meanwhile.
    pub fn before_lock(&self, happens: impl FnOnce() + Send + 'static) {
        self.state().before_lock = Some(BeforeLock(Box::new(happens)));
    }

    /// Whether the power has gone.
    pub fn has_crashed(&self) -> bool {
        self.state().crashed
    }

    /// The same disk with a file system on which a file has one name only.
    pub fn without_links(self) -> Self {
        self.state().has_links = false;
        self
    }

    /// Ends a lack of room, or puts a good disk with the same bytes in place of one that refuses.
    pub fn make_room(&self) {
        let mut state = self.state();
        (state.has_room, state.fault) = (true, Fault::None);
        state.broken.clear();
        state.refused_names.clear();
    }

    /// Makes every operation on a file or folder fail.
    pub fn break_path(&self, path: &Path) {
        self.state().broken.insert(path.to_owned());
    }

    /// Makes the content of a file one that cannot be read; it can be renamed, replaced and removed.
    pub fn make_unreadable(&self, path: &Path) {
        self.make_bytes_unreadable(path, 0..usize::MAX);
    }

    /// Does so with some bytes of a file: a bad sector.
    pub fn make_bytes_unreadable(&self, path: &Path, bytes: Range<usize>) {
        self.state().unreadable.insert(path.to_owned(), bytes);
    }

    /// The file or folder that [`Fault::Breaks`] has hit.
    pub fn broken(&self) -> Option<PathBuf> {
        self.state().broken.first().cloned()
    }

    /// Ends what [`Fault::Breaks`], [`FaultyDisk::break_path`] and [`FaultyDisk::make_unreadable`] began.
    pub fn mend(&self) {
        let mut state = self.state();
        state.broken.clear();
        state.unreadable.clear();
        state.refused_names.clear();
        state.fault = Fault::None;
    }

    /// Whether the disk has had a fault that stays.
    pub fn had_a_fault_that_stays(&self) -> bool {
        self.state().stays
    }

    /// What fails from now on; operations are counted anew.
    pub fn set_fault(&self, fault: Fault) {
        let mut state = self.state();
        (state.fault, state.operations, state.changes, state.renames) = (fault, 0, 0, 0);
        state.stays |= matches!(fault, Fault::Breaks(_));
    }

    /// The disk as it is found when the power is back.
    pub fn after_crash(&self, unsynced: Unsynced) -> Self {
        let state = self.state();
        let mut names = state.names_on_medium.clone();
        let mut random = Random(match unsynced {
            Unsynced::Shuffled(seed) => seed,
            _ => 0,
        });
        let mut changes = state.unsynced_names.clone();
        match unsynced {
            Unsynced::Dropped => changes.clear(),
            Unsynced::Kept => {}
            Unsynced::Shuffled(_) => changes.retain(|_| random.below(2) == 0),
        }
        changes.iter().for_each(|change| change.apply(&mut names));
        let reachable = names.clone();
        names.retain(|path, _| path.ancestors().all(|folder| reachable.contains_key(folder)));
        let files = names.values().filter_map(|entry| match entry {
            Entry::File(inode) => Some(*inode),
            Entry::Folder => None,
        });
        let contents = files.map(|inode| {
            let content = &state.contents[&inode];
            let bytes = match unsynced {
                Unsynced::Dropped => content.on_medium.clone(),
                // After a kill the page cache is still there.
                Unsynced::Kept => content.seen.clone(),
                Unsynced::Shuffled(_) => content.mixed(&mut random),
            };
            (inode, Content { seen: bytes.clone(), on_medium: bytes, ..Content::default() })
        });
        let contents = contents.collect();
        let left = Self::of(names, contents, Fault::None);
        left.state().has_links = state.has_links;
        left
    }

    /// The same disk for another process, after the one before was killed: nothing is lost, and nothing more is on the
    /// medium.
    pub fn after_kill(&self) -> Self {
        let state = self.state();
        let mut disk = Self::of(state.names.clone(), state.contents.clone(), Fault::None);
        let next =
            Arc::get_mut(&mut disk.state).expect("nobody else has it").get_mut().expect("no panic yet");
        next.names_on_medium = state.names_on_medium.clone();
        next.unsynced_names = state.unsynced_names.clone();
        next.next_inode = state.next_inode;
        next.has_links = state.has_links;
        for content in next.contents.values_mut() {
            (content.readers, content.locked) = (0, false);
        }
        disk
    }

    /// A copy with everything on the medium that programs see.
    pub fn copy(&self) -> Self {
        self.after_crash(Unsynced::Kept)
    }

    /// Every file and its bytes, in order.
    pub fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let state = self.state();
        let files = state.names.iter().filter_map(|(path, entry)| match entry {
            Entry::File(inode) => Some((path.clone(), state.contents[inode].seen.clone())),
            Entry::Folder => None,
        });
        files.collect()
    }

    /// Puts a file in place, on the medium at once; its folder must exist.
    pub fn put(&self, path: &Path, bytes: &[u8]) {
        let mut state = self.state();
        let inode = state.new_inode();
        let content = Content { seen: bytes.to_vec(), on_medium: bytes.to_vec(), ..Content::default() };
        state.contents.insert(inode, content);
        state.names.insert(path.to_owned(), Entry::File(inode));
        state.names_on_medium.insert(path.to_owned(), Entry::File(inode));
    }

    /// Takes a file or folder away, on the medium at once.
    pub fn take(&self, path: &Path) {
        let mut state = self.state();
        state.names.retain(|name, _| !name.starts_with(path));
        state.names_on_medium.retain(|name, _| !name.starts_with(path));
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}
