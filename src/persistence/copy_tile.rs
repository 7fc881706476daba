//! Copies a tile from one map to another.

use crate::config::Storage;
use crate::error::{DecodeError, Error, FormatError, Result};
use crate::space::TileIndex;
use crate::store::{FileChecksum, StoredTile, TileFile, TileStore, TileVersion, TileWriter};
use crate::tile::format::{Trailer, renew_compact_file, renew_table};
use std::io;

/// Writes the next version of a tile's files from those of another map with the same parameters and storage, and
/// without a writer. Copies all bytes except the map's identity, and compares them with that map's log. The new files
/// have the given scan number.
pub(crate) fn copy_tile(
    from: &TileStore,
    writer: &TileWriter,
    tile: TileIndex,
    scan_number: u64,
) -> Result<TileVersion> {
    let Some((StoredTile { path, mut input, bytes, .. }, version)) =
        from.tables().open(tile)?.and_then(|stored| stored.version.map(|version| (stored, version)))
    else {
        let reason = format!("{} has no checksums of {tile}", from.folder().display());
        return Err(Error::argument("tile", reason));
    };
    let storage = writer.storage();
    let octree = match storage {
        Storage::OctoMap => from.copy_file(writer, tile, TileFile::Octree)?,
        Storage::Compact => FileChecksum::default(),
    };
    let renew = |trailer| Trailer { map_id: writer.map_id(), scan_number, ..trailer };
    let mut wrong = None;
    let written = writer.write_next(tile, TileFile::Table, |out| {
        let copied = match storage {
            Storage::OctoMap => renew_table(&mut input, bytes, renew, out),
            Storage::Compact => renew_compact_file(&mut input, bytes, renew, out),
        };
        copied.map_err(|error| match error {
            DecodeError::Io(error) => error,
            DecodeError::Format(error) => {
                wrong = Some(error);
                io::ErrorKind::InvalidData.into()
            }
        })
    });
    if let Some(error) = wrong {
        return Err(error.in_map(&path, Some(tile)));
    }
    let table = match written {
        Err(Error::Io { cause, .. }) if input.has_failed() => Err(Error::io(&path, "read", cause)),
        written => written,
    }?;
    if input.finish().0 != version.table {
        let reason = "the file does not match commits.log";
        return Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
    }
    Ok(TileVersion { scan_number, table, octree, ..version })
}
