use super::{Error, FormatError, Place};
use crate::space::TileIndex;
use std::io;
use std::path::Path;

/// Why a stream could not be decoded: the stream failed, or its content is wrong.
#[derive(Debug, thiserror::Error)]
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
