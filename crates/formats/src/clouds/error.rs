use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What goes wrong with files of other programs.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The system refused.
    #[error("cannot {action} {}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried: `read`.
        action: &'static str,
        /// Why not.
        source: io::Error,
    },
    /// A file is not what it says.
    #[error("{}, {place}: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What is wrong.
        reason: String,
    },
    /// Something that was asked for cannot be.
    #[error("{what}: {reason}")]
    Argument {
        /// The option, file or value.
        what: String,
        /// What is wrong, and what to do.
        reason: String,
    },
}

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Bytes before it.
    Byte(u64),
    /// Number of a line, from 1.
    Line(u64),
    /// Number of a record, a point or a message, from 0.
    Record(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(offset) => write!(f, "byte {offset}"),
            Self::Line(line) => write!(f, "line {line}"),
            Self::Record(record) => write!(f, "record {record}"),
        }
    }
}

impl Error {
    /// The system refused to do something with a path.
    pub fn io(path: &Path, action: &'static str, source: io::Error) -> Self {
        Self::Io { path: path.to_owned(), action, source }
    }

    /// A file is not what it says.
    pub fn format(path: &Path, place: Place, reason: impl Into<String>) -> Self {
        Self::Format { path: path.to_owned(), place, reason: reason.into() }
    }

    /// Something that was asked for cannot be.
    pub fn argument(what: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Argument { what: what.into(), reason: reason.into() }
    }
}
