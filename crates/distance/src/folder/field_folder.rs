use super::field_disk::{FieldDisk, FsDisk, UNFINISHED};
use super::index::Index;
use super::tile_file;
use super::tile_key::TileKey;
use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxtile::store::check_outside_of_maps;
use voxtile::{Error, Result, TileIndex};

/// Files of a field.
#[derive(Clone, Debug)]
pub(super) struct FieldFolder {
    folder: PathBuf,
    tiles: PathBuf,
    disk: Arc<dyn FieldDisk>,
}

const INDEX: &str = "field.json";
const LOCK: &str = "writer.lock";
const TILES: &str = "tiles";
/// End of the names of tiles.
const EXTENSION: &str = ".vxdist";
/// Largest `field.json` that is read: ten million tiles.
const MAX_INDEX_BYTES: u64 = 1 << 30;

impl FieldFolder {
    pub(super) fn new(folder: &Path) -> Self {
        Self::on(Arc::new(FsDisk), folder)
    }

    fn on(disk: Arc<dyn FieldDisk>, folder: &Path) -> Self {
        Self { folder: folder.to_owned(), tiles: folder.join(TILES), disk }
    }

    /// Creates the folder, or checks that it contains a field, and locks it against other writers.
    ///
    /// # Errors
    ///
    /// Fails if the folder is in a map or has other content, if another process writes the field, or with an I/O error.
    pub(super) fn open_to_write(disk: Arc<dyn FieldDisk>, folder: &Path) -> Result<(Self, File)> {
        check_outside_of_maps(folder)?;
        let field = Self::on(disk, folder);
        let in_use = || {
            let hint = "choose an empty folder, or one with a distance field";
            Error::AlreadyExists { path: folder.to_owned(), hint }
        };
        match field.disk.list(folder) {
            Ok(names) => {
                let is_own = |name: &String| [LOCK, TILES].iter().any(|own| name == own);
                let is_field = names.iter().any(|name| name == INDEX);
                if !is_field && !names.iter().all(is_own) {
                    return Err(in_use());
                }
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => return Err(in_use()),
            Err(error) => return Err(Error::io(folder, "list", error)),
        }
        field.disk.create_folder(&field.tiles).map_err(|error| Error::io(&field.tiles, "create", error))?;
        let path = folder.join(LOCK);
        let lock = File::options().create(true).truncate(false).write(true).open(&path);
        let lock = lock.map_err(|error| Error::io(&path, "create", error))?;
        match lock.try_lock() {
            Ok(()) => Ok((field, lock)),
            Err(TryLockError::WouldBlock) => {
                let reason =
                    "another process writes this distance field; wait for it, or choose another folder";
                Err(Error::argument(folder.display().to_string(), reason))
            }
            Err(TryLockError::Error(error)) => Err(Error::io(&path, "lock", error)),
        }
    }

    /// Reads `field.json`; `None` if there is none.
    ///
    /// # Errors
    ///
    /// Fails if the file is malformed or cannot be read.
    pub(super) fn read_index(&self) -> Result<Option<Index>> {
        let path = self.folder.join(INDEX);
        match fs::metadata(&path) {
            Ok(metadata) if metadata.len() > MAX_INDEX_BYTES => {
                let hint = "this is no field.json of a distance field";
                Err(Error::TooLarge {
                    what: "field.json",
                    size: metadata.len(),
                    limit: MAX_INDEX_BYTES,
                    hint,
                })
            }
            Ok(_) => {
                let bytes = self.disk.read(&path).map_err(|error| Error::io(&path, "read", error))?;
                Index::parse(&bytes, &path).map(Some)
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(Error::io(&path, "read", error)),
        }
    }

    /// Replaces `field.json`: from now on, its tiles are the field.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(super) fn write_index(&self, index: &Index) -> Result<()> {
        let path = self.folder.join(INDEX);
        let write = || {
            let mut file = self.disk.create(&self.folder)?;
            self.disk.write(&mut file, &serde_json::to_vec(index)?)?;
            self.disk.sync(file.path())?;
            self.disk.rename(file, &path)?;
            self.disk.sync(&self.folder)
        };
        write().map_err(|error: io::Error| Error::io(&path, "write", error))
    }

    /// Path of a tile's file.
    pub(super) fn tile_path(&self, tile: TileIndex, key: TileKey) -> PathBuf {
        self.tiles.join(tile_name(tile, key))
    }

    /// Writes a tile's file.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(super) fn write_tile(&self, tile: TileIndex, key: TileKey, bytes: &[u8]) -> Result<()> {
        let path = self.tile_path(tile, key);
        let write = || {
            let mut file = self.disk.create(&self.tiles)?;
            self.disk.write(&mut file, bytes)?;
            self.disk.rename(file, &path)
        };
        write().map_err(|error: io::Error| Error::io(&path, "write", error))
    }

    /// Reads and checks the file of a tile.
    ///
    /// # Errors
    ///
    /// Fails if the file is missing, damaged or of another key.
    pub(super) fn read_tile(&self, tile: TileIndex, edge: usize, key: TileKey) -> Result<Vec<u8>> {
        let path = self.tile_path(tile, key);
        let bytes = self.disk.read(&path).map_err(|error| Error::io(&path, "read", error))?;
        tile_file::check(&bytes, tile, edge, key).map_err(|error| error.in_input(&path))?;
        Ok(bytes)
    }

    /// Removes the files of tiles that are not listed, and unfinished files.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(super) fn remove_others(&self, listed: impl Iterator<Item = (TileIndex, TileKey)>) -> Result<()> {
        let listed: BTreeSet<String> = listed.map(|(tile, key)| tile_name(tile, key)).collect();
        for folder in [&self.tiles, &self.folder] {
            let names = self.disk.list(folder).map_err(|error| Error::io(folder, "list", error))?;
            for name in names {
                let is_old = name.ends_with(EXTENSION) && !listed.contains(&name);
                if is_old || name.starts_with(UNFINISHED) {
                    let path = folder.join(name);
                    self.disk.remove(&path).map_err(|error| Error::io(&path, "remove", error))?;
                }
            }
        }
        Ok(())
    }
}

fn tile_name(tile: TileIndex, key: TileKey) -> String {
    format!("{}_{}_{}.{key}{EXTENSION}", tile.x, tile.y, tile.z)
}
