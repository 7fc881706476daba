//! What the snapshots of a map see beside what the map itself does.

use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::persistence::load;
use crate::space::TileIndex;
use crate::store::{Disk, Layout, MAX_NUMBER, Snapshot, TileStore, TileVersion};
use std::collections::BTreeMap;

/// Kept tables that have been looked at and are whole, and as which version: several snapshots may see one. A snapshot
/// whose own is lost is led to one that it does not mean.
pub(super) type WholeTables = BTreeMap<(TileIndex, u64), TileVersion>;

/// The tiles of a snapshot whose tables cannot be read as the snapshot names them. Tables that are the map's own too
/// are left to whoever looks at the map.
///
/// # Errors
///
/// A disk that refuses.
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
            Err(error) if matches!(error, Error::Damaged { .. }) || error.is_of_medium() => {
                lost.push((tile, error))
            }
            Err(error) => return Err(error),
        }
    }
    Ok(lost)
}

/// The highest flush that snapshots and names of kept tables know of: flushes must go on from there, whatever else is
/// lost.
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
        // What cannot be listed is told by whoever reads it next.
        let names = disk.list(&layout.tile_folder(tile)).unwrap_or_default();
        let kept = names.iter().filter_map(|name| layout.flush_of_kept(name));
        last = kept.filter(|&flush_number| flush_number < MAX_NUMBER).fold(last, u64::max);
    }
    last
}
