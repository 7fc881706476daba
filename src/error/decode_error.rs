use super::{Error, FormatError, Place};
use crate::space::TileIndex;
use std::io;
use std::path::Path;

/// Error of decoding a stream: a failed read or invalid content.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// A read failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The content is invalid.
    #[error(transparent)]
    Format(#[from] FormatError),
}

impl DecodeError {
    /// Adds `bytes` to the offset, for an error in a part that begins there.
    pub(crate) fn further_by(self, bytes: u64) -> Self {
        match self {
            Self::Format(FormatError { place: Place::Offset, at, reason }) => {
                FormatError::at_offset(at.saturating_add(bytes), reason).into()
            }
            error => error,
        }
    }

    /// Returns the error for an input file.
    pub fn in_input(self, path: &Path) -> Error {
        match self {
            Self::Io(source) => Error::io(path, "read", source),
            Self::Format(source) => source.in_input(path),
        }
    }

    /// Returns the error for a file of a map.
    pub fn in_map(self, path: &Path, tile: Option<TileIndex>) -> Error {
        match self {
            Self::Io(source) => Error::io(path, "read", source),
            Self::Format(source) => source.in_map(path, tile),
        }
    }
}
