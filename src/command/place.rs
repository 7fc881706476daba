use crate::io::{ReadOptions, ScanSource};
use crate::scan::Stop;
use crate::store::MapPath;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// How the URLs of maps in buckets begin.
const SCHEMES: [&str; 7] = ["s3", "gs", "az", "abfs", "abfss", "http", "https"];

/// Where a map is that is to be read: a folder, or the URL of a bucket.
///
/// # Errors
///
/// As for [`Bucket::open`](crate::bucket::Bucket::open); a URL, where the command was built without buckets.
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

/// Sets the bound for all buckets of this process.
#[cfg(feature = "bucket")]
pub fn set_bucket_timeout(timeout: std::time::Duration) {
    // The command line is read once.
    let _ = BUCKET_TIMEOUT.set(timeout);
}

/// The bucket of a URL, whose waits end with the first signal that is caught.
///
/// # Errors
///
/// As for [`Bucket::open`](crate::bucket::Bucket::open).
#[cfg(feature = "bucket")]
pub fn bucket_at(url: &str) -> Result<crate::bucket::Bucket> {
    let bucket = crate::bucket::Bucket::open(url)?.with_stop(super::stop_signal::flag_of_signals());
    Ok(match BUCKET_TIMEOUT.get() {
        Some(timeout) => bucket.with_timeout(*timeout),
        None => bucket,
    })
}

/// Whether there is a map at a URL; false where the command was built without buckets.
///
/// # Errors
///
/// As for [`Bucket::open`](crate::bucket::Bucket::open) and [`Bucket::has_map`](crate::bucket::Bucket::has_map).
#[cfg(feature = "bucket")]
pub fn is_map_at(url: &str, stop: &Stop) -> Result<bool> {
    bucket_at(url)?.has_map(&|| stop.is_set())
}

#[cfg(not(feature = "bucket"))]
pub fn is_map_at(_: &str, _: &Stop) -> Result<bool> {
    Ok(false)
}

/// Opens the scans at a URL that is none of a map.
///
/// # Errors
///
/// As for [`Bucket::open`](crate::bucket::Bucket::open) and
/// [`FetchedFiles::fetch`](crate::bucket::FetchedFiles::fetch); a URL, where the command was built without buckets.
#[cfg(feature = "bucket")]
pub fn scans_at(url: &str, options: &ReadOptions, stop: &Stop) -> Result<Box<dyn ScanSource + Send>> {
    Ok(Box::new(super::fetched_source::FetchedSource::open(url, options, stop)?))
}

#[cfg(not(feature = "bucket"))]
pub fn scans_at(url: &str, _: &ReadOptions, _: &Stop) -> Result<Box<dyn ScanSource + Send>> {
    Err(without_buckets(url))
}

/// Scans as files, for as long as this lives.
pub struct LocalScans {
    path: PathBuf,
    #[cfg(feature = "bucket")]
    _fetched: Option<crate::bucket::FetchedFiles>,
}

impl LocalScans {
    /// Fetches what lies at a URL that is none of a map, until it is asked to stop; takes all else as it is.
    ///
    /// # Errors
    ///
    /// As for [`scans_at`]; [`Error::Stopped`].
    #[cfg(feature = "bucket")]
    pub fn of(scans: &Path, stop: &Stop) -> Result<Self> {
        let url = match url_of(scans) {
            Some(url) if !super::kept_source::is_map(scans, stop)? => Some(url),
            _ => None,
        };
        let fetched = url.map(|url| super::fetched_source::fetch(url, stop)).transpose()?;
        let path = fetched.as_ref().map_or(scans, |files| files.path()).to_owned();
        Ok(Self { path, _fetched: fetched })
    }

    #[cfg(not(feature = "bucket"))]
    pub fn of(scans: &Path, _: &Stop) -> Result<Self> {
        url_of(scans).map_or(Ok(Self { path: scans.to_owned() }), |url| Err(without_buckets(url)))
    }

    /// Where they are.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

#[cfg(feature = "bucket")]
fn in_bucket(url: &str) -> Result<MapPath> {
    Ok(crate::bucket::BucketDisk::open(bucket_at(url)?)?.into_map_path())
}

#[cfg(not(feature = "bucket"))]
fn in_bucket(url: &str) -> Result<MapPath> {
    Err(without_buckets(url))
}

#[cfg(not(feature = "bucket"))]
fn without_buckets(url: &str) -> Error {
    let reason = "this voxtile was built without buckets; `cargo install --locked --path . --features bucket` makes one with them";
    Error::argument(url, reason)
}
