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

/// A result whose error is voxtile's [`Error`](enum@Error).
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong, one variant for each thing a caller can do about it.
///
/// Every message names the path, tile, offset or argument it is about and says what to do.
///
/// Some have a cause, the operating system's or the place in a file:
/// [`source`](std::error::Error::source) gives it, so that a program need not look for it in a text. `{error}` is the
/// message without it and `{error:#}` the one with it, `message: cause`. So whoever prints a chain of errors, as `{:#}`
/// of anyhow does, tells each cause once; whoever prints one of these by itself wants `{error:#}`.
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
    #[error(fmt = fmt_io)]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, as a verb with its object.
        action: &'static str,
        /// The refusal.
        #[source]
        cause: io::Error,
    },
    /// A file of a map is damaged or not the one that belongs there: restore or repair it.
    #[error(fmt = fmt_damaged)]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The tile it belongs to, if to one.
        tile: Option<TileIndex>,
        /// Where and what.
        #[source]
        cause: FormatError,
    },
    /// A file that was given to be read is not what it should be: give another.
    #[error(fmt = fmt_malformed)]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where and what.
        #[source]
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
    /// A server stopped answering: look at the network and the server, then try again.
    #[error(fmt = fmt_no_answer)]
    NoAnswer {
        /// The URL of the bucket.
        path: PathBuf,
        /// What was asked, how often and for how long.
        unanswered: Box<Unanswered>,
        /// How the last attempt failed.
        #[source]
        cause: io::Error,
    },
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

    /// The variant in one word that later versions keep: its name in snake case, `no_map` for [`Error::NoMap`].
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

    /// The file or folder that it is about, if it is about one.
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

    /// The tile that it is about, if it is about one.
    pub fn tile(&self) -> Option<TileIndex> {
        match *self {
            Self::Damaged { tile, .. } => tile,
            Self::UnsavedChanges { tile } => Some(tile),
            _ => None,
        }
    }

    /// The place in the file that it is about, if it is about one.
    pub fn place(&self) -> Option<(Place, u64)> {
        match self {
            Self::Damaged { cause, .. } | Self::Malformed { cause, .. } => Some((cause.place, cause.at)),
            _ => None,
        }
    }

    /// A refusal of the operating system about a path. An [`Error::NoAnswer`] or [`Error::Stopped`] that a
    /// [`Disk`](crate::store::Disk) has put into the cause is returned as it is.
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

/// With `{:#}` the cause is part of the message; printers of chains ask for `{}` and tell it themselves.
fn fmt_cause(cause: &impl fmt::Display, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if f.alternate() { write!(f, ": {cause:#}") } else { Ok(()) }
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
/// The beginning of a text that is not another one; where both begin alike, the part that differs.
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
    fn two_long_texts_that_begin_alike_are_shown_where_they_differ() {
        let [a, b] = ["a", "b"].map(|end| "x".repeat(200) + end);
        let parts = [beginning_or_difference(&a, &b), beginning_or_difference(&b, &a)];
        assert!(parts[0] != parts[1] && parts[0].ends_with("xa (from character 161 on)"), "{parts:?}");
        assert_ne!(beginning_or_difference(&a, &a[..200]), beginning_or_difference(&a[..200], &a));
        assert_eq!(beginning_or_difference("EPSG:25832", "EPSG:25833"), "EPSG:25832");
    }
}
