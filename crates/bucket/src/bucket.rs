use super::content::{fetch_bytes, fetch_whole, get_once};
use super::file_fetch::fetch_file;
use super::manifest::{MANIFEST, Manifest};
use super::object_name::{OBJECTS, ObjectName};
use super::pending::Pending;
use super::remote_store::remote_store;
use super::request::{Failure, PROGRESS_BYTES, Request, retried};
use super::store_health::StoreHealth;
use bytes::Bytes;
use futures_util::TryStreamExt;
use object_store::path::Path as Key;
use object_store::{ObjectStore, ObjectStoreExt, PutMode, PutOptions, UpdateVersion};
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use voxtile::{Error, Result};

/// A place for one map in an object store.
///
/// Its calls wait for the network. What fails for a reason that may pass is tried again. A request that makes no progress
/// for a [`timeout`](Bucket::with_timeout) fails with [`Error::NoAnswer`]: progress is 16 KiB more of an object, or the
/// answer. An attempt without progress for half of the timeout is ended and begun again; an object that is fetched
/// continues at the byte reached. An upload has twice as much time. 20 attempts in a row that get no further are the
/// last, 4 where the server was never reached. A wait of 8 seconds, or a quarter of the timeout, is reported as a warning of the crate `log`. Every error
/// names its object.
#[derive(Clone, Debug)]
pub struct Bucket {
    /// As the user wrote it, for messages.
    url: String,
    store: Arc<dyn ObjectStore>,
    prefix: Key,
    can_write: bool,
    /// Whether the store's client counts what it sends.
    counts_sent: bool,
    health: Arc<StoreHealth>,
    timeout: Duration,
    stop: Arc<AtomicBool>,
}

/// A manifest and what tells it from its successor.
pub(super) struct FoundManifest {
    pub(super) manifest: Manifest,
    pub(super) version: UpdateVersion,
}

/// An object that is there, as a file below the bucket's URL.
pub(super) struct StoredObject {
    /// Its name below the URL; its own, where the URL is that of the object.
    pub(super) name: String,
    pub(super) is_url: bool,
    pub(super) bytes: u64,
    pub(super) key: Key,
    pub(super) e_tag: Option<String>,
    /// When it was put, in seconds of Unix time; 0 where the store does not tell.
    pub(super) modified_s: i64,
}

/// The environment variable with the bound on a request without progress, in seconds.
const TIMEOUT_VARIABLE: &str = "VOXTILE_BUCKET_TIMEOUT";

/// The bounds of that bound.
const TIMEOUTS_S: std::ops::RangeInclusive<f64> = 0.1..=86_400.0;

/// Of a store that does not count what it is sent, an object has the timeout for each such part.
const UNCOUNTED_BYTES: u64 = 1 << 20;

/// What helps where an object is lost or damaged.
pub(super) const SEND_AGAIN: &str = "send all of the map again with `voxtile push --resend`";

/// The longest manifest or page that is read.
const MAX_LIST_BYTES: u64 = 1 << 28;

impl Bucket {
    /// How long a request may remain without progress, unless something else is asked for.
    pub const DEFAULT_TIMEOUT: Duration = Duration::from_secs(60);

    /// The bucket and prefix of a URL: `s3://BUCKET/MAP`, `gs://BUCKET/MAP`, `az://CONTAINER/MAP`, and for reading
    /// `https://HOST/MAP`. Keys, region and endpoint come from the environment, by the names that each store's own
    /// tools use: `AWS_ACCESS_KEY_ID`, `AWS_REGION`, `AWS_ENDPOINT_URL`, `GOOGLE_SERVICE_ACCOUNT`,
    /// `AZURE_STORAGE_ACCOUNT_NAME` and so on. `VOXTILE_BUCKET_TIMEOUT` is the [timeout](Bucket::with_timeout) in
    /// seconds.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] for another URL, or if the environment lacks something.
    pub fn open(url: &str) -> Result<Self> {
        let wrong = |reason: String| Error::argument(url, reason);
        let no_bucket =
            || wrong("is no URL of a bucket; these begin with s3://, gs://, az:// or https://".to_owned());
        let (scheme, rest) = url.split_once("://").ok_or_else(no_bucket)?;
        let (host, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        if host.is_empty() {
            return Err(wrong(format!("names no bucket; write {scheme}://BUCKET/MAP")));
        }
        if rest.contains(['?', '#']) {
            return Err(wrong("has a query or a fragment; give keys by the environment".to_owned()));
        }
        let root = format!("{scheme}://{host}");
        let store = remote_store(url, scheme, &root)?.ok_or_else(no_bucket)?;
        let prefix = Key::parse(prefix.trim_end_matches('/')).map_err(|error| wrong(error.to_string()))?;
        let can_write = !scheme.starts_with("http");
        let url = url.trim_end_matches('/');
        let timeout = timeout_of_environment()?;
        Ok(Self { can_write, counts_sent: true, ..Self::new(store, prefix, url) }.with_timeout(timeout))
    }

    /// A place below a prefix of any object store; `url` is what messages call it. The store should not retry by itself.
    /// How much of an object it has sent is not known: instead, an object to be put has the timeout for each MiB.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] for a prefix that no object has.
    pub fn on(store: Arc<dyn ObjectStore>, prefix: &str, url: &str) -> Result<Self> {
        let prefix = Key::parse(prefix).map_err(|error| Error::argument(url, error.to_string()))?;
        Ok(Self::new(store, prefix, url))
    }

    fn new(store: Arc<dyn ObjectStore>, prefix: Key, url: &str) -> Self {
        Self {
            url: url.to_owned(),
            store,
            prefix,
            can_write: true,
            counts_sent: false,
            health: Arc::new(StoreHealth::new(url)),
            timeout: Self::DEFAULT_TIMEOUT,
            stop: Arc::default(),
        }
    }

    /// Fails requests that remain without progress for so long; from 0.1 s to a day. Put what a slow link needs for
    /// 32 KiB.
    pub fn with_timeout(mut self, timeout: Duration) -> Self {
        let [least, most] = [*TIMEOUTS_S.start(), *TIMEOUTS_S.end()].map(Duration::from_secs_f64);
        self.timeout = timeout.clamp(least, most);
        self
    }

    /// Fails all waits with [`Error::Stopped`] once the flag is set; it is looked at ten times a second.
    pub fn with_stop(mut self, stop: Arc<AtomicBool>) -> Self {
        self.stop = stop;
        self
    }

    /// Its URL.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Its URL as a path, as errors name it.
    pub(super) fn path(&self) -> &Path {
        Path::new(&self.url)
    }

    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if it can only be read.
    pub(super) fn check_can_write(&self) -> Result<()> {
        if self.can_write {
            return Ok(());
        }
        let reason = "can be read and not written to: a web server keeps no two writers apart; push to s3://, gs:// or az://";
        Err(Error::argument(&self.url, reason))
    }

    /// The manifest; `None` if there is none.
    pub(super) fn manifest(&self) -> Result<Option<FoundManifest>> {
        let Some((bytes, version)) = self.manifest_bytes()? else { return Ok(None) };
        let manifest = Manifest::from_bytes(&bytes).map_err(|reason| self.is_no_manifest(&reason))?;
        Ok(Some(FoundManifest { manifest, version }))
    }

    /// The manifest for who puts another in its place: one that is damaged is only told from its successor. What a
    /// later version has written is not damaged.
    pub(super) fn replaceable_manifest(&self) -> Result<Option<(Option<Manifest>, UpdateVersion)>> {
        let Some((bytes, version)) = self.manifest_bytes()? else { return Ok(None) };
        match Manifest::from_bytes(&bytes) {
            Err(reason) if Manifest::is_of_later_version(&bytes) => Err(self.is_no_manifest(&reason)),
            Err(reason) => {
                log::warn!("{}: {reason}; it is replaced", self.path().join(MANIFEST).display());
                Ok(Some((None, version)))
            }
            Ok(manifest) => Ok(Some((Some(manifest), version))),
        }
    }

    fn manifest_bytes(&self) -> Result<Option<(Bytes, UpdateVersion)>> {
        match self.get_manifest().wait() {
            Ok(found) => Ok(Some(found)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(Error::io(&self.path().join(MANIFEST), "read", error)),
        }
    }

    fn is_no_manifest(&self, reason: &str) -> Error {
        let reason = format!("{}: {reason}", self.key(MANIFEST));
        let error = io::Error::new(io::ErrorKind::InvalidData, reason);
        Error::io(&self.path().join(MANIFEST), "read", error)
    }

    /// Puts a manifest in place of the one that was found, if that is still there.
    ///
    /// # Errors
    ///
    /// One of the kind `AlreadyExists` if it is not; a store that refuses.
    pub(super) fn replace_manifest(&self, manifest: &Manifest, found: Option<UpdateVersion>) -> Result<()> {
        let (store, key) = (self.store.clone(), self.key(MANIFEST));
        let failed = |error| Error::io(&self.path().join(MANIFEST), "write", error);
        let bytes = Bytes::from(manifest.to_bytes().map_err(|error| failed(error.into()))?);
        let content = bytes.clone();
        let put = self.pending_put(MANIFEST, bytes.len() as u64, move |request| async move {
            loop {
                let mode = found.clone().map_or(PutMode::Create, PutMode::Update);
                let options = PutOptions { mode, ..PutOptions::default() };
                let put = store.put_opts(&key, content.clone().into(), options);
                let failure = match request.attempt(0, async { Ok(put.await?) }).await {
                    Ok(_) => return Ok(true),
                    Err(failure) => failure,
                };
                // The state there decides: an attempt whose answer was lost finds what it has put itself.
                let now = request.ask(get_once(&request, &store, &key, MAX_LIST_BYTES)).await;
                let is_unchanged = match now {
                    Ok((now, _)) if now == content => return Ok(true),
                    Ok((_, version)) => Some(found.as_ref() == Some(&version)),
                    Err(Failure::Refused(object_store::Error::NotFound { .. })) => Some(found.is_none()),
                    Err(_) => None,
                };
                match (is_unchanged, failure) {
                    (Some(false), _) => return Ok(false),
                    // A conflict with an attempt of ours that the store has not finished, or whose answer was lost.
                    (
                        _,
                        Failure::Refused(
                            error @ (object_store::Error::Precondition { .. }
                            | object_store::Error::AlreadyExists { .. }),
                        ),
                    ) => request.retry_after(Failure::Broken(error)).await?,
                    (_, failure) => request.retry_after(failure).await?,
                }
            }
        });
        match put.wait() {
            Ok(true) => Ok(()),
            Ok(false) => Err(self.overtaken()),
            Err(error) => Err(failed(error)),
        }
    }

    /// The error of a push that another one came before.
    pub(super) fn overtaken(&self) -> Error {
        let reason = "another push came first, and its state stays; push again to go on from there";
        let error = io::Error::new(io::ErrorKind::AlreadyExists, reason);
        Error::io(&self.path().join(MANIFEST), "replace", error)
    }

    /// Begins to fetch an object, whose content is compared with its name.
    pub(super) fn fetch(&self, name: ObjectName, most_bytes: u64) -> Pending<Bytes> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        self.pending("GET", &name.key(), move |request| async move {
            fetch_whole(&request, &store, &key, name, most_bytes).await
        })
    }

    /// Begins to fetch some bytes of an object. Nothing tells here whether they are the right ones.
    pub(super) fn fetch_bytes(&self, name: ObjectName, range: Range<u64>) -> Pending<Bytes> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        self.pending("GET", &name.key(), move |request| async move {
            fetch_bytes(&request, &store, &key, range).await
        })
    }

    /// Reads a list of files.
    pub(super) fn fetch_list(&self, name: ObjectName) -> io::Result<Bytes> {
        self.fetch(name, MAX_LIST_BYTES).wait()
    }

    /// Begins to put an object; `false` if that is there already, of which the store is asked before where `asks`.
    pub(super) fn put(&self, name: ObjectName, content: Bytes, asks: bool) -> Pending<bool> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        self.pending_put(&name.key(), content.len() as u64, move |request| async move {
            // A name is of one content, and an object is there whole or not at all. Who may not ask may put.
            if asks
                && let Ok(there) = request.ask(async { Ok(store.head(&key).await?) }).await
                && there.size == content.len() as u64
            {
                return Ok(false);
            }
            loop {
                let put = store.put(&key, content.clone().into());
                match request.attempt(0, async { Ok(put.await?) }).await {
                    Ok(_) => return Ok(true),
                    Err(failure) => request.retry_after(failure).await?,
                }
            }
        })
    }

    /// When the manifest was put, and the objects put before then.
    pub(super) fn objects_before_manifest(&self) -> io::Result<Vec<ObjectName>> {
        let (store, key, folder) = (self.store.clone(), self.key(MANIFEST), self.key(OBJECTS));
        self.pending("LIST", OBJECTS, move |request| async move {
            let list = || async {
                let manifest = store.head(&key).await?;
                let listed = store.list(Some(&folder)).try_filter_map(|object| {
                    request.moved(BYTES_OF_ENTRY);
                    let is_older = object.last_modified < manifest.last_modified;
                    let name = object.location.filename().and_then(ObjectName::from_digits);
                    std::future::ready(Ok(name.filter(|_| is_older)))
                });
                Ok(listed.try_collect().await?)
            };
            retried(&request, list).await
        })
        .wait()
    }

    /// Begins to remove an object; one that is not there is removed.
    pub(super) fn remove(&self, name: ObjectName) -> Pending<()> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        self.pending("DELETE", &name.key(), move |request| async move {
            let delete = || async {
                match store.delete(&key).await {
                    Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
                    Err(error) => Err(error.into()),
                }
            };
            retried(&request, delete).await
        })
    }

    /// Whether a map is there. `is_stopped` is asked ten times a second.
    ///
    /// # Errors
    ///
    /// A store that refuses or does not answer; [`Error::Stopped`].
    pub fn has_map(&self, is_stopped: &dyn Fn() -> bool) -> Result<bool> {
        let (store, key, prefix) = (self.store.clone(), self.key(MANIFEST), self.prefix.clone());
        let asked = self.pending("HEAD", MANIFEST, move |request| async move {
            match retried(&request, || async { Ok(store.head(&key).await?) }).await {
                Ok(_) => Ok(true),
                Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
                Err(error) => {
                    // Where nothing may be listed, stores do not say that an object is missing. A file is no map.
                    let is_file = error.kind() == io::ErrorKind::PermissionDenied
                        && !prefix.as_ref().is_empty()
                        && retried(&request, || async { Ok(store.head(&prefix).await?) })
                            .await
                            .is_ok_and(|file| file.size > 0);
                    if is_file { Ok(false) } else { Err(error) }
                }
            }
        });
        let answer = asked.wait_unless(is_stopped).ok_or(Error::Stopped)?;
        answer.map_err(|error| Error::io(self.path(), "look for a map in", error))
    }

    /// Begins to list the object of the URL itself, or those below it, by name.
    pub(super) fn objects_below(&self) -> Pending<Vec<StoredObject>> {
        let (store, prefix) = (self.store.clone(), self.prefix.clone());
        self.pending("LIST", "", move |request| async move {
            let object = |meta: object_store::ObjectMeta, name: String, is_url| StoredObject {
                name,
                is_url,
                bytes: meta.size,
                modified_s: meta.last_modified.timestamp(),
                key: meta.location,
                e_tag: meta.e_tag,
            };
            match retried(&request, || async { Ok(store.head(&prefix).await?) }).await {
                Ok(meta) if meta.size > 0 => {
                    let name = prefix.filename().unwrap_or_default().to_owned();
                    return Ok(vec![object(meta, name, true)]);
                }
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(error),
            }
            let list = || async {
                let listed = store.list(Some(&prefix)).try_filter_map(|meta| {
                    request.moved(BYTES_OF_ENTRY);
                    let name: Option<Key> = meta.location.prefix_match(&prefix).map(|parts| parts.collect());
                    // Some tools put an empty object where a folder would be.
                    let is_file = meta.size > 0 || meta.location.extension().is_some();
                    let name = name.filter(|name| is_file && !name.as_ref().is_empty());
                    std::future::ready(Ok(name.map(|name| object(meta, name.as_ref().to_owned(), false))))
                });
                Ok(listed.try_collect::<Vec<_>>().await?)
            };
            let mut objects = retried(&request, list).await?;
            objects.sort_by(|a, b| a.name.cmp(&b.name));
            Ok(objects)
        })
    }

    /// Begins to fetch an object into a file, as it was when it was listed.
    pub(super) fn fetch_file(&self, object: StoredObject, to: PathBuf) -> Pending<()> {
        let store = self.store.clone();
        let request = Request::new("GET", object.key.clone(), self.timeout, self.health.clone());
        Pending::begin(request, self.stop.clone(), move |request| async move {
            fetch_file(&request, &store, &object, &to).await
        })
    }

    fn get_manifest(&self) -> Pending<(Bytes, UpdateVersion)> {
        let (store, key) = (self.store.clone(), self.key(MANIFEST));
        self.pending("GET", MANIFEST, move |request| async move {
            retried(&request, || get_once(&request, &store, &key, MAX_LIST_BYTES)).await
        })
    }

    fn key(&self, name: &str) -> Key {
        let name = Key::from(name);
        self.prefix.parts().chain(name.parts()).collect()
    }

    /// Begins a request about an object, or about all below the prefix.
    fn pending<T: Send + 'static, F: Future<Output = io::Result<T>> + Send + 'static>(
        &self,
        verb: &'static str,
        name: &str,
        request: impl FnOnce(Arc<Request>) -> F,
    ) -> Pending<T> {
        let about = Request::new(verb, self.key(name), self.timeout, self.health.clone());
        Pending::begin(about, self.stop.clone(), request)
    }

    /// Begins to put an object of so many bytes.
    fn pending_put<T: Send + 'static, F: Future<Output = io::Result<T>> + Send + 'static>(
        &self,
        name: &str,
        bytes: u64,
        request: impl FnOnce(Arc<Request>) -> F,
    ) -> Pending<T> {
        let times = if self.counts_sent { 1 } else { bytes.div_ceil(UNCOUNTED_BYTES).max(1) };
        let timeout = self.timeout.saturating_mul(u32::try_from(times).unwrap_or(u32::MAX));
        let about = Request::new("PUT", self.key(name), timeout, self.health.clone());
        Pending::begin(about, self.stop.clone(), request)
    }
}

/// What an entry of a list counts as: of a list that arrives page by page, each page is progress.
const BYTES_OF_ENTRY: u64 = PROGRESS_BYTES;

/// The bound that the environment sets.
fn timeout_of_environment() -> Result<Duration> {
    let Some(text) = std::env::var_os(TIMEOUT_VARIABLE) else { return Ok(Bucket::DEFAULT_TIMEOUT) };
    let seconds = text.to_str().and_then(|text| text.trim().parse().ok());
    match seconds.filter(|seconds| TIMEOUTS_S.contains(seconds)) {
        Some(seconds) => Ok(Duration::from_secs_f64(seconds)),
        None => Err(Error::argument(
            TIMEOUT_VARIABLE,
            format!(
                "is {}; give seconds from {} to {}",
                text.display(),
                TIMEOUTS_S.start(),
                TIMEOUTS_S.end()
            ),
        )),
    }
}

/// The refusal of an object store, which names the object.
pub(super) fn refused(key: &Key, error: &object_store::Error) -> io::Error {
    let kind = match error {
        object_store::Error::NotFound { .. } => io::ErrorKind::NotFound,
        object_store::Error::PermissionDenied { .. } | object_store::Error::Unauthenticated { .. } => {
            io::ErrorKind::PermissionDenied
        }
        _ => io::ErrorKind::Other,
    };
    io::Error::new(kind, format!("object {key}: {}", told(error)))
}

/// An object that is missing is no file that is missing: the map does name it.
pub(super) fn missing_object(error: io::Error) -> io::Error {
    if error.kind() != io::ErrorKind::NotFound {
        return error;
    }
    let reason = format!(
        "{error}; if the map was pushed with --prune meanwhile, open it again; else {SEND_AGAIN} from its folder"
    );
    io::Error::other(reason)
}

/// An error with its causes, on one line.
pub(super) fn told(error: &object_store::Error) -> String {
    let mut text = error.to_string();
    let mut cause = std::error::Error::source(error);
    while let Some(error) = cause {
        let reason = error.to_string();
        if !text.contains(&reason) {
            text = format!("{text}: {reason}");
        }
        cause = error.source();
    }
    // Without keys the stores' clients ask the machines of their clouds, which are not there elsewhere.
    if text.contains("169.254.169.254") || text.contains("metadata.google.internal") {
        let keys = "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY (s3), GOOGLE_SERVICE_ACCOUNT (gs), \
                    AZURE_STORAGE_ACCOUNT_NAME and AZURE_STORAGE_ACCOUNT_KEY (az)";
        text = format!("no keys: set {keys} in the environment; without them this was tried: {text}");
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
