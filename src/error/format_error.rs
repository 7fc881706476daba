use super::Error;
use crate::space::TileIndex;
use std::fmt;
use std::path::Path;

/// Error in the format of bytes or text, with its position.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error("{place} {at}: {reason}")]
pub struct FormatError {
    /// Unit of `at`.
    pub place: Place,
    /// Byte offset, line number (from 1) or record number (from 0).
    pub at: u64,
    /// Problem, and valid content.
    pub reason: String,
}

/// Unit of the position of a [`FormatError`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Bytes from the beginning of the file.
    Offset,
    /// Lines, from 1.
    Line,
    /// Records, points or messages, from 0.
    Record,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Offset => "offset",
            Self::Line => "line",
            Self::Record => "record",
        })
    }
}

impl FormatError {
    /// Returns an error at a byte offset.
    pub fn at_offset(offset: u64, reason: impl Into<String>) -> Self {
        Self { place: Place::Offset, at: offset, reason: reason.into() }
    }

    /// Returns an error in a line, counted from 1.
    pub fn at_line(line: u64, reason: impl Into<String>) -> Self {
        Self { place: Place::Line, at: line, reason: reason.into() }
    }

    /// Returns an error in a record, counted from 0.
    pub fn at_record(record: u64, reason: impl Into<String>) -> Self {
        Self { place: Place::Record, at: record, reason: reason.into() }
    }

    /// Returns the error for an input file.
    pub fn in_input(self, path: &Path) -> Error {
        Error::Malformed { path: path.to_owned(), cause: self }
    }

    /// Returns the error for a file of a map.
    pub fn in_map(self, path: &Path, tile: Option<TileIndex>) -> Error {
        Error::Damaged { path: path.to_owned(), tile, cause: self }
    }
}
