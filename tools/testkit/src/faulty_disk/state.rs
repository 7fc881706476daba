use super::content::Content;
use super::fault::Fault;
use super::names::{Entry, Inode, NameChange, Names};
use super::operation::{Kind, Verdict};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Content of the disk and its faults.
#[derive(Debug)]
pub(super) struct State {
    pub(super) contents: HashMap<Inode, Content>,
    pub(super) names: Names,
    pub(super) names_on_medium: Names,
    pub(super) unsynced_names: Vec<NameChange>,
    pub(super) next_inode: Inode,
    pub(super) fault: Fault,
    /// Whether a fault was permanent.
    pub(super) had_permanent_fault: bool,
    pub(super) operations: u64,
    pub(super) changes: u64,
    pub(super) renames: u64,
    /// Names to which renames fail.
    pub(super) refused_names: BTreeSet<PathBuf>,
    pub(super) has_space: bool,
    pub(super) has_links: bool,
    pub(super) crashed: bool,
    /// Files and folders on which every operation fails.
    pub(super) broken: BTreeSet<PathBuf>,
    /// Files with unreadable bytes.
    pub(super) unreadable: BTreeMap<PathBuf, Range<usize>>,
    /// Number of times each file was opened for reading from its beginning.
    pub(super) opened: BTreeMap<PathBuf, u64>,
    pub(super) before_lock: Option<BeforeLock>,
}

/// Called before the next lock is taken.
pub(super) struct BeforeLock(pub(super) Box<dyn FnOnce() + Send>);

impl fmt::Debug for BeforeLock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("BeforeLock")
    }
}

impl State {
    pub(super) fn new_inode(&mut self) -> Inode {
        self.next_inode += 1;
        self.next_inode - 1
    }

    pub(super) fn operation(&mut self, kind: Kind, path: &Path) -> Verdict {
        let number = self.operations;
        let change = self.changes;
        self.operations += 1;
        self.changes += u64::from(kind != Kind::Reads);
        let error = |kind: io::ErrorKind| Verdict::Fails(kind.into());
        match self.fault {
            _ if self.crashed => {
                Verdict::Fails(io::Error::other("the power is off or the process was killed"))
            }
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
            Fault::IsFull(at) if change >= at && kind == Kind::NeedsSpace => {
                self.has_space = false;
                error(io::ErrorKind::StorageFull)
            }
            Fault::IsReadOnly(at) if change >= at && kind != Kind::Reads => {
                self.has_space = false;
                error(io::ErrorKind::ReadOnlyFilesystem)
            }
            _ => Verdict::Succeeds,
        }
    }

    /// Fails the renames that [`Fault::RefusesRename`] selects.
    pub(super) fn attempt_rename(&mut self, to: &Path) -> io::Result<()> {
        if self.fault == Fault::RefusesRename(self.renames) {
            self.refused_names.insert(to.to_owned());
        }
        self.renames += 1;
        match self.refused_names.contains(to) {
            true => Err(io::Error::other("input/output error")),
            false => Ok(()),
        }
    }

    pub(super) fn attempt(&mut self, kind: Kind, path: &Path) -> io::Result<()> {
        match self.operation(kind, path) {
            Verdict::Succeeds => Ok(()),
            Verdict::Fails(error) => Err(error),
        }
    }

    pub(super) fn file(&self, path: &Path) -> io::Result<Inode> {
        match self.names.get(path) {
            Some(Entry::File(inode)) => Ok(*inode),
            Some(Entry::Folder) => Err(io::ErrorKind::InvalidInput.into()),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }

    pub(super) fn content(&mut self, inode: Inode) -> &mut Content {
        self.contents.get_mut(&inode).expect("contents outlive their names")
    }

    pub(super) fn change_name(&mut self, change: NameChange) {
        change.apply(&mut self.names);
        self.unsynced_names.push(change);
    }

    /// Returns the file, created if missing.
    pub(super) fn file_or_new(&mut self, path: &Path) -> io::Result<Inode> {
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

    pub(super) fn sync(&mut self, inode: Inode, path: &Path) -> io::Result<()> {
        let loses =
            matches!(self.fault, Fault::LosesSync(at) | Fault::LosesSyncAndDies(at) if at == self.changes);
        match self.operation(Kind::Changes, path) {
            Verdict::Succeeds => {
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

pub(super) fn medium_error() -> io::Error {
    io::Error::from_raw_os_error(5)
}
