use super::request::{PROGRESS_BYTES, REQUEST, Request};
use bytes::Bytes;
use futures_util::future::BoxFuture;
use futures_util::{TryStreamExt, stream};
use http_body_util::BodyExt;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpRequestBody, HttpResponse,
    HttpResponseBody, HttpService,
};
use object_store::{ClientConfigKey, ClientOptions};
use std::sync::Arc;
use std::time::Duration;

/// Connector whose clients count the bytes that they send: the clients of `object_store` do not report the progress of
/// an upload.
#[derive(Debug, Default)]
pub(super) struct CountingConnector;

#[derive(Debug)]
struct CountingClient(reqwest::Client);

impl HttpConnector for CountingConnector {
    fn connect(&self, options: &ClientOptions) -> object_store::Result<HttpClient> {
        let failed = |source| object_store::Error::Generic { store: "client", source };
        let builder = builder_of(options).map_err(failed)?;
        let client = builder.build().map_err(|error| failed(error.into()))?;
        Ok(HttpClient::new(CountingClient(client)))
    }
}

/// Builds a client with the options that the environment can set, except for HTTP/2.
fn builder_of(
    options: &ClientOptions,
) -> Result<reqwest::ClientBuilder, Box<dyn std::error::Error + Send + Sync>> {
    let text = |key| options.get_config_value(&key);
    let duration = |key| text(key).map(|value| humantime::parse_duration(&value)).transpose();
    let is_set = |key| text(key).is_some_and(|value| value == "true" || value == "1");
    let agent = concat!(env!("CARGO_PKG_NAME"), "/", env!("CARGO_PKG_VERSION"));
    let mut builder = reqwest::Client::builder()
        .http1_only()
        .https_only(!is_set(ClientConfigKey::AllowHttp))
        .user_agent(text(ClientConfigKey::UserAgent).unwrap_or_else(|| agent.to_owned()));
    if let Some(headers) = options.get_default_headers() {
        builder = builder.default_headers(headers.clone());
    }
    if let Some(url) = text(ClientConfigKey::ProxyUrl) {
        let mut proxy = reqwest::Proxy::all(url)?;
        if let Some(excludes) = text(ClientConfigKey::ProxyExcludes) {
            proxy = proxy.no_proxy(reqwest::NoProxy::from_string(&excludes));
        }
        builder = builder.proxy(proxy);
    }
    if let Some(certificate) = text(ClientConfigKey::ProxyCaCertificate) {
        let certificate = reqwest::Certificate::from_pem(certificate.as_bytes())?;
        builder = builder.tls_certs_merge([certificate]);
    }
    if is_set(ClientConfigKey::NoSystemCertificates) {
        builder = builder.tls_certs_only([]);
    }
    if is_set(ClientConfigKey::AllowInvalidCertificates) {
        builder = builder.tls_danger_accept_invalid_certs(true);
    }
    if let Some(timeout) = duration(ClientConfigKey::Timeout)? {
        builder = builder.timeout(timeout);
    }
    if let Some(timeout) = duration(ClientConfigKey::ReadTimeout)? {
        builder = builder.read_timeout(timeout);
    }
    if let Some(timeout) = duration(ClientConfigKey::PoolIdleTimeout)? {
        builder = builder.pool_idle_timeout(timeout);
    }
    if let Some(max_idle) = text(ClientConfigKey::PoolMaxIdlePerHost) {
        builder = builder.pool_max_idle_per_host(max_idle.parse()?);
    }
    let connecting = duration(ClientConfigKey::ConnectTimeout)?.unwrap_or(Duration::from_secs(5));
    Ok(builder.connect_timeout(connecting))
}

impl HttpService for CountingClient {
    fn call<'a, 'b>(&'a self, request: HttpRequest) -> BoxFuture<'b, Result<HttpResponse, HttpError>>
    where
        'a: 'b,
        Self: 'b,
    {
        Box::pin(async move {
            let counted = REQUEST.try_with(Arc::clone).ok();
            if let (Some(counted), Some(server)) = (&counted, request.uri().authority()) {
                // The part after `@`, without a user name and password.
                counted.set_server(server.as_str().rsplit('@').next().unwrap_or_default().to_owned());
            }
            let for_body = counted.clone();
            let request = reqwest::Request::try_from(request.map(|body| body_of(body, for_body)));
            let request = request.map_err(|error| failed(error, None))?;
            let response =
                self.0.execute(request).await.map_err(|error| failed(error, counted.as_deref()))?;
            if let Some(counted) = &counted {
                counted.set_status(response.status().as_u16());
            }
            let response = hyper::Response::<reqwest::Body>::from(response);
            Ok(response.map(|body| HttpResponseBody::new(body.map_err(|error| failed(error, None)))))
        })
    }
}

/// Returns the body of a request. The content is sent in slices, and each slice is counted when it is sent.
fn body_of(body: HttpRequestBody, counted: Option<Arc<Request>>) -> reqwest::Body {
    if let Some(bytes) = body.as_bytes() {
        return bytes.clone().into();
    }
    let slices = move |mut bytes: Bytes| {
        let counted = counted.clone();
        stream::iter(std::iter::from_fn(move || {
            let slice = bytes.split_to(bytes.len().min(PROGRESS_BYTES as usize));
            (!slice.is_empty()).then(|| {
                counted.iter().for_each(|request| request.add_bytes(slice.len() as u64));
                Ok::<_, HttpError>(slice)
            })
        }))
    };
    reqwest::Body::wrap_stream(body.into_data_stream().map_ok(slices).try_flatten())
}

fn failed(error: reqwest::Error, counted: Option<&Request>) -> HttpError {
    let kind = if error.is_timeout() {
        HttpErrorKind::Timeout
    } else if error.is_connect() {
        HttpErrorKind::Connect
    } else if error.is_decode() {
        HttpErrorKind::Decode
    } else {
        HttpErrorKind::Interrupted
    };
    if let (true, Some(counted)) = (error.is_connect(), counted) {
        counted.set_unreachable();
    }
    // The caller adds the name of the object.
    HttpError::new(kind, error.without_url())
}
