use crate::place::url_of;
#[cfg(not(feature = "bucket"))]
use crate::place::without_buckets;
use crate::watch::Watch;
use std::path::{Path, PathBuf};
use voxtile::Result;
use voxtile_formats::{ReadOptions, ScanSource};

/// Opens the scans at a URL that is none of a map.
///
/// # Errors
///
/// As for `Bucket::open` and
/// `FetchedFiles::fetch`; a URL, where the command was built without buckets.
#[cfg(feature = "bucket")]
pub fn scans_at(url: &str, options: &ReadOptions, watch: &Watch) -> Result<Box<dyn ScanSource + Send>> {
    Ok(Box::new(crate::fetched_source::FetchedSource::open(url, options, watch)?))
}

#[cfg(not(feature = "bucket"))]
pub fn scans_at(url: &str, _: &ReadOptions, _: &Watch) -> Result<Box<dyn ScanSource + Send>> {
    Err(without_buckets(url))
}

/// Scans as files, for as long as this lives.
pub struct LocalScans {
    path: PathBuf,
    #[cfg(feature = "bucket")]
    _fetched: Option<voxtile_bucket::FetchedFiles>,
}

impl LocalScans {
    /// Fetches what lies at a URL that is none of a map, until it is asked to stop; takes all else as it is.
    ///
    /// # Errors
    ///
    /// A place that cannot be read; [`Error::Stopped`](voxtile::Error::Stopped).
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

    /// Takes what is no URL as it is.
    ///
    /// # Errors
    ///
    /// A URL: there are no buckets.
    #[cfg(not(feature = "bucket"))]
    pub fn of(scans: &Path, _: &Watch) -> Result<Self> {
        url_of(scans).map_or(Ok(Self { path: scans.to_owned() }), |url| Err(without_buckets(url)))
    }

    /// Where they are.
    pub fn path(&self) -> &Path {
        &self.path
    }
}
