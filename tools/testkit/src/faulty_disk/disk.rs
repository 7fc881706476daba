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

/// A disk in memory that fails or loses power at a chosen operation.
///
/// It separates what programs see from what is on the medium. The content of a file reaches the medium by a sync of the
/// file, a name by a sync of its folder. A rename reaches it completely or not at all.
#[derive(Clone, Debug)]
pub struct FaultyDisk {
    state: Arc<Mutex<State>>,
}

impl FaultyDisk {
    /// Creates an empty disk with the folder `/`.
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
            had_permanent_fault: matches!(fault, Fault::Breaks(_)),
            operations: 0,
            changes: 0,
            renames: 0,
            refused_names: BTreeSet::new(),
            has_space: true,
            has_links: true,
            crashed: false,
            broken: BTreeSet::new(),
            unreadable: BTreeMap::new(),
            opened: BTreeMap::new(),
            before_lock: None,
        };
        Self { state: Arc::new(Mutex::new(state)) }
    }

    /// Returns a handle to the same disk, in the form that a mapper takes.
    pub fn shared(&self) -> Arc<dyn Disk> {
        Arc::new(self.clone())
    }

    /// Number of operations so far.
    pub fn operations(&self) -> u64 {
        self.state().operations
    }

    /// Number of operations so far that changed the disk.
    pub fn changes(&self) -> u64 {
        self.state().changes
    }

    /// Number of renames so far.
    pub fn renames(&self) -> u64 {
        self.state().renames
    }

    /// Number of times that a file was opened for reading from its beginning.
    pub fn times_opened(&self, path: &Path) -> u64 {
        self.state().opened.get(path).copied().unwrap_or_default()
    }

    /// Calls `happens` once, before the next lock is taken, like a concurrent process.
    pub fn before_lock(&self, happens: impl FnOnce() + Send + 'static) {
        self.state().before_lock = Some(BeforeLock(Box::new(happens)));
    }

    /// Returns whether the power has failed.
    pub fn has_crashed(&self) -> bool {
        self.state().crashed
    }

    /// Returns the same disk without support for hard links.
    pub fn without_links(self) -> Self {
        self.state().has_links = false;
        self
    }

    /// Ends all faults except unreadable bytes, as if space was freed on a full disk, or the disk was replaced by a
    /// copy.
    pub fn make_room(&self) {
        let mut state = self.state();
        (state.has_space, state.fault) = (true, Fault::None);
        state.broken.clear();
        state.refused_names.clear();
    }

    /// Makes every operation on a file or folder fail.
    pub fn break_path(&self, path: &Path) {
        self.state().broken.insert(path.to_owned());
    }

    /// Makes the content of a file unreadable; the file can still be renamed, replaced and removed.
    pub fn make_unreadable(&self, path: &Path) {
        self.make_bytes_unreadable(path, 0..usize::MAX);
    }

    /// Makes some bytes of a file unreadable, like a bad sector.
    pub fn make_bytes_unreadable(&self, path: &Path, bytes: Range<usize>) {
        self.state().unreadable.insert(path.to_owned(), bytes);
    }

    /// The file or folder that [`Fault::Breaks`] has broken.
    pub fn broken(&self) -> Option<PathBuf> {
        self.state().broken.first().cloned()
    }

    /// Undoes [`Fault::Breaks`], [`FaultyDisk::break_path`] and [`FaultyDisk::make_unreadable`].
    pub fn mend(&self) {
        let mut state = self.state();
        state.broken.clear();
        state.unreadable.clear();
        state.refused_names.clear();
        state.fault = Fault::None;
    }

    /// Returns whether the disk has had a permanent fault.
    pub fn had_permanent_fault(&self) -> bool {
        self.state().had_permanent_fault
    }

    /// Sets the fault, and resets the counters of operations.
    pub fn set_fault(&self, fault: Fault) {
        let mut state = self.state();
        (state.fault, state.operations, state.changes, state.renames) = (fault, 0, 0, 0);
        state.had_permanent_fault |= matches!(fault, Fault::Breaks(_));
    }

    /// The disk after a power failure and restart.
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
                // After a kill, the page cache is intact.
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

    /// Returns the disk as another process sees it after a kill of this one: no data is lost, and unsynced data remains
    /// unsynced.
    pub fn after_kill(&self) -> Self {
        let state = self.state();
        let mut disk = Self::of(state.names.clone(), state.contents.clone(), Fault::None);
        let next =
            Arc::get_mut(&mut disk.state).expect("it is not shared yet").get_mut().expect("no panic yet");
        next.names_on_medium = state.names_on_medium.clone();
        next.unsynced_names = state.unsynced_names.clone();
        next.next_inode = state.next_inode;
        next.has_links = state.has_links;
        for content in next.contents.values_mut() {
            (content.readers, content.locked) = (0, false);
        }
        disk
    }

    /// Returns a copy of the disk on which all data has reached the medium.
    pub fn copy(&self) -> Self {
        self.after_crash(Unsynced::Kept)
    }

    /// All files with their bytes, in order.
    pub fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let state = self.state();
        let files = state.names.iter().filter_map(|(path, entry)| match entry {
            Entry::File(inode) => Some((path.clone(), state.contents[inode].seen.clone())),
            Entry::Folder => None,
        });
        files.collect()
    }

    /// Writes a file, at once on the medium; its folder must exist.
    pub fn put(&self, path: &Path, bytes: &[u8]) {
        let mut state = self.state();
        let inode = state.new_inode();
        let content = Content { seen: bytes.to_vec(), on_medium: bytes.to_vec(), ..Content::default() };
        state.contents.insert(inode, content);
        state.names.insert(path.to_owned(), Entry::File(inode));
        state.names_on_medium.insert(path.to_owned(), Entry::File(inode));
    }

    /// Removes a file or folder, at once on the medium.
    pub fn take(&self, path: &Path) {
        let mut state = self.state();
        state.names.retain(|name, _| !name.starts_with(path));
        state.names_on_medium.retain(|name, _| !name.starts_with(path));
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}
