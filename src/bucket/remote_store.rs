use crate::error::{Error, Result};
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::azure::{AzureConfigKey, MicrosoftAzureBuilder};
use object_store::gcp::{GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::http::HttpBuilder;
use object_store::{BackoffConfig, ClientConfigKey, ObjectStore, RetryConfig};
use std::sync::Arc;
use std::time::Duration;

/// How long a client waits for a server that it has reached; a server that cannot be reached is noticed in seconds.
#[derive(Clone, Copy)]
pub(super) struct Waits {
    /// Without a byte of the answer. What is sent counts as waiting, so there is none for sending.
    silent: Option<Duration>,
    /// For a whole request, with its content.
    whole: Duration,
    /// How long after it began a request is begun again.
    retried: Duration,
}

/// For what is read: a server that goes on sending may take its time, as one that sends a file whole has to.
pub(super) const READING: Waits = Waits {
    silent: Some(Duration::from_secs(30)),
    whole: Duration::from_secs(24 * 60 * 60),
    retried: Duration::from_secs(60),
};

/// For what is sent: eight parts of 16 MiB at once at 1.2 Mbit/s. A signature is good for a quarter of an hour.
pub(super) const SENDING: Waits =
    Waits { silent: None, whole: Duration::from_secs(15 * 60), retried: Duration::from_secs(4 * 60) };

/// The store of a URL, by its scheme and its first part; `None` for a scheme of no store.
///
/// # Errors
///
/// [`Error::InvalidArgument`] if the environment lacks something.
pub(super) fn remote_store(
    url: &str,
    scheme: &str,
    root: &str,
    waits: Waits,
) -> Result<Option<Arc<dyn ObjectStore>>> {
    choose_tls();
    let refused = |error: object_store::Error| Error::argument(url, super::bucket::told(&error));
    Ok(Some(match scheme {
        "s3" => Arc::new(amazon(root, waits).build().map_err(refused)?),
        "gs" => Arc::new(google(root, waits).build().map_err(refused)?),
        "az" | "abfs" | "abfss" => Arc::new(azure(root, waits).build().map_err(refused)?),
        "http" | "https" => Arc::new(web(root, scheme == "http", waits).build().map_err(refused)?),
        _ => return Ok(None),
    }))
}

/// Of the two libraries that could encrypt, the one that the rest of voxtile has.
fn choose_tls() {
    // Whoever has chosen one before keeps it.
    let _ = rustls::crypto::ring::default_provider().install_default();
}

fn amazon(root: &str, waits: Waits) -> AmazonS3Builder {
    // Whoever names an endpoint without TLS means it: a server of their own.
    let endpoint = ["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT"];
    let endpoint = endpoint.iter().find_map(|name| std::env::var(name).ok());
    let mut builder = AmazonS3Builder::from_env().with_url(root).with_retry(waits.retry());
    for (key, value) in waits.settings(Some("AWS")) {
        builder = builder.with_config(AmazonS3ConfigKey::Client(key), value);
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

fn google(root: &str, waits: Waits) -> GoogleCloudStorageBuilder {
    let builder = GoogleCloudStorageBuilder::from_env().with_url(root).with_retry(waits.retry());
    waits
        .settings(Some("GOOGLE"))
        .into_iter()
        .fold(builder, |builder, (key, value)| builder.with_config(GoogleConfigKey::Client(key), value))
}

fn azure(root: &str, waits: Waits) -> MicrosoftAzureBuilder {
    let builder = MicrosoftAzureBuilder::from_env().with_url(root).with_retry(waits.retry());
    waits
        .settings(Some("AZURE"))
        .into_iter()
        .fold(builder, |builder, (key, value)| builder.with_config(AzureConfigKey::Client(key), value))
}

fn web(root: &str, is_plain: bool, waits: Waits) -> HttpBuilder {
    let builder = HttpBuilder::new().with_url(root).with_retry(waits.retry());
    let builder = builder.with_config(ClientConfigKey::AllowHttp, is_plain.to_string());
    waits.settings(None).into_iter().fold(builder, |builder, (key, value)| builder.with_config(key, value))
}

impl Waits {
    fn retry(self) -> RetryConfig {
        RetryConfig {
            backoff: BackoffConfig { max_backoff: Duration::from_secs(5), ..BackoffConfig::default() },
            max_retries: 6,
            retry_timeout: self.retried,
        }
    }

    /// As settings of a client. What the environment says for a store that asks it stays, such as `AWS_TIMEOUT`.
    fn settings(self, store: Option<&str>) -> Vec<(ClientConfigKey, String)> {
        let all = [("READ_TIMEOUT", ClientConfigKey::ReadTimeout, self.silent)];
        let all = all.into_iter().chain([("TIMEOUT", ClientConfigKey::Timeout, Some(self.whole))]);
        let is_said = |name| store.is_some_and(|store| std::env::var_os(format!("{store}_{name}")).is_some());
        let own = all.filter(|(name, ..)| !is_said(*name));
        own.filter_map(|(_, key, wait)| Some((key, format!("{} seconds", wait?.as_secs())))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part of 16 MiB takes longer than the client's own 30 seconds where eight share a slow link.
    #[test]
    fn all_clients_wait_for_slow_links() {
        for (waits, silent) in [(READING, Some("30 seconds".to_owned())), (SENDING, None)] {
            let keys = [ClientConfigKey::ReadTimeout, ClientConfigKey::Timeout];
            let amazon = amazon("s3://robots", waits);
            let google = google("gs://robots", waits);
            let azure = azure("az://robots", waits);
            let of = [
                keys.map(|key| amazon.get_config_value(&AmazonS3ConfigKey::Client(key))),
                keys.map(|key| google.get_config_value(&GoogleConfigKey::Client(key))),
                keys.map(|key| azure.get_config_value(&AzureConfigKey::Client(key))),
            ];
            for [read, whole] in of {
                assert_eq!(read, silent);
                let whole = whole.unwrap();
                let seconds: u64 = whole.split(' ').next().unwrap().parse().unwrap();
                assert!(seconds >= 15 * 60, "{whole}");
            }
            assert!(remote_store("http://host/map", "http", "http://host", waits).unwrap().is_some());
        }
    }
}
