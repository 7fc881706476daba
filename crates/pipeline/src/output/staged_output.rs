use super::target::{TargetKind, check_target, folder_of, sync_folder};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use voxtile::store::{Disk, FsDisk, check_outside_of_maps};
use voxtile::{Error, Result};

/// A file or folder that a library writes by path, and its companion files. All are written to a temporary folder and
/// renamed when complete.
pub struct StagedOutput {
    target: PathBuf,
    staging: tempfile::TempDir,
}

impl StagedOutput {
    /// Creates the temporary folder.
    ///
    /// # Errors
    ///
    /// The target is a symbolic link, within a map or a folder that is not empty, or its folder is not writable.
    pub fn beside(target: &Path) -> Result<Self> {
        check_staged_target(target)?;
        let staging = tempfile::Builder::new().prefix(".voxtile-").tempdir_in(folder_of(target));
        let staging = staging.map_err(|error| Error::io(target, "create", error))?;
        Ok(Self { target: target.to_owned(), staging })
    }

    /// Creates the temporary folder for an output that must be a folder: absent, or empty.
    ///
    /// # Errors
    ///
    /// The target is a file, a symbolic link, inside a map, or not empty, or its parent folder is not writable.
    pub fn folder_beside(target: &Path) -> Result<Self> {
        match fs::symlink_metadata(target) {
            Ok(found) if !found.is_dir() => {
                let reason = "is a file or a link, but the output is a folder: choose another name, or remove it first";
                return Err(Error::argument(target.display().to_string(), reason));
            }
            _ => check_outside_of_maps(target)?,
        }
        Self::beside(target)
    }

    /// Returns the temporary folder.
    pub fn folder(&self) -> &Path {
        self.staging.path()
    }

    /// Returns the temporary path of the output itself.
    ///
    /// # Errors
    ///
    /// The target has no file name.
    pub fn path(&self) -> Result<PathBuf> {
        let name = self.target.file_name().ok_or_else(|| Error::argument("output", "has no name"))?;
        Ok(self.folder().join(name))
    }

    /// Syncs and renames everything, the output itself last. Returns the companion files.
    ///
    /// # Errors
    ///
    /// A name is taken by another file (nothing is changed then), or an I/O error occurs.
    pub fn finish(self) -> Result<Vec<PathBuf>> {
        let own = self.path()?;
        let folder = folder_of(&self.target);
        let companions = self.companions(&own)?;
        let name_of = |from: &Path| from.file_name().map_or(self.target.clone(), |name| folder.join(name));
        let mut names: Vec<PathBuf> = companions.iter().map(|from| name_of(from)).collect();
        // Check everything before the first rename.
        for (from, to) in companions.iter().zip(&names) {
            check_staged(from, to)?;
            self.check_companion(from, to)?;
        }
        names.push(name_of(&own));
        check_staged(&own, &self.target)?;
        for (from, to) in companions.iter().chain([&own]).zip(&names) {
            rename_over(from, to).map_err(|error| Error::io(to, "replace", error))?;
        }
        names.pop();
        sync_folder(folder).map_err(|error| Error::io(&self.target, "make durable", error))?;
        Ok(names)
    }

    /// Returns the companion files, sorted.
    fn companions(&self, own: &Path) -> Result<Vec<PathBuf>> {
        let list = fs::read_dir(self.folder()).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let list = list.map_err(|error| Error::io(self.folder(), "list", error))?;
        let mut companions: Vec<PathBuf> =
            list.iter().map(fs::DirEntry::path).filter(|path| path != own).collect();
        companions.sort_unstable();
        Ok(companions)
    }

    /// Checks that a companion file may be written. Companion files are not named by the user, so an existing one is
    /// replaced only if the output exists too (it then belongs to an earlier export) or if its content is the same.
    fn check_companion(&self, from: &Path, to: &Path) -> Result<()> {
        if self.target.exists() || !to.exists() || is_same(from, to)? {
            return Ok(());
        }
        let hint = "a companion file of the output needs this name: move or remove the existing file, or choose \
             another output";
        Err(Error::AlreadyExists { path: to.to_owned(), hint })
    }
}

/// Returns whether two files have the same content.
fn is_same(a: &Path, b: &Path) -> Result<bool> {
    let len = |path: &Path| {
        fs::metadata(path).map(|metadata| metadata.len()).map_err(|error| Error::io(path, "look at", error))
    };
    let content = |path: &Path| fs::read(path).map_err(|error| Error::io(path, "read", error));
    Ok(len(a)? == len(b)? && content(a)? == content(b)?)
}

/// Syncs a file or folder before it is renamed, and checks the destination.
fn check_staged(from: &Path, to: &Path) -> Result<()> {
    sync_all(from).map_err(|error| Error::io(from, "make durable", error))?;
    if to.is_dir() && !from.is_dir() {
        let reason = "is a folder, but a file needs its name: choose another output, or remove the folder";
        return Err(Error::argument(to.display().to_string(), reason));
    }
    check_staged_target(to)
}

fn rename_over(from: &Path, to: &Path) -> io::Result<()> {
    if from.is_dir() && to.is_dir() {
        fs::remove_dir(to)?;
    }
    fs::rename(from, to)
}

/// Checks that the target is absent, a regular file or an empty folder.
fn check_staged_target(target: &Path) -> Result<()> {
    if !target.is_dir() {
        return match check_target(target)? {
            TargetKind::File => Ok(()),
            TargetKind::Stream => {
                let reason = format!("{} is not a regular file", target.display());
                Err(Error::argument("output", reason))
            }
        };
    }
    let is_empty = std::fs::read_dir(target).is_ok_and(|mut entries| entries.next().is_none());
    if is_empty {
        return Ok(());
    }
    let reason = "is a folder that is not empty: choose another output, or remove it first";
    Err(Error::argument(target.display().to_string(), reason))
}

/// Syncs a file, or a folder with its files, many at once.
fn sync_all(path: &Path) -> io::Result<()> {
    let (mut files, mut folders) = (Vec::new(), Vec::new());
    list(path, &mut files, &mut folders)?;
    FsDisk.sync_all(&files, &folders).into_iter().flatten().collect()
}

fn list(path: &Path, files: &mut Vec<PathBuf>, folders: &mut Vec<PathBuf>) -> io::Result<()> {
    if !path.is_dir() {
        files.push(path.to_owned());
        return Ok(());
    }
    for entry in fs::read_dir(path)? {
        list(&entry?.path(), files, folders)?;
    }
    folders.push(path.to_owned());
    Ok(())
}
