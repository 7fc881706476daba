use super::content::{fetch_bytes, fetch_whole, get_once};
use super::file_fetch::fetch_file;
use super::manifest::{MANIFEST, Manifest};
use super::object_name::{OBJECTS, ObjectName};
use super::pending::Pending;
use super::remote_store::remote_store;
use super::request::{Failure, PROGRESS_BYTES, Request, retry};
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

/// Location of one map in an object store.
///
/// Calls block on the network and retry temporary failures. A request that makes no progress for a
/// [`timeout`](Bucket::with_timeout) fails with [`Error::NoAnswer`]. Progress is an answer, or 16 KiB more of an
/// object. An attempt without progress for half of the timeout is aborted and retried; a download continues at the byte
/// reached. An upload has twice as much time. A request fails after 20 attempts in a row without progress, or after 4
/// if the server was never reached. A wait of 8 seconds, or of a quarter of the timeout if that is less, is logged as a
/// warning of the crate `log`. Every error names its object.
#[derive(Clone, Debug)]
pub struct Bucket {
    /// URL as given by the user, for messages.
    url: String,
    store: Arc<dyn ObjectStore>,
    prefix: Key,
    can_write: bool,
    /// Whether the store's client counts the bytes that it sends.
    counts_sent: bool,
    health: Arc<StoreHealth>,
    timeout: Duration,
    stop: Arc<AtomicBool>,
}

/// A manifest, and the version of its object.
pub(super) struct FoundManifest {
    pub(super) manifest: Manifest,
    pub(super) version: UpdateVersion,
}

/// An object, seen as a file below the bucket's URL.
pub(super) struct StoredObject {
    /// Name below the URL; the object's own name if the URL is that of the object.
    pub(super) name: String,
    pub(super) is_url: bool,
    pub(super) bytes: u64,
    pub(super) key: Key,
    pub(super) e_tag: Option<String>,
    /// Modification time in seconds of Unix time; 0 if the store does not report it.
    pub(super) modified_s: i64,
}

/// Environment variable of the timeout of requests, in seconds.
const TIMEOUT_VARIABLE: &str = "VOXTILE_BUCKET_TIMEOUT";

/// Valid timeouts, in seconds.
const TIMEOUTS_S: std::ops::RangeInclusive<f64> = 0.1..=86_400.0;

/// Bytes of an upload per timeout, for a store whose client does not count the bytes it sends.
const UNCOUNTED_BYTES: u64 = 1 << 20;

/// Remedy for a lost or damaged object, for messages.
pub(super) const RESEND_HINT: &str = "send the whole map again with `voxtile push --resend`";

/// Maximum size of a manifest or page, in bytes.
const MAX_LIST_BYTES: u64 = 1 << 28;

impl Bucket {
    /// Default [timeout](Bucket::with_timeout) of a request without progress.
    pub const DEFAULT_TIMEOUT: Duration = Duration::from_secs(60);

    /// Opens the bucket and prefix of a URL: `s3://BUCKET/MAP`, `gs://BUCKET/MAP`, `az://CONTAINER/MAP`
    /// (or `abfs`, `abfss`), or `https://HOST/MAP` (or `http`), which is read-only. Keys, region and endpoint are read from the environment variables of
    /// each store's own tools: `AWS_ACCESS_KEY_ID`, `AWS_REGION`, `AWS_ENDPOINT_URL`, `GOOGLE_SERVICE_ACCOUNT`,
    /// `AZURE_STORAGE_ACCOUNT_NAME` and so on. `VOXTILE_BUCKET_TIMEOUT` is the [timeout](Bucket::with_timeout) in
    /// seconds.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] for an invalid URL, or if an environment variable is missing or invalid.
    pub fn open(url: &str) -> Result<Self> {
        let wrong = |reason: String| Error::argument(url, reason);
        let no_bucket = || wrong("not the URL of a bucket; use s3://, gs://, az:// or https://".to_owned());
        let (scheme, rest) = url.split_once("://").ok_or_else(no_bucket)?;
        let (host, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        if host.is_empty() {
            return Err(wrong(format!("the URL has no bucket; use {scheme}://BUCKET/MAP")));
        }
        if rest.contains(['?', '#']) {
            return Err(wrong(
                "the URL has a query or a fragment; set keys in environment variables".to_owned(),
            ));
        }
        let root = format!("{scheme}://{host}");
        let store = remote_store(url, scheme, &root)?.ok_or_else(no_bucket)?;
        let prefix = Key::parse(prefix.trim_end_matches('/')).map_err(|error| wrong(error.to_string()))?;
        let can_write = !scheme.starts_with("http");
        let url = url.trim_end_matches('/');
        let timeout = timeout_of_environment()?;
        Ok(Self { can_write, counts_sent: true, ..Self::new(store, prefix, url) }.with_timeout(timeout))
    }

    /// Creates a bucket from any object store and a prefix. `url` is its name in messages. The store should not retry
    /// by itself. The progress of its uploads is unknown, so an upload has one timeout per MiB.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] for a prefix that is not a valid path of an object.
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

    /// Sets the timeout of a request without progress, from 0.1 s to a day. On a slow link, use at least the transfer
    /// time of 32 KiB.
    pub fn with_timeout(mut self, timeout: Duration) -> Self {
        let [min, max] = [*TIMEOUTS_S.start(), *TIMEOUTS_S.end()].map(Duration::from_secs_f64);
        self.timeout = timeout.clamp(min, max);
        self
    }

    /// Sets a flag that stops all waits with [`Error::Stopped`]. It is checked ten times a second.
    pub fn with_stop(mut self, stop: Arc<AtomicBool>) -> Self {
        self.stop = stop;
        self
    }

    /// Returns the URL.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Returns the URL as a path, for errors.
    pub(super) fn path(&self) -> &Path {
        Path::new(&self.url)
    }

    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if the bucket is read-only.
    pub(super) fn check_can_write(&self) -> Result<()> {
        if self.can_write {
            return Ok(());
        }
        let reason = "cannot be written to: a web server does not prevent concurrent writes; \
                      push to s3://, gs:// or az://";
        Err(Error::argument(&self.url, reason))
    }

    /// Reads the manifest; `None` if there is none.
    pub(super) fn manifest(&self) -> Result<Option<FoundManifest>> {
        let Some((bytes, version)) = self.manifest_bytes()? else { return Ok(None) };
        let manifest = Manifest::from_bytes(&bytes).map_err(|reason| self.manifest_error(&reason))?;
        Ok(Some(FoundManifest { manifest, version }))
    }

    /// Reads the manifest for a push that replaces it. A damaged manifest gives only its version. A manifest of a later
    /// version of voxtile is an error.
    pub(super) fn replaceable_manifest(&self) -> Result<Option<(Option<Manifest>, UpdateVersion)>> {
        let Some((bytes, version)) = self.manifest_bytes()? else { return Ok(None) };
        match Manifest::from_bytes(&bytes) {
            Err(reason) if Manifest::is_of_later_version(&bytes) => Err(self.manifest_error(&reason)),
            Err(reason) => {
                log::warn!("{}: {reason}; the push replaces it", self.path().join(MANIFEST).display());
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

    fn manifest_error(&self, reason: &str) -> Error {
        let reason = format!("{}: {reason}", self.key(MANIFEST));
        let error = io::Error::new(io::ErrorKind::InvalidData, reason);
        Error::io(&self.path().join(MANIFEST), "read", error)
    }

    /// Replaces the manifest that was found, if it is unchanged in the store.
    ///
    /// # Errors
    ///
    /// An error of kind `AlreadyExists` if it has changed; a store that refuses the request.
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
                // The state in the store decides: if the answer to an attempt was lost, the attempt finds its own
                // manifest.
                let now = request.query(get_once(&request, &store, &key, MAX_LIST_BYTES)).await;
                let is_unchanged = match now {
                    Ok((now, _)) if now == content => return Ok(true),
                    Ok((_, version)) => Some(found.as_ref() == Some(&version)),
                    Err(Failure::Refused(object_store::Error::NotFound { .. })) => Some(found.is_none()),
                    Err(_) => None,
                };
                match (is_unchanged, failure) {
                    (Some(false), _) => return Ok(false),
                    // A conflict with an own attempt that the store has not finished, or whose answer was lost.
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

    /// Returns the error of a push that another push has overtaken.
    pub(super) fn overtaken(&self) -> Error {
        let reason = "another push came first, and its state is kept; push again";
        let error = io::Error::new(io::ErrorKind::AlreadyExists, reason);
        Error::io(&self.path().join(MANIFEST), "replace", error)
    }

    /// Starts to fetch an object, and compares its content with its name.
    pub(super) fn fetch(&self, name: ObjectName, max_bytes: u64) -> Pending<Bytes> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        self.pending("GET", &name.key(), move |request| async move {
            fetch_whole(&request, &store, &key, name, max_bytes).await
        })
    }

    /// Starts to fetch a range of bytes of an object, without a check of its content.
    pub(super) fn fetch_bytes(&self, name: ObjectName, range: Range<u64>) -> Pending<Bytes> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        self.pending("GET", &name.key(), move |request| async move {
            fetch_bytes(&request, &store, &key, range).await
        })
    }

    /// Fetches a page of the file list.
    pub(super) fn fetch_list(&self, name: ObjectName) -> io::Result<Bytes> {
        self.fetch(name, MAX_LIST_BYTES).wait()
    }

    /// Starts to upload an object. The result is `false` if the object already exists, which is only checked if
    /// `checks_existing`.
    pub(super) fn put(&self, name: ObjectName, content: Bytes, checks_existing: bool) -> Pending<bool> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        self.pending_put(&name.key(), content.len() as u64, move |request| async move {
            // An object with this name and size is complete, because its name identifies its content. If the check is
            // not permitted, the upload may still be.
            if checks_existing
                && let Ok(existing) = request.query(async { Ok(store.head(&key).await?) }).await
                && existing.size == content.len() as u64
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

    /// Lists the objects that are older than the manifest.
    pub(super) fn objects_before_manifest(&self) -> io::Result<Vec<ObjectName>> {
        let (store, key, folder) = (self.store.clone(), self.key(MANIFEST), self.key(OBJECTS));
        self.pending("LIST", OBJECTS, move |request| async move {
            let list = || async {
                let manifest = store.head(&key).await?;
                let listed = store.list(Some(&folder)).try_filter_map(|object| {
                    request.add_bytes(BYTES_OF_ENTRY);
                    let is_older = object.last_modified < manifest.last_modified;
                    let name = object.location.filename().and_then(ObjectName::from_digits);
                    std::future::ready(Ok(name.filter(|_| is_older)))
                });
                Ok(listed.try_collect().await?)
            };
            retry(&request, list).await
        })
        .wait()
    }

    /// Starts to remove an object. An object that does not exist counts as removed.
    pub(super) fn remove(&self, name: ObjectName) -> Pending<()> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        self.pending("DELETE", &name.key(), move |request| async move {
            let delete = || async {
                match store.delete(&key).await {
                    Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
                    Err(error) => Err(error.into()),
                }
            };
            retry(&request, delete).await
        })
    }

    /// Returns whether the bucket has a map. `is_stopped` is checked ten times a second.
    ///
    /// # Errors
    ///
    /// A store that refuses the request or does not answer; [`Error::Stopped`].
    pub fn has_map(&self, is_stopped: &dyn Fn() -> bool) -> Result<bool> {
        let (store, key, prefix) = (self.store.clone(), self.key(MANIFEST), self.prefix.clone());
        let pending = self.pending("HEAD", MANIFEST, move |request| async move {
            match retry(&request, || async { Ok(store.head(&key).await?) }).await {
                Ok(_) => Ok(true),
                Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
                Err(error) => {
                    // Without the permission to list objects, stores answer "permission denied" for a missing object.
                    // If there is a file at the URL, it is not a map.
                    let is_file = error.kind() == io::ErrorKind::PermissionDenied
                        && !prefix.as_ref().is_empty()
                        && retry(&request, || async { Ok(store.head(&prefix).await?) })
                            .await
                            .is_ok_and(|file| file.size > 0);
                    if is_file { Ok(false) } else { Err(error) }
                }
            }
        });
        let answer = pending.wait_unless(is_stopped).ok_or(Error::Stopped)?;
        answer.map_err(|error| Error::io(self.path(), "look for a map", error))
    }

    /// Starts to list the object of the URL itself, or the objects below it, ordered by name.
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
            match retry(&request, || async { Ok(store.head(&prefix).await?) }).await {
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
                    request.add_bytes(BYTES_OF_ENTRY);
                    let name: Option<Key> = meta.location.prefix_match(&prefix).map(|parts| parts.collect());
                    // Some tools create an empty object for a folder.
                    let is_file = meta.size > 0 || meta.location.extension().is_some();
                    let name = name.filter(|name| is_file && !name.as_ref().is_empty());
                    std::future::ready(Ok(name.map(|name| object(meta, name.as_ref().to_owned(), false))))
                });
                Ok(listed.try_collect::<Vec<_>>().await?)
            };
            let mut objects = retry(&request, list).await?;
            objects.sort_by(|a, b| a.name.cmp(&b.name));
            Ok(objects)
        })
    }

    /// Starts to fetch an object into a file. An object that changed since it was listed is an error.
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
            retry(&request, || get_once(&request, &store, &key, MAX_LIST_BYTES)).await
        })
    }

    fn key(&self, name: &str) -> Key {
        let name = Key::from(name);
        self.prefix.parts().chain(name.parts()).collect()
    }

    /// Starts a request for an object, or for all objects below a prefix.
    fn pending<T: Send + 'static, F: Future<Output = io::Result<T>> + Send + 'static>(
        &self,
        verb: &'static str,
        name: &str,
        request: impl FnOnce(Arc<Request>) -> F,
    ) -> Pending<T> {
        let state = Request::new(verb, self.key(name), self.timeout, self.health.clone());
        Pending::begin(state, self.stop.clone(), request)
    }

    /// Starts to upload an object of `bytes` bytes.
    fn pending_put<T: Send + 'static, F: Future<Output = io::Result<T>> + Send + 'static>(
        &self,
        name: &str,
        bytes: u64,
        request: impl FnOnce(Arc<Request>) -> F,
    ) -> Pending<T> {
        let times = if self.counts_sent { 1 } else { bytes.div_ceil(UNCOUNTED_BYTES).max(1) };
        let timeout = self.timeout.saturating_mul(u32::try_from(times).unwrap_or(u32::MAX));
        let state = Request::new("PUT", self.key(name), timeout, self.health.clone());
        Pending::begin(state, self.stop.clone(), request)
    }
}

/// Number of bytes for which an entry of a list counts, so that each page of a long list is progress.
const BYTES_OF_ENTRY: u64 = PROGRESS_BYTES;

/// Reads the timeout from the environment.
fn timeout_of_environment() -> Result<Duration> {
    let Some(text) = std::env::var_os(TIMEOUT_VARIABLE) else { return Ok(Bucket::DEFAULT_TIMEOUT) };
    let seconds = text.to_str().and_then(|text| text.trim().parse().ok());
    match seconds.filter(|seconds| TIMEOUTS_S.contains(seconds)) {
        Some(seconds) => Ok(Duration::from_secs_f64(seconds)),
        None => Err(Error::argument(
            TIMEOUT_VARIABLE,
            format!(
                "{} is not a number of seconds from {} to {}",
                text.display(),
                TIMEOUTS_S.start(),
                TIMEOUTS_S.end()
            ),
        )),
    }
}

/// Returns an error of an object store that names the object.
pub(super) fn object_error(key: &Key, error: &object_store::Error) -> io::Error {
    let kind = match error {
        object_store::Error::NotFound { .. } => io::ErrorKind::NotFound,
        object_store::Error::PermissionDenied { .. } | object_store::Error::Unauthenticated { .. } => {
            io::ErrorKind::PermissionDenied
        }
        _ => io::ErrorKind::Other,
    };
    io::Error::new(kind, format!("object {key}: {}", error_text(error)))
}

/// Replaces a `NotFound` error by damage: the object is missing, but the map has the file.
pub(super) fn missing_object(error: io::Error) -> io::Error {
    if error.kind() != io::ErrorKind::NotFound {
        return error;
    }
    let reason = format!(
        "{error}; if another push used --prune, open the map again; otherwise {RESEND_HINT} from its folder"
    );
    io::Error::new(io::ErrorKind::InvalidData, reason)
}

/// Returns an error with its causes, on one line.
pub(super) fn error_text(error: &object_store::Error) -> String {
    let mut text = error.to_string();
    let mut cause = std::error::Error::source(error);
    while let Some(error) = cause {
        let reason = error.to_string();
        if !text.contains(&reason) {
            text = format!("{text}: {reason}");
        }
        cause = error.source();
    }
    // Without keys, the clients query the metadata servers of their clouds, which do not exist elsewhere.
    if text.contains("169.254.169.254") || text.contains("metadata.google.internal") {
        let keys = "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY (s3), GOOGLE_SERVICE_ACCOUNT (gs), \
                    AZURE_STORAGE_ACCOUNT_NAME and AZURE_STORAGE_ACCOUNT_KEY (az)";
        text = format!("no keys: set {keys} in the environment; without keys, the client failed: {text}");
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
