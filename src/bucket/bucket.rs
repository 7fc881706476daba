use super::manifest::{MANIFEST, Manifest};
use super::object_name::{OBJECTS, ObjectName};
use crate::error::{Error, Result};
use crate::store::{Disk, FsDisk};
use bytes::Bytes;
use futures_util::TryStreamExt;
use object_store::aws::AmazonS3Builder;
use object_store::azure::MicrosoftAzureBuilder;
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::http::HttpBuilder;
use object_store::path::Path as Key;
use object_store::{
    BackoffConfig, ClientOptions, GetOptions, GetRange, ObjectStore, ObjectStoreExt, PutMode, PutOptions,
    RetryConfig, UpdateVersion,
};
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use tokio::task::AbortHandle;

/// A place for one map in an object store.
///
/// Its calls wait for the network. What fails for a reason that may pass is tried again, for a minute at most; every
/// error names its object.
#[derive(Clone, Debug)]
pub struct Bucket {
    /// As the user wrote it, for messages.
    url: String,
    store: Arc<dyn ObjectStore>,
    prefix: Key,
    can_write: bool,
}

/// What a request will answer, while others are made.
pub(super) struct Pending<T> {
    answer: Receiver<io::Result<T>>,
    /// Ends the request.
    task: Option<AbortHandle>,
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
    key: Key,
    e_tag: Option<String>,
}

/// How often content is fetched that is not what its name says: a proxy may have cut it off.
const FETCHES: usize = 3;

/// What took longer to fail is not tried again.
const LATEST_RETRY: Duration = Duration::from_secs(10);

/// How long an answer may keep us waiting before we look up.
const PATIENCE: Duration = Duration::from_millis(100);

/// The longest manifest or page that is read.
const MOST_LIST_BYTES: u64 = 1 << 28;

impl Bucket {
    /// The bucket and prefix of a URL: `s3://BUCKET/MAP`, `gs://BUCKET/MAP`, `az://CONTAINER/MAP`, and for reading
    /// `https://HOST/MAP`. Keys, region and endpoint come from the environment, by the names that each store's own
    /// tools use: `AWS_ACCESS_KEY_ID`, `AWS_REGION`, `AWS_ENDPOINT_URL`, `GOOGLE_SERVICE_ACCOUNT`,
    /// `AZURE_STORAGE_ACCOUNT_NAME` and so on.
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
        let retry = RetryConfig {
            backoff: BackoffConfig { max_backoff: Duration::from_secs(5), ..BackoffConfig::default() },
            max_retries: 6,
            retry_timeout: Duration::from_secs(60),
        };
        let refused = |error: object_store::Error| wrong(told(&error));
        let root = format!("{scheme}://{host}");
        choose_tls();
        let store: Arc<dyn ObjectStore> = match scheme {
            "s3" => {
                // Whoever names an endpoint without TLS means it: a server of their own.
                let endpoint = ["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT"];
                let endpoint = endpoint.iter().find_map(|name| std::env::var(name).ok());
                let builder = AmazonS3Builder::from_env().with_url(&root).with_retry(retry);
                let builder = match endpoint {
                    Some(endpoint) => {
                        let is_plain = endpoint.starts_with("http://");
                        let builder = builder.with_endpoint(endpoint);
                        if is_plain { builder.with_allow_http(true) } else { builder }
                    }
                    None => builder,
                };
                Arc::new(builder.build().map_err(refused)?)
            }
            "gs" => {
                let builder = GoogleCloudStorageBuilder::from_env().with_url(&root).with_retry(retry);
                Arc::new(builder.build().map_err(refused)?)
            }
            "http" | "https" => {
                let options = ClientOptions::new().with_allow_http(scheme == "http");
                let builder = HttpBuilder::new().with_url(&root).with_retry(retry);
                Arc::new(builder.with_client_options(options).build().map_err(refused)?)
            }
            "az" | "abfs" | "abfss" => {
                let builder = MicrosoftAzureBuilder::from_env().with_url(&root).with_retry(retry);
                Arc::new(builder.build().map_err(refused)?)
            }
            _ => return Err(no_bucket()),
        };
        let prefix = Key::parse(prefix.trim_end_matches('/')).map_err(|error| wrong(error.to_string()))?;
        let can_write = !scheme.starts_with("http");
        Ok(Self { url: url.trim_end_matches('/').to_owned(), store, prefix, can_write })
    }

    /// A place below a prefix of any object store; `url` is what messages call it.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] for a prefix that no object has.
    pub fn on(store: Arc<dyn ObjectStore>, prefix: &str, url: &str) -> Result<Self> {
        let prefix = Key::parse(prefix).map_err(|error| Error::argument(url, error.to_string()))?;
        Ok(Self { url: url.to_owned(), store, prefix, can_write: true })
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
        let key = self.key(MANIFEST);
        let failed = |error| Error::io(&self.path().join(MANIFEST), "read", error);
        let (bytes, version) = match self.get(key.clone(), MOST_LIST_BYTES).wait() {
            Ok(found) => found,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(failed(error)),
        };
        let manifest = Manifest::from_bytes(&bytes).map_err(|reason| {
            failed(io::Error::new(io::ErrorKind::InvalidData, format!("{key}: {reason}")))
        })?;
        Ok(Some(FoundManifest { manifest, version }))
    }

    /// Puts a manifest in place of the one that was found, if that is still there.
    ///
    /// # Errors
    ///
    /// One of the kind `AlreadyExists` if it is not; a store that refuses.
    pub(super) fn replace_manifest(&self, manifest: &Manifest, found: Option<UpdateVersion>) -> Result<()> {
        let (store, key) = (self.store.clone(), self.key(MANIFEST));
        let failed = |error| Error::io(&self.path().join(MANIFEST), "write", error);
        let bytes = manifest.to_bytes().map_err(|error| failed(error.into()))?;
        let mode = found.map_or(PutMode::Create, PutMode::Update);
        let options = PutOptions { mode, ..PutOptions::default() };
        let put = pending(async move {
            let outcome = store.put_opts(&key, bytes.into(), options).await;
            Ok(outcome.map(drop))
        });
        match put.wait().map_err(failed)? {
            Ok(()) => Ok(()),
            Err(object_store::Error::Precondition { .. } | object_store::Error::AlreadyExists { .. }) => {
                Err(self.overtaken())
            }
            Err(error) => Err(failed(io::Error::other(told(&error)))),
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
        let this = self.clone();
        pending(async move {
            let key = this.key(&name.key());
            for _ in 0..FETCHES {
                let (content, _) = get(&this.store, &key, None, most_bytes).await?;
                // Hashing is work, though short beside the way over the network.
                if ObjectName::of(&content) == name {
                    return Ok(content);
                }
            }
            let reason = format!("object {key}: its content is not what its name says; push the map again");
            Err(io::Error::new(io::ErrorKind::InvalidData, reason))
        })
    }

    /// Begins to fetch some bytes of an object. Nothing tells here whether they are the right ones.
    pub(super) fn fetch_bytes(&self, name: ObjectName, range: Range<u64>) -> Pending<Bytes> {
        let this = self.clone();
        pending(async move {
            let key = this.key(&name.key());
            let bytes = range.end.saturating_sub(range.start);
            let (content, _) = get(&this.store, &key, Some(range), bytes).await?;
            Ok(content)
        })
    }

    /// Reads a list of files.
    pub(super) fn fetch_list(&self, name: ObjectName) -> io::Result<Bytes> {
        self.fetch(name, MOST_LIST_BYTES).wait()
    }

    /// Begins to put an object.
    pub(super) fn put(&self, name: ObjectName, content: Bytes) -> Pending<()> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        pending(async move {
            let put = store.put(&key, content.into()).await;
            put.map(drop).map_err(|error| refused(&key, &error))
        })
    }

    /// When the manifest was put, and the objects put before then.
    pub(super) fn objects_before_manifest(&self) -> io::Result<Vec<ObjectName>> {
        let (store, key, folder) = (self.store.clone(), self.key(MANIFEST), self.key(OBJECTS));
        pending(async move {
            let manifest = store.head(&key).await.map_err(|error| refused(&key, &error))?;
            let listed = store.list(Some(&folder)).try_filter_map(|object| {
                let is_older = object.last_modified < manifest.last_modified;
                let name = object.location.filename().and_then(ObjectName::from_digits);
                std::future::ready(Ok(name.filter(|_| is_older)))
            });
            listed.try_collect().await.map_err(|error| refused(&folder, &error))
        })
        .wait()
    }

    /// Begins to remove an object; one that is not there is removed.
    pub(super) fn remove(&self, name: ObjectName) -> Pending<()> {
        let (store, key) = (self.store.clone(), self.key(&name.key()));
        pending(async move {
            match store.delete(&key).await {
                Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
                Err(error) => Err(refused(&key, &error)),
            }
        })
    }

    /// Whether a map is there.
    pub fn has_map(&self) -> bool {
        let (store, key) = (self.store.clone(), self.key(MANIFEST));
        pending(async move { store.head(&key).await.map_err(|error| refused(&key, &error)) }).wait().is_ok()
    }

    /// Begins to list the object of the URL itself, or those below it, by name.
    pub(super) fn objects_below(&self) -> Pending<Vec<StoredObject>> {
        let (store, prefix) = (self.store.clone(), self.prefix.clone());
        pending(async move {
            let object = |meta: object_store::ObjectMeta, name: String, is_url| StoredObject {
                name,
                is_url,
                bytes: meta.size,
                key: meta.location,
                e_tag: meta.e_tag,
            };
            match store.head(&prefix).await {
                Ok(meta) if meta.size > 0 => {
                    let name = prefix.filename().unwrap_or_default().to_owned();
                    return Ok(vec![object(meta, name, true)]);
                }
                Ok(_) | Err(object_store::Error::NotFound { .. }) => {}
                Err(error) => return Err(refused(&prefix, &error)),
            }
            let listed = store.list(Some(&prefix)).try_filter_map(|meta| {
                let name: Option<Key> = meta.location.prefix_match(&prefix).map(|parts| parts.collect());
                // Some tools put an empty object where a folder would be.
                let is_file = meta.size > 0 || meta.location.extension().is_some();
                let name = name.filter(|name| is_file && !name.as_ref().is_empty());
                std::future::ready(Ok(name.map(|name| object(meta, name.as_ref().to_owned(), false))))
            });
            let mut objects: Vec<StoredObject> =
                listed.try_collect().await.map_err(|error| refused(&prefix, &error))?;
            objects.sort_by(|a, b| a.name.cmp(&b.name));
            Ok(objects)
        })
    }

    /// Begins to fetch an object into a file, as it was when it was listed.
    pub(super) fn fetch_file(&self, object: StoredObject, to: PathBuf) -> Pending<()> {
        let store = self.store.clone();
        pending(async move {
            let began = Instant::now();
            for _ in 1..FETCHES {
                match fetch_file_once(&store, &object, &to).await {
                    Err(error) if error.kind() == io::ErrorKind::Other && began.elapsed() < LATEST_RETRY => {}
                    outcome => return outcome,
                }
            }
            fetch_file_once(&store, &object, &to).await
        })
    }

    fn get(&self, key: Key, most_bytes: u64) -> Pending<(Bytes, UpdateVersion)> {
        let store = self.store.clone();
        pending(async move { get(&store, &key, None, most_bytes).await })
    }

    fn key(&self, name: &str) -> Key {
        let name = Key::from(name);
        self.prefix.parts().chain(name.parts()).collect()
    }
}

impl<T> Pending<T> {
    /// Waits for the answer.
    pub(super) fn wait(self) -> io::Result<T> {
        self.answer.recv().unwrap_or_else(|_| Err(given_up()))
    }

    /// Waits for the answer; `None` if that is to stop before it comes. Nothing of the request goes on then.
    pub(super) fn wait_unless(self, is_stopped: &dyn Fn() -> bool) -> Option<io::Result<T>> {
        while !is_stopped() {
            match self.answer.recv_timeout(PATIENCE) {
                Ok(answer) => return Some(answer),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Some(Err(given_up())),
            }
        }
        self.give_up();
        None
    }

    /// Ends the request, and waits until nothing of it goes on.
    pub(super) fn give_up(self) {
        if let Some(task) = &self.task {
            task.abort();
        }
        // An answer after all, or the end of who would have sent one.
        let _ = self.answer.recv();
    }
}

fn given_up() -> io::Error {
    io::Error::other("the request was given up")
}

/// Begins a request on threads of its own, so that the caller may be on any thread, even one of another runtime.
fn pending<T: Send + 'static>(request: impl Future<Output = io::Result<T>> + Send + 'static) -> Pending<T> {
    static RUNTIME: OnceLock<io::Result<Runtime>> = OnceLock::new();
    let new = || {
        let mut builder = tokio::runtime::Builder::new_multi_thread();
        builder.worker_threads(2).thread_name("voxtile-bucket").enable_all().build()
    };
    let (out, answer) = sync_channel(1);
    let task = match RUNTIME.get_or_init(new) {
        Ok(runtime) => Some(runtime.spawn(async move { out.send(request.await) }).abort_handle()),
        Err(error) => {
            let reason = format!("no threads for the network: {error}");
            let _ = out.send(Err(io::Error::other(reason)));
            None
        }
    };
    Pending { answer, task }
}

/// Gets an object, or some of its bytes. An answer that is cut off is asked for again; the store itself does that only
/// before it begins.
async fn get(
    store: &dyn ObjectStore,
    key: &Key,
    range: Option<Range<u64>>,
    most_bytes: u64,
) -> io::Result<(Bytes, UpdateVersion)> {
    let began = Instant::now();
    for _ in 1..FETCHES {
        match get_once(store, key, range.clone(), most_bytes).await {
            Err(error) if error.kind() == io::ErrorKind::Other && began.elapsed() < LATEST_RETRY => {}
            outcome => return outcome,
        }
    }
    get_once(store, key, range, most_bytes).await
}

async fn get_once(
    store: &dyn ObjectStore,
    key: &Key,
    range: Option<Range<u64>>,
    most_bytes: u64,
) -> io::Result<(Bytes, UpdateVersion)> {
    let options = GetOptions { range: range.map(GetRange::Bounded), ..GetOptions::default() };
    let found = store.get_opts(key, options).await.map_err(|error| refused(key, &error))?;
    let bytes = found.range.end.saturating_sub(found.range.start);
    if bytes > most_bytes {
        let reason = format!("object {key}: {bytes} bytes, and at most {most_bytes} belong there");
        return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
    }
    let version = UpdateVersion { e_tag: found.meta.e_tag.clone(), version: found.meta.version.clone() };
    // A server may send more than it said.
    let mut content = Vec::new();
    let mut stream = found.into_stream();
    while let Some(chunk) = stream.try_next().await.map_err(|error| refused(key, &error))? {
        content.extend_from_slice(&chunk);
        if content.len() as u64 > most_bytes {
            let reason = format!("object {key}: more than the {most_bytes} bytes that belong there");
            return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
        }
    }
    Ok((content.into(), version))
}

async fn fetch_file_once(store: &dyn ObjectStore, object: &StoredObject, to: &Path) -> io::Result<()> {
    let key = &object.key;
    let options = GetOptions { if_match: object.e_tag.clone(), ..GetOptions::default() };
    let found = match store.get_opts(key, options).await {
        Ok(found) => found,
        Err(object_store::Error::Precondition { .. }) => {
            let reason = format!("object {key}: it was changed while it was read; begin again");
            return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
        }
        Err(error) => return Err(refused(key, &error)),
    };
    let mut stream = found.into_stream();
    let on_disk = |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", to.display()));
    let (mut file, mut bytes) = (FsDisk.create(to).map_err(on_disk)?, 0);
    while let Some(chunk) = stream.try_next().await.map_err(|error| refused(key, &error))? {
        file.write_all(&chunk).map_err(on_disk)?;
        bytes += chunk.len() as u64;
    }
    if bytes == object.bytes {
        return Ok(());
    }
    Err(io::Error::other(format!("object {key}: {bytes} bytes came, and it has {}", object.bytes)))
}

/// The refusal of an object store, which names the object.
fn refused(key: &Key, error: &object_store::Error) -> io::Error {
    let kind = match error {
        object_store::Error::NotFound { .. } => io::ErrorKind::NotFound,
        object_store::Error::PermissionDenied { .. } | object_store::Error::Unauthenticated { .. } => {
            io::ErrorKind::PermissionDenied
        }
        _ => io::ErrorKind::Other,
    };
    io::Error::new(kind, format!("object {key}: {}", told(error)))
}

/// An error with its causes, on one line.
fn told(error: &object_store::Error) -> String {
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

/// Of the two libraries that could encrypt, the one that the rest of voxtile has.
fn choose_tls() {
    // Whoever has chosen one before keeps it.
    let _ = rustls::crypto::ring::default_provider().install_default();
}
