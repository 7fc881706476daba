use super::bucket::{RESEND_HINT, error_text, object_error};
use super::object_name::ObjectName;
use super::request::{Failure, Request};
use bytes::Bytes;
use futures_util::TryStreamExt;
use object_store::path::Path as Key;
use object_store::{GetOptions, GetRange, GetResult, ObjectStore, UpdateVersion};
use std::io;
use std::ops::Range;

/// Maximum number of downloads of an object whose content does not match its name: a proxy may have truncated it.
const MAX_FETCHES: usize = 3;

/// Fetches a whole object and compares it with its name. After a broken connection, the download continues at the byte
/// reached: the name detects parts that do not belong together.
pub(super) async fn fetch_whole(
    request: &Request,
    store: &dyn ObjectStore,
    key: &Key,
    name: ObjectName,
    max_bytes: u64,
) -> io::Result<Bytes> {
    for _ in 0..MAX_FETCHES {
        let mut fetch = Fetch { max_bytes, ..Fetch::new(None) };
        fetch.run(request, store, key).await?;
        // Hashed on the network thread, because this takes little time compared with the download.
        if ObjectName::of(&fetch.content) == name {
            return Ok(fetch.content.into());
        }
    }
    let reason = format!("object {key}: its content does not match its name; {RESEND_HINT}");
    Err(io::Error::new(io::ErrorKind::InvalidData, reason))
}

/// Fetches a range of bytes of an object. After a broken connection, the download continues at the byte reached: an
/// object never changes under its name, and checksums in the file detect damage.
pub(super) async fn fetch_bytes(
    request: &Request,
    store: &dyn ObjectStore,
    key: &Key,
    range: Range<u64>,
) -> io::Result<Bytes> {
    let mut fetch = Fetch::new(Some(range));
    fetch.run(request, store, key).await?;
    Ok(fetch.content.into())
}

/// Makes one attempt to fetch a whole object with its version.
pub(super) async fn get_once(
    request: &Request,
    store: &dyn ObjectStore,
    key: &Key,
    max_bytes: u64,
) -> Result<(Bytes, UpdateVersion), Failure> {
    let found = store.get_opts(key, GetOptions::default()).await?;
    let version = UpdateVersion { e_tag: found.meta.e_tag.clone(), version: found.meta.version.clone() };
    let mut content = Vec::new();
    receive(request, key, found, max_bytes, &mut content).await?;
    Ok((content.into(), version))
}

/// Download of an object, or of a range of it.
struct Fetch {
    /// Range to fetch; `None` for the whole object.
    range: Option<Range<u64>>,
    max_bytes: u64,
    content: Vec<u8>,
    /// End of the object or range, once it is known.
    end: Option<u64>,
    can_continue: bool,
}

impl Fetch {
    fn new(range: Option<Range<u64>>) -> Self {
        let max_bytes = range.as_ref().map_or(u64::MAX, |range| range.end.saturating_sub(range.start));
        Self { range, max_bytes, content: Vec::new(), end: None, can_continue: true }
    }

    async fn run(&mut self, request: &Request, store: &dyn ObjectStore, key: &Key) -> io::Result<()> {
        loop {
            let kept = self.content.len() as u64;
            match request.attempt(kept, self.fetch_rest(request, store, key)).await {
                Ok(()) => return Ok(()),
                Err(Failure::Broken(error) | Failure::Refused(error)) if ignores_ranges(&error) => {
                    if kept == 0 {
                        return Err(object_error(key, &error));
                    }
                    self.can_continue = false;
                }
                Err(failure) => request.retry_after(failure).await?,
            }
            if !self.can_continue {
                self.content.clear();
            }
        }
    }

    async fn fetch_rest(
        &mut self,
        request: &Request,
        store: &dyn ObjectStore,
        key: &Key,
    ) -> Result<(), Failure> {
        let begin = self.range.as_ref().map_or(0, |range| range.start);
        let at = begin + self.content.len() as u64;
        let range = match (&self.range, self.end) {
            (Some(range), _) => Some(at..range.end),
            (None, Some(end)) if !self.content.is_empty() => Some(at..end),
            (None, _) => None,
        };
        if range.as_ref().is_some_and(|range| range.is_empty() && !self.content.is_empty()) {
            return Ok(());
        }
        let options = GetOptions { range: range.map(GetRange::Bounded), ..GetOptions::default() };
        let found = store.get_opts(key, options).await?;
        self.end = Some(found.range.end);
        receive(request, key, found, self.max_bytes, &mut self.content).await
    }
}

/// Returns whether a server supports only whole objects.
pub(super) fn ignores_ranges(error: &object_store::Error) -> bool {
    // Not all clients have a variant for this error.
    matches!(error, object_store::Error::NotSupported { .. })
        || error_text(error).contains("non-partial response")
}

/// Appends the content of an answer, up to `max_bytes`.
async fn receive(
    request: &Request,
    key: &Key,
    found: GetResult,
    max_bytes: u64,
    content: &mut Vec<u8>,
) -> Result<(), Failure> {
    let fatal = |reason| Failure::Fatal(io::Error::new(io::ErrorKind::InvalidData, reason));
    let bytes = content.len() as u64 + found.range.end.saturating_sub(found.range.start);
    if bytes > max_bytes {
        return Err(fatal(format!("object {key}: {bytes} bytes, but the maximum is {max_bytes}")));
    }
    // The size is checked again while receiving, because a server may send more than it announced.
    let mut stream = found.into_stream();
    while let Some(chunk) = stream.try_next().await? {
        content.extend_from_slice(&chunk);
        request.add_bytes(chunk.len() as u64);
        if content.len() as u64 > max_bytes {
            return Err(fatal(format!("object {key}: more than the maximum of {max_bytes} bytes")));
        }
    }
    Ok(())
}
