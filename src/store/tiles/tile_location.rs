use super::file_checksum::Checksumming;
use super::tile_version::TileVersion;
use crate::config::Storage;
use crate::error::{Error, FormatError, Result};
use crate::space::TileIndex;
use crate::store::disk::{Disk, DiskRead, EntryKind};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;

/// Where a tile's table is, and what is known of it.
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

/// A tile's table as it is stored, ready to be read.
pub struct StoredTile {
    /// Where it is.
    pub path: PathBuf,
    /// The bytes; their checksum is computed as they pass.
    pub input: Checksumming<Box<dyn DiskRead>>,
    /// Length of the file in bytes.
    pub bytes: u64,
    /// Id of the map that the file must name; `None` if it is of the original format.
    pub map_id: Option<[u8; 16]>,
    /// What the log says of the tile, if it does.
    pub version: Option<TileVersion>,
    /// Its storage form.
    pub storage: Storage,
}

impl TileLocation {
    /// Which tile.
    pub fn tile(&self) -> TileIndex {
        self.tile
    }

    /// What the log says of the tile, if it does.
    pub fn version(&self) -> Option<TileVersion> {
        self.version
    }

    /// Id of the map that the file must name; `None` if it is of the original format.
    pub fn map_id(&self) -> Option<[u8; 16]> {
        self.map_id
    }

    /// Its storage form.
    pub fn storage(&self) -> Storage {
        self.storage
    }

    /// Whether the tile's folder is one, and no link.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn is_in_folder(&self) -> Result<bool> {
        Ok(self.disk.kind_at(&self.folder)? == Some(EntryKind::Folder))
    }

    /// Reads some bytes of the table's file, fewer if it ends before.
    ///
    /// # Errors
    ///
    /// A file that is missing or none, and a disk that refuses.
    pub fn read_at(&self, offset: u64, bytes: usize) -> io::Result<Vec<u8>> {
        self.disk.read_at(&self.path, offset, bytes)
    }

    /// Opens the table.
    ///
    /// # Errors
    ///
    /// A file or folder that is missing or none, and a disk that refuses.
    pub fn open(self) -> Result<StoredTile> {
        let Self { disk, tile, folder, path, map_id, version, storage } = self;
        let damaged = |reason| Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        match disk.kind_at(&folder)? {
            Some(EntryKind::Folder) => {}
            Some(_) => {
                return damaged("the tile's folder is a file or a link, not a folder");
            }
            None => return damaged("the tile's folder is missing, and the map holds this tile"),
        }
        match disk.open(&path) {
            Ok(input) => {
                let bytes = input.file_bytes();
                Ok(StoredTile { path, input: Checksumming::new(input), bytes, map_id, version, storage })
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                damaged("the file is missing, and the map holds this tile")
            }
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
                damaged("not a regular file; links inside a map are not followed")
            }
            Err(error) => Err(Error::io(&path, "open", error)),
        }
    }
}
