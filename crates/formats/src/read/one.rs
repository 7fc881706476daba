use super::cloud::{CloudHead, CloudPoint, CloudSource};
use super::name_stamps;
use std::path::Path;
use voxtile::Result;

/// Callback for the points of a cloud.
pub type Visit<'v> = &'v mut dyn FnMut(CloudPoint) -> Result<()>;

/// Points of an open cloud.
pub trait Points: Send {
    /// Visits the points in order. Call it at most once.
    ///
    /// # Errors
    ///
    /// A file cannot be read or is invalid, or `visit` returns an error.
    fn read(&mut self, visit: Visit<'_>) -> Result<()>;

    /// Returns remarks for the user about the points read so far, such as guesses and skipped rows.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Returns the properties of a cloud that are known from its file name.
pub(crate) fn head_of(path: &Path) -> CloudHead {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    CloudHead { name, stamp_ns: name_stamps::in_name(path), ..CloudHead::default() }
}

/// Source for a file with one cloud.
pub(crate) struct OneCloud {
    format: String,
    head: Option<CloudHead>,
    points: Option<Box<dyn Points>>,
    /// Remarks on points already read.
    remarks: Vec<String>,
}

impl OneCloud {
    pub(crate) fn new(format: impl Into<String>, (head, points): (CloudHead, Box<dyn Points>)) -> Self {
        Self { format: format.into(), head: Some(head), points: Some(points), remarks: Vec::new() }
    }

    /// Closes the file and keeps its remarks.
    fn close(&mut self) {
        if let Some(points) = self.points.take() {
            self.remarks = points.remarks();
        }
    }
}

impl CloudSource for OneCloud {
    fn format(&self) -> &str {
        &self.format
    }

    fn len_hint(&self) -> Option<u64> {
        Some(1)
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        let head = self.head.take();
        if head.is_none() {
            self.close();
        }
        Ok(head)
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        // There is no current cloud before the first call of `next_cloud`.
        match (&self.head, self.points.take()) {
            (None, Some(mut points)) => {
                let read = points.read(visit);
                self.points = Some(points);
                self.close();
                read
            }
            (_, points) => {
                self.points = points;
                Ok(())
            }
        }
    }

    fn remarks(&self) -> Vec<String> {
        match &self.points {
            Some(points) => points.remarks(),
            None => self.remarks.clone(),
        }
    }
}
