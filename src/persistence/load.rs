//! Tiles from their files. How they get there is `tile_saver.rs`.

use crate::config::Storage;
use crate::error::{Error, FormatError, Result};
use crate::space::{Grid, TileIndex};
use crate::store::{FileChecksum, StoredTile, TileStore, TileVersion, hex};
use crate::tile::format::{DecodedTable, Trailer, read_compact_file, read_table};
use crate::tile::{OctreeFactory, Table, Tile};

/// Reads the latest version of a tile; `None` if there is none. The octree is derived from the table.
pub(crate) fn load(
    store: &TileStore,
    grid: &Grid,
    octrees: &OctreeFactory,
    index: TileIndex,
) -> Result<Option<(Tile, u64)>> {
    let Some(read) = load_table(store, grid, index)? else { return Ok(None) };
    Ok(Some((Tile::from_table(grid, octrees, index, read.table), read.file.bytes)))
}

/// [`load`] for a tile that is looked at once.
pub(crate) fn load_uncached(store: &TileStore, grid: &Grid, index: TileIndex) -> Result<Option<(Tile, u64)>> {
    let Some(read) = load_table(store, grid, index)? else { return Ok(None) };
    Ok(Some((Tile::uncached(grid, index, read.table), read.file.bytes)))
}

/// Reads the latest version of a tile's table; `None` if there is none.
pub(crate) fn load_table(store: &TileStore, grid: &Grid, index: TileIndex) -> Result<Option<ReadTable>> {
    let read = |stored: Result<Option<StoredTile>>| {
        let Some(stored) = stored? else { return Ok(None) };
        let path = stored.path.clone();
        let table = read_stored_table(grid, index, stored)?;
        if table.trailer.is_some() && store.map_id().is_none() && store.is_upgraded_meanwhile()? {
            let reason = "the file was written after the map was opened";
            return Err(FormatError::at_offset(0, reason).in_map(&path, Some(index)));
        }
        Ok(Some(table))
    };
    let loaded = read(store.open_table(index));
    if matches!(loaded, Err(Error::Damaged { .. })) {
        for path in store.other_places(index)? {
            match read(store.open_version(index, path)) {
                Err(Error::Damaged { .. }) => {}
                elsewhere => return elsewhere,
            }
        }
    }
    loaded
}

/// A table that was read from its file and belongs there.
pub(crate) struct ReadTable {
    pub table: Table,
    pub file: FileChecksum,
    /// `None` in a map of the original format.
    pub trailer: Option<Trailer>,
}

/// Reads a tile's table. In a map with an id it must be that map's, and the version that the log names, if it does.
pub(crate) fn read_stored_table(grid: &Grid, index: TileIndex, mut stored: StoredTile) -> Result<ReadTable> {
    let voxels = grid.voxels_of_tile(index);
    let decoded = match stored.storage {
        Storage::OctoMap => read_table(&mut stored.input, stored.bytes, &voxels),
        Storage::Compact => read_compact_file(&mut stored.input, stored.bytes, &voxels),
    };
    let decoded = decoded.map_err(|error| error.in_map(&stored.path, Some(index)))?;
    let StoredTile { path, input, map_id, version, storage, .. } = stored;
    let (file, _) = input.finish();
    let DecodedTable { table, trailer } = decoded;
    if let Some(map_id) = map_id {
        check(map_id, index, storage, trailer.as_ref(), file, version)
            .map_err(|error| error.in_map(&path, Some(index)))?;
    }
    Ok(ReadTable { table, file, trailer })
}

/// Checks that an intact file belongs to this map and tile and is the version in the log.
pub(super) fn check(
    map_id: [u8; 16],
    index: TileIndex,
    storage: Storage,
    trailer: Option<&Trailer>,
    file: FileChecksum,
    version: Option<TileVersion>,
) -> std::result::Result<(), FormatError> {
    let Some(trailer) = trailer else {
        return Err(FormatError::at_offset(file.bytes, "the trailer after the last entry is missing"));
    };
    let at = match storage {
        Storage::OctoMap => file.bytes - trailer.bytes(),
        Storage::Compact => 0,
    };
    let damaged = |offset, reason: String| Err(FormatError::at_offset(at + offset, reason));
    if trailer.map_id != map_id {
        return damaged(
            8,
            format!("the file belongs to map {}, not to {}", hex(&trailer.map_id), hex(&map_id)),
        );
    }
    if trailer.tile != index {
        return damaged(24, format!("the file belongs to tile {}", trailer.tile));
    }
    match version {
        Some(version) if file != version.table => {
            let (found, wanted) = (trailer.scan_number, version.scan_number);
            let reason =
                format!("the file is of scan {found}, commits.log names the version of scan {wanted}");
            damaged(36, reason)
        }
        _ => Ok(()),
    }
}
