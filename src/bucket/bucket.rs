use super::file_fetch::fetch_file;
use super::manifest::{MANIFEST, Manifest};
use super::object_name::{OBJECTS, ObjectName};
use super::remote_store::{READING, SENDING, remote_store};
use crate::error::{Error, Result};
use bytes::Bytes;
use futures_util::TryStreamExt;
use object_store::path::Path as Key;
use object_store::{GetOptions, GetRange, ObjectStore, ObjectStoreExt, PutMode, PutOptions, UpdateVersion};
use std::io;
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
    /// The same for objects that are put, which takes longer.
    sending: Arc<dyn ObjectStore>,
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
    pub(super) key: Key,
    pub(super) e_tag: Option<String>,
    /// When it was put, in seconds of Unix time; 0 where the store does not tell.
    pub(super) modified_s: i64,
}

/// How often content is fetched that is not what its name says: a proxy may have cut it off.
const FETCHES: usize = 3;

/// What took longer to fail is not tried again.
const LATEST_RETRY: Duration = Duration::from_secs(10);

/// How long an answer may keep us waiting before we look up.
const PATIENCE: Duration = Duration::from_millis(100);

/// What helps where an object is lost or damaged.
pub(super) const SEND_AGAIN: &str = "send all of the map again with `voxtile push --resend`";

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
        let root = format!("{scheme}://{host}");
        let store = remote_store(url, scheme, &root, READING)?.ok_or_else(no_bucket)?;
        let sending = remote_store(url, scheme, &root, SENDING)?.ok_or_else(no_bucket)?;
        let prefix = Key::parse(prefix.trim_end_matches('/')).map_err(|error| wrong(error.to_string()))?;
        let can_write = !scheme.starts_with("http");
        Ok(Self { url: url.trim_end_matches('/').to_owned(), store, sending, prefix, can_write })
    }

    /// A place below a prefix of any object store; `url` is what messages call it.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] for a prefix that no object has.
    pub fn on(store: Arc<dyn ObjectStore>, prefix: &str, url: &str) -> Result<Self> {
        let prefix = Key::parse(prefix).map_err(|error| Error::argument(url, error.to_string()))?;
        Ok(Self { url: url.to_owned(), sending: store.clone(), store, prefix, can_write: true })
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
        match self.get(self.key(MANIFEST), MOST_LIST_BYTES).wait() {
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
        let (store, key) = (self.sending.clone(), self.key(MANIFEST));
        let failed = |error| Error::io(&self.path().join(MANIFEST), "write", error);
        let bytes = Bytes::from(manifest.to_bytes().map_err(|error| failed(error.into()))?);
        let mode = found.map_or(PutMode::Create, PutMode::Update);
        let options = PutOptions { mode, ..PutOptions::default() };
        let content = bytes.clone();
        let put = pending(async move { Ok(store.put_opts(&key, content.into(), options).await) });
        let Err(error) = put.wait().map_err(failed)? else { return Ok(()) };
        // A request whose answer was lost is made again, and finds in its way what it has put itself.
        if self.manifest_bytes().is_ok_and(|found| found.is_some_and(|(found, _)| found == bytes)) {
            return Ok(());
        }
        match error {
            object_store::Error::Precondition { .. } | object_store::Error::AlreadyExists { .. } => {
                Err(self.overtaken())
            }
            error => Err(failed(io::Error::other(told(&error)))),
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
            let reason = format!("object {key}: its content is not what its name says; {SEND_AGAIN}");
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

    /// Begins to put an object; `false` if that is there already, of which the store is asked before where `asks`.
    pub(super) fn put(&self, name: ObjectName, content: Bytes, asks: bool) -> Pending<bool> {
        let (store, sending, key) = (self.store.clone(), self.sending.clone(), self.key(&name.key()));
        pending(async move {
            // A name is of one content, and an object is there whole or not at all. Who may not ask may put.
            if asks
                && let Ok(there) = store.head(&key).await
                && there.size == content.len() as u64
            {
                return Ok(false);
            }
            let put = sending.put(&key, content.into()).await;
            put.map(|_| true).map_err(|error| refused(&key, &error))
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

    /// Whether a map is there. `is_stopped` is asked ten times a second.
    ///
    /// # Errors
    ///
    /// A store that refuses or does not answer; [`Error::Stopped`].
    pub fn has_map(&self, is_stopped: &dyn Fn() -> bool) -> Result<bool> {
        let (store, key, prefix) = (self.store.clone(), self.key(MANIFEST), self.prefix.clone());
        let asked = pending(async move {
            match store.head(&key).await {
                Ok(_) => Ok(true),
                Err(object_store::Error::NotFound { .. }) => Ok(false),
                Err(error) => {
                    let error = refused(&key, &error);
                    // Where nothing may be listed, stores do not say that an object is missing. A file is no map.
                    let is_file = error.kind() == io::ErrorKind::PermissionDenied
                        && !prefix.as_ref().is_empty()
                        && store.head(&prefix).await.is_ok_and(|file| file.size > 0);
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
        pending(async move {
            let object = |meta: object_store::ObjectMeta, name: String, is_url| StoredObject {
                name,
                is_url,
                bytes: meta.size,
                modified_s: meta.last_modified.timestamp(),
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
        pending(async move { fetch_file(&store, &object, &to).await })
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
