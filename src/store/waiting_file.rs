use super::tile_store::TileStore;
use super::tile_writer::make_folder;
use crate::error::{Error, FormatError, Result};
use crate::space::TileIndex;
use std::io::{Read, Write};

/// How much of a tile's file of waiting updates counts: so many bytes with this checksum. What stands behind them is of
/// an attempt that was given up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WaitingFile {
    /// Length in bytes.
    pub bytes: u64,
    crc: u32,
}

/// Updates that wait for a tile in a file of its folder, because memory is short. They are no part of the map on disk:
/// a commit does not know the file, and opening the map removes it.
impl TileStore {
    /// Appends updates to those of `file`, and returns what is there then. After an error `file` still counts.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn append_waiting(&self, tile: TileIndex, file: WaitingFile, updates: &[u8]) -> Result<WaitingFile> {
        let path = self.layout.waiting(tile);
        make_folder(&*self.disk, &self.layout.tile_folder(tile))?;
        let append = || {
            let mut out = match file.bytes {
                0 => self.disk.create(&path)?,
                bytes => self.disk.append(&path, bytes)?,
            };
            out.write_all(updates)?;
            out.flush()
        };
        append().map_err(|error| Error::io(&path, "append to", error))?;
        let mut crc = crc32fast::Hasher::new_with_initial(file.crc);
        crc.update(updates);
        Ok(WaitingFile { bytes: file.bytes + updates.len() as u64, crc: crc.finalize() })
    }

    /// The updates that wait in a tile's file.
    ///
    /// # Errors
    ///
    /// A disk that refuses, and a file that is not what was written.
    pub fn read_waiting(&self, tile: TileIndex, file: WaitingFile) -> Result<Vec<u8>> {
        if file.bytes == 0 {
            return Ok(Vec::new());
        }
        let path = self.layout.waiting(tile);
        let input = self.disk.open(&path).map_err(|error| Error::io(&path, "open", error))?;
        let mut updates = Vec::with_capacity(file.bytes.min(input.file_bytes()) as usize);
        input.take(file.bytes).read_to_end(&mut updates).map_err(|error| Error::io(&path, "read", error))?;
        if updates.len() as u64 != file.bytes || crc32fast::hash(&updates) != file.crc {
            let reason = "the updates that wait here for their tile are not those written; \
                          go on from the last flush";
            return Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        }
        Ok(updates)
    }

    /// Cuts off what stands behind the updates that count. If that fails it does no harm but for the room that it takes.
    pub fn cut_waiting(&self, tile: TileIndex, file: WaitingFile) {
        if file.bytes == 0 {
            return self.remove_waiting(tile);
        }
        let path = self.layout.waiting(tile);
        if let Err(error) = self.disk.append(&path, file.bytes) {
            log::debug!("{}: not cut: {error}", path.display());
        }
    }

    /// Removes a tile's file of waiting updates: they were applied, or nobody wants them any more. A file that stays
    /// does no harm.
    pub fn remove_waiting(&self, tile: TileIndex) {
        let path = self.layout.waiting(tile);
        if let Err(error) = self.disk.remove_file(&path) {
            log::debug!("{}: not removed: {error}", path.display());
        }
    }
}
