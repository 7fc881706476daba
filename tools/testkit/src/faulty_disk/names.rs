use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Identifies a file, independent of its names.
pub(super) type Inode = usize;

/// File or folder behind a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Entry {
    Folder,
    File(Inode),
}

/// All files and folders.
pub(super) type Names = BTreeMap<PathBuf, Entry>;

/// A change of names, possibly not yet on the medium.
#[derive(Clone, Debug)]
pub(super) enum NameChange {
    Put(PathBuf, Entry),
    Remove(PathBuf),
    /// Removes a folder and the files that were in it. The files are listed, because another folder may get the same
    /// name before this change reaches the medium.
    RemoveFolder(PathBuf, Vec<Inode>),
    /// Renames a file. The file is listed: a file system writes it into the entry of the new name, whatever reached the
    /// medium of earlier changes of the old name.
    RenameFile(PathBuf, PathBuf, Inode),
    RenameFolder(PathBuf, PathBuf),
}

impl NameChange {
    /// Adjusts the names to a rename of a folder that contains them.
    pub(super) fn follow(&mut self, from: &Path, to: &Path) {
        let follow = |name: &mut PathBuf| {
            if let Ok(rest) = name.strip_prefix(from)
                && rest != Path::new("")
            {
                *name = to.join(rest);
            }
        };
        match self {
            Self::Put(name, _) | Self::Remove(name) | Self::RemoveFolder(name, _) => follow(name),
            Self::RenameFile(old, new, _) | Self::RenameFolder(old, new) => {
                follow(old);
                follow(new);
            }
        }
    }

    /// Applies the change.
    pub(super) fn apply(&self, names: &mut Names) {
        match self {
            Self::Put(path, entry) => {
                names.insert(path.clone(), *entry);
            }
            Self::Remove(path) => {
                names.remove(path);
            }
            Self::RemoveFolder(path, gone) => {
                names.remove(path);
                names.retain(|name, entry| !is_one_of(name, entry, path, gone));
            }
            Self::RenameFile(from, to, inode) => {
                names.remove(from);
                names.insert(to.clone(), Entry::File(*inode));
            }
            Self::RenameFolder(from, to) => {
                let moved: Vec<_> = names.keys().filter(|path| path.starts_with(from)).cloned().collect();
                for path in moved {
                    let entry = names.remove(&path).expect("a name from the list");
                    let rest = path.strip_prefix(from).expect("a name below");
                    names.insert(if rest.as_os_str().is_empty() { to.clone() } else { to.join(rest) }, entry);
                }
            }
        }
    }

    /// Returns what is left of the change after these files below a folder were removed with it.
    pub(super) fn without(self, folder: &Path, files: &[Inode]) -> Option<Self> {
        match self {
            Self::Put(name, entry) if is_one_of(&name, &entry, folder, files) => None,
            Self::RenameFile(from, to, inode) if is_one_of(&to, &Entry::File(inode), folder, files) => {
                Some(Self::Remove(from))
            }
            change => Some(change),
        }
    }
}

fn is_one_of(name: &Path, entry: &Entry, folder: &Path, files: &[Inode]) -> bool {
    name.starts_with(folder) && matches!(entry, Entry::File(inode) if files.contains(inode))
}
