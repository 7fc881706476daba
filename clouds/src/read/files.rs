use super::one::Visit;
use crate::cloud::{CloudHead, CloudSource};
use crate::error::Result;
use std::path::PathBuf;

/// Opens a file of a folder.
pub(super) type OpenFile = Box<dyn Fn(&PathBuf) -> Result<Box<dyn CloudSource>> + Send>;

/// Remarks that are kept; a folder may have a million files.
const MOST_REMARKS: usize = 20;

/// The clouds of all files of a folder, one file open at a time.
pub(super) struct Files {
    format: String,
    paths: std::vec::IntoIter<PathBuf>,
    files: u64,
    is_one_each: bool,
    open: OpenFile,
    current: Option<(PathBuf, Box<dyn CloudSource>)>,
    crs: Option<String>,
    remarks: Vec<String>,
}

impl Files {
    /// The clouds of files in this order. `is_one_each`: every file is one cloud.
    pub(super) fn new(format: String, paths: Vec<PathBuf>, is_one_each: bool, open: OpenFile) -> Self {
        Self {
            format,
            files: paths.len() as u64,
            paths: paths.into_iter(),
            is_one_each,
            open,
            current: None,
            crs: None,
            remarks: Vec::new(),
        }
    }

    fn remark(&mut self, remark: String) {
        if self.remarks.len() < MOST_REMARKS {
            self.remarks.push(remark);
        } else if self.remarks.len() == MOST_REMARKS {
            self.remarks.push("there is more to say of other files".into());
        }
    }

    /// Keeps what is to be said of the file that ends.
    fn close(&mut self) {
        let Some((path, source)) = self.current.take() else { return };
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        for remark in source.remarks() {
            self.remark(format!("{name}: {remark}"));
        }
        match (&self.crs, source.crs()) {
            (None, Some(crs)) => self.crs = Some(crs.to_owned()),
            (Some(first), Some(crs)) if first != crs => {
                self.remark(format!(
                    "{name}: another coordinate reference system than that of the files before"
                ));
            }
            _ => {}
        }
    }
}

impl CloudSource for Files {
    fn format(&self) -> &str {
        &self.format
    }

    fn len_hint(&self) -> Option<u64> {
        self.is_one_each.then_some(self.files)
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        loop {
            if let Some((path, source)) = &mut self.current {
                match source.next_cloud() {
                    Ok(Some(mut head)) => {
                        let file = path.file_name().unwrap_or_default().to_string_lossy();
                        if head.name != file {
                            head.name = format!("{file}/{}", head.name);
                        }
                        return Ok(Some(head));
                    }
                    Ok(None) => self.close(),
                    Err(error) => return Err(error),
                }
            }
            let Some(path) = self.paths.next() else { return Ok(None) };
            let source = (self.open)(&path)?;
            self.current = Some((path, source));
        }
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        self.current.as_mut().map_or(Ok(()), |(_, source)| source.read_points(visit))
    }

    fn remarks(&self) -> Vec<String> {
        let now = self.current.iter().flat_map(|(_, source)| source.remarks());
        self.remarks.iter().cloned().chain(now).collect()
    }

    fn crs(&self) -> Option<&str> {
        self.crs.as_deref().or_else(|| self.current.as_ref()?.1.crs())
    }
}
