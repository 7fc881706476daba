use super::bucket::{StoredObject, refused};
use crate::store::{Disk, DiskWrite, FsDisk};
use futures_util::TryStreamExt;
use object_store::{GetOptions, GetRange, ObjectMeta, ObjectStore};
use std::io::{self, Write};
use std::path::Path;
use std::time::{Duration, Instant};

/// Bytes of a file that one request asks for. On a slow link that takes minutes and not hours, and what came before
/// it broke off need not come again.
const RANGE_BYTES: u64 = 16 << 20;

/// How often a request that brings nothing is made.
const REQUESTS: usize = 3;

/// What took longer to fail is not tried again: the store's client has done that.
const LATEST_RETRY: Duration = Duration::from_secs(10);

/// Fetches an object into a file, as it was when it was listed: a long one range by range.
///
/// # Errors
///
/// One of the kind `InvalidData` if it was changed meanwhile; a store or a disk that refuses.
pub(super) async fn fetch_file(store: &dyn ObjectStore, object: &StoredObject, to: &Path) -> io::Result<()> {
    let by_ranges = object.bytes > RANGE_BYTES && object.can_be_told_from_another();
    let mut fetch = FileFetch { store, object, to, out: create(to)?, bytes: 0, by_ranges };
    let (mut requests, mut since) = (0, Instant::now());
    loop {
        let before = fetch.bytes;
        let outcome = fetch.go_on().await;
        if fetch.by_ranges && fetch.bytes > before {
            (requests, since) = (0, Instant::now());
        }
        match outcome {
            Ok(()) if fetch.bytes == object.bytes => return fetch.out.flush().map_err(|error| on(to, error)),
            Ok(()) => {}
            Err(error) => {
                requests += 1;
                let may_pass = error.kind() == io::ErrorKind::Other;
                if !may_pass || requests >= REQUESTS || since.elapsed() > LATEST_RETRY {
                    return Err(error);
                }
            }
        }
    }
}

/// A file that is being fetched.
struct FileFetch<'a> {
    store: &'a dyn ObjectStore,
    object: &'a StoredObject,
    to: &'a Path,
    out: Box<dyn DiskWrite>,
    /// What is written, from the beginning.
    bytes: u64,
    by_ranges: bool,
}

impl FileFetch<'_> {
    /// Fetches the next range, or the whole. What came of a range before an error is kept.
    async fn go_on(&mut self) -> io::Result<()> {
        let key = &self.object.key;
        let end = match self.by_ranges {
            true => self.object.bytes.min(self.bytes + RANGE_BYTES),
            false => {
                self.begin_again()?;
                self.object.bytes
            }
        };
        let range = self.by_ranges.then_some(GetRange::Bounded(self.bytes..end));
        // A weak ETag matches nothing, by the rules of If-Match.
        let if_match = self.object.e_tag.clone().filter(|e_tag| !e_tag.starts_with("W/"));
        let options = GetOptions { range, if_match, ..GetOptions::default() };
        let found = match self.store.get_opts(key, options).await {
            Ok(found) => found,
            Err(object_store::Error::Precondition { .. }) => return Err(self.changed()),
            Err(error) if self.by_ranges && ignores_ranges(&error) => {
                self.by_ranges = false;
                return Ok(());
            }
            Err(error) => return Err(refused(key, &error)),
        };
        if !self.object.is_same(&found.meta) {
            return Err(self.changed());
        }
        let mut stream = found.into_stream();
        while let Some(chunk) = stream.try_next().await.map_err(|error| refused(key, &error))? {
            if chunk.len() as u64 > end - self.bytes {
                return Err(io::Error::other(format!("object {key}: more bytes came than were asked for")));
            }
            self.out.write_all(&chunk).map_err(|error| on(self.to, error))?;
            self.bytes += chunk.len() as u64;
        }
        if self.bytes == end {
            return Ok(());
        }
        let reason = format!("object {key}: {} bytes came, and it has {}", self.bytes, self.object.bytes);
        Err(io::Error::other(reason))
    }

    fn begin_again(&mut self) -> io::Result<()> {
        if self.bytes > 0 {
            self.out = create(self.to)?;
            self.bytes = 0;
        }
        Ok(())
    }

    fn changed(&self) -> io::Error {
        let reason = format!("object {}: it was changed while it was read; begin again", self.object.key);
        io::Error::new(io::ErrorKind::InvalidData, reason)
    }
}

impl StoredObject {
    /// Whether an answer tells if it is still this object.
    fn can_be_told_from_another(&self) -> bool {
        self.e_tag.is_some() || self.modified_s != 0
    }

    /// Whether an answer is of this object, as far as it tells.
    fn is_same(&self, found: &ObjectMeta) -> bool {
        // Some stores quote ETags in one answer and not in another.
        let bare = |e_tag: &str| e_tag.trim_start_matches("W/").trim_matches('"').to_owned();
        let is_as_marked = match (&self.e_tag, &found.e_tag) {
            (Some(listed), Some(found)) => bare(listed) == bare(found),
            _ => self.modified_s == 0 || self.modified_s == found.last_modified.timestamp(),
        };
        is_as_marked && self.bytes == found.size
    }
}

/// Whether a server has only whole files.
fn ignores_ranges(error: &object_store::Error) -> bool {
    // The stores' clients do not all have a variant for it.
    matches!(error, object_store::Error::NotSupported { .. })
        || super::bucket::told(error).contains("non-partial response")
}

fn create(path: &Path) -> io::Result<Box<dyn DiskWrite>> {
    FsDisk.create(path).map_err(|error| on(path, error))
}

fn on(path: &Path, error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}
