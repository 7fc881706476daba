use super::file_checksum::{Checksumming, FileChecksum};
use crate::config::Storage;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::TileFile;
use crate::store::map_files::MapFiles;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes next versions of tiles, beside the committed ones. Another thread may do so while the map goes on.
///
/// It is got from [`TileStore::writer`](crate::store::TileStore::writer), which makes sure that no committed version
/// still has the name that is written to. Not to be used any more once the map has committed.
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

    /// Leaves an earlier next version as it is until the new one is whole: it can be read meanwhile, and an error loses
    /// nothing.
    pub fn keeping_earlier(self) -> Self {
        Self { keeps_earlier: true, ..self }
    }

    /// The map's id.
    pub fn map_id(&self) -> [u8; 16] {
        self.map_id
    }

    /// How the map's tiles are stored.
    pub fn storage(&self) -> Storage {
        self.files.layout().storage()
    }

    /// Writes the next version of one of a tile's files; the committed version stays as it is.
    ///
    /// # Errors
    ///
    /// A disk that refuses; what there was of an earlier next version is lost then, unless it is kept
    /// ([`TileWriter::keeping_earlier`]).
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

/// Makes the folder of a tile if it is not there.
pub(in crate::store) fn make_folder(disk: &dyn Disk, folder: &Path) -> Result<()> {
    match disk.kind_at(folder)? {
        Some(EntryKind::Folder) => Ok(()),
        None => disk.create_folder(folder).map_err(|error| Error::io(folder, "create", error)),
        Some(_) => {
            let cause = io::Error::new(io::ErrorKind::NotADirectory, "something else has the folder's name");
            Err(Error::io(folder, "create", cause))
        }
    }
}
