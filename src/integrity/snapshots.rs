//! Checks the tables that only snapshots of a map use.

use super::finding::Finding;
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::persistence::load;
use crate::space::TileIndex;
use crate::store::{Disk, Layout, MAX_NUMBER, Snapshot, TileStore, TileVersion};
use std::collections::BTreeMap;

/// Kept tables that were read and are intact, with their versions. Several snapshots may use one table. The version is
/// compared, because the look-up of a missing table finds the table of another version.
pub(super) type WholeTables = BTreeMap<(TileIndex, u64), TileVersion>;

/// Returns the tiles of a snapshot whose tables are not readable as the version that it names. Tables that the map also
/// uses are omitted: the check of the map reports them.
///
/// # Errors
///
/// An I/O error.
pub(super) fn lost_tiles(
    store: &TileStore,
    config: &MapConfig,
    snapshot: &Snapshot,
    whole: &mut WholeTables,
) -> Result<Vec<(TileIndex, Error)>> {
    let past = store.at(snapshot);
    let mut lost = Vec::new();
    for (tile, version) in snapshot.commits.tiles.iter() {
        let kept = past.tables().kept(tile)?.range(snapshot.commits.flush_number..).next().copied();
        let is_known = match kept {
            Some(flush_number) => whole.get(&(tile, flush_number)) == Some(&version),
            None => store.tiles().version(tile) == Some(version),
        };
        if is_known {
            continue;
        }
        match load::load_table(&past, &config.grid, tile) {
            Ok(_) => drop(kept.map(|flush_number| whole.insert((tile, flush_number), version))),
            Err(error) if matches!(error, Error::Damaged { .. }) || Finding::is_of_file(&error) => {
                lost.push((tile, error))
            }
            Err(error) => return Err(error),
        }
    }
    Ok(lost)
}

/// Returns the highest flush number in snapshots and in names of kept tables. New flushes must have higher numbers,
/// even if the log is lost.
pub(super) fn last_known_flush(
    disk: &dyn Disk,
    layout: &Layout,
    map_id: [u8; 16],
    tiles: &[TileIndex],
) -> u64 {
    let mut last = 0;
    for name in Snapshot::list(disk, layout).unwrap_or_default() {
        if let Ok(snapshot) = Snapshot::read(disk, layout, &name, map_id, None) {
            last = last.max(snapshot.commits.flush_number);
        }
    }
    for &tile in tiles {
        // Errors are ignored: the next read of the folder reports them.
        let names = disk.list(&layout.tile_folder(tile)).unwrap_or_default();
        let kept = names.iter().filter_map(|name| layout.flush_of_kept(name));
        last = kept.filter(|&flush_number| flush_number < MAX_NUMBER).fold(last, u64::max);
    }
    last
}
