use futures_util::future::BoxFuture;
use futures_util::stream::{self, BoxStream, StreamExt};
use std::fmt;
use std::sync::{Arc, Mutex};
use voxtile_bucket::object_store::memory::InMemory;
use voxtile_bucket::object_store::path::Path as Key;
use voxtile_bucket::object_store::{
    CopyOptions, Error, GetOptions, GetRange, GetResult, GetResultPayload, ListResult, MultipartUpload,
    ObjectMeta, ObjectStore, PutMultipartOptions, PutOptions, PutPayload, PutResult, Result,
};

/// Selects the fault for a request, given the number of earlier requests.
type Faults = dyn Fn(&SeenRequest, usize) -> Fault + Send + Sync;

/// Store in memory that records requests and injects faults.
pub struct FaultyStore {
    inner: Arc<InMemory>,
    requests: Mutex<Vec<SeenRequest>>,
    fault: Box<Faults>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct SeenRequest {
    pub kind: Kind,
    pub key: String,
    /// Number of bytes written or read; `None` for all.
    pub bytes: Option<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Put,
    Get,
    Head,
}

pub enum Fault {
    None,
    Refused,
    /// Fails like a broken connection.
    Fails,
    /// Executes the request, and then reports a failed precondition, as if the client had repeated the request.
    DoneBefore,
    /// Returns half of the response.
    CutOff,
}

impl FaultyStore {
    /// Creates a store. `fault` receives each request and the number of earlier ones.
    pub fn new(
        inner: Arc<InMemory>,
        fault: impl Fn(&SeenRequest, usize) -> Fault + Send + Sync + 'static,
    ) -> Arc<Self> {
        Arc::new(Self { inner, requests: Mutex::default(), fault: Box::new(fault) })
    }

    pub fn requests(&self, kind: Kind) -> Vec<SeenRequest> {
        self.requests.lock().unwrap().iter().filter(|request| request.kind == kind).cloned().collect()
    }

    fn note(&self, request: SeenRequest) -> Fault {
        let before = {
            let mut all = self.requests.lock().unwrap();
            all.push(request.clone());
            all.len() - 1
        };
        (self.fault)(&request, before)
    }
}

fn refused(key: &Key) -> Error {
    Error::PermissionDenied { path: key.to_string(), source: "not for you".into() }
}

fn failed() -> Error {
    Error::Generic { store: "test", source: "the connection broke".into() }
}

fn cut_off(found: GetResult) -> GetResult {
    let GetResult { payload, meta, range, attributes, extensions } = found;
    let GetResultPayload::Stream(whole) = payload;
    let half = whole.map(|chunk| chunk.map(|chunk| chunk.slice(..chunk.len() / 2)));
    let payload = GetResultPayload::Stream(half.chain(stream::iter([Err(failed())])).boxed());
    GetResult { payload, meta, range, attributes, extensions }
}

impl ObjectStore for FaultyStore {
    fn put_opts<'a, 'b, 'c>(
        &'a self,
        key: &'b Key,
        payload: PutPayload,
        options: PutOptions,
    ) -> BoxFuture<'c, Result<PutResult>>
    where
        'a: 'c,
        'b: 'c,
    {
        Box::pin(async move {
            let bytes = Some(payload.content_length() as u64);
            match self.note(SeenRequest { kind: Kind::Put, key: key.to_string(), bytes }) {
                Fault::None | Fault::CutOff => self.inner.put_opts(key, payload, options).await,
                Fault::Refused => Err(refused(key)),
                Fault::Fails => Err(failed()),
                Fault::DoneBefore => {
                    self.inner.put_opts(key, payload, options).await?;
                    Err(Error::Precondition { path: key.to_string(), source: "it is another".into() })
                }
            }
        })
    }

    fn put_multipart_opts<'a, 'b, 'c>(
        &'a self,
        key: &'b Key,
        options: PutMultipartOptions,
    ) -> BoxFuture<'c, Result<Box<dyn MultipartUpload>>>
    where
        'a: 'c,
        'b: 'c,
    {
        self.inner.put_multipart_opts(key, options)
    }

    fn get_opts<'a, 'b, 'c>(&'a self, key: &'b Key, options: GetOptions) -> BoxFuture<'c, Result<GetResult>>
    where
        'a: 'c,
        'b: 'c,
    {
        Box::pin(async move {
            let bytes = match &options.range {
                Some(GetRange::Bounded(range)) => Some(range.end - range.start),
                _ => None,
            };
            let kind = if options.head { Kind::Head } else { Kind::Get };
            match self.note(SeenRequest { kind, key: key.to_string(), bytes }) {
                Fault::None | Fault::DoneBefore => self.inner.get_opts(key, options).await,
                Fault::Refused => Err(refused(key)),
                Fault::Fails => Err(failed()),
                Fault::CutOff => self.inner.get_opts(key, options).await.map(cut_off),
            }
        })
    }

    fn delete_stream(&self, keys: BoxStream<'static, Result<Key>>) -> BoxStream<'static, Result<Key>> {
        self.inner.delete_stream(keys)
    }

    fn list(&self, prefix: Option<&Key>) -> BoxStream<'static, Result<ObjectMeta>> {
        self.inner.list(prefix)
    }

    fn list_with_delimiter<'a, 'b, 'c>(&'a self, prefix: Option<&'b Key>) -> BoxFuture<'c, Result<ListResult>>
    where
        'a: 'c,
        'b: 'c,
    {
        self.inner.list_with_delimiter(prefix)
    }

    fn copy_opts<'a, 'b, 'c, 'd>(
        &'a self,
        from: &'b Key,
        to: &'c Key,
        options: CopyOptions,
    ) -> BoxFuture<'d, Result<()>>
    where
        'a: 'd,
        'b: 'd,
        'c: 'd,
    {
        self.inner.copy_opts(from, to, options)
    }
}

impl fmt::Debug for FaultyStore {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("FaultyStore")
    }
}

impl fmt::Display for FaultyStore {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("FaultyStore")
    }
}
