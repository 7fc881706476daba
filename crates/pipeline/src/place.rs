//! Locations of maps: a folder, or the URL of a bucket.

use std::path::Path;
use voxtile::scan::Stop;
use voxtile::store::MapPath;
use voxtile::{Error, Result};

/// URL schemes of maps in buckets.
const SCHEMES: [&str; 7] = ["s3", "gs", "az", "abfs", "abfss", "http", "https"];

/// Returns the location of a map to read: a folder or a bucket URL.
///
/// # Errors
///
/// As for `Bucket::open`. Also fails for a URL if this build does not support buckets.
pub fn place_of(map: &Path) -> Result<MapPath> {
    match url_of(map) {
        Some(url) => in_bucket(url),
        None => Ok(map.into()),
    }
}

/// Returns the URL if the path is one.
pub fn url_of(map: &Path) -> Option<&str> {
    let text = map.to_str()?;
    let (scheme, _) = text.split_once("://")?;
    SCHEMES.contains(&scheme).then_some(text)
}

/// Checks that a map to modify is not in a bucket.
///
/// # Errors
///
/// [`Error::InvalidArgument`] for a URL.
pub fn check_is_folder(map: &Path) -> Result<()> {
    let Some(url) = url_of(map) else { return Ok(()) };
    let reason = "a map in a bucket is read-only: `voxtile pull` it, change the copy, and `voxtile push` it";
    Err(Error::argument(url, reason))
}

/// Maximum time without progress for bucket requests, if set by the user.
#[cfg(feature = "bucket")]
static BUCKET_TIMEOUT: std::sync::OnceLock<std::time::Duration> = std::sync::OnceLock::new();

/// Stop flag for all bucket requests of this process.
#[cfg(feature = "bucket")]
static BUCKET_STOP: std::sync::OnceLock<Stop> = std::sync::OnceLock::new();

/// Sets the stop flag for all bucket requests of this process. Only the first call has an effect.
pub fn stop_buckets_with(stop: &Stop) {
    #[cfg(feature = "bucket")]
    let _ = BUCKET_STOP.set(stop.clone());
    #[cfg(not(feature = "bucket"))]
    let _ = stop;
}

/// Sets the maximum time without progress for all bucket requests of this process. Only the first call has an effect.
#[cfg(feature = "bucket")]
pub fn set_bucket_timeout(timeout: std::time::Duration) {
    let _ = BUCKET_TIMEOUT.set(timeout);
}

/// Opens the bucket of a URL. Its requests can be stopped; see [`stop_buckets_with`].
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

/// Returns whether there is a map at a URL.
///
/// # Errors
///
/// As for `Bucket::open` and `Bucket::has_map`.
#[cfg(feature = "bucket")]
pub fn is_map_at(url: &str, stop: &Stop) -> Result<bool> {
    bucket_at(url)?.has_map(&|| stop.is_set())
}

/// Returns `false`, because this build does not support buckets.
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

/// Returns the error for a URL in a build without buckets.
#[cfg(not(feature = "bucket"))]
pub fn without_buckets(url: &str) -> Error {
    let reason = "this build does not support buckets: install one with `cargo install --locked --path crates/cli \
                  --features bucket`";
    Error::argument(url, reason)
}
