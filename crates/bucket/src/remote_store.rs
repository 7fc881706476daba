use super::counting_client::CountingConnector;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::azure::{AzureConfigKey, MicrosoftAzureBuilder};
use object_store::gcp::{GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::http::HttpBuilder;
use object_store::{ClientConfigKey, ObjectStore, RetryConfig};
use std::sync::Arc;
use std::time::Duration;
use voxtile::{Error, Result};

/// Timeout of a whole request with its content. `Request` ends requests without progress earlier; a request with
/// progress may take long, such as the download of a whole file.
const REQUEST_TIMEOUT: &str = "1 day";

/// Returns the store of a URL, by its scheme and root; `None` for an unknown scheme.
///
/// # Errors
///
/// [`Error::InvalidArgument`] if an environment variable is missing or invalid.
pub(super) fn remote_store(url: &str, scheme: &str, root: &str) -> Result<Option<Arc<dyn ObjectStore>>> {
    choose_tls();
    let refused = |error: object_store::Error| Error::argument(url, super::bucket::error_text(&error));
    Ok(Some(match scheme {
        "s3" => Arc::new(amazon(root).build().map_err(refused)?),
        "gs" => Arc::new(google(root).build().map_err(refused)?),
        "az" | "abfs" | "abfss" => Arc::new(azure(root).build().map_err(refused)?),
        "http" | "https" => Arc::new(web(root, scheme == "http").build().map_err(refused)?),
        _ => return Ok(None),
    }))
}

/// Chooses the cryptography library of rustls that the rest of voxtile uses.
fn choose_tls() {
    // This fails if the program has already chosen a library. Its choice is kept.
    let _ = rustls::crypto::ring::default_provider().install_default();
}

fn amazon(root: &str) -> AmazonS3Builder {
    // An endpoint without TLS is allowed if the user sets one, such as a local server.
    let endpoint = ["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT"];
    let endpoint = endpoint.iter().find_map(|name| std::env::var(name).ok());
    let mut builder = AmazonS3Builder::from_env()
        .with_url(root)
        .with_retry(no_retries())
        .with_http_connector(CountingConnector);
    if !is_set("AWS_TIMEOUT") {
        builder = builder.with_config(AmazonS3ConfigKey::Client(ClientConfigKey::Timeout), REQUEST_TIMEOUT);
    }
    match endpoint {
        Some(endpoint) => {
            let is_plain = endpoint.starts_with("http://");
            let builder = builder.with_endpoint(endpoint);
            if is_plain { builder.with_allow_http(true) } else { builder }
        }
        None => builder,
    }
}

fn google(root: &str) -> GoogleCloudStorageBuilder {
    let builder = GoogleCloudStorageBuilder::from_env().with_url(root).with_retry(no_retries());
    let builder = builder.with_http_connector(CountingConnector);
    if is_set("GOOGLE_TIMEOUT") {
        return builder;
    }
    builder.with_config(GoogleConfigKey::Client(ClientConfigKey::Timeout), REQUEST_TIMEOUT)
}

fn azure(root: &str) -> MicrosoftAzureBuilder {
    let builder = MicrosoftAzureBuilder::from_env().with_url(root).with_retry(no_retries());
    let builder = builder.with_http_connector(CountingConnector);
    if is_set("AZURE_TIMEOUT") {
        return builder;
    }
    builder.with_config(AzureConfigKey::Client(ClientConfigKey::Timeout), REQUEST_TIMEOUT)
}

fn web(root: &str, is_plain: bool) -> HttpBuilder {
    let builder = HttpBuilder::new().with_url(root).with_retry(no_retries());
    let builder = builder.with_http_connector(CountingConnector);
    let builder = builder.with_config(ClientConfigKey::AllowHttp, is_plain.to_string());
    builder.with_config(ClientConfigKey::Timeout, REQUEST_TIMEOUT)
}

/// Disables the retries of the client: `Request` retries, keeps the bytes received, and has the timeout.
fn no_retries() -> RetryConfig {
    RetryConfig { max_retries: 0, retry_timeout: Duration::ZERO, ..RetryConfig::default() }
}

/// Returns whether an environment variable is set. A timeout set there has priority.
fn is_set(name: &str) -> bool {
    std::env::var_os(name).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With eight downloads on a slow link, a part of 16 MiB takes longer than the client's default timeout of 30 s.
    #[test]
    fn all_clients_wait_for_slow_links() {
        let (amazon, google, azure) = (amazon("s3://robots"), google("gs://robots"), azure("az://robots"));
        let bounds = [
            amazon.get_config_value(&AmazonS3ConfigKey::Client(ClientConfigKey::Timeout)),
            google.get_config_value(&GoogleConfigKey::Client(ClientConfigKey::Timeout)),
            azure.get_config_value(&AzureConfigKey::Client(ClientConfigKey::Timeout)),
        ];
        for bound in bounds {
            let bound = humantime::parse_duration(&bound.unwrap()).unwrap();
            assert!(bound >= Duration::from_secs(15 * 60), "{bound:?}");
        }
        assert!(remote_store("http://host/map", "http", "http://host").unwrap().is_some());
    }

    /// Spark and Hadoop name the account in the URL.
    #[test]
    fn an_azure_url_may_name_its_account() {
        let store = remote_store(
            "abfss://robots@fleet.dfs.core.windows.net/map",
            "abfss",
            "abfss://robots@fleet.dfs.core.windows.net",
        );
        assert!(store.unwrap().unwrap().to_string().contains("fleet"));
    }
}
