use super::bucket::{Bucket, StoredObject};
use super::pending::Pending;
use std::collections::VecDeque;
use std::path::{Component, Path, PathBuf};
use tempfile::TempDir;
use voxtile::store::{Disk, FsDisk};
use voxtile::{Error, Result};

/// Files below a URL, or the file at the URL, in a temporary folder. For programs that read files and not objects, such
/// as readers of scans. The files are removed when this is dropped.
#[derive(Debug)]
pub struct FetchedFiles {
    _folder: TempDir,
    path: PathBuf,
    files: u64,
    bytes: u64,
}

/// Maximum number of concurrent downloads.
const MAX_IN_FLIGHT: usize = 8;

impl FetchedFiles {
    /// Fetches the files into a new folder in `parent`. An object that changes during the download is an error.
    /// `is_stopped` is checked ten times a second; `progress` receives the bytes done and the bytes of all files. If
    /// the download fails or is stopped, all files are removed.
    ///
    /// # Errors
    ///
    /// No object at the URL; an object that is missing, truncated or changed, or whose name leads out of the folder; an
    /// error of the disk; [`Error::Stopped`].
    pub fn fetch(
        bucket: &Bucket,
        parent: &Path,
        is_stopped: &dyn Fn() -> bool,
        progress: impl FnMut(u64, u64),
    ) -> Result<Self> {
        let folder = tempfile::Builder::new().prefix("voxtile-scans-").tempdir_in(parent);
        let folder = folder.map_err(|error| Error::io(parent, "create a folder in", error))?;
        let objects = wait(bucket, bucket.objects_below(), is_stopped)?;
        let (files, bytes) = (objects.len() as u64, objects.iter().map(|object| object.bytes).sum());
        let path = match &*objects {
            [] => {
                return Err(Error::argument(
                    bucket.url(),
                    "there is nothing at this URL; check the URL and the read permissions",
                ));
            }
            // The URL is that of a file.
            [one] if one.is_url => folder.path().join(checked_name(bucket, &one.name)?),
            _ => folder.path().to_owned(),
        };
        let in_flight = VecDeque::new();
        let mut fetching = Fetching { bucket, is_stopped, progress, in_flight, done: 0, bytes };
        let fetched = fetching.all(objects, folder.path());
        // End all writes into the folder before it is removed.
        fetching.in_flight.into_iter().for_each(|(_, pending)| pending.abort());
        fetched?;
        Ok(Self { _folder: folder, path, files, bytes })
    }

    /// Returns the path of the folder, or of the single file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of files.
    pub fn files(&self) -> u64 {
        self.files
    }

    /// Returns the total size of the files, in bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// Downloads in progress.
struct Fetching<'a, P> {
    bucket: &'a Bucket,
    is_stopped: &'a dyn Fn() -> bool,
    progress: P,
    /// Downloads in order, each with its size in bytes.
    in_flight: VecDeque<(u64, Pending<()>)>,
    done: u64,
    bytes: u64,
}

impl<P: FnMut(u64, u64)> Fetching<'_, P> {
    fn all(&mut self, objects: Vec<StoredObject>, folder: &Path) -> Result<()> {
        for object in objects {
            if self.in_flight.len() == MAX_IN_FLIGHT {
                self.finish_first()?;
            }
            let to = folder.join(checked_name(self.bucket, &object.name)?);
            make_folders(folder, &to)?;
            self.in_flight.push_back((object.bytes, self.bucket.fetch_file(object, to)));
        }
        while !self.in_flight.is_empty() {
            self.finish_first()?;
        }
        Ok(())
    }

    fn finish_first(&mut self) -> Result<()> {
        let Some((bytes, pending)) = self.in_flight.pop_front() else { return Ok(()) };
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

/// Creates the folders between a folder and a file in it.
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

/// Returns the name of an object as a relative path inside a folder.
fn checked_name<'a>(bucket: &Bucket, object: &'a str) -> Result<&'a Path> {
    let path = Path::new(object);
    let is_inside = path.components().all(|part| matches!(part, Component::Normal(_)));
    if is_inside && path.components().next().is_some() {
        return Ok(path);
    }
    Err(Error::argument(
        bucket.url(),
        format!("object {object:?} has a name that is not a path inside a folder"),
    ))
}
