use super::bucket::StoredObject;
use super::content::ignores_ranges;
use super::request::{Failure, Request};
use futures_util::TryStreamExt;
use object_store::{GetOptions, GetRange, ObjectMeta, ObjectStore};
use std::io::{self, Write};
use std::path::Path;
use voxtile::store::{Disk, DiskWrite, FsDisk};

/// Bytes of a file per request. On a slow link, a request takes minutes and not hours.
const RANGE_BYTES: u64 = 16 << 20;

/// Fetches an object into a file, in the version that was listed. A large object is fetched range by range. After a
/// broken connection, the download continues at the byte reached if the answer identifies the version of the object.
///
/// # Errors
///
/// An error of kind `InvalidData` if the object has changed; a store that refuses the request; an error of the disk.
pub(super) async fn fetch_file(
    request: &Request,
    store: &dyn ObjectStore,
    object: &StoredObject,
    to: &Path,
) -> io::Result<()> {
    let by_ranges = object.has_identity();
    let mut fetch = FileFetch { request, store, object, to, out: create(to)?, bytes: 0, by_ranges };
    while fetch.bytes < object.bytes {
        if !fetch.by_ranges {
            fetch.restart()?;
        }
        match request.attempt(fetch.bytes, fetch.fetch_next()).await {
            Ok(()) => {}
            Err(Failure::Broken(error) | Failure::Refused(error))
                if fetch.by_ranges && ignores_ranges(&error) =>
            {
                fetch.by_ranges = false;
            }
            Err(failure) => request.retry_after(failure).await?,
        }
    }
    fetch.out.flush().map_err(|error| with_path(to, error))
}

/// Download of a file.
struct FileFetch<'a> {
    request: &'a Request,
    store: &'a dyn ObjectStore,
    object: &'a StoredObject,
    to: &'a Path,
    out: Box<dyn DiskWrite>,
    /// Number of bytes written so far.
    bytes: u64,
    by_ranges: bool,
}

impl FileFetch<'_> {
    /// Fetches the next range, or the whole object. The bytes received before an error are kept.
    async fn fetch_next(&mut self) -> Result<(), Failure> {
        let key = &self.object.key;
        let end = match self.by_ranges {
            true => self.object.bytes.min(self.bytes + RANGE_BYTES),
            false => self.object.bytes,
        };
        // Request the whole object without a range, for servers without ranges.
        let is_whole = self.bytes == 0 && end == self.object.bytes;
        let range = (!is_whole).then_some(GetRange::Bounded(self.bytes..end));
        // A weak ETag never matches in If-Match.
        let if_match = self.object.e_tag.clone().filter(|e_tag| !e_tag.starts_with("W/"));
        let options = GetOptions { range, if_match, ..GetOptions::default() };
        let found = match self.store.get_opts(key, options).await {
            Err(object_store::Error::Precondition { .. }) => return Err(self.changed()),
            found => found?,
        };
        if !self.object.is_same(&found.meta) {
            return Err(self.changed());
        }
        let mut stream = found.into_stream();
        while let Some(chunk) = stream.try_next().await? {
            if chunk.len() as u64 > end - self.bytes {
                let reason = format!("object {key}: the server sent more bytes than requested");
                return Err(Failure::Fatal(io::Error::other(reason)));
            }
            self.out.write_all(&chunk).map_err(|error| Failure::Fatal(with_path(self.to, error)))?;
            self.bytes += chunk.len() as u64;
            self.request.add_bytes(chunk.len() as u64);
        }
        if self.bytes == end {
            return Ok(());
        }
        let reason = format!("received {} of {} bytes", self.bytes, self.object.bytes);
        Err(Failure::Broken(object_store::Error::Generic { store: "answer", source: reason.into() }))
    }

    fn restart(&mut self) -> io::Result<()> {
        if self.bytes > 0 {
            self.out = create(self.to)?;
            self.bytes = 0;
        }
        Ok(())
    }

    fn changed(&self) -> Failure {
        let reason = format!("object {}: it was changed while it was read; start again", self.object.key);
        Failure::Fatal(io::Error::new(io::ErrorKind::InvalidData, reason))
    }
}

impl StoredObject {
    /// Returns whether the store reports an ETag or a modification time, by which answers are checked to be of the same
    /// version.
    fn has_identity(&self) -> bool {
        self.e_tag.is_some() || self.modified_s != 0
    }

    /// Returns whether an answer is of this object and version, as far as the store reports it.
    fn is_same(&self, found: &ObjectMeta) -> bool {
        // Some stores quote ETags in one answer and not in another.
        let bare = |e_tag: &str| e_tag.trim_start_matches("W/").trim_matches('"').to_owned();
        let is_same_version = match (&self.e_tag, &found.e_tag) {
            (Some(listed), Some(found)) => bare(listed) == bare(found),
            _ => self.modified_s == 0 || self.modified_s == found.last_modified.timestamp(),
        };
        is_same_version && self.bytes == found.size
    }
}

fn create(path: &Path) -> io::Result<Box<dyn DiskWrite>> {
    FsDisk.create(path).map_err(|error| with_path(path, error))
}

fn with_path(path: &Path, error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}
