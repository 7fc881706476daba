use super::Error;
use crate::space::TileIndex;
use std::fmt;
use std::path::Path;

/// Bytes or text that do not keep to their format: where, and what.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error("{place} {at}: {reason}")]
pub struct FormatError {
    /// What `at` counts.
    pub place: Place,
    /// Byte offset, line number (from 1) or record number (from 0).
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
    /// Records, points or messages, the first being 0.
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
    /// Something wrong at a byte offset.
    pub fn at_offset(offset: u64, reason: impl Into<String>) -> Self {
        Self { place: Place::Offset, at: offset, reason: reason.into() }
    }

    /// Something wrong in a line, the first being 1.
    pub fn at_line(line: u64, reason: impl Into<String>) -> Self {
        Self { place: Place::Line, at: line, reason: reason.into() }
    }

    /// Something wrong in a record, the first being 0.
    pub fn at_record(record: u64, reason: impl Into<String>) -> Self {
        Self { place: Place::Record, at: record, reason: reason.into() }
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
