use crate::place::url_of;
#[cfg(not(feature = "bucket"))]
use crate::place::without_buckets;
use crate::watch::Watch;
use std::path::{Path, PathBuf};
use voxtile::Result;
use voxtile_formats::{ReadOptions, ScanSource};

/// Opens the scans at a URL that is not a map.
///
/// # Errors
///
/// As for `Bucket::open` and `FetchedFiles::fetch`. Also fails if this build does not support buckets.
#[cfg(feature = "bucket")]
pub fn scans_at(url: &str, options: &ReadOptions, watch: &Watch) -> Result<Box<dyn ScanSource + Send>> {
    Ok(Box::new(crate::fetched_source::FetchedSource::open(url, options, watch)?))
}

#[cfg(not(feature = "bucket"))]
pub fn scans_at(url: &str, _: &ReadOptions, _: &Watch) -> Result<Box<dyn ScanSource + Send>> {
    Err(without_buckets(url))
}

/// Scans as local files. Fetched files are removed with this value.
pub struct LocalScans {
    path: PathBuf,
    #[cfg(feature = "bucket")]
    _fetched: Option<voxtile_bucket::FetchedFiles>,
}

impl LocalScans {
    /// Fetches the files at a URL that is not a map, unless it is stopped. Other paths are used unchanged.
    ///
    /// # Errors
    ///
    /// The location cannot be read, or [`Error::Stopped`](voxtile::Error::Stopped).
    #[cfg(feature = "bucket")]
    pub fn of(scans: &Path, watch: &Watch) -> Result<Self> {
        let url = match url_of(scans) {
            Some(url) if !crate::kept_source::is_map(scans, watch.stop())? => Some(url),
            _ => None,
        };
        let fetched = url.map(|url| crate::fetched_source::fetch(url, watch)).transpose()?;
        let path = fetched.as_ref().map_or(scans, |files| files.path()).to_owned();
        Ok(Self { path, _fetched: fetched })
    }

    /// Uses a path unchanged.
    ///
    /// # Errors
    ///
    /// The path is a URL, and this build does not support buckets.
    #[cfg(not(feature = "bucket"))]
    pub fn of(scans: &Path, _: &Watch) -> Result<Self> {
        url_of(scans).map_or(Ok(Self { path: scans.to_owned() }), |url| Err(without_buckets(url)))
    }

    /// Returns the path of the scans.
    pub fn path(&self) -> &Path {
        &self.path
    }
}
