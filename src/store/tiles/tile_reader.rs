use super::spill_file::SpillFile;
use super::tile_location::TileLocation;
use super::tile_version::TileVersion;
use crate::error::Result;
use crate::space::TileIndex;
use crate::store::layout::TileFile;
use crate::store::map_files::MapFiles;
use std::io::BufRead;
use std::path::Path;

/// Reader of tables that runs concurrently with the map's writer, on another thread of its process.
///
/// The caller gives the version, so a read returns that version or an error.
#[derive(Clone, Debug)]
pub struct TileReader {
    files: MapFiles,
    map_id: [u8; 16],
}

impl TileReader {
    pub(in crate::store) fn new(files: MapFiles, map_id: [u8; 16]) -> Self {
        Self { files, map_id }
    }

    /// Returns the possible locations of the latest version of a table: its `*.next` name, and its final name after a
    /// commit, which can rename it at any time.
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

    /// Checks the updates in a tile's spill file, and opens them as a stream.
    ///
    /// # Errors
    ///
    /// An I/O error, or a file that does not match its checksum.
    pub fn open_spill(&self, tile: TileIndex, file: SpillFile) -> Result<impl BufRead + use<>> {
        self.files.open_spill(tile, file)
    }

    /// The map's folder.
    pub fn folder(&self) -> &Path {
        self.files.folder()
    }
}
