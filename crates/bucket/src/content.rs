use super::bucket::{SEND_AGAIN, refused, told};
use super::object_name::ObjectName;
use super::request::{Failure, Request};
use bytes::Bytes;
use futures_util::TryStreamExt;
use object_store::path::Path as Key;
use object_store::{GetOptions, GetRange, GetResult, ObjectStore, UpdateVersion};
use std::io;
use std::ops::Range;

/// How often content is fetched that is not what its name says: a proxy may have cut it off.
const FETCHES: usize = 3;

/// Fetches an object whole, and compares it with its name. After a break it continues at the byte reached: the name
/// tells whether both parts belong together.
pub(super) async fn fetch_whole(
    request: &Request,
    store: &dyn ObjectStore,
    key: &Key,
    name: ObjectName,
    most_bytes: u64,
) -> io::Result<Bytes> {
    for _ in 0..FETCHES {
        let mut fetch = Fetch { most_bytes, ..Fetch::new(None) };
        fetch.run(request, store, key).await?;
        // Hashing is work, though short compared with the way over the network.
        if ObjectName::of(&fetch.content) == name {
            return Ok(fetch.content.into());
        }
    }
    let reason = format!("object {key}: its content is not what its name says; {SEND_AGAIN}");
    Err(io::Error::new(io::ErrorKind::InvalidData, reason))
}

/// Fetches some bytes of an object. After a break it continues at the byte reached: an object of this name never
/// changes, and checksums in the file tell whether it is damaged.
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

/// Makes one attempt to get an object whole, with its version.
pub(super) async fn get_once(
    request: &Request,
    store: &dyn ObjectStore,
    key: &Key,
    most_bytes: u64,
) -> Result<(Bytes, UpdateVersion), Failure> {
    let found = store.get_opts(key, GetOptions::default()).await?;
    let version = UpdateVersion { e_tag: found.meta.e_tag.clone(), version: found.meta.version.clone() };
    let mut content = Vec::new();
    receive(request, key, found, most_bytes, &mut content).await?;
    Ok((content.into(), version))
}

/// An object, or a part of one, that is being fetched.
struct Fetch {
    /// All of the object if there is none.
    range: Option<Range<u64>>,
    most_bytes: u64,
    content: Vec<u8>,
    /// Where the object or the part ends, once that is known.
    end: Option<u64>,
    can_continue: bool,
}

impl Fetch {
    fn new(range: Option<Range<u64>>) -> Self {
        let most_bytes = range.as_ref().map_or(u64::MAX, |range| range.end.saturating_sub(range.start));
        Self { range, most_bytes, content: Vec::new(), end: None, can_continue: true }
    }

    async fn run(&mut self, request: &Request, store: &dyn ObjectStore, key: &Key) -> io::Result<()> {
        loop {
            let kept = self.content.len() as u64;
            match request.attempt(kept, self.go_on(request, store, key)).await {
                Ok(()) => return Ok(()),
                Err(Failure::Broken(error) | Failure::Refused(error)) if ignores_ranges(&error) => {
                    if kept == 0 {
                        return Err(refused(key, &error));
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

    async fn go_on(&mut self, request: &Request, store: &dyn ObjectStore, key: &Key) -> Result<(), Failure> {
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
        receive(request, key, found, self.most_bytes, &mut self.content).await
    }
}

/// Whether a server has only whole files.
pub(super) fn ignores_ranges(error: &object_store::Error) -> bool {
    // The stores' clients do not all have a variant for it.
    matches!(error, object_store::Error::NotSupported { .. }) || told(error).contains("non-partial response")
}

/// Appends what an answer brings, if that is not too much.
async fn receive(
    request: &Request,
    key: &Key,
    found: GetResult,
    most_bytes: u64,
    content: &mut Vec<u8>,
) -> Result<(), Failure> {
    let useless = |reason| Failure::Useless(io::Error::new(io::ErrorKind::InvalidData, reason));
    let bytes = content.len() as u64 + found.range.end.saturating_sub(found.range.start);
    if bytes > most_bytes {
        return Err(useless(format!("object {key}: {bytes} bytes, and at most {most_bytes} belong there")));
    }
    // A server may send more than it said.
    let mut stream = found.into_stream();
    while let Some(chunk) = stream.try_next().await? {
        content.extend_from_slice(&chunk);
        request.moved(chunk.len() as u64);
        if content.len() as u64 > most_bytes {
            return Err(useless(format!("object {key}: more than the {most_bytes} bytes that belong there")));
        }
    }
    Ok(())
}
