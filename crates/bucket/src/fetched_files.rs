use super::bucket::{Bucket, StoredObject};
use super::pending::Pending;
use std::collections::VecDeque;
use std::path::{Component, Path, PathBuf};
use tempfile::TempDir;
use voxtile::store::{Disk, FsDisk};
use voxtile::{Error, Result};

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
const MAX_IN_FLIGHT: usize = 8;

impl FetchedFiles {
    /// Fetches them into a new folder in `parent`. An object that changes meanwhile is an error. `is_stopped` is asked
    /// ten times a second; `progress` hears of bytes done and of all bytes. Where it fails or is stopped, nothing stays.
    ///
    /// # Errors
    ///
    /// Nothing there; an object that is missing, cut or changed, or whose name leads out of the folder, named; a disk
    /// that refuses; [`Error::Stopped`].
    pub fn fetch(
        bucket: &Bucket,
        parent: &Path,
        is_stopped: &dyn Fn() -> bool,
        progress: impl FnMut(u64, u64),
    ) -> Result<Self> {
        let folder = tempfile::Builder::new().prefix("voxtile-scans-").tempdir_in(parent);
        let folder = folder.map_err(|error| Error::io(parent, "make a folder in", error))?;
        let objects = wait(bucket, bucket.objects_below(), is_stopped)?;
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
        let on_their_way = VecDeque::new();
        let mut fetching = Fetching { bucket, is_stopped, progress, on_their_way, done: 0, bytes };
        let fetched = fetching.all(objects, folder.path());
        // Nobody writes into the folder any more when it goes.
        fetching.on_their_way.into_iter().for_each(|(_, pending)| pending.give_up());
        fetched?;
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

/// Objects that are being fetched.
struct Fetching<'a, P> {
    bucket: &'a Bucket,
    is_stopped: &'a dyn Fn() -> bool,
    progress: P,
    /// With the bytes of each, in order.
    on_their_way: VecDeque<(u64, Pending<()>)>,
    done: u64,
    bytes: u64,
}

impl<P: FnMut(u64, u64)> Fetching<'_, P> {
    fn all(&mut self, objects: Vec<StoredObject>, folder: &Path) -> Result<()> {
        for object in objects {
            if self.on_their_way.len() == MAX_IN_FLIGHT {
                self.end_first()?;
            }
            let to = folder.join(checked_name(self.bucket, &object.name)?);
            make_folders(folder, &to)?;
            self.on_their_way.push_back((object.bytes, self.bucket.fetch_file(object, to)));
        }
        while !self.on_their_way.is_empty() {
            self.end_first()?;
        }
        Ok(())
    }

    fn end_first(&mut self) -> Result<()> {
        let Some((bytes, pending)) = self.on_their_way.pop_front() else { return Ok(()) };
        wait(self.bucket, pending, self.is_stopped)?;
        self.done += bytes;
        (self.progress)(self.done, self.bytes);
        Ok(())
    }
}

fn wait<T>(bucket: &Bucket, pending: Pending<T>, is_stopped: &dyn Fn() -> bool) -> Result<T> {
    let answer = pending.wait_unless(is_stopped).ok_or(Error::Stopped)?;
    answer.map_err(|error| Error::io(bucket.path(), "read", error))
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
