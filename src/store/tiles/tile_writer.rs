use super::file_checksum::{Checksumming, FileChecksum};
use crate::config::Storage;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::TileFile;
use crate::store::map_files::MapFiles;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writer of next versions of tiles, which can run on another thread while the map is used.
///
/// [`TileStore::writer`](crate::store::TileStore::writer) returns it, after all committed versions are renamed. It must
/// not be used after the next commit.
#[derive(Clone, Debug)]
pub struct TileWriter {
    files: MapFiles,
    map_id: [u8; 16],
    keeps_earlier: bool,
}

impl TileWriter {
    pub(in crate::store) fn new(files: MapFiles, map_id: [u8; 16]) -> Self {
        Self { files, map_id, keeps_earlier: false }
    }

    /// Keeps the `*.next` file that was written before until the new one is complete, so that it can be read meanwhile
    /// and is not lost on an error.
    pub fn keeping_earlier(self) -> Self {
        Self { keeps_earlier: true, ..self }
    }

    /// Id of the map.
    pub fn map_id(&self) -> [u8; 16] {
        self.map_id
    }

    /// Storage of the map's tiles.
    pub fn storage(&self) -> Storage {
        self.files.layout().storage()
    }

    /// Writes the next version of a tile's file. The committed version is unchanged.
    ///
    /// # Errors
    ///
    /// An I/O error. An earlier next version is lost then, except with [`TileWriter::keeping_earlier`].
    pub fn write_next(
        &self,
        tile: TileIndex,
        file: TileFile,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<FileChecksum> {
        make_folder(&**self.files.disk(), &self.files.layout().tile_folder(tile))?;
        let next = self.files.layout().next(tile, file);
        let path = if self.keeps_earlier { self.files.layout().replacement(tile) } else { next.clone() };
        let write_file = || {
            let mut out =
                Checksumming::new(BufWriter::with_capacity(1 << 16, self.files.disk().create(&path)?));
            write(&mut out)?;
            out.flush()?;
            Ok(out.finish().0)
        };
        let written = write_file().map_err(|error| Error::io(&path, "write", error))?;
        if self.keeps_earlier {
            let renamed = self.files.disk().rename(&path, &next);
            renamed.map_err(|error| Error::io(&path, "rename", error))?;
        }
        Ok(written)
    }
}

/// Creates the folder of a tile if it is missing.
pub(in crate::store) fn make_folder(disk: &dyn Disk, folder: &Path) -> Result<()> {
    match disk.kind_at(folder)? {
        Some(EntryKind::Folder) => Ok(()),
        None => disk.create_folder(folder).map_err(|error| Error::io(folder, "create", error)),
        Some(_) => {
            let cause = io::Error::new(io::ErrorKind::NotADirectory, "a file or link has the folder's name");
            Err(Error::io(folder, "create", cause))
        }
    }
}
