use crate::random_scans::Random;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io::{self, Cursor, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};
use voxtile::store::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, ReaderWatch, Scratch};

/// A disk in memory that fails or loses power at the operation it is told to.
///
/// It keeps what programs see apart from what is on the medium. A file's content gets there by a sync of the file, a
/// name by a sync of its folder; a rename gets there as a whole or not at all.
#[derive(Clone, Debug)]
pub struct FaultyDisk {
    state: Arc<Mutex<State>>,
}

/// What goes wrong, and at which operation, counted from 0. All but `Fails` count only operations that change
/// something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    None,
    /// The operation fails; a write has written half.
    Fails(u64),
    /// The operation fails, and from then on every operation on the same file or folder, until [`FaultyDisk::mend`]:
    /// what a disk does with sectors that it cannot read or write.
    Breaks(u64),
    /// The change fails; and a sync that fails leaves the file as it was on the medium, while later syncs of the same
    /// bytes report success, as Linux does.
    LosesSync(u64),
    /// The same, and the process is killed before it can do anything about it: every later operation fails.
    LosesSyncAndDies(u64),
    /// From this change on there is no room for anything new, until [`FaultyDisk::make_room`].
    IsFull(u64),
    /// From this change on only reading works, until [`FaultyDisk::make_room`].
    IsReadOnly(u64),
    /// The power goes at this change; every later operation fails.
    Crashes(u64),
}

/// What is on the medium after a crash, beside what was synced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unsynced {
    /// Nothing.
    Dropped,
    /// Everything, as after a kill.
    Kept,
    /// Some names and some blocks, whatever their order was.
    Shuffled(u64),
}

type Inode = usize;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Entry {
    Folder,
    File(Inode),
}

#[derive(Clone, Debug, Default)]
struct Content {
    seen: Vec<u8>,
    on_medium: Vec<u8>,
    /// Whether `seen` counts as synced although it never came to the medium.
    lost: bool,
    readers: usize,
    locked: bool,
}

#[derive(Clone, Debug)]
enum NameChange {
    Put(PathBuf, Entry),
    Remove(PathBuf),
    /// And with it the files that were in it on the medium or on the way there: another folder may get its name.
    RemoveFolder(PathBuf, Vec<Inode>),
    Rename(PathBuf, PathBuf),
}

type Names = BTreeMap<PathBuf, Entry>;

impl NameChange {
    /// A folder around the names has got another name.
    fn follow(&mut self, from: &Path, to: &Path) {
        let follow = |name: &mut PathBuf| {
            if let Ok(rest) = name.strip_prefix(from)
                && rest != Path::new("")
            {
                *name = to.join(rest);
            }
        };
        match self {
            Self::Put(name, _) | Self::Remove(name) | Self::RemoveFolder(name, _) => follow(name),
            Self::Rename(old, new) => {
                follow(old);
                follow(new);
            }
        }
    }
}

#[derive(Debug)]
struct State {
    contents: HashMap<Inode, Content>,
    names: Names,
    names_on_medium: Names,
    unsynced_names: Vec<NameChange>,
    next_inode: Inode,
    fault: Fault,
    /// Whether that was one that stays.
    stays: bool,
    operations: u64,
    changes: u64,
    has_room: bool,
    has_links: bool,
    crashed: bool,
    /// Files and folders that every operation fails on.
    broken: BTreeSet<PathBuf>,
    /// Files of whose content some bytes cannot be read.
    unreadable: BTreeMap<PathBuf, Range<usize>>,
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
            has_room: true,
            has_links: true,
            crashed: false,
            broken: BTreeSet::new(),
            unreadable: BTreeMap::new(),
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
        state.fault = Fault::None;
    }

    /// Whether the disk was made with a fault that stays.
    pub fn had_a_fault_that_stays(&self) -> bool {
        self.state().stays
    }

    /// What fails from now on; operations are counted anew.
    pub fn set_fault(&self, fault: Fault) {
        let mut state = self.state();
        (state.fault, state.operations, state.changes) = (fault, 0, 0);
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
        changes.iter().for_each(|change| apply(&mut names, change));
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
                Unsynced::Shuffled(_) => mix(content, &mut random),
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

    fn reader(&self, path: &Path) -> io::Result<Reader> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        let inode = state.file(path)?;
        let bytes = state.content(inode).seen.clone();
        Ok(Reader { disk: self.clone(), path: path.to_owned(), bytes, at: 0, shared: None })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

/// EIO.
fn medium_error() -> io::Error {
    io::Error::from_raw_os_error(5)
}

/// Blocks of what was written and not synced, some there and some not, up to a length that is there or not.
fn mix(content: &Content, random: &mut Random) -> Vec<u8> {
    const BLOCK: usize = 512;
    let (old, new) = (&content.on_medium, &content.seen);
    match random.below(3) {
        0 => return old.clone(),
        1 => return new.clone(),
        _ => {}
    }
    let length = if random.below(2) == 0 { old.len() } else { new.len() };
    let mut bytes = old.clone();
    bytes.resize(length, 0);
    for start in (0..length.min(new.len())).step_by(BLOCK) {
        let end = (start + BLOCK).min(length).min(new.len());
        if random.below(2) == 0 {
            bytes[start..end].copy_from_slice(&new[start..end]);
        }
    }
    bytes
}

fn is_one_of(name: &Path, entry: &Entry, folder: &Path, files: &[Inode]) -> bool {
    name.starts_with(folder) && matches!(entry, Entry::File(inode) if files.contains(inode))
}

fn puts_one_of(change: &NameChange, folder: &Path, files: &[Inode]) -> bool {
    matches!(change, NameChange::Put(name, entry) if is_one_of(name, entry, folder, files))
}

fn apply(names: &mut Names, change: &NameChange) {
    match change {
        NameChange::Put(path, entry) => {
            names.insert(path.clone(), *entry);
        }
        NameChange::Remove(path) => {
            names.remove(path);
        }
        NameChange::RemoveFolder(path, gone) => {
            names.remove(path);
            names.retain(|name, entry| !is_one_of(name, entry, path, gone));
        }
        NameChange::Rename(from, to) => {
            let moved: Vec<_> = names.keys().filter(|path| path.starts_with(from)).cloned().collect();
            for path in moved {
                let entry = names.remove(&path).expect("a name from the list");
                let rest = path.strip_prefix(from).expect("a name below");
                names.insert(if rest.as_os_str().is_empty() { to.clone() } else { to.join(rest) }, entry);
            }
        }
    }
}

/// What an operation does, as far as faults go.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Reads,
    Changes,
    NeedsRoom,
}

enum Verdict {
    Goes,
    Fails(io::Error),
}

impl State {
    fn new_inode(&mut self) -> Inode {
        self.next_inode += 1;
        self.next_inode - 1
    }

    fn operation(&mut self, kind: Kind, path: &Path) -> Verdict {
        let number = self.operations;
        let change = self.changes;
        self.operations += 1;
        self.changes += u64::from(kind != Kind::Reads);
        let error = |kind: io::ErrorKind| Verdict::Fails(kind.into());
        match self.fault {
            _ if self.crashed => Verdict::Fails(io::Error::other("the power is off, or the process dead")),
            Fault::Crashes(at) if change == at && kind != Kind::Reads => {
                self.crashed = true;
                Verdict::Fails(io::Error::other("the power is off"))
            }
            _ if self.broken.contains(path) => Verdict::Fails(medium_error()),
            Fault::Breaks(at) if number == at => {
                self.broken.insert(path.to_owned());
                Verdict::Fails(medium_error())
            }
            Fault::Fails(at) if number == at => Verdict::Fails(io::Error::other("input/output error")),
            Fault::LosesSync(at) if change == at && kind != Kind::Reads => {
                Verdict::Fails(io::Error::other("input/output error"))
            }
            Fault::LosesSyncAndDies(at) if change == at && kind != Kind::Reads => {
                self.crashed = true;
                Verdict::Fails(io::Error::other("input/output error"))
            }
            Fault::IsFull(at) if change >= at && kind == Kind::NeedsRoom => {
                self.has_room = false;
                error(io::ErrorKind::StorageFull)
            }
            Fault::IsReadOnly(at) if change >= at && kind != Kind::Reads => {
                self.has_room = false;
                error(io::ErrorKind::ReadOnlyFilesystem)
            }
            _ => Verdict::Goes,
        }
    }

    fn attempt(&mut self, kind: Kind, path: &Path) -> io::Result<()> {
        match self.operation(kind, path) {
            Verdict::Goes => Ok(()),
            Verdict::Fails(error) => Err(error),
        }
    }

    fn file(&self, path: &Path) -> io::Result<Inode> {
        match self.names.get(path) {
            Some(Entry::File(inode)) => Ok(*inode),
            Some(Entry::Folder) => Err(io::ErrorKind::InvalidInput.into()),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn content(&mut self, inode: Inode) -> &mut Content {
        self.contents.get_mut(&inode).expect("contents outlive their names")
    }

    fn change_name(&mut self, change: NameChange) {
        apply(&mut self.names, &change);
        self.unsynced_names.push(change);
    }

    /// The file, made if missing.
    fn file_or_new(&mut self, path: &Path) -> io::Result<Inode> {
        match self.file(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let folder = path.parent().and_then(|folder| self.names.get(folder));
                if folder != Some(&Entry::Folder) {
                    return Err(io::ErrorKind::NotFound.into());
                }
                let inode = self.new_inode();
                self.contents.insert(inode, Content::default());
                self.change_name(NameChange::Put(path.to_owned(), Entry::File(inode)));
                Ok(inode)
            }
            found => found,
        }
    }

    fn sync(&mut self, inode: Inode, path: &Path) -> io::Result<()> {
        let loses =
            matches!(self.fault, Fault::LosesSync(at) | Fault::LosesSyncAndDies(at) if at == self.changes);
        match self.operation(Kind::Changes, path) {
            Verdict::Goes => {
                let content = self.content(inode);
                if !content.lost {
                    content.on_medium = content.seen.clone();
                }
                Ok(())
            }
            Verdict::Fails(error) => {
                self.content(inode).lost |= loses;
                Err(error)
            }
        }
    }
}

struct Reader {
    disk: FaultyDisk,
    path: PathBuf,
    bytes: Vec<u8>,
    at: usize,
    shared: Option<Inode>,
}

struct Writer {
    disk: FaultyDisk,
    path: PathBuf,
    inode: Inode,
}

struct Watch {
    disk: FaultyDisk,
    inode: Inode,
}

struct Locked {
    disk: FaultyDisk,
    inode: Inode,
    path: PathBuf,
}

impl DiskLock for Locked {
    fn is_in_place(&self) -> io::Result<bool> {
        let mut state = self.disk.state();
        state.attempt(Kind::Reads, &self.path)?;
        // An unfinished map that has got its name has taken the file along.
        Ok(state.names.get(&self.path) == Some(&Entry::File(self.inode)))
    }
}

impl Read for Reader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut state = self.disk.state();
        state.attempt(Kind::Reads, &self.path)?;
        let bad = state.unreadable.get(&self.path).cloned().unwrap_or_default();
        drop(state);
        if bad.contains(&self.at) {
            return Err(medium_error());
        }
        let end = if self.at < bad.start { bad.start.min(self.bytes.len()) } else { self.bytes.len() };
        let count = (&self.bytes[self.at..end]).read(buffer)?;
        self.at += count;
        Ok(count)
    }
}

impl DiskRead for Reader {
    fn file_bytes(&self) -> u64 {
        self.bytes.len() as u64
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        if let Some(inode) = self.shared {
            self.disk.state().content(inode).readers -= 1;
        }
    }
}

impl Write for Writer {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let mut state = self.disk.state();
        let verdict = state.operation(Kind::NeedsRoom, &self.path);
        let content = state.content(self.inode);
        // What is written anew is to be synced anew.
        content.lost = false;
        match verdict {
            Verdict::Goes => {
                content.seen.extend_from_slice(buffer);
                Ok(buffer.len())
            }
            Verdict::Fails(error) => {
                content.seen.extend_from_slice(&buffer[..buffer.len() / 2]);
                Err(error)
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl DiskWrite for Writer {
    fn sync(&mut self) -> io::Result<()> {
        self.disk.state().sync(self.inode, &self.path)
    }
}

impl ReaderWatch for Watch {
    fn has_readers(&self) -> bool {
        self.disk.state().content(self.inode).readers > 0
    }
}

impl Drop for Locked {
    fn drop(&mut self) {
        self.disk.state().content(self.inode).locked = false;
    }
}

/// A file without a name: no crash leaves anything of it.
struct ScratchFile {
    disk: FaultyDisk,
    folder: PathBuf,
    content: Cursor<Vec<u8>>,
}

impl Read for ScratchFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.disk.state().attempt(Kind::Reads, &self.folder)?;
        self.content.read(buffer)
    }
}

impl Write for ScratchFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.disk.state().attempt(Kind::NeedsRoom, &self.folder)?;
        self.content.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for ScratchFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.content.seek(to)
    }
}

impl Disk for FaultyDisk {
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        Ok(Box::new(self.reader(path)?))
    }

    fn open_at(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskRead>> {
        let has_bad_bytes = self.state().unreadable.contains_key(path);
        let mut input = self.reader(path)?;
        if has_bad_bytes {
            // What lies before is passed over.
            input.at = input.bytes.len().min(offset as usize);
        } else {
            io::copy(&mut input.by_ref().take(offset), &mut io::sink())?;
        }
        Ok(Box::new(input))
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        let inode = state.file(path)?;
        state.content(inode).readers += 1;
        let bytes = state.content(inode).seen.clone();
        Ok(Box::new(Reader { disk: self.clone(), path: path.to_owned(), bytes, at: 0, shared: Some(inode) }))
    }

    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        let inode = state.file(path)?;
        Ok(Box::new(Watch { disk: self.clone(), inode }))
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        let mut state = self.state();
        state.attempt(Kind::NeedsRoom, path)?;
        let inode = state.file_or_new(path)?;
        let is_linked = state.names.values().filter(|entry| **entry == Entry::File(inode)).count() > 1;
        if is_linked {
            state.change_name(NameChange::Remove(path.to_owned()));
        }
        let inode = state.file_or_new(path)?;
        state.unreadable.remove(path);
        let content = state.content(inode);
        content.seen.clear();
        content.lost = false;
        Ok(Box::new(Writer { disk: self.clone(), path: path.to_owned(), inode }))
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        let mut state = self.state();
        state.attempt(Kind::Changes, path)?;
        let inode = state.file(path)?;
        let content = state.content(inode);
        if (content.seen.len() as u64) < offset {
            return Err(io::Error::other("shorter than expected"));
        }
        if content.seen.len() as u64 != offset {
            content.seen.truncate(offset as usize);
            content.lost = false;
        }
        Ok(Box::new(Writer { disk: self.clone(), path: path.to_owned(), inode }))
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        let inode = state.file(path)?;
        state.sync(inode, path)
    }

    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::Changes, path)?;
        let is_in = |name: &Path| name.parent() == Some(path);
        let changes = std::mem::take(&mut state.unsynced_names);
        let is_synced = |change: &NameChange| match change {
            NameChange::Put(name, _) | NameChange::Remove(name) | NameChange::RemoveFolder(name, _) => {
                is_in(name)
            }
            NameChange::Rename(from, to) => is_in(from) || is_in(to),
        };
        let (mut synced, mut unsynced) = (Vec::new(), Vec::new());
        for change in changes {
            if !is_synced(&change) {
                unsynced.push(change);
                continue;
            }
            if let NameChange::RemoveFolder(folder, gone) = &change {
                unsynced.retain(|change| !puts_one_of(change, folder, gone));
            }
            synced.push(change);
        }
        state.unsynced_names = unsynced;
        for change in &synced {
            apply(&mut state.names_on_medium, change);
        }
        Ok(())
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut state = self.state();
        let path = if state.broken.contains(to) { to } else { from };
        state.attempt(Kind::Changes, path)?;
        let Some(entry) = state.names.get(from).copied() else { return Err(io::ErrorKind::NotFound.into()) };
        match (entry, state.names.get(to)) {
            (_, None) | (Entry::File(_), Some(Entry::File(_))) => {}
            _ => return Err(io::ErrorKind::AlreadyExists.into()),
        }
        state.unreadable.remove(to);
        if let Some(bytes) = state.unreadable.remove(from) {
            state.unreadable.insert(to.to_owned(), bytes);
        }
        if entry == Entry::Folder {
            // What is on its way to the medium in a folder is so under the folder's new name.
            state.unsynced_names.iter_mut().for_each(|change| change.follow(from, to));
        }
        state.change_name(NameChange::Rename(from.to_owned(), to.to_owned()));
        Ok(())
    }

    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>> {
        self.state().attempt(Kind::NeedsRoom, folder)?;
        let content = Cursor::new(Vec::new());
        Ok(Box::new(ScratchFile { disk: self.clone(), folder: folder.to_owned(), content }))
    }

    fn link(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::NeedsRoom, from)?;
        let inode = state.file(from)?;
        match state.names.contains_key(to) {
            _ if !state.has_links => return Err(io::ErrorKind::Unsupported.into()),
            true => return Err(io::ErrorKind::AlreadyExists.into()),
            false => state.change_name(NameChange::Put(to.to_owned(), Entry::File(inode))),
        }
        Ok(())
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::Changes, path)?;
        state.file(path)?;
        state.unreadable.remove(path);
        state.change_name(NameChange::Remove(path.to_owned()));
        Ok(())
    }

    fn create_folder(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::NeedsRoom, path)?;
        if state.names.contains_key(path) {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        state.change_name(NameChange::Put(path.to_owned(), Entry::Folder));
        Ok(())
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::Changes, path)?;
        if state.names.keys().any(|name| name.parent() == Some(path)) {
            return Err(io::ErrorKind::DirectoryNotEmpty.into());
        }
        let on_medium = state.names_on_medium.iter();
        let in_flight = state.unsynced_names.iter().filter_map(|change| match change {
            NameChange::Put(name, entry) => Some((name, entry)),
            _ => None,
        });
        let in_it = on_medium.chain(in_flight).filter(|(name, _)| name.starts_with(path));
        let files = in_it.filter_map(|(_, entry)| match entry {
            Entry::File(inode) => Some(*inode),
            Entry::Folder => None,
        });
        let change = NameChange::RemoveFolder(path.to_owned(), files.collect());
        state.change_name(change);
        Ok(())
    }

    fn list(&self, path: &Path) -> io::Result<Vec<String>> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        if state.names.get(path) != Some(&Entry::Folder) {
            return Err(io::ErrorKind::NotFound.into());
        }
        let names = state.names.keys().filter(|name| name.parent() == Some(path));
        Ok(names.map(|name| name.file_name().unwrap().to_str().unwrap().to_owned()).collect())
    }

    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        Ok(state.names.get(path).map(|entry| match entry {
            Entry::Folder => EntryKind::Folder,
            Entry::File(inode) => EntryKind::File(state.contents[inode].seen.len() as u64),
        }))
    }

    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>> {
        let mut state = self.state();
        let is_there = state.names.contains_key(path);
        state.attempt(if is_there { Kind::Changes } else { Kind::NeedsRoom }, path)?;
        let inode = state.file_or_new(path)?;
        let content = state.content(inode);
        if std::mem::replace(&mut content.locked, true) {
            return Ok(None);
        }
        Ok(Some(Box::new(Locked { disk: self.clone(), inode, path: path.to_owned() })))
    }

    fn pause(&self) {
        std::thread::yield_now();
    }
}
