use crate::error::{Error, FormatError, Place};
use crate::space::TileIndex;
use serde::Serialize;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Finding about the files of a map.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Finding {
    /// Severity.
    pub severity: Severity,
    /// File or folder.
    #[serde(serialize_with = "crate::path_text::serialize")]
    pub path: PathBuf,
    /// Tile of the file, if it belongs to one.
    pub tile: Option<[i32; 3]>,
    /// Position in the file, in bytes from its beginning.
    pub offset: Option<u64>,
    /// Position in the file as a line, from 1.
    pub line: Option<u64>,
    /// Description.
    pub reason: String,
}

/// Severity of a [`Finding`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The map, or a part of it, differs from what was flushed.
    Damage,
    /// No damage: remains of an interrupted process, or foreign files.
    Note,
}

impl Finding {
    pub(super) fn note(path: &Path, tile: Option<TileIndex>, reason: impl Into<String>) -> Self {
        let (severity, tile) = (Severity::Note, tile.map(TileIndex::to_array));
        Self { severity, path: path.to_owned(), tile, offset: None, line: None, reason: reason.into() }
    }

    pub(super) fn damage(path: &Path, tile: Option<TileIndex>, cause: &FormatError) -> Self {
        let at = |place| (cause.place == place).then_some(cause.at);
        Self {
            severity: Severity::Damage,
            path: path.to_owned(),
            tile: tile.map(TileIndex::to_array),
            offset: at(Place::Offset),
            line: at(Place::Line),
            reason: cause.reason.clone(),
        }
    }

    /// Returns whether an error is specific to one file: it is not a regular file, the medium failed, or an object in a
    /// bucket is lost or damaged.
    pub(super) fn is_of_file(error: &Error) -> bool {
        matches!(error, Error::Io { cause, .. }
            if matches!(cause.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData))
            || error.is_of_medium()
    }

    /// Converts an error to a finding if it reports damage. Returns other errors unchanged.
    pub(super) fn of(error: Error) -> Result<Self, Error> {
        match error {
            Error::Damaged { path, tile, cause } => Ok(Self::damage(&path, tile, &cause)),
            Error::Io { path, cause, .. } if cause.kind() == io::ErrorKind::InvalidInput => {
                Ok(Self::damage(&path, None, &FormatError::at_offset(0, cause.to_string())))
            }
            Error::Io { path, cause, .. } if cause.kind() == io::ErrorKind::InvalidData => {
                let finding = Self::damage(&path, None, &FormatError::at_offset(0, cause.to_string()));
                Ok(Self { offset: None, ..finding })
            }
            error if error.is_of_medium() => Ok(Self::unreadable(&error, None)),
            error => Err(error),
        }
    }

    fn unreadable(error: &Error, tile: Option<TileIndex>) -> Self {
        let Error::Io { path, action, cause } = error else {
            return Self::damage(Path::new(""), tile, &FormatError::at_offset(0, format!("{error:#}")));
        };
        let reason = format!("cannot {action}: {cause}; the storage medium or its file system is damaged");
        let mut finding = Self::damage(path, tile, &FormatError::at_offset(0, reason));
        finding.offset = None;
        finding
    }

    /// Sets the tile of the finding, if it has none.
    pub(super) fn in_tile(self, tile: TileIndex) -> Self {
        Self { tile: Some(self.tile.unwrap_or(tile.to_array())), ..self }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Damage => "damage",
            Severity::Note => "note",
        };
        write!(f, "{severity}: {}: ", self.path.display())?;
        if let Some([x, y, z]) = self.tile {
            write!(f, "tile ({x}, {y}, {z}): ")?;
        }
        match (self.offset, self.line) {
            (Some(offset), _) => write!(f, "offset {offset}: ")?,
            (_, Some(line)) => write!(f, "line {line}: ")?,
            _ => {}
        }
        f.write_str(&self.reason)
    }
}
