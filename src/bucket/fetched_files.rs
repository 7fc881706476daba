use super::bucket::{Bucket, Pending};
use crate::error::{Error, Result};
use crate::store::{Disk, FsDisk};
use std::collections::VecDeque;
use std::path::{Component, Path, PathBuf};
use tempfile::TempDir;

/// The files below a URL, or the one that it names, in a temporary folder: for what reads files and no objects, such as
/// the scans of a drive. They go when this is dropped.
#[derive(Debug)]
pub struct FetchedFiles {
    _folder: TempDir,
    path: PathBuf,
    files: u64,
    bytes: u64,
}

/// Objects that are fetched at a time.
const MOST_IN_FLIGHT: usize = 8;

impl FetchedFiles {
    /// Fetches them into a new folder in `parent`. An object that changes meanwhile is an error. `progress` hears of
    /// bytes done and of all bytes.
    ///
    /// # Errors
    ///
    /// Nothing there; an object that is missing, cut or changed, or whose name leads out of the folder, named; a disk
    /// that refuses.
    pub fn fetch(bucket: &Bucket, parent: &Path, mut progress: impl FnMut(u64, u64)) -> Result<Self> {
        let failed = |error| Error::io(Path::new(bucket.url()), "read", error);
        let folder = tempfile::Builder::new().prefix("voxtile-scans-").tempdir_in(parent);
        let folder = folder.map_err(|error| Error::io(parent, "make a folder in", error))?;
        let objects = bucket.objects_below().map_err(failed)?;
        let (files, bytes) = (objects.len() as u64, objects.iter().map(|object| object.bytes).sum());
        let path = match &*objects {
            [] => {
                return Err(Error::argument(
                    bucket.url(),
                    "there is nothing; check the name, and what may be read",
                ));
            }
            // The URL of a file.
            [one] if one.is_url => folder.path().join(checked_name(bucket, &one.name)?),
            _ => folder.path().to_owned(),
        };
        let (mut done, mut on_their_way) = (0, VecDeque::<(u64, Pending<()>)>::new());
        let mut wait = |(fetched, pending): (u64, Pending<()>)| -> Result<()> {
            pending.wait().map_err(failed)?;
            done += fetched;
            progress(done, bytes);
            Ok(())
        };
        for object in objects {
            if on_their_way.len() == MOST_IN_FLIGHT
                && let Some(first) = on_their_way.pop_front()
            {
                wait(first)?;
            }
            let to = folder.path().join(checked_name(bucket, &object.name)?);
            make_folders(folder.path(), &to)?;
            on_their_way.push_back((object.bytes, bucket.fetch_file(object, to)));
        }
        on_their_way.into_iter().try_for_each(wait)?;
        Ok(Self { _folder: folder, path, files, bytes })
    }

    /// The folder, or the one file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many files there are.
    pub fn files(&self) -> u64 {
        self.files
    }

    /// Bytes of all of them.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// Makes the folders between a folder and a file in it.
fn make_folders(folder: &Path, file: &Path) -> Result<()> {
    let disk: &dyn Disk = &FsDisk;
    let between = file.ancestors().skip(1).take_while(|path| *path != folder);
    for path in between.collect::<Vec<_>>().into_iter().rev() {
        if disk.kind_at(path)?.is_none() {
            disk.create_folder(path).map_err(|error| Error::io(path, "create", error))?;
        }
    }
    Ok(())
}

/// The name of an object below the URL as a path that stays in a folder.
fn checked_name<'a>(bucket: &Bucket, object: &'a str) -> Result<&'a Path> {
    let path = Path::new(object);
    let is_inside = path.components().all(|part| matches!(part, Component::Normal(_)));
    if is_inside && path.components().next().is_some() {
        return Ok(path);
    }
    Err(Error::argument(bucket.url(), format!("object {object:?} has a name that is no path below a folder")))
}
