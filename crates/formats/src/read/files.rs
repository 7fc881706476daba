use super::cloud::{CloudHead, CloudSource};
use super::one::Visit;
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Opens a file of a folder.
pub(crate) type OpenFile = Box<dyn Fn(&Path) -> Result<Box<dyn CloudSource>> + Send>;

/// Maximum number of remarks to keep; a folder may have a million files.
const MAX_REMARKS: usize = 20;

/// Source of the clouds of all files of a folder. Only one file is open at a time.
pub(crate) struct Files {
    format: String,
    paths: std::vec::IntoIter<PathBuf>,
    files: u64,
    is_one_each: bool,
    ends: Option<[String; 2]>,
    open: OpenFile,
    current: Option<(PathBuf, Box<dyn CloudSource>)>,
    crs: Option<String>,
    /// Whether a file was opened; `crs` is then final.
    is_begun: bool,
    remarks: Remarks,
}

/// Remarks on files. A remark that applies to several files appears once.
#[derive(Clone, Default)]
struct Remarks {
    remarks: Vec<FileRemark>,
    are_more: bool,
}

/// Remark on a file, or on the folder if `file` is empty, with the number of other files it applies to.
#[derive(Clone)]
struct FileRemark {
    file: String,
    others: u64,
    remark: String,
}

impl Remarks {
    fn add(&mut self, file: String, remark: String) {
        if let Some(remarks) =
            self.remarks.iter_mut().find(|remarks| remarks.remark == remark && !remarks.file.is_empty())
        {
            remarks.others += 1;
        } else if self.remarks.len() < MAX_REMARKS {
            self.remarks.push(FileRemark { file, others: 0, remark });
        } else {
            self.are_more = true;
        }
    }

    fn lines(&self) -> Vec<String> {
        let line = |FileRemark { file, others, remark }: &FileRemark| match (file.as_str(), others) {
            ("", _) => remark.clone(),
            (_, 0) => format!("{file}: {remark}"),
            (_, 1) => format!("{file} and another file: {remark}"),
            _ => format!("{file} and {others} other files: {remark}"),
        };
        let more = self.are_more.then(|| "there are more remarks on other files".to_owned());
        self.remarks.iter().map(line).chain(more).collect()
    }
}

impl Files {
    /// Creates the source. Files are read in the given order. `is_one_each`: every file is one cloud.
    pub(crate) fn new(format: String, paths: Vec<PathBuf>, is_one_each: bool, open: OpenFile) -> Self {
        let ends =
            paths.first().zip(paths.last()).map(|(first, last)| [first, last].map(|path| name_of(path)));
        Self {
            format,
            files: paths.len() as u64,
            ends: ends.filter(|_| is_one_each),
            paths: paths.into_iter(),
            is_one_each,
            open,
            current: None,
            crs: None,
            is_begun: false,
            remarks: Remarks::default(),
        }
    }

    /// Adds remarks on the folder itself.
    pub(crate) fn with_remarks(mut self, remarks: Vec<String>) -> Self {
        remarks.into_iter().for_each(|remark| self.remarks.add(String::new(), remark));
        self
    }

    /// Closes the current file and keeps its remarks.
    fn close(&mut self) {
        let Some((path, source)) = self.current.take() else { return };
        let name = name_of(&path);
        for remark in source.remarks() {
            self.remarks.add(name.clone(), remark);
        }
    }

    /// Checks that a file uses the coordinate system of the files before it, so that no map mixes systems.
    fn check_crs(&mut self, path: &Path, crs: Option<&str>) -> Result<()> {
        let is_first = !std::mem::replace(&mut self.is_begun, true);
        let Some(crs) = crs else { return Ok(()) };
        match &self.crs {
            Some(first) if first != crs => {
                let reason = format!(
                    "its coordinates are in {crs:.80}, but those of the previous files are in {first:.80}: convert it \
                     first, for instance with pdal, or build a separate map"
                );
                return Err(Error::argument(path.display().to_string(), reason));
            }
            Some(_) => return Ok(()),
            None => self.crs = Some(crs.to_owned()),
        }
        if !is_first {
            let remark = format!(
                "names the coordinate system {crs:.80}, but the previous files name none: check that their points are \
                 in it, and that the map names it (`voxtile info`); otherwise read this file first"
            );
            self.remarks.add(name_of(path), remark);
        }
        Ok(())
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

impl CloudSource for Files {
    fn format(&self) -> &str {
        &self.format
    }

    fn len_hint(&self) -> Option<u64> {
        self.is_one_each.then_some(self.files)
    }

    fn ends(&self) -> Option<[String; 2]> {
        self.ends.clone()
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        loop {
            if let Some((path, source)) = &mut self.current {
                match source.next_cloud() {
                    Ok(Some(mut head)) => {
                        let file = name_of(path);
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
            self.check_crs(&path, source.crs())?;
            self.current = Some((path, source));
        }
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        self.current.as_mut().map_or(Ok(()), |(_, source)| source.read_points(visit))
    }

    fn remarks(&self) -> Vec<String> {
        let mut remarks = self.remarks.clone();
        if let Some((path, source)) = &self.current {
            source.remarks().into_iter().for_each(|remark| remarks.add(name_of(path), remark));
        }
        remarks.lines()
    }

    fn crs(&self) -> Option<&str> {
        self.crs.as_deref()
    }
}
