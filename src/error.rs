mod decode_error;
mod format_error;
mod unanswered;

use crate::space::{GridError, TileIndex};
pub use decode_error::DecodeError;
pub use format_error::{FormatError, Place};
use std::path::{Path, PathBuf};
use std::{fmt, io};
use thiserror::Error;
pub use unanswered::Unanswered;

/// A result with voxtile's [`Error`](enum@Error).
pub type Result<T> = std::result::Result<T, Error>;

/// Error of a voxtile operation, with one variant for each way to handle it.
///
/// Every message names the path, tile, offset or argument, and the remedy.
///
/// Some errors have a cause, from the operating system or at a position in a file, which
/// [`source`](std::error::Error::source) returns. `{error}` is the message without the cause, and `{error:#}` includes
/// it as `message: cause`. Printers of error chains, such as anyhow's `{:#}`, therefore print each cause once. To print
/// a single error, use `{error:#}`.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// An argument is invalid: pass another value.
    #[error("{argument}: {reason}")]
    InvalidArgument {
        /// Name of the argument, as the caller knows it.
        argument: String,
        /// Problem and valid values.
        reason: String,
    },
    /// The lengths of the grid are invalid: choose others.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// An operation of the operating system failed: check the path, the disk and the permissions, then retry.
    #[error(fmt = fmt_io)]
    Io {
        /// File or folder.
        path: PathBuf,
        /// Failed operation: a verb, perhaps with its object.
        action: &'static str,
        /// Error of the operating system.
        #[source]
        cause: io::Error,
    },
    /// A file of a map is damaged or belongs elsewhere: restore or repair it.
    #[error(fmt = fmt_damaged)]
    Damaged {
        /// Damaged file.
        path: PathBuf,
        /// Tile of the file, if it belongs to one.
        tile: Option<TileIndex>,
        /// Position and problem.
        #[source]
        cause: FormatError,
    },
    /// An input file is malformed: use another file.
    #[error(fmt = fmt_malformed)]
    Malformed {
        /// Input file.
        path: PathBuf,
        /// Position and problem.
        #[source]
        cause: FormatError,
    },
    /// There is no map at the path: create one or use another path.
    #[error("{}: no map here (metadata.json is missing); `voxtile build` creates one", path.display())]
    NoMap {
        /// Folder.
        path: PathBuf,
    },
    /// A map or other content already exists at the path: open it, or choose another path.
    #[error("{}: there is a map or other content already; {hint}", path.display())]
    AlreadyExists {
        /// Folder or file.
        path: PathBuf,
        /// Remedy.
        hint: &'static str,
    },
    /// The map has other parameters: use the map's own.
    #[error("{}: the map has {what} {found}, not {wanted}; use the map's value or build another map", path.display())]
    Mismatch {
        /// Folder of the map.
        path: PathBuf,
        /// Name of the parameter.
        what: &'static str,
        /// Value of the map.
        found: String,
        /// Requested value.
        wanted: String,
    },
    /// Another process writes the map: wait for it or stop it.
    #[error("{}: another process is writing to this map; wait for it, or open the map for reading", path.display())]
    Locked {
        /// Folder of the map.
        path: PathBuf,
    },
    /// The lock file was removed or replaced, so another process may write the map: close and reopen the map to
    /// continue from its last flush.
    #[error(
        "{}: the lock file was removed or replaced, so another process may be writing to the map; nothing was written \
         since; open the map again to continue from its last flush",
        path.display()
    )]
    LockLost {
        /// Lock file.
        path: PathBuf,
    },
    /// A writer flushed the map during the read: open it again.
    #[error("{}: the map was flushed while it was being read; open it again", path.display())]
    Changed {
        /// Folder of the map.
        path: PathBuf,
    },
    /// A view of the map is too old, and its data was released: take a new view.
    #[error("the view of the map is too old: its data was replaced; take a new view")]
    Expired,
    /// The operation was stopped on request. It has not changed the map.
    #[error("stopped on request; the map is unchanged")]
    Stopped,
    /// A server stopped responding: check the network and the server, then retry.
    #[error(fmt = fmt_no_answer)]
    NoAnswer {
        /// URL of the bucket.
        path: PathBuf,
        /// Request, number of attempts and duration.
        unanswered: Box<Unanswered>,
        /// Error of the last attempt.
        #[source]
        cause: io::Error,
    },
    /// The operation would discard unsaved updates: flush first, or request to discard them.
    #[error("tile {tile} has updates that are not on disk; flush first, or request to discard them")]
    UnsavedChanges {
        /// Tile with unsaved updates.
        tile: TileIndex,
    },
    /// The result would exceed a limit: request less.
    #[error("{what} would be {size}, more than the limit of {limit}; {hint}")]
    TooLarge {
        /// Quantity that would be too large.
        what: &'static str,
        /// Its value.
        size: u64,
        /// Limit.
        limit: u64,
        /// Remedy.
        hint: &'static str,
    },
}

impl Error {
    /// Returns the error of an invalid argument.
    pub fn argument(argument: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::InvalidArgument { argument: argument.into(), reason: reason.into() }
    }

    /// Returns whether the storage medium failed: an unreadable or unwritable sector, or a damaged file system. Such an
    /// error affects one file and is permanent.
    pub fn is_of_medium(&self) -> bool {
        matches!(self, Self::Io { cause, .. } if is_of_medium(cause))
    }

    /// Name of the variant in snake case, such as `no_map` for [`Error::NoMap`]. Later versions keep these names.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::InvalidArgument { .. } => "invalid_argument",
            Self::Grid(_) => "grid",
            Self::Io { .. } => "io",
            Self::Damaged { .. } => "damaged",
            Self::Malformed { .. } => "malformed",
            Self::NoMap { .. } => "no_map",
            Self::AlreadyExists { .. } => "already_exists",
            Self::Mismatch { .. } => "mismatch",
            Self::Locked { .. } => "locked",
            Self::LockLost { .. } => "lock_lost",
            Self::Changed { .. } => "changed",
            Self::Expired => "expired",
            Self::Stopped => "stopped",
            Self::NoAnswer { .. } => "no_answer",
            Self::UnsavedChanges { .. } => "unsaved_changes",
            Self::TooLarge { .. } => "too_large",
        }
    }

    /// File or folder of the error, if any.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Io { path, .. }
            | Self::Damaged { path, .. }
            | Self::Malformed { path, .. }
            | Self::NoMap { path }
            | Self::AlreadyExists { path, .. }
            | Self::Mismatch { path, .. }
            | Self::Locked { path }
            | Self::LockLost { path }
            | Self::NoAnswer { path, .. }
            | Self::Changed { path } => Some(path),
            Self::InvalidArgument { .. }
            | Self::Grid(_)
            | Self::Expired
            | Self::Stopped
            | Self::UnsavedChanges { .. }
            | Self::TooLarge { .. } => None,
        }
    }

    /// Tile of the error, if any.
    pub fn tile(&self) -> Option<TileIndex> {
        match *self {
            Self::Damaged { tile, .. } => tile,
            Self::UnsavedChanges { tile } => Some(tile),
            _ => None,
        }
    }

    /// Position in the file of the error, if any.
    pub fn place(&self) -> Option<(Place, u64)> {
        match self {
            Self::Damaged { cause, .. } | Self::Malformed { cause, .. } => Some((cause.place, cause.at)),
            _ => None,
        }
    }

    /// Returns the error of a failed I/O operation on a path. If a [`Disk`](crate::store::Disk) has wrapped an
    /// [`Error::NoAnswer`] or [`Error::Stopped`] in the cause, that error is returned.
    pub fn io(path: &Path, action: &'static str, cause: io::Error) -> Self {
        let kind = cause.kind();
        match cause.downcast() {
            Ok(error @ (Self::NoAnswer { .. } | Self::Stopped)) => error,
            Ok(error) => Self::Io { path: path.to_owned(), action, cause: io::Error::new(kind, error) },
            Err(cause) => Self::Io { path: path.to_owned(), action, cause },
        }
    }
}

fn fmt_io(path: &Path, action: &str, cause: &io::Error, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(f, "{}: cannot {action}", path.display())?;
    fmt_cause(cause, f)
}

fn fmt_no_answer(
    path: &Path,
    unanswered: &Unanswered,
    cause: &io::Error,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(f, "{}: no answer to {unanswered}", path.display())?;
    fmt_cause(cause, f)
}

fn fmt_damaged(
    path: &Path,
    tile: &Option<TileIndex>,
    cause: &FormatError,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(f, "{}: ", path.display())?;
    if let Some(tile) = tile {
        write!(f, "tile {tile} is ")?;
    }
    f.write_str("damaged (see `voxtile verify` and `voxtile repair`)")?;
    fmt_cause(cause, f)
}

fn fmt_malformed(path: &Path, cause: &FormatError, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(f, "{}: malformed", path.display())?;
    fmt_cause(cause, f)
}

/// Appends the cause for `{:#}`. Printers of error chains use `{}` and print the cause themselves.
fn fmt_cause(cause: &impl fmt::Display, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if f.alternate() { write!(f, ": {cause:#}") } else { Ok(()) }
}

/// Returns whether the storage medium failed: an unreadable or unwritable sector, or a damaged file system. Such an
/// error affects one file and is permanent. Other errors, such as too many open files, do not depend on the file.
pub(crate) fn is_of_medium(error: &io::Error) -> bool {
    // EIO, ENXIO, ENODATA, EBADMSG, EUCLEAN and EREMOTEIO.
    #[cfg(unix)]
    const OF_MEDIUM: [i32; 6] = [5, 6, 61, 74, 117, 121];
    // ERROR_CRC, ERROR_SECTOR_NOT_FOUND, ERROR_READ_FAULT, ERROR_IO_DEVICE, ERROR_FILE_CORRUPT and ERROR_DISK_CORRUPT.
    #[cfg(not(unix))]
    const OF_MEDIUM: [i32; 6] = [23, 27, 30, 1117, 1392, 1393];
    error.raw_os_error().is_some_and(|code| OF_MEDIUM.contains(&code))
}
/// Returns the beginning of `text`, or the part that differs from `other` if both begin alike.
#[doc(hidden)]
pub fn beginning_or_difference(text: &str, other: &str) -> String {
    const MAX_CHARS: usize = 80;
    let common = text.chars().zip(other.chars()).take_while(|(a, b)| a == b).count();
    if common < MAX_CHARS {
        return text.chars().take(MAX_CHARS).collect();
    }
    let from = common - MAX_CHARS / 2;
    let part: String = text.chars().skip(from).take(MAX_CHARS).collect();
    format!("..{part} (from character {} on)", from + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_with_a_common_beginning_show_the_difference() {
        let [a, b] = ["a", "b"].map(|end| "x".repeat(200) + end);
        let parts = [beginning_or_difference(&a, &b), beginning_or_difference(&b, &a)];
        assert!(parts[0] != parts[1] && parts[0].ends_with("xa (from character 161 on)"), "{parts:?}");
        assert_ne!(beginning_or_difference(&a, &a[..200]), beginning_or_difference(&a[..200], &a));
        assert_eq!(beginning_or_difference("EPSG:25832", "EPSG:25833"), "EPSG:25832");
    }
}
