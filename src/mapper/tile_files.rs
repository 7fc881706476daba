//! A tile to its two files and back: the one place that knows both tiles and store.

use crate::config::MapConfig;
use crate::error::{FormatError, Result};
use crate::octree::write_bt;
use crate::space::TileIndex;
use crate::store::{StoredTile, TileFile, TileStamp, TileStore};
use crate::tile::Tile;
use crate::tile::format::{DecodedTable, Trailer, read_table, write_table};

/// Writes the next version of a tile's files. Its octree is brought up to date.
pub(super) fn save(
    store: &mut TileStore,
    config: &MapConfig,
    tile: &mut Tile,
    scan_number: u64,
) -> Result<TileStamp> {
    let index = tile.index();
    let threshold = config.occupied_log_odds();
    let map_id = store.map_id().unwrap_or_default();
    let octree = tile.sync_octree();
    let octree = store.write_next(index, TileFile::Octree, |mut out| {
        write_bt(octree, config.grid.resolution_m(), threshold as f32, &mut out).map(drop)
    })?;
    let (octree_crc, octree_bytes) = (octree.crc, octree.bytes);
    let trailer = Trailer { map_id, tile: index, scan_number, table_crc: 0, octree_crc, octree_bytes };
    let table = store.write_next(index, TileFile::Table, |mut out| {
        write_table(tile.table(), trailer, &mut out).map(drop)
    })?;
    let occupied = tile.table().iter().filter(|(_, evidence)| evidence.log_odds >= threshold).count() as u64;
    let stamp = TileStamp { scan_number, table, octree, voxels: tile.table().len() as u64, occupied };
    store.note_next(index, stamp);
    Ok(stamp)
}

/// Reads the latest version of a tile; `None` if there is none. The octree is derived from the table.
pub(super) fn load(store: &TileStore, config: &MapConfig, index: TileIndex) -> Result<Option<(Tile, u64)>> {
    let loaded = decode(store, config, index, store.open_table(index));
    if store.is_read_only() && loaded.is_err() {
        // A writer beside this reader, or a crash, may have committed a version without renaming it yet.
        let next = decode(store, config, index, store.open_next_table(index));
        return if next.is_ok() { next } else { loaded };
    }
    loaded
}

fn decode(
    store: &TileStore,
    config: &MapConfig,
    index: TileIndex,
    stored: Result<Option<StoredTile>>,
) -> Result<Option<(Tile, u64)>> {
    let Some(mut stored) = stored? else { return Ok(None) };
    let voxels = config.grid.voxels_of_tile(index);
    let decoded = read_table(&mut stored.input, stored.bytes, &voxels)
        .map_err(|error| error.in_map(&stored.path, Some(index)))?;
    let bytes = stored.bytes;
    check(store, index, &decoded, stored)?;
    Ok(Some((Tile::from_table(config, index, decoded.table), bytes)))
}

/// Whether a file that is whole in itself is also the one that belongs here.
fn check(store: &TileStore, index: TileIndex, decoded: &DecodedTable, stored: StoredTile) -> Result<()> {
    let StoredTile { path, input, bytes, stamp } = stored;
    let Some(stamp) = stamp else { return Ok(()) };
    let damaged = |offset, reason: String| -> Result<()> {
        Err(FormatError::at_offset(offset, reason).in_map(&path, Some(index)))
    };
    let Some(trailer) = decoded.trailer else {
        return damaged(bytes, "the trailer after the last entry is missing".into());
    };
    if store.map_id() != Some(trailer.map_id) {
        return damaged(bytes, "the file belongs to another map".into());
    }
    if trailer.tile != index {
        return damaged(bytes, format!("the file belongs to tile {}", trailer.tile));
    }
    if input.finish().0 != stamp.table {
        let (found, wanted) = (trailer.scan_number, stamp.scan_number);
        return damaged(
            bytes,
            format!("the file is of scan {found}, commits.log names the version of scan {wanted}"),
        );
    }
    Ok(())
}
