use super::commit_log::{CommitLog, Commits};
use super::disk::Disk;
use super::layout::Layout;
use super::map_folder;
use super::metadata::{Bounds, Metadata};
use crate::error::{DecodeError, Error, FormatError, Result};
use std::io;

/// What can still be read of the two files that say what a map is, when they cannot be read together.
#[derive(Debug)]
pub struct Remains {
    /// `metadata.json`, or what is wrong with it.
    pub metadata: Result<Metadata>,
    /// What is wrong with `commits.log`, if anything is.
    pub log_error: Option<Error>,
    /// Id in the header of the log, if that can be read.
    pub log_map_id: Option<[u8; 16]>,
    /// The records of the log before the first that cannot be read.
    pub commits: Commits,
}

impl Remains {
    /// Reads what can be read.
    ///
    /// # Errors
    ///
    /// A disk that refuses; damage is no error here.
    pub fn read(disk: &dyn Disk, layout: &Layout) -> Result<Self> {
        let metadata = match map_folder::read_metadata(disk, layout) {
            Err(error @ Error::Io { .. }) if !is_no_file(&error) => return Err(error),
            metadata => metadata,
        };
        let path = layout.commit_log();
        let mut commits = Commits::default();
        let read = match disk.open(&path) {
            Ok(input) => {
                let bytes = input.file_bytes();
                commits.read_from(&mut io::BufReader::new(input), bytes)
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                Err(FormatError::at_offset(0, "the file is missing").into())
            }
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
                Err(FormatError::at_offset(0, error.to_string()).into())
            }
            Err(error) => return Err(Error::io(&path, "open", error)),
        };
        let (log_map_id, log_error) = match read {
            Ok(log) => (Some(log.map_id()), None),
            Err(DecodeError::Io(error)) => return Err(Error::io(&path, "read", error)),
            Err(error) => (None, Some(error.in_map(&path, None))),
        };
        Ok(Self { metadata, log_error, log_map_id, commits })
    }

    /// Writes `commits.log` and then `metadata.json` anew, each in place of what there is.
    ///
    /// # Errors
    ///
    /// A disk that refuses; calling again goes on.
    pub fn write(
        &self,
        disk: &dyn Disk,
        layout: &Layout,
        map_id: [u8; 16],
        commits: &Commits,
        mut metadata: Metadata,
    ) -> Result<()> {
        metadata.bounds = Bounds::of(commits.tiles.keys().copied());
        if let Some(ext) = &mut metadata.ext {
            ext.empty = metadata.bounds.is_none();
            (ext.flush_number, ext.scan_number) = (commits.flush_number, commits.scan_number);
        }
        let text = metadata.to_text();
        let sync = || {
            let folder = layout.folder();
            disk.sync_folder(folder).map_err(|error| Error::io(folder, "sync", error))
        };
        map_folder::replace(disk, &layout.commit_log(), |next| {
            CommitLog::write_whole(disk, next, map_id, commits, &text)
        })?;
        sync()?;
        map_folder::replace(disk, &layout.metadata(), |next| map_folder::write_text(disk, next, &text))?;
        sync()
    }
}

/// Whether an error is about a link, or anything else that is no file.
fn is_no_file(error: &Error) -> bool {
    matches!(error, Error::Io { cause, .. } if cause.kind() == io::ErrorKind::InvalidInput)
}
