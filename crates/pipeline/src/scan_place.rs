use crate::place::url_of;
#[cfg(not(feature = "bucket"))]
use crate::place::without_buckets;
use crate::scan_input::{ScanInput, ScanInputs};
use crate::watch::Watch;
use std::path::PathBuf;
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
    inputs: ScanInputs,
    #[cfg(feature = "bucket")]
    _fetched: Vec<voxtile_bucket::FetchedFiles>,
}

impl LocalScans {
    /// Divides paths into inputs as [`ScanInputs::of`], and fetches the files at URLs that are not maps.
    ///
    /// # Errors
    ///
    /// As for [`ScanInputs::of`] and [`LocalScans::of_inputs`].
    pub fn of(paths: &[PathBuf], options: &ReadOptions, watch: &Watch) -> Result<Self> {
        Self::of_inputs(ScanInputs::of(paths, options, watch.stop())?, watch)
    }

    /// Fetches the files at URLs that are not maps, unless it is stopped. Other inputs are used unchanged.
    ///
    /// # Errors
    ///
    /// A location cannot be read, or [`Error::Stopped`](voxtile::Error::Stopped).
    #[cfg(feature = "bucket")]
    pub fn of_inputs(mut inputs: ScanInputs, watch: &Watch) -> Result<Self> {
        let mut fetched = Vec::new();
        for input in inputs.inputs_mut() {
            if let Some(url) = url_of(input.first())
                && !crate::kept_source::is_map(input.first(), watch.stop())?
            {
                let files = crate::fetched_source::fetch(url, watch)?;
                *input = ScanInput::of(files.path());
                fetched.push(files);
            }
        }
        Ok(Self { inputs, _fetched: fetched })
    }

    /// Uses the inputs unchanged.
    ///
    /// # Errors
    ///
    /// A path is a URL, and this build does not support buckets.
    #[cfg(not(feature = "bucket"))]
    pub fn of_inputs(inputs: ScanInputs, _: &Watch) -> Result<Self> {
        let url = inputs.inputs().iter().find_map(|input: &ScanInput| url_of(input.first()));
        url.map_or(Ok(()), |url| Err(without_buckets(url)))?;
        Ok(Self { inputs })
    }

    /// Returns the inputs on this machine.
    pub fn inputs(&self) -> &ScanInputs {
        &self.inputs
    }
}
