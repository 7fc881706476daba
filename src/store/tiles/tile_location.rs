use super::file_checksum::Checksumming;
use super::tile_version::TileVersion;
use crate::config::Storage;
use crate::error::{Error, FormatError, Result};
use crate::space::TileIndex;
use crate::store::disk::{Disk, DiskRead, EntryKind};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;

/// Location and identity of a tile's table.
#[derive(Clone, Debug)]
pub struct TileLocation {
    pub(in crate::store) disk: Arc<dyn Disk>,
    pub(in crate::store) tile: TileIndex,
    pub(in crate::store) folder: PathBuf,
    pub(in crate::store) path: PathBuf,
    pub(in crate::store) map_id: Option<[u8; 16]>,
    pub(in crate::store) version: Option<TileVersion>,
    pub(in crate::store) storage: Storage,
}

/// Opened table of a tile.
pub struct StoredTile {
    /// Path of the file.
    pub path: PathBuf,
    /// Content. Reading it computes the checksum.
    pub input: Checksumming<Box<dyn DiskRead>>,
    /// Length of the file in bytes.
    pub bytes: u64,
    /// Map id that the file must contain; `None` for the original format.
    pub map_id: Option<[u8; 16]>,
    /// Version in the log, if any.
    pub version: Option<TileVersion>,
    /// Storage of the tile.
    pub storage: Storage,
}

impl TileLocation {
    /// Index of the tile.
    pub fn tile(&self) -> TileIndex {
        self.tile
    }

    /// Version in the log, if any.
    pub fn version(&self) -> Option<TileVersion> {
        self.version
    }

    /// Map id that the file must contain; `None` for the original format.
    pub fn map_id(&self) -> Option<[u8; 16]> {
        self.map_id
    }

    /// Storage of the tile.
    pub fn storage(&self) -> Storage {
        self.storage
    }

    /// Returns whether the tile's folder is a folder, not a symbolic link.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn is_in_folder(&self) -> Result<bool> {
        Ok(self.disk.kind_at(&self.folder)? == Some(EntryKind::Folder))
    }

    /// Reads up to `bytes` bytes of the file at `offset`.
    ///
    /// # Errors
    ///
    /// A missing file, anything but a regular file, or an I/O error.
    pub fn read_at(&self, offset: u64, bytes: usize) -> io::Result<Vec<u8>> {
        self.disk.read_at(&self.path, offset, bytes)
    }

    /// Opens the table.
    ///
    /// # Errors
    ///
    /// A missing file or folder, anything but a regular file, or an I/O error.
    pub fn open(self) -> Result<StoredTile> {
        let Self { disk, tile, folder, path, map_id, version, storage } = self;
        let damaged = |reason| Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        match disk.kind_at(&folder)? {
            Some(EntryKind::Folder) => {}
            Some(_) => {
                return damaged("the tile's folder is a file or a link, not a folder");
            }
            None => return damaged("the tile's folder is missing, but the map contains this tile"),
        }
        match disk.open(&path) {
            Ok(input) => {
                let bytes = input.file_bytes();
                Ok(StoredTile { path, input: Checksumming::new(input), bytes, map_id, version, storage })
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                damaged("the file is missing, but the map contains this tile")
            }
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
                damaged("not a regular file; links inside a map are not followed")
            }
            Err(error) => Err(Error::io(&path, "open", error)),
        }
    }
}
