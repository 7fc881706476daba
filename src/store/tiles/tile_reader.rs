use super::spill_file::SpillFile;
use super::tile_location::TileLocation;
use super::tile_version::TileVersion;
use crate::error::Result;
use crate::space::TileIndex;
use crate::store::layout::TileFile;
use crate::store::map_files::MapFiles;
use std::io::BufRead;
use std::path::Path;

/// Finds versions of tables beside the map's writer, from another thread of its process.
///
/// It is told which version: what it reads is that version or an error.
#[derive(Clone, Debug)]
pub struct TileReader {
    files: MapFiles,
    map_id: [u8; 16],
}

impl TileReader {
    pub(in crate::store) fn new(files: MapFiles, map_id: [u8; 16]) -> Self {
        Self { files, map_id }
    }

    /// Where the latest version of a table may be: under the name of a next version until it is committed, and then
    /// under its own, which a commit gives it at any moment.
    pub fn places(&self, tile: TileIndex, version: TileVersion) -> [TileLocation; 2] {
        let layout = self.files.layout();
        let at = |path| TileLocation {
            disk: self.files.disk().clone(),
            tile,
            folder: layout.tile_folder(tile),
            path,
            map_id: Some(self.map_id),
            version: Some(version),
            storage: layout.storage(),
        };
        [at(layout.next(tile, TileFile::Table)), at(layout.current(tile, TileFile::Table))]
    }

    /// Opens the updates in a tile's spill file, whose checksum was compared.
    ///
    /// # Errors
    ///
    /// A disk that refuses, and a file that is not what was written.
    pub fn open_spill(&self, tile: TileIndex, file: SpillFile) -> Result<impl BufRead + use<>> {
        self.files.open_spill(tile, file)
    }

    /// The map's folder.
    pub fn folder(&self) -> &Path {
        self.files.folder()
    }
}
