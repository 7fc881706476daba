use super::tile_writer::make_folder;
use crate::error::{Error, FormatError, Result};
use crate::space::{TileIndex, TileValue, put_number, take_number, take_u32};
use crate::store::map_files::MapFiles;
use crate::store::tile_store::TileStore;
use std::io::{BufRead, BufReader, Read, Write};

const BUFFER_BYTES: usize = 1 << 16;

/// Length and checksum of the valid part of a tile's spill file. Later bytes were left by a failed append.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SpillFile {
    /// Length in bytes.
    pub bytes: u64,
    crc: u32,
}

impl TileValue for SpillFile {
    fn pack(self, _: Self, out: &mut Vec<u8>) {
        put_number(self.bytes, out);
        out.extend_from_slice(&self.crc.to_le_bytes());
    }

    fn unpack(_: Self, input: &mut &[u8]) -> Self {
        let bytes = take_number(input);
        Self { bytes, crc: take_u32(input) }
    }
}

/// Updates of tiles that do not fit in memory, in files in the tile folders. These files are not part of the map: no
/// commit names them, and opening the map removes them.
#[derive(Clone, Debug)]
pub struct SpillFiles {
    files: MapFiles,
}

impl TileStore {
    /// Returns the spill files of the map.
    pub fn spill_files(&self) -> SpillFiles {
        SpillFiles { files: self.files.clone() }
    }
}

impl SpillFiles {
    /// Appends updates to `file`. Returns the new valid part. After an error `file` is still valid.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn append(&self, tile: TileIndex, file: SpillFile, updates: &[u8]) -> Result<SpillFile> {
        let path = self.files.layout().spill(tile);
        make_folder(&**self.files.disk(), &self.files.layout().tile_folder(tile))?;
        let append = || {
            let mut out = match file.bytes {
                0 => self.files.disk().create(&path)?,
                bytes => self.files.disk().append(&path, bytes)?,
            };
            out.write_all(updates)?;
            out.flush()
        };
        append().map_err(|error| Error::io(&path, "append to", error))?;
        let mut crc = crc32fast::Hasher::new_with_initial(file.crc);
        crc.update(updates);
        Ok(SpillFile { bytes: file.bytes + updates.len() as u64, crc: crc.finalize() })
    }

    /// See [`TileReader::open_spill`](super::tile_reader::TileReader::open_spill).
    ///
    /// # Errors
    ///
    /// An I/O error, or a file that does not match its checksum.
    pub fn open(&self, tile: TileIndex, file: SpillFile) -> Result<impl BufRead + use<>> {
        self.files.open_spill(tile, file)
    }

    /// Truncates the file to its valid part. A failure only wastes disk space.
    pub fn cut(&self, tile: TileIndex, file: SpillFile) {
        if file.bytes == 0 {
            return self.remove(tile);
        }
        let path = self.files.layout().spill(tile);
        if let Err(error) = self.files.disk().append(&path, file.bytes) {
            log::debug!("{}: cannot truncate: {error}", path.display());
        }
    }

    /// Removes a tile's spill file after its updates were applied or discarded. A failure only wastes disk space.
    pub fn remove(&self, tile: TileIndex) {
        let path = self.files.layout().spill(tile);
        if let Err(error) = self.files.disk().remove_file(&path) {
            log::debug!("{}: cannot remove: {error}", path.display());
        }
    }
}

impl MapFiles {
    /// Checks the updates in a tile's spill file, and opens them as a stream: they may exceed memory.
    ///
    /// # Errors
    ///
    /// An I/O error, or a file that does not match its checksum.
    pub(super) fn open_spill(&self, tile: TileIndex, file: SpillFile) -> Result<impl BufRead + use<>> {
        let path = self.layout().spill(tile);
        let open = || {
            let input = self.disk().open(&path).map_err(|error| Error::io(&path, "open", error))?;
            Ok(BufReader::with_capacity(BUFFER_BYTES, input).take(file.bytes))
        };
        let mut crc = crc32fast::Hasher::new();
        let mut input = open()?;
        let mut bytes = 0;
        loop {
            let some = input.fill_buf().map_err(|error| Error::io(&path, "read", error))?;
            if some.is_empty() {
                break;
            }
            crc.update(some);
            let count = some.len();
            bytes += count as u64;
            input.consume(count);
        }
        if bytes != file.bytes || crc.finalize() != file.crc {
            let reason = "the buffered updates in this file do not match their checksum; \
                          reopen the map to continue from the last flush";
            return Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        }
        open()
    }
}
