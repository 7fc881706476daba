use super::finding::Finding;
use crate::config::MapConfig;
use crate::error::{Error, FormatError, Result, is_of_medium};
use crate::persistence::load::{self, ReadTable};
use crate::space::TileIndex;
use crate::store::{Checksumming, Disk, FileChecksum, TileFile, TileStore, TileVersion};
use std::io::{self, Read, Write};
use std::path::Path;

/// Result of checking both files of a tile.
pub(super) struct TileCheck {
    pub table: Result<ReadTable>,
    /// `None` if there is no octree file, or if its expected content is unknown.
    pub octree: Option<std::result::Result<(), FormatError>>,
}

/// Checks both files of a tile of the map.
///
/// # Errors
///
/// An I/O error. Damage is part of the result.
pub(super) fn check_tile(
    disk: &dyn Disk,
    store: &TileStore,
    config: &MapConfig,
    tile: TileIndex,
) -> Result<TileCheck> {
    let table = match load::load_table(store, &config.grid, tile) {
        Ok(Some(table)) => Ok(table),
        Ok(None) => {
            let path = store.layout().current(tile, TileFile::Table);
            Err(FormatError::at_offset(0, "the map does not contain this tile").in_map(&path, Some(tile)))
        }
        Err(error) if matches!(error, Error::Damaged { .. }) || Finding::is_of_file(&error) => Err(error),
        Err(error) => return Err(error),
    };
    let has_octree = store.layout().files().contains(&TileFile::Octree);
    let octree = match store.tiles().version(tile).filter(|_| has_octree) {
        Some(version) => Some(check_octree(disk, store, tile, version)?),
        None => None,
    };
    Ok(TileCheck { table, octree })
}

fn check_octree(
    disk: &dyn Disk,
    store: &TileStore,
    tile: TileIndex,
    version: TileVersion,
) -> Result<std::result::Result<(), FormatError>> {
    let layout = store.layout();
    let current = layout.current(tile, TileFile::Octree);
    let found = match checksum_of(disk, &current) {
        Err(Error::Io { action, cause, .. })
            if is_of_medium(&cause) || cause.kind() == io::ErrorKind::InvalidData =>
        {
            let reason = format!("cannot {action}: {cause}; it can be derived from the table");
            return Ok(Err(FormatError::at_offset(0, reason)));
        }
        found => found?,
    };
    // A concurrent writer may have committed the octree without renaming it yet.
    if found == Some(version.octree)
        || checksum_of(disk, &layout.next(tile, TileFile::Octree))
            .is_ok_and(|next| next == Some(version.octree))
    {
        return Ok(Ok(()));
    }
    Ok(Err(match found {
        None if matches!(disk.kind(&current), Ok(Some(_))) => {
            FormatError::at_offset(0, "not a regular file; it can be derived from the table")
        }
        None => FormatError::at_offset(0, "the file is missing; it can be derived from the table"),
        Some(FileChecksum { bytes, .. }) if bytes != version.octree.bytes => {
            let wanted = version.octree.bytes;
            FormatError::at_offset(bytes.min(wanted), format!("{bytes} bytes, but the log records {wanted}"))
        }
        Some(_) => FormatError::at_offset(0, "the file does not match its checksum in the log"),
    }))
}

pub(super) fn write_octree(config: &MapConfig, table: &ReadTable, out: &mut dyn Write) -> io::Result<()> {
    let threshold = config.occupied_log_odds() as f32;
    table.table.write_bt(config.grid.resolution_m(), threshold, &mut &mut *out)
}

/// Returns length and checksum of a file; `None` if it does not exist.
pub(super) fn checksum_of(disk: &dyn Disk, path: &Path) -> Result<Option<FileChecksum>> {
    let input = match disk.open(path) {
        Ok(input) => input,
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::InvalidInput) => {
            return Ok(None);
        }
        Err(error) => return Err(Error::io(path, "open", error)),
    };
    let mut input = Checksumming::new(input);
    io::copy(&mut input, &mut io::sink()).map_err(|error| Error::io(path, "read", error))?;
    Ok(Some(input.finish().0))
}

/// Returns the offset of the first byte that differs from the expected content, as a hint at the cause.
pub(super) fn first_difference(disk: &dyn Disk, path: &Path, expected: &[u8]) -> Option<u64> {
    let mut found = Vec::new();
    disk.open(path).ok()?.take(expected.len() as u64 + 1).read_to_end(&mut found).ok()?;
    let common = found.iter().zip(expected).take_while(|(a, b)| a == b).count();
    (common < found.len().max(expected.len())).then_some(common as u64)
}
