use crate::config::Storage;
use crate::error::{DecodeError, Error, FormatError, Result, is_of_medium};
use crate::store::commit::commit_log::CommitLog;
use crate::store::commit::commits::Commits;
use crate::store::commit::metadata::Metadata;
use crate::store::disk::Disk;
use crate::store::layout::{Layout, TileFile, tile_of_folder};
use crate::store::map_folder;
use std::io;
use std::path::Path;

/// Readable content of `metadata.json` and `commits.log`, when one of them is damaged.
#[derive(Debug)]
pub struct Salvage {
    /// `metadata.json`, or the error.
    pub metadata: Result<Metadata>,
    /// Error of `commits.log`, if any.
    pub log_error: Option<Error>,
    /// Map id in the header of the log, if readable.
    pub log_map_id: Option<[u8; 16]>,
    /// Records of the log before the first unreadable one.
    pub commits: Commits,
}

impl Salvage {
    /// Reads both files.
    ///
    /// # Errors
    ///
    /// An I/O error. Damage is not an error here.
    pub fn read(disk: &dyn Disk, layout: &Layout) -> Result<Self> {
        let metadata = match map_folder::read_metadata(disk, layout) {
            Err(error @ Error::Io { .. }) if !is_no_file(&error) && !error.is_of_medium() => {
                return Err(error);
            }
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
            Err(error) if error.kind() == io::ErrorKind::InvalidInput || is_of_medium(&error) => {
                Err(FormatError::at_offset(0, error.to_string()).into())
            }
            Err(error) => return Err(Error::io(&path, "open", error)),
        };
        let (log_map_id, log_error) = match read {
            Ok(log) => (Some(log.map_id()), None),
            Err(DecodeError::Io(error)) if !is_of_medium(&error) => {
                return Err(Error::io(&path, "read", error));
            }
            Err(error) => (None, Some(error.in_map(&path, None))),
        };
        Ok(Self { metadata, log_error, log_map_id, commits })
    }

    /// Returns the layout of the map in `folder`, with the storage in these two files. If they do not contain it, or
    /// disagree, the storage of most tiles is used.
    pub fn layout_of_tiles(&self, disk: &dyn Disk, folder: &Path) -> Layout {
        let written = self.metadata.as_ref().ok().filter(|metadata| metadata.ext.is_some());
        let logged = self.commits.metadata.as_ref();
        let layout = Layout::new(folder);
        match (written.map(Metadata::storage), logged.map(Metadata::storage)) {
            (Some(written), Some(logged)) if written == logged => layout.with_storage(written),
            (Some(storage), None) | (None, Some(storage)) => layout.with_storage(storage),
            _ => {
                let [seed, compact] = [Storage::OctoMap, Storage::Compact]
                    .map(|storage| count_tables(disk, &layout.clone().with_storage(storage)));
                layout.with_storage(if compact > seed { Storage::Compact } else { Storage::OctoMap })
            }
        }
    }

    /// Replaces `commits.log` and then `metadata.json`.
    ///
    /// # Errors
    ///
    /// An I/O error. The next call resumes.
    pub fn write(
        &self,
        disk: &dyn Disk,
        layout: &Layout,
        map_id: [u8; 16],
        commits: &Commits,
        metadata: &Metadata,
    ) -> Result<()> {
        let text = metadata.as_of(commits).to_text();
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

/// Returns whether the error is that the path is not a regular file.
fn is_no_file(error: &Error) -> bool {
    matches!(error, Error::Io { cause, .. } if cause.kind() == io::ErrorKind::InvalidInput)
}

/// Counts the tiles with a table of this layout, renamed or not.
fn count_tables(disk: &dyn Disk, layout: &Layout) -> usize {
    // Errors are ignored: the next read of the folder reports them.
    let names = disk.list(layout.folder()).unwrap_or_default();
    let is_there = |path: &Path| matches!(disk.kind(path), Ok(Some(_)));
    let has_table = |&tile: &_| {
        is_there(&layout.current(tile, TileFile::Table)) || is_there(&layout.next(tile, TileFile::Table))
    };
    names.iter().filter_map(|name| tile_of_folder(name)).filter(has_table).count()
}
