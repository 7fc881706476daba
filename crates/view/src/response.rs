use super::answer_memory::AnswerMemory;
use super::connections::Connection;
use bytes::Bytes;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use http_body_util::combinators::UnsyncBoxBody;
use http_body_util::{BodyExt, Full};
use hyper::header::{CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE, HeaderValue, RETRY_AFTER};
use hyper::{Response, StatusCode};
use std::convert::Infallible;
use std::io::{Read, Write};

pub type Body = UnsyncBoxBody<Bytes, Infallible>;

/// Caching of a response in the browser.
#[derive(Clone, Copy, PartialEq)]
pub enum Keep {
    /// Not cached: it may change.
    No,
    /// Cached forever: its URL contains its version.
    ForEver,
}

/// Response before content negotiation.
pub struct Answer {
    pub status: StatusCode,
    pub kind: &'static str,
    /// Content, compressed with gzip.
    pub gzip: Bytes,
    /// Uncompressed content that all clients share and that needs no extra memory.
    pub shared: Option<Bytes>,
    pub keep: Keep,
}

const JSON: &str = "application/json";
/// Only the page's own files are loaded, and other pages cannot embed it.
const POLICY: &str = "default-src 'self'; style-src 'self'; img-src 'self' data: blob:; worker-src 'self' blob:; \
                      connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    // Writes to memory cannot fail.
    gzip.write_all(bytes).and_then(|()| gzip.finish()).unwrap_or_default()
}

impl Answer {
    pub fn json(mut value: serde_json::Value) -> Self {
        // Same version as in the JSON of the command.
        if let Some(object) = value.as_object_mut().filter(|object| !object.contains_key("asset")) {
            object.insert("version".into(), 1.into());
        }
        Self::new(JSON, gzip(value.to_string().as_bytes()), Keep::No)
    }

    pub fn metrics(text: &str) -> Self {
        Self::new(voxtile_monitoring::CONTENT_TYPE, gzip(text.as_bytes()), Keep::No)
    }

    pub fn bytes(gzip: Vec<u8>, keep: Keep) -> Self {
        Self::new("application/octet-stream", gzip, keep)
    }

    fn new(kind: &'static str, gzip: Vec<u8>, keep: Keep) -> Self {
        Self { status: StatusCode::OK, kind, gzip: gzip.into(), shared: None, keep }
    }

    pub fn error(status: StatusCode, reason: &str) -> Self {
        Self { status, ..Self::json(serde_json::json!({ "error": reason })) }
    }

    /// Returns the response, or an error if responses in flight use too much memory.
    pub fn into_response(
        self,
        takes_gzip: bool,
        memory: &AnswerMemory,
        connection: &Connection,
    ) -> Response<Body> {
        let hold = |bytes| memory.hold(connection, bytes);
        let bytes = match (takes_gzip, self.shared) {
            (true, Some(_)) => Some(self.gzip),
            (false, Some(plain)) => Some(plain),
            (true, None) => hold(self.gzip),
            (false, None) => hold(plain(&self.gzip).into()),
        };
        let Some(bytes) = bytes else {
            connection.end_stalled();
            let reason = "memory for responses is in use by slow clients; retry in some seconds";
            let error = Self::error(StatusCode::SERVICE_UNAVAILABLE, reason);
            let mut response = error.into_response(takes_gzip, memory, connection);
            response.headers_mut().insert(RETRY_AFTER, HeaderValue::from_static("5"));
            return response;
        };
        let mut response = empty(self.status);
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(self.kind));
        if takes_gzip {
            headers.insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
        }
        let keep = match self.keep {
            Keep::No => "no-store",
            Keep::ForEver => "private, max-age=31536000, immutable",
        };
        headers.insert(CACHE_CONTROL, HeaderValue::from_static(keep));
        *response.body_mut() = Full::new(bytes).boxed_unsync();
        response
    }
}

/// Returns a response with the common headers.
pub fn empty(status: StatusCode) -> Response<Body> {
    let mut response = Response::new(Full::default().boxed_unsync());
    *response.status_mut() = status;
    for (name, value) in [
        ("content-security-policy", POLICY),
        ("referrer-policy", "no-referrer"),
        ("x-content-type-options", "nosniff"),
        ("cross-origin-resource-policy", "same-origin"),
        ("vary", "accept-encoding"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

fn plain(gzip: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Built by this server, so decoding cannot fail.
    GzDecoder::new(gzip).read_to_end(&mut bytes).unwrap_or_default();
    bytes
}
