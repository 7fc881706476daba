use super::cloud::{CloudHead, CloudPoint, CloudSource};
use super::name_stamps;
use std::path::Path;
use voxtile::Result;

/// Takes the points of a cloud.
pub type Visit<'v> = &'v mut dyn FnMut(CloudPoint) -> Result<()>;

/// The points of a cloud that was opened.
pub trait Points: Send {
    /// Visits them once, in order.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is invalid; the first error of `visit`.
    fn read(&mut self, visit: Visit<'_>) -> Result<()>;

    /// What a person should know of them, so far: what was guessed, rows that were left out.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// What a file's name tells of its cloud.
pub(crate) fn head_of(path: &Path) -> CloudHead {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    CloudHead { name, stamp_ns: name_stamps::in_name(path), ..CloudHead::default() }
}

/// A file with one cloud.
pub(crate) struct OneCloud {
    format: String,
    head: Option<CloudHead>,
    points: Option<Box<dyn Points>>,
    /// Of points that were read.
    remarks: Vec<String>,
}

impl OneCloud {
    pub(crate) fn new(format: impl Into<String>, (head, points): (CloudHead, Box<dyn Points>)) -> Self {
        Self { format: format.into(), head: Some(head), points: Some(points), remarks: Vec::new() }
    }

    /// Lets go of the file.
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
        // Before the first cloud there is nothing to read.
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
