use crate::space::{GridError, TileIndex};
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A result whose error is voxtile's [`Error`](enum@Error).
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong, one variant for each thing a caller can do about it.
///
/// Every message names the path, tile, offset or argument it is about and says what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// An argument is wrong: pass another.
    #[error("{argument}: {reason}")]
    InvalidArgument {
        /// Which argument, as the caller spells it.
        argument: String,
        /// What is wrong with it and what would be right.
        reason: String,
    },
    /// The lengths of the grid are wrong: choose others.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The operating system refused: look at the path, the disk, the rights; then try again.
    #[error("{}: cannot {action}: {cause}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, as a verb with its object.
        action: &'static str,
        /// The refusal.
        cause: io::Error,
    },
    /// A file of a map is damaged or not the one that belongs there: restore or repair it.
    #[error("{}: {}damaged: {cause}; see `voxtile verify` and `voxtile repair`", path.display(), of_tile(tile))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The tile it belongs to, if to one.
        tile: Option<TileIndex>,
        /// Where and what.
        cause: FormatError,
    },
    /// A file that was given to be read is not what it should be: give another.
    #[error("{}: {cause}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where and what.
        cause: FormatError,
    },
    /// There is no map at the path: create one or name another path.
    #[error("{}: no map here (metadata.json is missing); `voxtile build` makes one", path.display())]
    NoMap {
        /// The folder.
        path: PathBuf,
    },
    /// There is a map at the path already: open it, or choose another path.
    #[error("{}: there is a map or other content already; {hint}", path.display())]
    AlreadyExists {
        /// The folder.
        path: PathBuf,
        /// What to do instead.
        hint: &'static str,
    },
    /// The map was made with other parameters: open it with its own.
    #[error("{}: the map has {what} {found}, not {wanted}; go on with its own or build another map", path.display())]
    Mismatch {
        /// The folder of the map.
        path: PathBuf,
        /// Which parameter.
        what: &'static str,
        /// The map's value.
        found: String,
        /// The value that was asked for.
        wanted: String,
    },
    /// Another process writes to the map: wait for it or end it.
    #[error("{}: another process is writing to this map; readers may open it beside that one", path.display())]
    Locked {
        /// The folder of the map.
        path: PathBuf,
    },
    /// The file that keeps other writers out was removed or replaced, so that another may be at work: close the map,
    /// and open it again to go on from its last flush.
    #[error(
        "{}: the file was removed or replaced while this process held it locked, so another may be writing to the map; \
         nothing was written since; open the map again to go on from its last flush",
        path.display()
    )]
    LockLost {
        /// The file.
        path: PathBuf,
    },
    /// A writer flushed the map while it was being read: open it again.
    #[error("{}: the map was flushed while it was being read; open it again", path.display())]
    Changed {
        /// The folder of the map.
        path: PathBuf,
    },
    /// A view of the map was held while so much changed that what it saw had to be let go: take a new view.
    #[error("the view of the map was held for too long: what it saw has changed; take a new one")]
    Expired,
    /// What was under way was to be given up, and is: nothing of it is in the map.
    #[error("stopped as asked; the map is as before")]
    Stopped,
    /// The operation would undo unsaved work: flush first, or say that it may be lost.
    #[error("tile {tile} has updates that are not on disk; flush first, or ask to discard them")]
    UnsavedChanges {
        /// The tile.
        tile: TileIndex,
    },
    /// The answer would be larger than a stated limit: ask for less.
    #[error("{what} would be {size}, more than the limit of {limit}; {hint}")]
    TooLarge {
        /// What would be too large.
        what: &'static str,
        /// How large.
        size: u64,
        /// What is allowed.
        limit: u64,
        /// What to do.
        hint: &'static str,
    },
}

/// Bytes or text that do not keep to their format: where, and what.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{place} {at}: {reason}")]
pub struct FormatError {
    /// What `at` counts.
    pub place: Place,
    /// Byte offset or line number (from 1).
    pub at: u64,
    /// What is wrong there, and what is right.
    pub reason: String,
}

/// What the position of a [`FormatError`] counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Bytes from the beginning of the file.
    Offset,
    /// Lines, the first being 1.
    Line,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Offset => "offset",
            Self::Line => "line",
        })
    }
}

impl FormatError {
    /// Something wrong at a byte offset.
    pub fn at_offset(offset: u64, reason: impl Into<String>) -> Self {
        Self { place: Place::Offset, at: offset, reason: reason.into() }
    }

    /// Something wrong in a line, the first being 1.
    pub fn at_line(line: u64, reason: impl Into<String>) -> Self {
        Self { place: Place::Line, at: line, reason: reason.into() }
    }

    /// The error of a file that was given to be read.
    pub fn in_input(self, path: &Path) -> Error {
        Error::Malformed { path: path.to_owned(), cause: self }
    }

    /// The error of a file of a map.
    pub fn in_map(self, path: &Path, tile: Option<TileIndex>) -> Error {
        Error::Damaged { path: path.to_owned(), tile, cause: self }
    }
}

impl Error {
    /// A wrong argument.
    pub fn argument(argument: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::InvalidArgument { argument: argument.into(), reason: reason.into() }
    }

    /// Whether the medium refused: a sector that cannot be read or written, or a damaged file system. It concerns one
    /// file, and stays.
    pub fn is_of_medium(&self) -> bool {
        matches!(self, Self::Io { cause, .. } if is_of_medium(cause))
    }

    /// A refusal of the operating system about a path.
    pub fn io(path: &Path, action: &'static str, cause: io::Error) -> Self {
        Self::Io { path: path.to_owned(), action, cause }
    }
}

/// Why a stream could not be decoded: the stream failed, or its content is wrong.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// Reading failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// What was read is wrong.
    #[error(transparent)]
    Format(#[from] FormatError),
}

impl DecodeError {
    /// The same of a part that begins so many bytes into the file.
    pub(crate) fn further_by(self, bytes: u64) -> Self {
        match self {
            Self::Format(FormatError { place: Place::Offset, at, reason }) => {
                FormatError::at_offset(at.saturating_add(bytes), reason).into()
            }
            error => error,
        }
    }

    /// The error of a file that was given to be read.
    pub fn in_input(self, path: &Path) -> Error {
        match self {
            Self::Io(source) => Error::io(path, "read", source),
            Self::Format(source) => source.in_input(path),
        }
    }

    /// The error of a file of a map.
    pub fn in_map(self, path: &Path, tile: Option<TileIndex>) -> Error {
        match self {
            Self::Io(source) => Error::io(path, "read", source),
            Self::Format(source) => source.in_map(path, tile),
        }
    }
}

fn of_tile(tile: &Option<TileIndex>) -> String {
    tile.map(|tile| format!("tile {tile} is ")).unwrap_or_default()
}

/// Whether an error is of the medium: a sector that cannot be read or written, or a file system that finds itself
/// damaged. Such an error concerns one file and stays; others, such as too many open files, say nothing of the file.
pub(crate) fn is_of_medium(error: &io::Error) -> bool {
    // EIO, ENXIO, ENODATA, EBADMSG, EUCLEAN and EREMOTEIO.
    #[cfg(unix)]
    const OF_MEDIUM: [i32; 6] = [5, 6, 61, 74, 117, 121];
    // ERROR_CRC, ERROR_SECTOR_NOT_FOUND, ERROR_READ_FAULT, ERROR_IO_DEVICE, ERROR_FILE_CORRUPT and ERROR_DISK_CORRUPT.
    #[cfg(not(unix))]
    const OF_MEDIUM: [i32; 6] = [23, 27, 30, 1117, 1392, 1393];
    error.raw_os_error().is_some_and(|code| OF_MEDIUM.contains(&code))
}
