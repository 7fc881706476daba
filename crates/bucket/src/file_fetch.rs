use super::bucket::StoredObject;
use super::content::ignores_ranges;
use super::request::{Failure, Request};
use futures_util::TryStreamExt;
use object_store::{GetOptions, GetRange, ObjectMeta, ObjectStore};
use std::io::{self, Write};
use std::path::Path;
use voxtile::store::{Disk, DiskWrite, FsDisk};

/// Bytes of a file that one request asks for. On a slow link that takes minutes and not hours, and what came before
/// it broke off need not come again.
const RANGE_BYTES: u64 = 16 << 20;

/// Fetches an object into a file, as it was when it was listed: a long one range by range. After a break it continues at
/// the byte reached, if the answer tells that it still is that object.
///
/// # Errors
///
/// One of the kind `InvalidData` if it was changed meanwhile; a store or a disk that refuses.
pub(super) async fn fetch_file(
    request: &Request,
    store: &dyn ObjectStore,
    object: &StoredObject,
    to: &Path,
) -> io::Result<()> {
    let by_ranges = object.can_be_told_from_another();
    let mut fetch = FileFetch { request, store, object, to, out: create(to)?, bytes: 0, by_ranges };
    while fetch.bytes < object.bytes {
        if !fetch.by_ranges {
            fetch.begin_again()?;
        }
        match request.attempt(fetch.bytes, fetch.go_on()).await {
            Ok(()) => {}
            Err(Failure::Broken(error) | Failure::Refused(error))
                if fetch.by_ranges && ignores_ranges(&error) =>
            {
                fetch.by_ranges = false;
            }
            Err(failure) => request.retry_after(failure).await?,
        }
    }
    fetch.out.flush().map_err(|error| on(to, error))
}

/// A file that is being fetched.
struct FileFetch<'a> {
    request: &'a Request,
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
    async fn go_on(&mut self) -> Result<(), Failure> {
        let key = &self.object.key;
        let end = match self.by_ranges {
            true => self.object.bytes.min(self.bytes + RANGE_BYTES),
            false => self.object.bytes,
        };
        // A server without ranges is not asked for what is the whole.
        let is_whole = self.bytes == 0 && end == self.object.bytes;
        let range = (!is_whole).then_some(GetRange::Bounded(self.bytes..end));
        // A weak ETag matches nothing, by the rules of If-Match.
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
                let reason = format!("object {key}: more bytes came than were asked for");
                return Err(Failure::Useless(io::Error::other(reason)));
            }
            self.out.write_all(&chunk).map_err(|error| Failure::Useless(on(self.to, error)))?;
            self.bytes += chunk.len() as u64;
            self.request.moved(chunk.len() as u64);
        }
        if self.bytes == end {
            return Ok(());
        }
        let reason = format!("{} bytes came, and it has {}", self.bytes, self.object.bytes);
        Err(Failure::Broken(object_store::Error::Generic { store: "answer", source: reason.into() }))
    }

    fn begin_again(&mut self) -> io::Result<()> {
        if self.bytes > 0 {
            self.out = create(self.to)?;
            self.bytes = 0;
        }
        Ok(())
    }

    fn changed(&self) -> Failure {
        let reason = format!("object {}: it was changed while it was read; begin again", self.object.key);
        Failure::Useless(io::Error::new(io::ErrorKind::InvalidData, reason))
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

fn create(path: &Path) -> io::Result<Box<dyn DiskWrite>> {
    FsDisk.create(path).map_err(|error| on(path, error))
}

fn on(path: &Path, error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}
