//! Where a map is: a folder, or the URL of a bucket.

use std::path::Path;
use voxtile::scan::Stop;
use voxtile::store::MapPath;
use voxtile::{Error, Result};

/// How the URLs of maps in buckets begin.
const SCHEMES: [&str; 7] = ["s3", "gs", "az", "abfs", "abfss", "http", "https"];

/// Where a map is that is to be read: a folder, or the URL of a bucket.
///
/// # Errors
///
/// As for `Bucket::open`; a URL, where the command was built without buckets.
pub fn place_of(map: &Path) -> Result<MapPath> {
    match url_of(map) {
        Some(url) => in_bucket(url),
        None => Ok(map.into()),
    }
}

/// The URL that is given in place of a folder.
pub fn url_of(map: &Path) -> Option<&str> {
    let text = map.to_str()?;
    let (scheme, _) = text.split_once("://")?;
    SCHEMES.contains(&scheme).then_some(text)
}

/// A map that is to be changed cannot be in a bucket.
///
/// # Errors
///
/// [`Error::InvalidArgument`] for a URL.
pub fn check_is_folder(map: &Path) -> Result<()> {
    let Some(url) = url_of(map) else { return Ok(()) };
    let reason =
        "a map in a bucket can be read and not changed; `voxtile pull` it, change it, `voxtile push` it";
    Err(Error::argument(url, reason))
}

/// How long a request to a bucket may remain without progress, if the command line says so.
#[cfg(feature = "bucket")]
static BUCKET_TIMEOUT: std::sync::OnceLock<std::time::Duration> = std::sync::OnceLock::new();

/// What ends the waits for all buckets of this process.
#[cfg(feature = "bucket")]
static BUCKET_STOP: std::sync::OnceLock<Stop> = std::sync::OnceLock::new();

/// Sets what ends the waits for all buckets of this process; the first one counts.
pub fn stop_buckets_with(stop: &Stop) {
    #[cfg(feature = "bucket")]
    let _ = BUCKET_STOP.set(stop.clone());
    #[cfg(not(feature = "bucket"))]
    let _ = stop;
}

/// Sets the bound for all buckets of this process; the first one counts.
#[cfg(feature = "bucket")]
pub fn set_bucket_timeout(timeout: std::time::Duration) {
    let _ = BUCKET_TIMEOUT.set(timeout);
}

/// The bucket of a URL, whose waits end as [`stop_buckets_with`] says.
///
/// # Errors
///
/// As for `Bucket::open`.
#[cfg(feature = "bucket")]
pub fn bucket_at(url: &str) -> Result<voxtile_bucket::Bucket> {
    let bucket =
        voxtile_bucket::Bucket::open(url)?.with_stop(BUCKET_STOP.get().map(Stop::flag).unwrap_or_default());
    Ok(match BUCKET_TIMEOUT.get() {
        Some(timeout) => bucket.with_timeout(*timeout),
        None => bucket,
    })
}

/// Whether there is a map at a URL; false where the command was built without buckets.
///
/// # Errors
///
/// As for `Bucket::open` and `Bucket::has_map`.
#[cfg(feature = "bucket")]
pub fn is_map_at(url: &str, stop: &Stop) -> Result<bool> {
    bucket_at(url)?.has_map(&|| stop.is_set())
}

/// False: there are no buckets.
///
/// # Errors
///
/// None.
#[cfg(not(feature = "bucket"))]
pub fn is_map_at(_: &str, _: &Stop) -> Result<bool> {
    Ok(false)
}

#[cfg(feature = "bucket")]
fn in_bucket(url: &str) -> Result<MapPath> {
    Ok(voxtile_bucket::BucketDisk::open(bucket_at(url)?)?.into_map_path())
}

#[cfg(not(feature = "bucket"))]
fn in_bucket(url: &str) -> Result<MapPath> {
    Err(without_buckets(url))
}

/// Why a URL cannot be used, where there are no buckets.
#[cfg(not(feature = "bucket"))]
pub fn without_buckets(url: &str) -> Error {
    let reason = "this voxtile was built without buckets; `cargo install --locked --path crates/cli --features bucket` makes one with them";
    Error::argument(url, reason)
}
