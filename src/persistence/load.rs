//! Reads tiles from their files, which `tile_saver.rs` writes.

use crate::config::Storage;
use crate::error::{DecodeError, Error, FormatError, Result};
use crate::space::{Grid, TileIndex};
use crate::store::{FileChecksum, StoredTile, TileStore, TileVersion, hex};
use crate::tile::format::{
    Decoded, FilteredVoxels, Trailer, read_compact_file, read_compact_voxels_from, read_table,
    read_voxels_from,
};
use crate::tile::{OctreeFactory, Table, Tile};

/// Reads the latest version of a tile; `None` if there is none. The octree is built from the table.
pub(crate) fn load(
    store: &TileStore,
    grid: &Grid,
    octrees: &OctreeFactory,
    index: TileIndex,
) -> Result<Option<(Tile, u64)>> {
    let Some(read) = load_table(store, grid, index)? else { return Ok(None) };
    Ok(Some((Tile::from_table(grid, octrees, index, read.table), read.file.bytes)))
}

/// Like [`load`], for a tile that is used only once.
pub(crate) fn load_uncached(store: &TileStore, grid: &Grid, index: TileIndex) -> Result<Option<(Tile, u64)>> {
    let Some(read) = load_table(store, grid, index)? else { return Ok(None) };
    Ok(Some((Tile::uncached(grid, index, read.table), read.file.bytes)))
}

/// Reads the latest version of a tile's table; `None` if there is none.
pub(crate) fn load_table(store: &TileStore, grid: &Grid, index: TileIndex) -> Result<Option<ReadTable>> {
    load_made(store, index, |stored| read_stored_table(grid, index, stored))
}

/// Reads the observed voxels with log-odds of at least `from` in a tile's latest version, in Morton order. The file is
/// verified as for a table, but no table is built.
pub(crate) fn load_voxels_from(
    store: &TileStore,
    grid: &Grid,
    index: TileIndex,
    from: f64,
) -> Result<Option<FilteredVoxels>> {
    let read = |stored| read_stored_voxels_from(grid, index, stored, from);
    Ok(load_made(store, index, read)?.map(|read| read.table))
}

fn load_made<T>(
    store: &TileStore,
    index: TileIndex,
    read_stored: impl Fn(StoredTile) -> Result<Read<T>>,
) -> Result<Option<Read<T>>> {
    let read = |stored: Result<Option<StoredTile>>| {
        let Some(stored) = stored? else { return Ok(None) };
        let path = stored.path.clone();
        let table = read_stored(stored)?;
        if table.trailer.is_some() && store.map_id().is_none() && store.is_upgraded_meanwhile()? {
            let reason = "the file was written after the map was opened";
            return Err(FormatError::at_offset(0, reason).in_map(&path, Some(index)));
        }
        Ok(Some(table))
    };
    let loaded = read(store.tables().open(index));
    if matches!(loaded, Err(Error::Damaged { .. })) {
        for path in store.tables().other_places(index)? {
            match read(store.tables().open_at(index, path)) {
                Err(Error::Damaged { .. }) => {}
                elsewhere => return elsewhere,
            }
        }
    }
    loaded
}

/// Verified table, or a value decoded from it.
pub(crate) struct Read<T> {
    pub table: T,
    pub file: FileChecksum,
    /// `None` in a map of the original format.
    pub trailer: Option<Trailer>,
}

pub(crate) type ReadTable = Read<Table>;

/// Reads a tile's table. In a map with an id the file must belong to that map, and must be the version in the log, if
/// there is one.
pub(crate) fn read_stored_table(grid: &Grid, index: TileIndex, stored: StoredTile) -> Result<ReadTable> {
    let voxels = grid.voxels_of_tile(index);
    read_stored(index, stored, |stored| match stored.storage {
        Storage::OctoMap => read_table(&mut stored.input, stored.bytes, &voxels),
        Storage::Compact => read_compact_file(&mut stored.input, stored.bytes, &voxels),
    })
}

/// Like [`read_stored_table`], for the voxels with log-odds of at least `from`.
fn read_stored_voxels_from(
    grid: &Grid,
    index: TileIndex,
    stored: StoredTile,
    from: f64,
) -> Result<Read<FilteredVoxels>> {
    let voxels = grid.voxels_of_tile(index);
    read_stored(index, stored, |stored| match stored.storage {
        Storage::OctoMap => read_voxels_from(&mut stored.input, stored.bytes, &voxels, from),
        Storage::Compact => read_compact_voxels_from(&mut stored.input, stored.bytes, &voxels, from),
    })
}

fn read_stored<T>(
    index: TileIndex,
    mut stored: StoredTile,
    decode: impl FnOnce(&mut StoredTile) -> std::result::Result<Decoded<T>, DecodeError>,
) -> Result<Read<T>> {
    let decoded = decode(&mut stored).map_err(|error| error.in_map(&stored.path, Some(index)))?;
    let StoredTile { path, input, map_id, version, storage, .. } = stored;
    let (file, _) = input.finish();
    let Decoded { table, trailer } = decoded;
    if let Some(map_id) = map_id {
        check(map_id, index, storage, trailer.as_ref(), file, version)
            .map_err(|error| error.in_map(&path, Some(index)))?;
    }
    Ok(Read { table, file, trailer })
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
            let reason = format!(
                "the file is from scan {found}, but commits.log records the version from scan {wanted}"
            );
            damaged(36, reason)
        }
        _ => Ok(()),
    }
}
