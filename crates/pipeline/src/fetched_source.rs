use crate::place::bucket_at;
use crate::watch::Watch;
use voxtile::Result;
use voxtile_bucket::FetchedFiles;
use voxtile_formats::{PointStore, PoseSource, ReadOptions, ScanHead, ScanSource, open_scans};

/// Scans of a bucket, read from fetched files.
pub struct FetchedSource {
    source: Box<dyn ScanSource + Send>,
    /// Dropped after the source, which may have files open.
    _files: FetchedFiles,
}

impl FetchedSource {
    /// Fetches all files at a URL, then reads them like a folder.
    pub fn open(url: &str, options: &ReadOptions, watch: &Watch) -> Result<Self> {
        let files = fetch(url, watch)?;
        Ok(Self { source: open_scans(files.path(), options)?, _files: files })
    }
}

/// Fetches all files at a URL, unless it is stopped.
pub fn fetch(url: &str, watch: &Watch) -> Result<FetchedFiles> {
    let bucket = bucket_at(url)?;
    let gauge = watch.over_bytes();
    let is_stopped = || watch.stop().is_set();
    let report = |done, all| gauge.set(done, all);
    let files = FetchedFiles::fetch(&bucket, &std::env::temp_dir(), &is_stopped, report)?;
    drop(gauge);
    log::info!("{url}: fetched {} files, {} bytes", files.files(), files.bytes());
    Ok(files)
}

impl ScanSource for FetchedSource {
    fn len_hint(&self) -> Option<usize> {
        self.source.len_hint()
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        self.source.read_scan(points)
    }

    fn skip(&mut self, scans: usize) -> Result<usize> {
        self.source.skip(scans)
    }

    fn pass_unread(&mut self) -> bool {
        self.source.pass_unread()
    }

    fn format(&self) -> String {
        self.source.format()
    }

    fn fields(&self) -> Vec<String> {
        self.source.fields()
    }

    fn remarks(&self) -> Vec<String> {
        self.source.remarks()
    }

    fn crs(&self) -> Option<String> {
        self.source.crs()
    }

    fn pose_source(&self) -> PoseSource {
        self.source.pose_source()
    }

    fn fingerprint(&self) -> Result<String> {
        self.source.fingerprint()
    }
}
