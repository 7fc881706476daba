use super::point_store::{PointBudget, PointStore};
use super::sensor_scan::SensorScan;
use super::source::{ScanHead, ScanSource};
use super::stored_scan::StoredScan;
use crate::poses::PoseSource;
use crate::read::guard::catch;
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Wraps a reader that may panic on an unexpected file. A panic becomes an error with the name of the input. After it,
/// the input has no further scans.
pub(crate) struct GuardedScans {
    source: Box<dyn ScanSource + Send>,
    path: PathBuf,
    has_panicked: bool,
}

impl GuardedScans {
    pub(crate) fn open(
        path: &Path,
        open: impl FnOnce() -> Result<Box<dyn ScanSource + Send>>,
    ) -> Result<Box<dyn ScanSource + Send>> {
        let source = catch(open).map_err(|place| fault(path, &place))??;
        Ok(Box::new(Self { source, path: path.to_owned(), has_panicked: false }))
    }

    /// Calls the reader, or returns `none` after a panic, because the reader must not be used again.
    fn guard<T>(&mut self, none: T, call: impl FnOnce(&mut dyn ScanSource) -> Result<T>) -> Result<T> {
        if self.has_panicked {
            return Ok(none);
        }
        let source = &mut *self.source;
        catch(|| call(source)).unwrap_or_else(|place| {
            self.has_panicked = true;
            Err(fault(&self.path, &place))
        })
    }
}

fn fault(path: &Path, place: &str) -> Error {
    let reason = format!(
        "reading it caused an internal error in voxtile or one of its libraries ({place}): please report this message \
         together with the file"
    );
    Error::argument(path.display().to_string(), reason)
}

impl ScanSource for GuardedScans {
    fn len_hint(&self) -> Option<usize> {
        self.source.len_hint()
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        self.guard(None, |source| source.read_scan(points))
    }

    fn next_scan(&mut self) -> Result<Option<SensorScan>> {
        self.guard(None, |source| source.next_scan())
    }

    fn next_stored(&mut self, budget: &PointBudget) -> Result<Option<StoredScan>> {
        self.guard(None, |source| source.next_stored(budget))
    }

    fn skip(&mut self, scans: usize) -> Result<usize> {
        self.guard(0, |source| source.skip(scans))
    }

    fn pass_unread(&mut self) -> bool {
        !self.has_panicked && self.source.pass_unread()
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

#[cfg(test)]
mod tests {
    use super::*;

    struct Faulty;

    impl ScanSource for Faulty {
        fn len_hint(&self) -> Option<usize> {
            None
        }

        fn read_scan(&mut self, _: &mut PointStore) -> Result<Option<ScanHead>> {
            panic!("as a library might");
        }

        fn pass_unread(&mut self) -> bool {
            true
        }

        fn fingerprint(&self) -> Result<String> {
            Ok(String::new())
        }
    }

    #[test]
    fn panics_become_errors_with_the_input() {
        let path = Path::new("odd.las");
        let mut scans = GuardedScans::open(path, || Ok(Box::new(Faulty))).unwrap();
        let error = scans.next_scan().err().unwrap().to_string();
        assert!(error.starts_with("odd.las: ") && error.contains("guarded_scans.rs:"), "{error}");
        assert!(!scans.pass_unread() && scans.next_scan().unwrap().is_none());
        let error = GuardedScans::open(path, || panic!("while it is opened")).err().unwrap();
        assert!(error.to_string().starts_with("odd.las: reading it caused an internal error"), "{error}");
    }
}
